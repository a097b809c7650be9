/* tools/make/museum.c: the museum: the hall, its columns, benches and lamps, and statues on plinths. The
 * statues share the requested triangles. The vase comes last, so that its exact count corrects the total.
 */
#include "tools/make/parts.h"

#include <math.h>
#include <string.h>

#define PI            3.14159265358979323846
#define PLINTH_HEIGHT 1.
#define SMALL_HALF    .40625
#define LARGE_HALF    .53125
#define BENCH_LEG     .171875

/* The statues. share: of the requested triangles, over all places of the model. */
enum { VASE = MAKE_STATUES, MODELS };
static const struct {
    const char *name;
    double share;
} models[MODELS] = {
    [MAKE_TORSO] = {"torso", .15}, [MAKE_KNOT] = {"knot", .17}, [MAKE_GYROID] = {"gyroid", .18},
    [MAKE_SHELL] = {"shell", .20}, [MAKE_BUST] = {"bust", .18}, [VASE] = {"vase", .12}};

typedef struct exhibit {
    int model;
    double x, z, scale, degrees; /* about y */
    bool mirrored, large;
    const char *material;
} exhibit;

static const exhibit exhibits[] = {
    {MAKE_TORSO, -2.25, 3, 1.15, 35, false, false, "marble"},
    {MAKE_SHELL, -2.25, 0, 1, 20, false, false, "coral"},
    {MAKE_BUST, -2.25, -3, 1.1, 70, false, false, "bronze"},
    {VASE, -2.25, -6, 1.05, 0, false, false, "cobalt"},
    {MAKE_GYROID, 2.25, 3, 1.1, 25, false, false, "plaster"},
    {MAKE_BUST, 2.25, 0, 1.1, -60, false, false, "marble"},
    {MAKE_SHELL, 2.25, -3, 1, 160, true, false, "plaster"},
    {VASE, 2.25, -6, 1.05, 10, false, false, "jade"},
    {MAKE_KNOT, 0, -4.5, 1.5, 0, false, true, "marble"},
};
enum { EXHIBITS = sizeof exhibits / sizeof *exhibits };

static const struct {
    const char *name;
    double reflectance[3], emission[3];
    const char *group;
} materials[] = {
    {"floor", {.43, .38, .32}, {0}, NULL},
    {"carpet", {.52, .07, .08}, {0}, NULL},
    {"terracotta", {.66, .24, .15}, {0}, NULL},
    {"blue", {.16, .29, .60}, {0}, NULL},
    {"ivory", {.74, .70, .61}, {0}, NULL},
    {"ceiling", {.72, .70, .66}, {0}, NULL},
    {"stone", {.66, .62, .55}, {0}, NULL},
    {"wood", {.34, .21, .12}, {0}, NULL},
    {"marble", {.80, .78, .74}, {0}, NULL},
    {"plaster", {.78, .75, .70}, {0}, NULL},
    {"bronze", {.44, .32, .20}, {0}, NULL},
    {"coral", {.72, .42, .32}, {0}, NULL},
    {"jade", {.34, .56, .40}, {0}, NULL},
    {"cobalt", {.20, .28, .55}, {0}, NULL},
    {"skylight", {.5, .5, .5}, {6.6, 7.6, 8.8}, "daylight"},
    {"lamp", {.6, .6, .6}, {27, 16, 7.5}, "lamps"},
    {"panel_warm", {.5, .5, .5}, {4.6, 2.1, .5}, "panels"},
    {"panel_cool", {.5, .5, .5}, {.5, 2.0, 4.6}, "panels"},
};

static const struct {
    const char *name, *material;
} hall_parts[MAKE_HALL_PARTS] = {[MAKE_FLOOR] = {"floor", "floor"},
                                 [MAKE_CARPET] = {"carpet", "carpet"},
                                 [MAKE_WALL_LEFT] = {"wall_left", "terracotta"},
                                 [MAKE_WALL_RIGHT] = {"wall_right", "blue"},
                                 [MAKE_WALL_ENDS] = {"wall_ends", "ivory"},
                                 [MAKE_CEILING] = {"ceiling", "ceiling"},
                                 [MAKE_STONE] = {"stonework", "stone"},
                                 [MAKE_SKYLIGHT] = {"skylight", "skylight"},
                                 [MAKE_PANEL_WARM] = {"panel_warm", "panel_warm"},
                                 [MAKE_PANEL_COOL] = {"panel_cool", "panel_cool"}};

