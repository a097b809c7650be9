/* tools/bake/bake.c: facetree bake: the radiosity of a scene as vertex colours, in one file or one file per
 * object, and at probes. */
#define _GNU_SOURCE

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tools/bake/errors.h"
#include "tools/bake/normals.h"
#include "tools/bake/objects.h"
#include "tools/bake/outputs.h"
#include "tools/bake/probes.h"
#include "tools/bake/save.h"
#include "tools/bake/scene.h"
#include "tools/commands.h"
#include "tools/guard/signals.h"
#include "tools/kit/command.h"
#include "tools/kit/file.h"
#include "tools/kit/model.h"
#include "tools/kit/options.h"

typedef struct bake_options {
    fct_bake_def def;
    fct_backend backend;
    const char *probes;
    fct_mesh_save_def save;
    bake_outputs outputs;
    const char *also;
    bool two_sided, merge, no_textures;
    int quality; /* of qualities */
    bool error_given, final_given;
    uint64_t solve_peak; /* peak memory before the output */
    bake_target target;
} bake_options;

/* What --quality sets. */
static const struct bake_quality {
    double error;
    fct_final final;
} qualities[] = {{5e-4, FCT_FINAL_DIRECT}, {2e-5, FCT_FINAL_GATHER}, {5e-6, FCT_FINAL_GATHER}};

/* What --max-links takes. */
#define LEAST_LINKS 1e3
#define MOST_LINKS  4e9

enum {
    KEY_METHOD = TOOL_KEY,
    KEY_QUALITY,
    KEY_ERROR,
    KEY_SAMPLES,
    KEY_VISIBILITY,
    KEY_INDIRECT,
    KEY_FINAL,
    KEY_PROBE,
    KEY_EXPOSURE,
    KEY_MAX_EDGE,
    KEY_MAX_LINKS,
    KEY_ALSO,
    KEY_TWO_SIDED,
    KEY_LIGHT,
    KEY_KEEP,
    KEY_MERGE,
    KEY_SOURCE,
    KEY_NO_TEXTURES,
    KEY_NORMALS
};

static const struct argp_option bake_options_table[] = {
    {"method", KEY_METHOD, "NAME", 0,
     "face: radiosity of face clusters (default); reference: path tracing at every vertex", 0},
    {"quality", KEY_QUALITY, "NAME", 0,
     "draft: --error 5e-4 --final direct; normal (default): --error 2e-5 --final gather; fine: --error 5e-6 "
     "--final gather. These options override it",
     0},
    {"error", KEY_ERROR, "E", 0,
     "Split links until the uncertainty of each is at most this share of the absorbed power (default 2e-5, "
     "from 1e-9 to 1). A smaller E also means more rays and anchors. With a percentage, such as 2%, bake "
     "again with more rays and shorter edges until the estimated RMS error of the light is at most that "
     "(0.01% to 100%), at most six times",
     0},
    {"samples", KEY_SAMPLES, "N", 0,
     "reference: paths per vertex (default 256); face: gather rays per anchor (default: from --error)", 0},
    {"visibility", KEY_VISIBILITY, "NAME", 0,
     "Rays: obb (default) or embree. multires: obb, and the solution replaces each model of many faces by "
     "flat patches of its hierarchy, about 32,768 in all, so its memory does not grow with the models",
     0},
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
    {"light", KEY_LIGHT, "LIST", 0,
     "What to write, separated by commas: radiosity (default), the light that leaves a surface; irradiance, "
     "the "
     "light that arrives, before the surface's own colour; direct and indirect, the two parts of the "
     "irradiance. All are per area, in the unit of the scene's emission. The first one makes the colours, "
     "and "
     "all are written as floats. reference gives radiosity and irradiance. Behind these, error: the expected "
     "error of the radiosity at each vertex, in its unit, which render --show error draws; and normal: the "
     "shading normals, which a .glb always has",
     0},
    {"normals", KEY_NORMALS, "RULE", 0,
     "What the light of a vertex faces. file (default): the normals of the file; corners with different "
     "normals "
     "are different vertices; a model without normals is as with crease=40. crease=DEG: the mean of the "
     "faces "
     "around, with a vertex per side of an edge at which the faces turn by more than DEG degrees (over 0, up "
     "to 180). flat: the normal of the face",
     0},
    {"keep-mesh", KEY_KEEP, "HOW", 0,
     "Write the faces of the input in its order, and divide none. vertex: one colour per vertex, on a crease "
     "the "
     "mean of its sides; corner: a vertex more for each other side of a crease; face: one colour per face. A "
     "two-sided surface has the light of its brighter side",
     0},
    {"source", KEY_SOURCE, NULL, 0,
     "Also write where each face of a .ply comes from: source_face, a face of the object's mesh, and "
     "source_uv, the weights of the second and the third corner of that face at each corner",
     0},
    {"max-edge", KEY_MAX_EDGE, "L", 0,
     "Longest edge of an output triangle on flat ground, in the scene's unit (default: chosen from the "
     "scene)",
     0},
    {"max-links", KEY_MAX_LINKS, "N", 0,
     "Most links of the solution, from 1000 to 4e9: those with the largest errors are divided first "
     "(default: 1000000 and 30 per instance, more with a small --error). A warning tells if this leaves "
     "larger "
     "errors than --error asks for",
     0},
    {"two-sided", KEY_TWO_SIDED, NULL, 0,
     "Let every material that emits no light reflect on both sides, as models of single sheets need", 0},
    {"no-textures", KEY_NO_TEXTURES, NULL, 0,
     "Leave out textures and vertex colours: materials reflect their factors alone", 0},
    {"merge", KEY_MERGE, NULL, 0,
     "Write a .glb as one unlit mesh in world space, without the nodes and materials of the scene", 0},
    {"also", KEY_ALSO, "FILE", 0,
     "Also write all objects as one mesh to a second file, in the format of its name", 0},
    {0}};

