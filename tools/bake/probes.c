/* tools/bake/probes.c: see probes.h. */
#include "tools/bake/probes.h"

#include <math.h>

static json_t *describe_probes(const fct_scene_view *scene, const float *points, const fct_probe *probes,
                               size_t count) {
    json_t *list = json_array();
    for (size_t i = 0; i < count; ++i) {
        const fct_probe *p = probes + i;
        bool on_surface = p->instance != FCT_NONE;
        json_t *item = json_pack(
            "{s:o, s:o, s:o, s:o, s:o, s:o}", "position", tool_json_point(points + 3 * i, scene->origin),
            "radiosity", tool_json_floats(p->radiosity, 3), "irradiance", tool_json_floats(p->irradiance, 3),
            "instance", on_surface ? json_integer(p->instance) : json_null(), "object",
            on_surface ? tool_json_text(scene->instances[p->instance].name) : json_null(), "face",
            on_surface ? json_integer(p->face) : json_null());
        if (!item || json_array_append_new(list, item)) {
            json_decref(list);
            return NULL;
        }
    }
    return list;
}

static int check_normal(tool *t, const char *place, double *row, void *user) {
    (void)user;
    if (row[3] != 0 || row[4] != 0 || row[5] != 0) return TOOL_DONE;
    return tool_fail(t, TOOL_DATA, "%s: expected a normal, found a vector of length 0", place);
}

int bake_read_probes(tool *t, const char *path, bake_probes *set) {
    const tool_row_format format = {.least = 6, .columns = 6, .check = check_normal};
    int code = tool_rows_read(t, path, &format, &set->rows);
    if (code != TOOL_DONE) return code;
    set->count = set->rows.count;
    set->points = tool_allocate(t, set->count, 3 * sizeof *set->points);
    set->normals = tool_allocate(t, set->count, 3 * sizeof *set->normals);
    if (!set->points || !set->normals) return TOOL_MEMORY;
    for (size_t i = 0; i < set->count; ++i) {
        const double *n = set->rows.values + 6 * i + 3;
        double largest = fmax(fabs(n[0]), fmax(fabs(n[1]), fabs(n[2]))), x = n[0] / largest,
               y = n[1] / largest, z = n[2] / largest, length = sqrt(x * x + y * y + z * z);
        set->normals[3 * i] = (float)(x / length), set->normals[3 * i + 1] = (float)(y / length);
        set->normals[3 * i + 2] = (float)(z / length);
    }
    return TOOL_DONE;
}

static void print_probes(tool *t, const bake_probes *set, const fct_probe *probes) {
    for (size_t i = 0; i < set->count; ++i) {
        const double *p = set->rows.values + 6 * i;
        const float *b = probes[i].radiosity, *e = probes[i].irradiance;
        tool_say(t, "probe %g %g %g: radiosity %.6g %.6g %.6g, irradiance %.6g %.6g %.6g", p[0], p[1], p[2],
                 (double)b[0], (double)b[1], (double)b[2], (double)e[0], (double)e[1], (double)e[2]);
    }
}

int bake_run_probes(tool *t, fct_bake *bake, const fct_scene_view *scene, const bake_probes *set,
                    json_t **out) {
    fct_probe *probes = tool_allocate(t, set->count, sizeof *probes);
    if (!probes) return TOOL_MEMORY;
    tool_rows_points(&set->rows, 6, 0, scene->origin, set->points);
    int code = tool_result(t, fct_bake_probe(bake, set->count, set->points, set->normals, probes));
    if (code == TOOL_DONE) {
        print_probes(t, set, probes);
        *out = describe_probes(scene, set->points, probes, set->count);
        if (!*out) code = tool_fail(t, TOOL_MEMORY, "out of memory for the probes");
    }
    tool_release(t, probes);
    return code;
}

void bake_release_probes(tool *t, bake_probes *set) {
    tool_rows_release(t, &set->rows);
    tool_release(t, set->points);
    tool_release(t, set->normals);
    *set = (bake_probes){0};
}