typedef struct museum {
    tool *t;
    const char *folder;
    uint32_t wanted;
    make_result *result;
    json_t *models, *instances;
    uint64_t faces[64]; /* per model, in the order of `names` */
    char names[64][32];
    int model_count, code;
} museum;

static void add_model(museum *s, make_mesh *m, const char *name) {
    char file[48];
    if (s->code != TOOL_DONE) {
        make_clear(m);
        return;
    }
    snprintf(file, sizeof file, "%s.ply", name);
    snprintf(s->names[s->model_count], sizeof s->names[0], "%s", name);
    s->faces[s->model_count++] = m->face_count;
    json_object_set_new(s->models, name, json_string(file));
    s->code = make_scene_part(m, s->folder, file, s->result);
}

static uint64_t find_model_faces(const museum *s, const char *name) {
    for (int k = 0; k < s->model_count; ++k)
        if (strcmp(s->names[k], name) == 0) return s->faces[k];
    return 0;
}

/* An instance at a point, rotated about y, scaled and perhaps mirrored. */
static void add_instance(museum *s, const char *name, const char *model, const char *material, make_point at,
                         double degrees, double scale, bool mirrored) {
    json_t *o = json_pack("{s:s, s:s, s:s}", "name", name, "model", model, "material", material);
    if (at.x != 0 || at.y != 0 || at.z != 0)
        json_object_set_new(o, "translate", json_pack("[f, f, f]", at.x, at.y, at.z));
    if (degrees != 0)
        json_object_set_new(o, "rotate",
                            json_pack("{s:[i, i, i], s:f}", "axis", 0, 1, 0, "degrees", degrees));
    if (mirrored)
        json_object_set_new(o, "scale", json_pack("[f, f, f]", -scale, scale, scale));
    else if (scale != 1)
        json_object_set_new(o, "scale", json_real(scale));
    if (json_array_append_new(s->instances, o) && s->code == TOOL_DONE)
        s->code = tool_fail(s->t, TOOL_MEMORY, "out of memory for the scene file");
    s->result->triangles += find_model_faces(s, model);
}

/* The detail of round parts grows with the logarithm of the requested triangles. */
static uint32_t choose_detail(const museum *s, uint32_t least, uint32_t most) {
    double octaves = log2(fmax(1, s->wanted / 30e3));
    return (uint32_t)fmin(most, least + octaves * (most - least) / 7);
}

/* --- Furniture --- */

/* A square profile (half width, height), turned in four steps, with a flat top. */
static void add_square_lathe(make_mesh *m, const double (*profile)[2], int count) {
    static const int corner[5][2] = {{1, 1}, {1, -1}, {-1, -1}, {-1, 1}, {1, 1}};
    for (int k = 0; k + 1 < count; ++k) {
        double a = profile[k][0], b = profile[k + 1][0], low = profile[k][1], high = profile[k + 1][1];
        for (int i = 0; i < 4; ++i) {
            const int *p = corner[i], *q = corner[i + 1];
            make_patch(m, make_p(p[0] * a, low, p[1] * a), make_p(q[0] * a, low, q[1] * a),
                       make_p(q[0] * b, high, q[1] * b), make_p(p[0] * b, high, p[1] * b));
        }
    }
    double top = profile[count - 1][0], y = profile[count - 1][1];
    make_patch(m, make_p(-top, y, -top), make_p(-top, y, top), make_p(top, y, top), make_p(top, y, -top));
}

static void add_plinth(museum *s, const char *name, double half) {
    make_mesh m = {.t = s->t};
    double body = half - .0625;
    const double profile[][2] = {{half, 0},     {half, .125}, {body, .1875},
                                 {body, .8125}, {half, .875}, {half, PLINTH_HEIGHT}};
    add_square_lathe(&m, profile, sizeof profile / sizeof *profile);
    add_model(s, &m, name);
}

