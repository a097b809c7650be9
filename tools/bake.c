/* tools/bake.c: facetree bake: the radiosity of a scene as vertex colours, in one file or one file per
 * object, and at probes. */
#define _GNU_SOURCE
#include "tools/commands.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tools/kit/command.h"
#include "tools/kit/file.h"
#include "tools/kit/model.h"
#include "tools/kit/options.h"
#include "tools/kit/rows.h"

typedef struct bake_options {
    fct_bake_def def;
    fct_backend backend;
    const char *probes;
    double exposure;
    const char *also;
} bake_options;

enum {
    KEY_METHOD = TOOL_KEY,
    KEY_ERROR,
    KEY_SAMPLES,
    KEY_VISIBILITY,
    KEY_INDIRECT,
    KEY_FINAL,
    KEY_PROBE,
    KEY_EXPOSURE,
    KEY_MAX_EDGE,
    KEY_ALSO
};

static const struct argp_option bake_options_table[] = {
    {"method", KEY_METHOD, "NAME", 0,
     "face: radiosity of face clusters (default); reference: path tracing at every vertex", 0},
    {"error", KEY_ERROR, "E", 0,
     "Split links until the uncertainty of each is at most this share of the emitted power (default 2e-5, "
     "from "
     "1e-9 to 1). A smaller E also means more rays and anchors",
     0},
    {"samples", KEY_SAMPLES, "N", 0,
     "reference: paths per vertex (default 256); face: gather rays per anchor (default: from --error)", 0},
    {"visibility", KEY_VISIBILITY, "NAME", 0, "Backend for rays: obb (default) or embree", 0},
    {"backend", KEY_VISIBILITY, NULL, OPTION_ALIAS, NULL, 0},
    {"indirect-only", KEY_INDIRECT, NULL, 0, "Leave out emission and direct light", 0},
    {"final", KEY_FINAL, "HOW", 0,
     "none: the solution as it is; direct: shadow rays for direct light, anchors for indirect light; gather "
     "(default): as direct, with more anchors where the surface has relief",
     0},
    {"probe", KEY_PROBE, "FILE", 0,
     "Also compute the light at points, one per line: x y z nx ny nz; - is standard input", 0},
    {"exposure", KEY_EXPOSURE, "F", 0,
     "Factor on the colours for display (default 1); the stored radiosity does not change", 0},
    {"max-edge", KEY_MAX_EDGE, "L", 0,
     "Longest edge of an output triangle on flat ground, in the scene's unit (default: chosen from the "
     "scene)",
     0},
    {"also", KEY_ALSO, "FILE", 0, "Also write the mesh to a second file, in the format of its name", 0},
    {0}};