/* A whole number, which may be written as 2e6. */
static error_t parse_links(struct argp_state *state, const char *text, uint64_t *out) {
    double value = 0;
    const error_t error = tool_parse_real(state, "--max-links", text, LEAST_LINKS, MOST_LINKS, &value);
    if (!error && value != floor(value))
        return tool_usage(state, "--max-links: expected a whole number, found '%s'", text);
    *out = (uint64_t)value;
    return error;
}

static error_t parse_bake(int key, char *text, struct argp_state *state) {
    static const char *const methods[] = {"face", "reference", NULL}, *const finals[] = {"none", "direct",
                                                                                         "gather", NULL};
    static const fct_bake_method method_values[] = {FCT_BAKE_FACE, FCT_BAKE_REFERENCE};
    static const fct_final final_values[] = {FCT_FINAL_NONE, FCT_FINAL_DIRECT, FCT_FINAL_GATHER};
    static const char *const names[] = {"draft", "normal", "fine", NULL};
    static const char *const keeps[] = {"corner", "vertex", "face", NULL};
    static const fct_keep keep_values[] = {FCT_KEEP_CORNER, FCT_KEEP_VERTEX, FCT_KEEP_FACE};
    static const char *const backends[] = {"obb", "embree", "multires", NULL};
    static const fct_backend backend_values[] = {FCT_BACKEND_OBB, FCT_BACKEND_EMBREE, FCT_BACKEND_MULTIRES};
    bake_options *o = state->input;
    int index = 0;
    double exposure = 1;
    error_t error;
    switch (key) {
    case KEY_METHOD:
        error = tool_parse_choice(state, "--method", text, methods, &index);
        o->def.method = method_values[index];
        return error;
    case KEY_QUALITY:
        return tool_parse_choice(state, "--quality", text, names, &o->quality);
    case ARGP_KEY_END:
        if (!o->error_given || o->target.share > 0) o->def.error = qualities[o->quality].error;
        if (!o->final_given) o->def.final = qualities[o->quality].final;
        o->def.outputs = o->outputs.lights & ~(unsigned)FCT_MESH_COLORS;
        bake_set_save(&o->outputs, &o->save);
        return 0;
    case KEY_LIGHT:
        return bake_parse_outputs(state, text, &o->outputs);
    case KEY_KEEP:
        error = tool_parse_choice(state, "--keep-mesh", text, keeps, &index);
        o->def.keep = keep_values[index];
        return error;
    case KEY_NORMALS:
        return bake_parse_normals(state, text, &o->def);
    case KEY_SOURCE:
        o->def.sources = o->save.sources = true;
        return 0;
    case KEY_FINAL:
        o->final_given = true;
        error = tool_parse_choice(state, "--final", text, finals, &index);
        o->def.final = final_values[index];
        return error;
    case KEY_ERROR:
        o->error_given = true;
        return bake_parse_error(state, text, &o->def.error, &o->target);
    case KEY_SAMPLES:
        return tool_parse_count32(state, "--samples", text, 1, 100000000, &o->def.samples);
    case KEY_VISIBILITY:
        error = tool_parse_choice(state, "--visibility", text, backends, &index);
        o->backend = backend_values[index];
        return error;
    case KEY_INDIRECT:
        o->def.indirect_only = true;
        return 0;
    case KEY_PROBE:
        o->probes = text;
        return 0;
    case KEY_EXPOSURE:
        error = tool_parse_real(state, "--exposure", text, 0, 1e12, &exposure);
        o->save.exposure = (float)exposure;
        return error;
    case KEY_ALSO:
        o->also = text;
        return 0;
    case KEY_MERGE:
        o->merge = true;
        return 0;
    case KEY_TWO_SIDED:
        o->two_sided = true;
        return 0;
    case KEY_NO_TEXTURES:
        o->no_textures = true;
        return 0;
    case KEY_MAX_LINKS:
        return parse_links(state, text, &o->def.max_links);
    case KEY_MAX_EDGE:
        return tool_parse_real(state, "--max-edge", text, 1e-30, 1e30, &o->def.max_edge);
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* --- Outputs --- */

/* Saves a mesh of all objects. Files other than .glb have normals on request, so that their layout stays. */
static int save_merged(tool *t, const bake_options *o, const char *path, const fct_mesh *mesh) {
    fct_mesh view = *mesh;
    if (!tool_ends(path, "glb") && !(o->outputs.lights & FCT_MESH_NORMALS)) view.normals = NULL;
    return bake_save_mesh(t, path, &view, &o->save);
}

static int write_file(tool *t, const bake_options *o, fct_bake *bake) {
    fct_mesh mesh;
    if (tool_ends(t->output, "glb") && !o->merge) return bake_write_scene(t, bake, o->also, &o->save);
    int code = tool_result(t, fct_bake_mesh(bake, &mesh, NULL));
    if (code != TOOL_DONE) return code;
    code = save_merged(t, o, t->output, &mesh);
    if (code == TOOL_DONE && o->also) code = save_merged(t, o, o->also, &mesh);
    fct_mesh_release(&t->env, &mesh);
    return code;
}

/* Whether -o names a folder: one that exists, ends in /, or has no ending of a known kind of file. */
static bool is_folder_output(const char *output) {
    return tool_is_folder(output) || output[strlen(output) - 1] == '/' || tool_is_unknown_kind(output);
}

static int check_also(tool *t, const char *also) {
    if (!t->output || is_folder_output(t->output) || tool_same_output(t->output, also))
        return tool_fail(t, TOOL_USAGE, "--also %s: expected another file than that of -o FILE", also);
    int code = tool_check_kind(t, also, TOOL_COLOR_MESHES, NULL);
    return code == TOOL_DONE ? tool_check_output(t, also) : code;
}

static int check_bake_output(tool *t, const bake_options *o) {
    int code = o->also ? check_also(t, o->also) : TOOL_DONE;
    if (code != TOOL_DONE || !t->output) return code;
    if (is_folder_output(t->output)) return tool_check_folder(t, t->output);
    code = tool_check_kind(t, t->output, TOOL_COLOR_MESHES, "the name of a folder");
    return code == TOOL_DONE ? tool_check_output(t, t->output) : code;
}

/* --- The bake --- */

/* What a bake writes beside its mesh or meshes. */
typedef struct bake_answers {
    json_t *probes, *files, *objects; /* NULL: none */
} bake_answers;

static int report_bake(tool *t, const bake_options *o, const fct_bake_stats *s, uint32_t textures,
                       double load, const bake_answers *answers) {
    double total = tool_seconds() - t->start;
    tool_say(t, "%llu elements, %llu links, %llu rays in %u passes%s; output %llu vertices, %llu rays",
             (unsigned long long)s->elements, (unsigned long long)s->links, (unsigned long long)s->rays,
             s->passes, s->converged ? "" : " (NOT converged)", (unsigned long long)s->vertices,
             (unsigned long long)s->output_rays);
    if (s->interrupted)
        tool_say(t, "power %.6g emitted, %.6g absorbed; no error estimate", s->power_emitted,
                 s->power_absorbed);
    else
        tool_say(t, "power %.6g emitted, %.6g absorbed, %.6g escaped; estimated error %.2g %%",
                 s->power_emitted, s->power_absorbed, s->power_escaped, 100 * s->error_estimate);
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
    if (object) json_object_set_new(object, "outputs", bake_list_outputs(&o->outputs));
    if (object) json_object_set_new(object, "textures", json_integer(textures));
    if (object) json_object_set_new(object, "solve_peak_bytes", json_integer((json_int_t)o->solve_peak));
    if (object) json_object_set_new(object, "error", json_real(o->def.error));
    if (object) json_object_set_new(object, "interrupted", json_boolean(s->interrupted));
    if (object && s->interrupted) json_object_set_new(object, "error_estimate", json_null());
    if (object && s->interrupted)
        json_object_set_new(json_object_get(object, "power"), "escaped", json_null());
    if (object) json_object_set_new(object, "max_links", json_integer((json_int_t)s->max_links));
    if (object) json_object_set_new(object, "links_limited", json_boolean(s->links_limited));
    if (object) json_object_set_new(object, "link_error", json_real(s->link_error));
    if (object) json_object_set_new(object, "check_rays", json_integer((json_int_t)s->check_rays));
    if (answers->objects && object) json_object_set(object, "objects", answers->objects);
    if (answers->probes && object) json_object_set(object, "probes", answers->probes);
    if (answers->files && object) json_object_set(object, "files", answers->files);
    int code = tool_json(t, object);
    if (code != TOOL_DONE) return code;
    const bool reached = !(o->target.share > 0) || s->error_estimate <= o->target.share;
    if (!reached)
        tool_warn(t, "the estimated error is %.2g %%, wanted %.2g %%", 100 * s->error_estimate,
                  100 * o->target.share);
    return s->converged && reached ? TOOL_DONE : TOOL_NO;
}

/* Refuses a scene in which nothing emits light, because all colours would be black. */
static int check_light(tool *t, const fct_scene_view *scene) {
    for (uint32_t i = 0; i < scene->instance_count; ++i) {
        const float *e = scene->materials[scene->instances[i].material].emission;
        if (e[0] > 0 || e[1] > 0 || e[2] > 0) return TOOL_DONE;
    }
    return tool_fail(
        t, TOOL_DATA,
        "%s: nothing emits light; give a material an emission (\"emission\" in scene.json, Ke in "
        "an MTL file, emissiveFactor in glTF)",
        t->inputs[0]);
}

/* Errors of links that are above those that were asked for. */
static void warn_links(tool *t, const bake_options *o, const fct_bake_stats *s) {
    if (s->links_limited && s->link_error > o->def.error)
        tool_warn(
            t,
            "%llu links are too few for this scene: they carry errors of up to %.2g of the absorbed power "
            "instead of %.2g; more --max-links (60 bytes each) give finer ones",
            (unsigned long long)s->max_links, s->link_error, o->def.error);
}

static void warn_sides(tool *t, const fct_bake_stats *s) {
    const bool one = s->sides_left_out == 1;
    if (s->sides_left_out)
        tool_warn(t,
                  "%u two-sided surface%s lit on both sides; --keep-mesh has a place for the brighter side "
                  "alone",
                  s->sides_left_out, one ? " is" : "s are");
}

/* One bake. *bake: the caller destroys it, also after a failure. */
static int bake_once(tool *t, bake_options *o, const fct_scene *scene, bake_objects *objects, fct_bake **bake,
                     json_t **files) {
    const fct_scene_view view = fct_scene_get(scene);
    int code = tool_result(t, fct_bake_create(&t->env, scene, &o->def, bake));
    o->solve_peak = tool_peak_bytes();
    if (code != TOOL_DONE || !t->output) return code;
    if (!is_folder_output(t->output)) return write_file(t, o, *bake);
    json_t *list = json_array();
    code = bake_write_objects(t, *bake, &view, objects, &o->save, list);
    json_decref(code == TOOL_DONE ? *files : list);
    if (code == TOOL_DONE) *files = list;
    return code;
}

/* --- Interruption --- */

static bool is_interrupted(void *user) {
    (void)user;
    return guard_signal() != 0;
}

/* The first bake ends early at a signal; another one of --error N% is given up for the one before. */
static void prepare_interruption(tool *t, bake_options *o, bool first) {
    const unsigned parts = FCT_MESH_DIRECT | FCT_MESH_INDIRECT;
    const bool can = t->output && o->def.method == FCT_BAKE_FACE && !(o->def.outputs & parts);
    o->def.stop = can && first ? is_interrupted : NULL;
    t->soft = can && first;
    if (can) guard_end_softly();
    if (!can && first && t->output && is_folder_output(t->output))
        snprintf(t->ending, sizeof t->ending, "%.150s may have some of its files", t->output);
}

/* Says what a signal leaves behind. Returns whether there is a result to report. */
static bool end_interrupted(tool *t, int code, bool complete, fct_bake_stats *stats) {
    if (!guard_signal()) return false;
    if (code == TOOL_DONE && !stats->interrupted) {
        snprintf(t->ending, sizeof t->ending, "the outputs are complete");
    } else if (code == TOOL_DONE) {
        snprintf(t->ending, sizeof t->ending,
                 "%.150s has the light of the last complete solution, as --final none", t->output);
    } else if (code == TOOL_CANCELLED && complete) {
        snprintf(t->ending, sizeof t->ending, "%.150s has the light of the last complete bake", t->output);
        stats->interrupted = true;
    } else {
        return false;
    }
    return true;
}

static int solve_scene(tool *t, bake_options *o, const bake_probes *set, fct_scene *scene, double load,
                       bake_answers *answers) {
    fct_bake *bake = NULL;
    bake_objects objects = {0};
    const fct_scene_view view = fct_scene_get(scene);
    fct_bake_stats stats = {0};
    int code = check_light(t, &view);
    if (code == TOOL_DONE && t->output && is_folder_output(t->output))
        code = bake_plan_objects(t, &view, &objects);
    bool complete = false;
    do {
        fct_bake_destroy(bake);
        bake = NULL;
        prepare_interruption(t, o, !complete);
        if (code == TOOL_DONE) code = bake_once(t, o, scene, &objects, &bake, &answers->files);
        if (code != TOOL_DONE) break;
        complete = true;
        stats = fct_bake_get_stats(bake);
        json_decref(answers->objects);
        answers->objects = bake_describe_errors(bake, &view);
    } while (!guard_signal() && bake_try_again(t, &o->target, &stats, &o->def));
    const bool interrupted = end_interrupted(t, code, complete, &stats);
    if (interrupted) code = TOOL_DONE;
    if (code == TOOL_DONE && o->probes && !interrupted) {
        t->soft = false; /* a signal leaves out the probes */
        code = bake_run_probes(t, bake, &view, set, &answers->probes);
        if (code == TOOL_CANCELLED && t->output)
            snprintf(t->ending, sizeof t->ending, "the outputs are complete, without probes");
    }
    if (code == TOOL_DONE) {
        if (!interrupted) stats = fct_bake_get_stats(bake);
        warn_sides(t, &stats);
        bake_warn_normals(t, &stats);
        warn_links(t, o, &stats);
        if (!interrupted) code = bake_print_errors(t, bake, &view);
        if (code == TOOL_DONE) code = report_bake(t, o, &stats, view.texture_count, load, answers);
        if (interrupted) code = TOOL_CANCELLED;
    }
    bake_release_objects(t, &objects);
    fct_bake_destroy(bake);
    return code;
}

/* Whether a part of an object is closed and wound inwards with a black outside. An object as large as the
 * scene is a room. The parts are [begin, end). */
static bool is_turned_in(const fct_scene_view *view, uint32_t begin, uint32_t end) {
    fct_bounds bounds = view->instances[begin].bounds;
    bool inward = false, room = true;
    for (uint32_t i = begin; i < end; ++i) {
        const fct_instance *part = &view->instances[i];
        inward = inward || (view->models[part->model].inward && !view->materials[part->material].two_sided);
        for (int k = 0; k < 3; ++k) {
            bounds.lower[k] = fminf(bounds.lower[k], part->bounds.lower[k]);
            bounds.upper[k] = fmaxf(bounds.upper[k], part->bounds.upper[k]);
        }
    }
    for (int k = 0; k < 3; ++k)
        room = room && bounds.lower[k] <= view->bounds.lower[k] && bounds.upper[k] >= view->bounds.upper[k];
    return inward && !room;
}

static void warn_inward(tool *t, const fct_scene *scene) {
    fct_scene_view view = fct_scene_get(scene);
    const char *first = NULL;
    uint32_t count = 0;
    for (uint32_t begin = 0, end; begin < view.instance_count; begin = end) {
        for (end = begin + 1; end < view.instance_count;) {
            if (view.instances[end].object != view.instances[begin].object) break;
            ++end;
        }
        if (!is_turned_in(&view, begin, end)) continue;
        if (!first) first = view.instances[begin].name;
        ++count;
    }
    if (count)
        tool_warn(
            t,
            "%u closed object%s wound inwards, such as \"%s\": light falls on the inside; --flip-inward "
            "turns %s",
            count, count == 1 ? " is" : "s are", first, count == 1 ? "it" : "them");
}

static int bake_scene(tool *t, bake_options *o, const bake_probes *set) {
    fct_scene *scene;
    bake_answers answers = {0};
    double start = tool_seconds();
    t->env.no_textures = o->no_textures;
    int code = tool_result(t, fct_scene_load(&t->env, t->inputs[0], o->backend, &scene));
    if (code == TOOL_DONE && o->two_sided) fct_scene_make_two_sided(scene);
    if (code == TOOL_DONE) warn_inward(t, scene);
    if (code == TOOL_DONE && o->also) code = tool_refuse_input(t, o->also);
    if (code == TOOL_DONE) code = solve_scene(t, o, set, scene, tool_seconds() - start, &answers);
    json_decref(answers.probes);
    json_decref(answers.files);
    json_decref(answers.objects);
    fct_scene_destroy(scene);
    return code;
}

/* A target needs an estimate, and an output that can be written again. */
static int check_target(tool *t, const bake_options *o) {
    if (!(o->target.share > 0)) return TOOL_DONE;
    if (o->def.method == FCT_BAKE_REFERENCE)
        return tool_fail(t, TOOL_USAGE, "--error with %% needs --method face: the reference takes --samples");
    if (!t->output || tool_is_stream(t->output) || (o->also && tool_is_stream(o->also)))
        return tool_fail(t, TOOL_USAGE,
                         "--error with %% needs a file or a folder as output, because each bake replaces it");
    return TOOL_DONE;
}

static int run_bake(tool *t, void *options) {
    bake_options *o = options;
    bake_probes set = {0};
    if (!t->output && !o->probes) return tool_fail(t, TOOL_USAGE, "expected -o OUT or --probe FILE");
    o->def.seed = t->seed;
    if ((o->merge && t->output && tool_ends(t->output, "glb")) || (o->also && tool_ends(o->also, "glb")))
        o->def.outputs |= FCT_MESH_NORMALS;
    snprintf(t->ending, sizeof t->ending, "no solution was complete, nothing is written");
    int code = check_target(t, o);
    if (code == TOOL_DONE) code = check_bake_output(t, o);
    if (code == TOOL_DONE && o->probes) code = bake_read_probes(t, o->probes, &set);
    if (code == TOOL_DONE) code = bake_scene(t, o, &set);
    bake_release_probes(t, &set);
    return code;
}

int tool_bake(int argc, char **argv) {
    static const tool_stage stages[] = {
        {"models|read|dual graph|clusters|order|boxes|boxes of large clusters|ray structure", 2},
        {"links|textures", 7},
        {"direct light", 8},
        {"gathering", 8},
        {"iteration", 1},
        {"objects|surface|covers|anchors|vertices|check|reference", 72},
        {"write", 1},
        {"probes", 1},
        {0}};
    static const tool_command command = {
        .name = "bake",
        .synopsis = "SCENE -o OUT\nSCENE --probe FILE",
        .summary = "compute the radiosity of a scene as vertex colours",
        .text =
            "SCENE is a scene.json, an OBJ with its MTL, a glTF file (.gltf, .glb) or a mesh. OUT is "
            "a folder, which receives one .ply per object; a .glb, which keeps the nodes of the scene; or a "
            "mesh of another kind in world space. A .glb holds linear COLOR_0, exposed "
            "and clamped, "
            "and float _RADIOSITY. A .ply holds sRGB bytes and float radiosity_r/g/b. With --light they hold "
            "_IRRADIANCE, _DIRECT, _INDIRECT, irradiance_r/g/b, ...\n\n"
            "In a .glb each object is a node with its name and transform, and a mesh with a primitive per "
            "material. From a glTF input all nodes, materials, textures, texture coordinates, cameras, "
            "lights "
            "and extras stay as they are; the light is in COLOR_0, or in COLOR_1 where the input has "
            "colours. "
            "From other inputs the materials are unlit, so that viewers show the light; their extras hold "
            "the "
            "reflectance and the emission. --merge writes one unlit mesh instead.\n\n"
            "Large flat triangles are divided, so "
            "that they can carry shadows; --keep-mesh keeps the faces of the input instead. A scene in which "
            "nothing emits light is an error. A first Ctrl-C (SIGINT, or SIGTERM) ends the bake early: if a "
            "pass of "
            "the solution was complete, the output is written from it, objects that were not lit yet as with "
            "--final none, and without probes; then the program dies of the signal. With --error N% the last "
            "complete bake stays; in a folder some files may be those of the bake that was interrupted. With "
            "--light direct or "
            "indirect, or --method reference, nothing is written. A second Ctrl-C ends it at once. The exit "
            "code is "
            "1 if the solution has not converged or the error of --error N% is not reached.\n\n"
            "A surface has light on its front, to which its corners run counterclockwise. A two-sided "
            "surface "
            "that is lit on both sides is written twice: its brighter side, then the other one, each with "
            "its own vertices and wound so that it is in front.\n\n"
            "A probe belongs to a surface that lies at its point and faces its normal. In free space it "
            "has irradiance "
            "and no radiosity.\n\n"
            "JSON keys: method, converged, passes, elements, links, rays, output_rays, vertices, faces, "
            "seconds{load, open, "
            "solve, push, total}, peak_bytes, touched_bytes, power{emitted, absorbed, escaped}, "
            "error_estimate (RMS error over the mean of the light that surfaces without emission show, from "
            "a "
            "check at random points; of probes alone the noise of the solution), objects[]{object, "
            "normals (file, crease or flat), error_estimate, bias, area (the last three only if a point of "
            "the "
            "object was checked)}, error (--error of the last bake), "
            "interrupted (a signal ended the bake early), max_links, links_limited (whether max_links left "
            "some "
            "links coarser than they should be), link_error (the error that links carry, as a share of the "
            "absorbed power), check_rays, outputs[] (the "
            "quantities of --light), textures (how many images the "
            "materials have), "
            "probes[]{position, radiosity, irradiance, instance, object, face}, and for a folder "
            "files[]{object, file, faces, source}: the name of the object in the scene, its file, and the "
            "name of its model. Powers are sums over "
            "red, green and blue.",
        .examples = "  facetree bake scene.json -o lit.glb\n"
                    "  facetree bake room.obj -o lit.glb --quality draft\n"
                    "  facetree bake scene.json -o lit/ --json\n"
                    "  facetree bake scene.json -o lit.glb --error 1%\n"
                    "  facetree bake scene.json -o lit.glb --light irradiance,direct\n"
                    "  facetree bake model.obj -o lit/ --keep-mesh vertex\n"
                    "  facetree bake scene.json --probe points.txt",
        .options = bake_options_table,
        .parse = parse_bake,
        .run = run_bake,
        .stages = stages,
        .turns_bodies = true,
        .builds_tree = true,
        .inputs_min = 1,
        .inputs_max = 1,
        .output = TOOL_OUTPUT_OPTIONAL,
        .output_folder = true};
    bake_options options = {.def = fct_bake_def_default(),
                            .save = fct_mesh_save_def_default(),
                            .outputs = {FCT_MESH_COLORS, FCT_MESH_COLORS},
                            .quality = 1};
    return tool_main(&command, argc, argv, &options);
}