static void add_column(museum *s) {
    make_mesh m = {.t = s->t};
    uint32_t flutes = s->wanted < 100000 ? 12 : 20, steps = choose_detail(s, 2, 6), segments = flutes * steps;
    uint32_t drums = choose_detail(s, 4, 16);
    double h = MAKE_COLUMN_HALF;
    make_box(&m, make_p(-h, 0, -h), make_p(h, .25, h), false, true);
    make_box(&m, make_p(-h, 3.75, -h), make_p(h, MAKE_COLUMN_HEIGHT, h), true, false);
    static const double foot[][2] = {{.225, .25}, {.24, .29}, {.225, .33}, {.19, .36}, {.185, .42}};
    static const double head[][2] = {{.155, 3.5}, {.165, 3.53}, {.19, 3.6}, {.225, 3.68}, {.24, 3.75}};
    uint32_t rows = 0, first = (uint32_t)m.vertex_count;
    for (uint32_t k = 0; k < 5 + drums + 4; ++k, ++rows) {
        double y, r, depth = 0;
        if (k < 5)
            r = foot[k][0], y = foot[k][1];
        else if (k < 5 + drums) {
            double u = (double)(k - 4) / (drums + 1);
            y = .42 + u * (3.5 - .42), r = .185 - .03 * u * u;
            depth = .07 * fmin(1, fmin(u, 1 - u) * 30);
        } else
            r = head[k - 4 - drums][0], y = head[k - 4 - drums][1];
        for (uint32_t i = 0; i < segments; ++i) {
            double angle = 2 * PI * i / segments, groove = fabs(sin(.5 * flutes * angle));
            double out = r * (1 - depth * groove);
            make_vertex(&m, make_p(out * cos(angle), y, out * sin(angle)));
        }
    }
    for (uint32_t k = 0; k + 1 < rows; ++k)
        for (uint32_t i = 0; i < segments; ++i) {
            uint32_t next = (i + 1) % segments, low = first + k * segments, high = low + segments;
            make_quad(&m, low + i, high + i, high + next, low + next);
        }
    add_model(s, &m, "column");
}

static void add_furniture(museum *s) {
    add_plinth(s, "plinth", SMALL_HALF);
    add_plinth(s, "plinth_large", LARGE_HALF);
    add_column(s);
    make_mesh lamp = {.t = s->t}, rod = {.t = s->t}, leg = {.t = s->t}, seat = {.t = s->t};
    make_sphere(&lamp, make_p(0, 0, 0), .15, choose_detail(s, 2, 8));
    add_model(s, &lamp, "lamp");
    make_box(&rod, make_p(-.0078125, .14, -.0078125), make_p(.0078125, 1, .0078125), false, false);
    add_model(s, &rod, "rod");
    make_box(&leg, make_p(-BENCH_LEG, 0, -BENCH_LEG), make_p(BENCH_LEG, .375, BENCH_LEG), false, false);
    add_model(s, &leg, "bench_leg");
    make_box(&seat, make_p(-.25, .375, -.9375), make_p(.25, .46875, .9375), true, true);
    add_model(s, &seat, "bench_seat");
}

static const double bench_x[2] = {-2.25, 2.25}, bench_z = 4.75, bench_leg_z = .625;

static void place_furniture(museum *s) {
    char name[48];
    for (int side = -1; side <= 1; side += 2) {
        const char *which = side < 0 ? "left" : "right";
        for (int k = 0; k < MAKE_BAYS; ++k) {
            snprintf(name, sizeof name, "column %s %d", which, k + 1);
            add_instance(s, name, "column", "stone", make_p(side * MAKE_COLUMN_X, 0, make_column_z[k]), 0, 1,
                         false);
        }
        for (int k = 0; k + 1 < MAKE_BAYS; ++k) {
            make_point at =
                make_p(side * 5.25, MAKE_AISLE_HEIGHT - 1, .5 * (make_column_z[k] + make_column_z[k + 1]));
            snprintf(name, sizeof name, "lamp %s %d", which, k + 1);
            add_instance(s, name, "lamp", "lamp", at, 0, 1, false);
            snprintf(name, sizeof name, "rod %s %d", which, k + 1);
            add_instance(s, name, "rod", "bronze", at, 0, 1, false);
        }
        double x = bench_x[side > 0];
        snprintf(name, sizeof name, "bench %s", which);
        add_instance(s, name, "bench_seat", "wood", make_p(x, 0, bench_z), 0, 1, false);
        for (int leg = -1; leg <= 1; leg += 2) {
            snprintf(name, sizeof name, "bench leg %s %d", which, leg > 0 ? 2 : 1);
            add_instance(s, name, "bench_leg", "wood", make_p(x, 0, bench_z + leg * bench_leg_z), 0, 1,
                         false);
        }
    }
    for (int k = 0; k < EXHIBITS; ++k) {
        const exhibit *e = exhibits + k;
        snprintf(name, sizeof name, "plinth %d", k + 1);
        add_instance(s, name, e->large ? "plinth_large" : "plinth", "stone", make_p(e->x, 0, e->z), 0, 1,
                     false);
    }
}

/* --- Hall and statues --- */