static error_t parse_bake(int key, char *text, struct argp_state *state) {
    static const char *const methods[] = {"face", "reference", NULL}, *const finals[] = {"none", "direct",
                                                                                         "gather", NULL};
    static const fct_bake_method method_values[] = {FCT_BAKE_FACE, FCT_BAKE_REFERENCE};
    static const fct_final final_values[] = {FCT_FINAL_NONE, FCT_FINAL_DIRECT, FCT_FINAL_GATHER};
    bake_options *o = state->input;
    int index = 0;
    error_t error;
    switch (key) {
    case KEY_METHOD:
        error = tool_parse_choice(state, "--method", text, methods, &index);
        o->def.method = method_values[index];
        return error;
    case KEY_FINAL:
        error = tool_parse_choice(state, "--final", text, finals, &index);
        o->def.final = final_values[index];
        return error;
    case KEY_ERROR:
        return tool_parse_real(state, "--error", text, 1e-9, 1, &o->def.error);
    case KEY_SAMPLES:
        return tool_parse_count32(state, "--samples", text, 1, 100000000, &o->def.samples);
    case KEY_VISIBILITY:
        return tool_parse_backend(state, "--visibility", text, &o->backend);
    case KEY_INDIRECT:
        o->def.indirect_only = true;
        return 0;
    case KEY_PROBE:
        o->probes = text;
        return 0;
    case KEY_EXPOSURE:
        return tool_parse_real(state, "--exposure", text, 0, 1e12, &o->exposure);
    case KEY_ALSO:
        o->also = text;
        return 0;
    case KEY_MAX_EDGE:
        return tool_parse_real(state, "--max-edge", text, 1e-30, 1e30, &o->def.max_edge);
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* --- One file per object --- */

/* "FOLDER/NAME.ply". Characters that a file name cannot hold become _; a second object of the same name gets
 * "-2". */
static int make_object_path(tool *t, const fct_scene_view *scene, uint32_t instance, char *path,
                            size_t size) {
    char name[sizeof scene->instances->name];
    const char *wanted = scene->instances[instance].name;
    uint32_t object = scene->instances[instance].object, same = 0, seen = FCT_NONE;
    for (uint32_t i = 0; i < instance; ++i) {
        const fct_instance *other = scene->instances + i;
        if (other->object != object && other->object != seen && !strcmp(other->name, wanted))
            ++same, seen = other->object;
    }
    snprintf(name, sizeof name, "%s", *wanted ? wanted : "object");
    for (char *c = name; *c; ++c)
        if (*c == '/' || (unsigned char)*c < 32 || (c == name && *c == '.')) *c = '_';
    size_t length = strlen(t->output);
    const char *slash = length && t->output[length - 1] == '/' ? "" : "/";
    int used = same ? snprintf(path, size, "%s%s%s-%u.ply", t->output, slash, name, same + 1)
                    : snprintf(path, size, "%s%s%s.ply", t->output, slash, name);
    return (size_t)used < size
               ? TOOL_DONE
               : tool_fail(t, TOOL_OUTPUT, "%s/%s.ply: the name is too long", t->output, name);
}

/* Appends the positions, triangles, colours and normals of `part` to `all`. */
static int append_part(tool *t, fct_mesh *all, const fct_mesh *part) {
    bool normals = part->normals && (all->normals || !all->vertex_count);
    fct_mesh sum;
    if (all->vertex_count > INT32_MAX - part->vertex_count || all->face_count > INT32_MAX - part->face_count)
        return tool_fail(t, TOOL_DATA, "an object has more than 2^31 vertices or faces");
    int code = tool_result(t, fct_mesh_create(&t->env, all->vertex_count + part->vertex_count,
                                              all->face_count + part->face_count,
                                              FCT_MESH_COLORS | (normals ? FCT_MESH_NORMALS : 0), &sum));
    if (code != TOOL_DONE) return code;
    const fct_mesh *parts[2] = {all, part};
    size_t vertex = 0, corner = 0;
    for (int p = 0; p < 2; ++p) {
        const size_t floats = 3 * (size_t)parts[p]->vertex_count, corners = 3 * (size_t)parts[p]->face_count;
        if (!floats) continue;
        memcpy(sum.positions + 3 * vertex, parts[p]->positions, floats * sizeof(float));
        memcpy(sum.colors + 3 * vertex, parts[p]->colors, floats * sizeof(float));
        if (normals) memcpy(sum.normals + 3 * vertex, parts[p]->normals, floats * sizeof(float));
        for (size_t c = 0; c < corners; ++c)
            sum.triangles[corner + c] = parts[p]->triangles[c] + (uint32_t)vertex;
        vertex += parts[p]->vertex_count;
        corner += corners;
    }
    fct_mesh_release(&t->env, all);
    *all = sum;
    return TOOL_DONE;
}

/* Writes the file of the object whose first instance is `first`. */
static int write_object(tool *t, const bake_options *o, fct_bake *bake, const fct_scene_view *scene,
                        uint32_t first) {
    char path[PATH_MAX];
    fct_mesh all = {0};
    int code = make_object_path(t, scene, first, path, sizeof path);
    for (uint32_t i = first; i < scene->instance_count && code == TOOL_DONE; ++i) {
        fct_mesh part;
        if (scene->instances[i].object != scene->instances[first].object) continue;
        code = tool_result(t, fct_bake_instance(bake, i, &part));
        if (code != TOOL_DONE) break;
        code = append_part(t, &all, &part);
        fct_mesh_release(&t->env, &part);
    }
    if (code == TOOL_DONE) code = tool_save_mesh(t, path, &all, o->exposure);
    fct_mesh_release(&t->env, &all);
    return code;
}

static int write_folder(tool *t, const bake_options *o, fct_bake *bake, const fct_scene_view *scene) {
    int code = TOOL_DONE;
    uint8_t *done = tool_allocate(t, scene->object_count, 1);
    if (!done) return TOOL_MEMORY;
    memset(done, 0, scene->object_count);
    for (uint32_t i = 0; i < scene->instance_count && code == TOOL_DONE; ++i) {
        if (done[scene->instances[i].object]) continue;
        done[scene->instances[i].object] = 1;
        code = write_object(t, o, bake, scene, i);
    }
    tool_release(t, done);
    return code;
}

static int write_file(tool *t, const bake_options *o, fct_bake *bake) {
    fct_mesh mesh;
    int code = tool_result(t, fct_bake_mesh(bake, &mesh, NULL));
    if (code != TOOL_DONE) return code;
    code = tool_save_mesh(t, t->output, &mesh, o->exposure);
    if (code == TOOL_DONE && o->also) code = tool_save_mesh(t, o->also, &mesh, o->exposure);
    fct_mesh_release(&t->env, &mesh);
    return code;
}

/* Whether -o names a folder: one that exists, ends in /, or has no ending of a mesh. */
static bool is_folder_output(const char *output) {
    return strcmp(output, "-") != 0 && (tool_is_folder(output) || output[strlen(output) - 1] == '/' ||
                                        !(tool_is_mesh_name(output) || tool_ends(output, "fct")));
}

static int check_bake_output(tool *t, const bake_options *o) {
    if (o->also) {
        if (!t->output || is_folder_output(t->output) || !tool_is_mesh_name(o->also) ||
            tool_ends(o->also, "stl"))
            return tool_fail(t, TOOL_USAGE,
                             "--also %s: expected a name that ends in .glb or .ply, together with -o FILE",
                             o->also);
        int code = tool_check_output(t, o->also);
        if (code != TOOL_DONE) return code;
    }
    if (!t->output) return TOOL_DONE;
    if (is_folder_output(t->output)) return tool_check_folder(t, t->output);
    if (tool_ends(t->output, "stl") || tool_ends(t->output, "fct"))
        return tool_fail(t, TOOL_USAGE, "%s: expected a name that ends in .glb or .ply, or a folder",
                         t->output);
    return tool_check_output(t, t->output);
}

/* --- Probes --- */

static json_t *describe_probes(const fct_scene_view *scene, const float *points, const fct_probe *probes,
                               size_t count) {
    json_t *list = json_array();
    for (size_t i = 0; i < count; ++i) {
        const fct_probe *p = probes + i;
        bool on_surface = p->instance != FCT_NONE;
        json_t *item = json_pack(
            "{s:o, s:o, s:o, s:o, s:o, s:o}", "position", tool_json_floats(points + 3 * i, 3), "radiosity",
            tool_json_floats(p->radiosity, 3), "irradiance", tool_json_floats(p->irradiance, 3), "instance",
            on_surface ? json_integer(p->instance) : json_null(), "object",
            on_surface ? json_string(scene->instances[p->instance].name) : json_null(), "face",
            on_surface ? json_integer(p->face) : json_null());
        if (!item || json_array_append_new(list, item)) {
            json_decref(list);
            return NULL;
        }
    }
    return list;
}

typedef struct probe_set {
    size_t count;
    float *points, *normals; /* count x 3 each */
} probe_set;

static int read_probes(tool *t, const char *path, probe_set *set) {
    tool_rows rows;
    int code = tool_rows_read(t, path, 6, 6, NULL, &rows);
    if (code != TOOL_DONE) return code;
    set->count = rows.count;
    set->points = tool_allocate(t, rows.count, 6 * sizeof *set->points);
    if (!set->points) code = TOOL_MEMORY;
    for (size_t i = 0; i < rows.count && code == TOOL_DONE; ++i) {
        const float *row = rows.values + 6 * i;
        double length = sqrt((double)row[3] * row[3] + (double)row[4] * row[4] + (double)row[5] * row[5]);
        if (!(length > 0)) {
            code = tool_fail(t, TOOL_DATA, "%s: row %zu: expected a normal, found a vector of length 0", path,
                             i + 1);
            break;
        }
        set->normals = set->points + 3 * rows.count;
        for (int c = 0; c < 3; ++c) {
            set->points[3 * i + (size_t)c] = row[c];
            set->normals[3 * i + (size_t)c] = (float)(row[3 + c] / length);
        }
    }
    tool_rows_release(t, &rows);
    return code;
}

static void print_probes(tool *t, const probe_set *set, const fct_probe *probes) {
    for (size_t i = 0; i < set->count; ++i) {
        const float *p = set->points + 3 * i, *b = probes[i].radiosity, *e = probes[i].irradiance;
        tool_say(t, "probe %g %g %g: radiosity %.6g %.6g %.6g, irradiance %.6g %.6g %.6g", (double)p[0],
                 (double)p[1], (double)p[2], (double)b[0], (double)b[1], (double)b[2], (double)e[0],
                 (double)e[1], (double)e[2]);
    }
}

static int run_probes(tool *t, fct_bake *bake, const fct_scene_view *scene, const probe_set *set,
                      json_t **out) {
    fct_probe *probes = tool_allocate(t, set->count, sizeof *probes);
    if (!probes) return TOOL_MEMORY;
    int code = tool_result(t, fct_bake_probe(bake, set->count, set->points, set->normals, probes));
    if (code == TOOL_DONE) {
        print_probes(t, set, probes);
        *out = describe_probes(scene, set->points, probes, set->count);
        if (!*out) code = tool_fail(t, TOOL_MEMORY, "out of memory for the probes");
    }
    tool_release(t, probes);
    return code;
}

/* --- The bake --- */

static int report_bake(tool *t, const bake_options *o, const fct_bake_stats *s, double load, json_t *probes) {
    double total = tool_seconds() - t->start;
    tool_say(t, "%llu elements, %llu links, %llu rays in %u passes%s; output %llu vertices, %llu rays",
             (unsigned long long)s->elements, (unsigned long long)s->links, (unsigned long long)s->rays,
             s->passes, s->converged ? "" : " (NOT converged)", (unsigned long long)s->vertices,
             (unsigned long long)s->output_rays);
    tool_say(t, "power %.6g emitted, %.6g absorbed, %.6g escaped; estimated error %.2g %%", s->power_emitted,
             s->power_absorbed, s->power_escaped, 100 * s->error_estimate);
    tool_say(t, "load %.2f s, open %.2f s, solve %.2f s, output %.2f s, total %.2f s; peak %.0f MB", load,
             s->seconds_open, s->seconds_solve, s->seconds_push, total, (double)tool_peak_bytes() / 1e6);
    json_t *object = json_pack(
        "{s:s, s:b, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:{s:f, s:f, s:f, s:f, s:f}, s:I, s:I, s:{s:f, s:f, "
        "s:f}, s:f}",
        "method", o->def.method == FCT_BAKE_REFERENCE ? "reference" : "face", "converged", s->converged,
        "passes", (json_int_t)s->passes, "elements", (json_int_t)s->elements, "links", (json_int_t)s->links,
        "rays", (json_int_t)s->rays, "output_rays", (json_int_t)s->output_rays, "vertices",
        (json_int_t)s->vertices, "faces", (json_int_t)s->faces, "seconds", "load", load, "open",
        s->seconds_open, "solve", s->seconds_solve, "push", s->seconds_push, "total", total, "peak_bytes",
        (json_int_t)tool_peak_bytes(), "touched_bytes", (json_int_t)s->touched_bytes, "power", "emitted",
        s->power_emitted, "absorbed", s->power_absorbed, "escaped", s->power_escaped, "error_estimate",
        s->error_estimate);
    if (probes && object) json_object_set(object, "probes", probes);
    int code = tool_json(t, object);
    return code != TOOL_DONE ? code : s->converged ? TOOL_DONE : TOOL_NO;
}

static int bake_scene(tool *t, const bake_options *o, const probe_set *set) {
    fct_scene *scene;
    fct_bake *bake = NULL;
    json_t *probes = NULL;
    double start = tool_seconds();
    int code = tool_result(t, fct_scene_load(&t->env, t->inputs[0], o->backend, &scene));
    if (code != TOOL_DONE) return code;
    double load = tool_seconds() - start;
    fct_scene_view view = fct_scene_get(scene);
    code = tool_result(t, fct_bake_create(&t->env, scene, &o->def, &bake));
    if (code == TOOL_DONE && t->output)
        code = is_folder_output(t->output) ? write_folder(t, o, bake, &view) : write_file(t, o, bake);
    if (code == TOOL_DONE && o->probes) code = run_probes(t, bake, &view, set, &probes);
    if (code == TOOL_DONE) {
        fct_bake_stats stats = fct_bake_get_stats(bake);
        code = report_bake(t, o, &stats, load, probes);
    }
    json_decref(probes);
    fct_bake_destroy(bake);
    fct_scene_destroy(scene);
    return code;
}

static int run_bake(tool *t, void *options) {
    bake_options *o = options;
    probe_set set = {0};
    if (!t->output && !o->probes) return tool_fail(t, TOOL_USAGE, "expected -o OUT or --probe FILE");
    o->def.seed = t->seed;
    int code = check_bake_output(t, o);
    if (code == TOOL_DONE && o->probes) code = read_probes(t, o->probes, &set);
    if (code == TOOL_DONE) code = bake_scene(t, o, &set);
    tool_release(t, set.points);
    return code;
}

int tool_bake(int argc, char **argv) {
    static const tool_command command = {
        .name = "bake",
        .synopsis = "SCENE -o OUT\nSCENE --probe FILE",
        .summary = "compute the radiosity of a scene as vertex colours",
        .text = "SCENE is a scene.json, an OBJ with its MTL, a glTF file (.gltf, .glb) or a mesh. OUT is "
                "either a mesh in world "
                "space or a folder, which receives one .ply per object. A .glb holds linear COLOR_0, exposed "
                "and clamped, "
                "and float _RADIOSITY. A .ply holds sRGB bytes and float radiosity_r/g/b. Large flat "
                "triangles are divided, so "
                "that they can carry shadows. The exit code is 1 if the solution has not converged.\n\n"
                "A probe belongs to a surface that lies at its point and faces its normal. In free space it "
                "has irradiance "
                "and no radiosity.\n\n"
                "JSON keys: method, converged, passes, elements, links, rays, output_rays, vertices, faces, "
                "seconds{load, open, "
                "solve, push, total}, peak_bytes, touched_bytes, power{emitted, absorbed, escaped}, "
                "error_estimate, "
                "probes[]{position, radiosity, irradiance, instance, object, face}. Powers are sums over "
                "red, green and blue.",
        .options = bake_options_table,
        .parse = parse_bake,
        .run = run_bake,
        .inputs_min = 1,
        .inputs_max = 1,
        .output = TOOL_OUTPUT_OPTIONAL,
        .output_folder = true};
    bake_options options = {.def = fct_bake_def_default(), .exposure = 1};
    return tool_main(&command, argc, argv, &options);
}
