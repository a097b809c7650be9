/* tools/make/cornell.c: the Cornell box as measured at Cornell's Program of Computer Graphics. The corners
 * are measured in millimetres and written in metres; the camera is at its measured position and looks along
 * +z. Reflectance and emission are the measured spectra in their usual linear RGB form. The light is scaled
 * so that the mean radiosity suits exposure 1. Each flat patch is cut into pieces, to reach the number of
 * triangles.
 */
#include "tools/make/parts.h"

#include <math.h>

/* Corners counter-clockwise, seen from inside the room or from outside the blocks; millimetres. */
typedef struct patch {
    int material;
    double corner[4][3];
} patch;

enum { WHITE, RED, GREEN, LIGHT, SHORT_BLOCK, TALL_BLOCK, MATERIALS };

static const struct {
    const char *name, *material;
    double reflectance[3], emission[3];
} surfaces[MATERIALS] = {
    [WHITE] = {"room", "white", {.725, .71, .68}, {0}},
    [RED] = {"left_wall", "red", {.63, .065, .05}, {0}},
    [GREEN] = {"right_wall", "green", {.14, .45, .091}, {0}},
    [LIGHT] = {"light", "light", {.78, .78, .78}, {17, 12, 4}},
    [SHORT_BLOCK] = {"short_block", "white", {.725, .71, .68}, {0}},
    [TALL_BLOCK] = {"tall_block", "white", {.725, .71, .68}, {0}},
};

static const patch patches[] = {
    /* floor; ceiling in four strips around the light; back wall */
    {WHITE, {{552.8, 0, 0}, {0, 0, 0}, {0, 0, 559.2}, {549.6, 0, 559.2}}},
    {WHITE, {{556, 548.8, 0}, {556, 548.8, 559.2}, {343, 548.8, 332}, {343, 548.8, 227}}},
    {WHITE, {{556, 548.8, 559.2}, {0, 548.8, 559.2}, {213, 548.8, 332}, {343, 548.8, 332}}},
    {WHITE, {{0, 548.8, 559.2}, {0, 548.8, 0}, {213, 548.8, 227}, {213, 548.8, 332}}},
    {WHITE, {{0, 548.8, 0}, {556, 548.8, 0}, {343, 548.8, 227}, {213, 548.8, 227}}},
    {WHITE, {{549.6, 0, 559.2}, {0, 0, 559.2}, {0, 548.8, 559.2}, {556, 548.8, 559.2}}},
    {GREEN, {{0, 0, 559.2}, {0, 0, 0}, {0, 548.8, 0}, {0, 548.8, 559.2}}},
    {RED, {{552.8, 0, 0}, {549.6, 0, 559.2}, {556, 548.8, 559.2}, {556, 548.8, 0}}},
    {LIGHT, {{343, 548.8, 227}, {343, 548.8, 332}, {213, 548.8, 332}, {213, 548.8, 227}}},
    {SHORT_BLOCK, {{130, 165, 65}, {82, 165, 225}, {240, 165, 272}, {290, 165, 114}}},
    {SHORT_BLOCK, {{290, 0, 114}, {290, 165, 114}, {240, 165, 272}, {240, 0, 272}}},
    {SHORT_BLOCK, {{130, 0, 65}, {130, 165, 65}, {290, 165, 114}, {290, 0, 114}}},
    {SHORT_BLOCK, {{82, 0, 225}, {82, 165, 225}, {130, 165, 65}, {130, 0, 65}}},
    {SHORT_BLOCK, {{240, 0, 272}, {240, 165, 272}, {82, 165, 225}, {82, 0, 225}}},
    {TALL_BLOCK, {{423, 330, 247}, {265, 330, 296}, {314, 330, 456}, {472, 330, 406}}},
    {TALL_BLOCK, {{423, 0, 247}, {423, 330, 247}, {472, 330, 406}, {472, 0, 406}}},
    {TALL_BLOCK, {{472, 0, 406}, {472, 330, 406}, {314, 330, 456}, {314, 0, 456}}},
    {TALL_BLOCK, {{314, 0, 456}, {314, 330, 456}, {265, 330, 296}, {265, 0, 296}}},
    {TALL_BLOCK, {{265, 0, 296}, {265, 330, 296}, {423, 330, 247}, {423, 0, 247}}},
};
enum { PATCHES = sizeof patches / sizeof *patches };