static void add_hall(museum *s) {
    make_footprint feet[2 * MAKE_BAYS + EXHIBITS + 4];
    uint32_t count = 0;
    for (int side = -1; side <= 1; side += 2)
        for (int k = 0; k < MAKE_BAYS; ++k)
            feet[count++] = (make_footprint){side * MAKE_COLUMN_X, make_column_z[k], MAKE_COLUMN_HALF};
    for (int k = 0; k < EXHIBITS; ++k)
        feet[count++] =
            (make_footprint){exhibits[k].x, exhibits[k].z, exhibits[k].large ? LARGE_HALF : SMALL_HALF};
    for (int k = 0; k < 4; ++k)
        feet[count++] = (make_footprint){bench_x[k / 2], bench_z + (k % 2 ? 1 : -1) * bench_leg_z, BENCH_LEG};
    make_mesh parts[MAKE_HALL_PARTS];
    for (int k = 0; k < MAKE_HALL_PARTS; ++k) parts[k] = (make_mesh){.t = s->t};
    make_hall(parts, feet, count);
    for (int k = 0; k < MAKE_HALL_PARTS; ++k) {
        add_model(s, parts + k, hall_parts[k].name);
        add_instance(s, hall_parts[k].name, hall_parts[k].name, hall_parts[k].material, make_p(0, 0, 0), 0, 1,
                     false);
    }
}

static int count_places(int model) {
    int count = 0;
    for (int k = 0; k < EXHIBITS; ++k) count += exhibits[k].model == model;
    return count;
}

static void add_statues(museum *s) {
    double left = fmax(0, (double)s->wanted - (double)s->result->triangles), for_statues = left;
    for (int k = 0; k < MODELS && s->code == TOOL_DONE; ++k) {
        make_mesh m = {.t = s->t};
        int places = count_places(k);
        double share = k == VASE ? left : models[k].share * for_statues;
        uint32_t triangles = (uint32_t)fmax(400, share / places);
        if (!s->t->env.progress(s->t->env.progress_user, "statues", (double)k / MODELS))
            s->code = tool_fail(s->t, TOOL_CANCELLED, "cancelled");
        else if (k == VASE)
            make_vase(&m, triangles);
        else
            s->code = make_statue_mesh(&m, (make_statue)k, triangles, s->t->seed + (uint64_t)k);
        left = fmax(0, left - (double)m.face_count * places);
        add_model(s, &m, models[k].name);
    }
    for (int k = 0; k < EXHIBITS; ++k) {
        const exhibit *e = exhibits + k;
        char name[48];
        snprintf(name, sizeof name, "%s%s", models[e->model].name,
                 count_places(e->model) == 1 ? ""
                 : e->x < 0                  ? " left"
                                             : " right");
        /* statues stand a little inside their plinths, so that no light passes below */
        add_instance(s, name, models[e->model].name, e->material,
                     make_p(e->x, PLINTH_HEIGHT - (e->model == VASE ? .003 : .01), e->z), e->degrees,
                     e->scale, e->mirrored);
    }
}

static json_t *material_table(void) {
    json_t *table = json_object();
    for (size_t k = 0; k < sizeof materials / sizeof *materials; ++k) {
        const double *r = materials[k].reflectance, *e = materials[k].emission;
        json_t *o = json_pack("{s:[f, f, f]}", "reflectance", r[0], r[1], r[2]);
        if (e[0] > 0) json_object_set_new(o, "emission", json_pack("[f, f, f]", e[0], e[1], e[2]));
        if (materials[k].group) json_object_set_new(o, "light_group", json_string(materials[k].group));
        json_object_set_new(table, materials[k].name, o);
    }
    return table;
}

int make_museum(tool *t, const char *folder, uint32_t triangles, make_result *result) {
    museum s = {.t = t, .folder = folder, .wanted = triangles, .result = result};
    s.models = json_object(), s.instances = json_array();
    add_furniture(&s);
    add_hall(&s);
    place_furniture(&s);
    add_statues(&s);
    if (s.code != TOOL_DONE) {
        json_decref(s.models);
        json_decref(s.instances);
        return s.code;
    }
    json_t *document =
        json_pack("{s:s, s:[s, s, s], s:o, s:o, s:o, s:{s:[f, f, f], s:[f, f, f], s:f}}", "description",
                  "A hall of statues, made by facetree make museum", "light_groups", "daylight", "lamps",
                  "panels", "materials", material_table(), "models", s.models, "instances", s.instances,
                  "camera", "position", -.75, 1.8, 8.4, "target", .15, 1.75, -3., "vertical_fov", 56.);
    return make_scene_file(t, folder, document, result);
}