static double measure_side(const patch *p, int a, int b) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) sum += pow(p->corner[a][c] - p->corner[b][c], 2);
    return sqrt(sum);
}

/* The number of pieces along both sides, for pieces of at most `edge` millimetres. */
static void find_cuts(const patch *p, double edge, uint32_t cuts[2]) {
    cuts[0] = (uint32_t)fmax(1, ceil(fmax(measure_side(p, 0, 1), measure_side(p, 3, 2)) / edge));
    cuts[1] = (uint32_t)fmax(1, ceil(fmax(measure_side(p, 1, 2), measure_side(p, 0, 3)) / edge));
}

static uint64_t count_triangles(double edge) {
    uint64_t count = 0;
    for (int k = 0; k < PATCHES; ++k) {
        uint32_t cuts[2];
        find_cuts(patches + k, edge, cuts);
        count += 2 * (uint64_t)cuts[0] * cuts[1];
    }
    return count;
}

static void add_patch(make_mesh *m, const patch *p, double edge) {
    uint32_t cuts[2], first = (uint32_t)m->vertex_count;
    find_cuts(p, edge, cuts);
    for (uint32_t j = 0; j <= cuts[1]; ++j)
        for (uint32_t i = 0; i <= cuts[0]; ++i) {
            double u = (double)i / cuts[0], v = (double)j / cuts[1], at[3];
            for (int c = 0; c < 3; ++c)
                at[c] = 1e-3 * ((1 - v) * ((1 - u) * p->corner[0][c] + u * p->corner[1][c]) +
                                v * ((1 - u) * p->corner[3][c] + u * p->corner[2][c]));
            make_vertex(m, make_p(at[0], at[1], at[2]));
        }
    for (uint32_t j = 0; j < cuts[1]; ++j)
        for (uint32_t i = 0; i < cuts[0]; ++i) {
            uint32_t a = first + j * (cuts[0] + 1) + i, d = a + cuts[0] + 1;
            make_quad(m, a, a + 1, d + 1, d);
        }
}

int make_cornell(tool *t, const char *folder, uint32_t triangles, make_result *result) {
    double low = .05, high = 1000; /* bounds of the longest edge, millimetres: the largest edge that gives
                                      enough triangles */
    while (high - low > 1e-4 * low) {
        double middle = .5 * (low + high);
        *(count_triangles(middle) >= triangles ? &low : &high) = middle;
    }
    json_t *models = json_object(), *instances = json_array(), *materials = json_object();
    int code = TOOL_DONE;
    for (int k = 0; k < MATERIALS && code == TOOL_DONE; ++k) {
        make_mesh m = {.t = t};
        char file[32];
        for (int p = 0; p < PATCHES; ++p)
            if (patches[p].material == k) add_patch(&m, patches + p, low);
        result->triangles += m.face_count;
        snprintf(file, sizeof file, "%s.ply", surfaces[k].name);
        code = make_scene_part(&m, folder, file, result);
        const double *r = surfaces[k].reflectance, *e = surfaces[k].emission;
        json_object_set_new(models, surfaces[k].name, json_string(file));
        json_array_append_new(instances, json_pack("{s:s, s:s, s:s}", "name", surfaces[k].name, "model",
                                                   surfaces[k].name, "material", surfaces[k].material));
        json_t *o = json_pack("{s:[f, f, f]}", "reflectance", r[0], r[1], r[2]);
        if (e[0] > 0) json_object_set_new(o, "emission", json_pack("[f, f, f]", e[0], e[1], e[2]));
        json_object_set_new(materials, surfaces[k].material, o);
    }
    json_t *document = json_pack("{s:s, s:o, s:o, s:o, s:{s:[f, f, f], s:[f, f, f], s:f}}", "description",
                                 "The Cornell box, made by facetree make cornell", "materials", materials,
                                 "models", models, "instances", instances, "camera", "position", .278, .273,
                                 -.8, "target", .278, .273, .28, "vertical_fov", 39.3);
    if (code != TOOL_DONE) {
        json_decref(document);
        return code;
    }
    return make_scene_file(t, folder, document, result);
}
