/* tools/simplify.c: facetree simplify: fewer triangles with the same shape and colours; progressive meshes.
 */
#include "tools/commands.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tools/kit/command.h"
#include "tools/kit/file.h"
#include "tools/kit/model.h"
#include "tools/kit/options.h"
#include "tools/wishes.h"

enum { MOST_LEVELS = 32 };

typedef struct simplify_options {
    fct_simplify_def def;
    bool faces_given, error_given, attributes_given;
    double ratio; /* 0: not given */
    const char *progressive;
    const char *resume, *save_state, *contour, *paint;
    const char *shaping;        /* an option that a state has of its own; NULL: none was given */
    double weights[3];          /* of color, uv, normal; negative: the default; NAN: not in the list */
    double levels[MOST_LEVELS]; /* faces, or ratios below 1 */
    uint32_t level_count;
} simplify_options;

enum {
    KEY_FACES = TOOL_KEY,
    KEY_RATIO,
    KEY_MAX_ERROR,
    KEY_ATTRIBUTES,
    KEY_PLACEMENT,
    KEY_WEIGHTS,
    KEY_BOUNDARY,
    KEY_FEATURE,
    KEY_REGULARIZE,
    KEY_LOCK_BORDER,
    KEY_TOPOLOGY,
    KEY_REFIT,
    KEY_PROGRESSIVE,
    KEY_LEVELS,
    KEY_RESUME,
    KEY_SAVE_STATE,
    KEY_CONTOUR,
    KEY_PAINT,
    KEY_PAIRS,
    KEY_PRIMITIVE
};

static const struct argp_option simplify_options_table[] = {
    {"faces", KEY_FACES, "N", 0, "Stop at N faces or fewer", 0},
    {"ratio", KEY_RATIO, "R", 0, "Stop at R times the faces of the input, above 0 and at most 1", 0},
    {"levels", KEY_LEVELS, "LIST", 0,
     "Write several levels in one run, such as 100000,10000,1000: faces, or ratios below 1, in descending "
     "order. With -o small.ply they are small-1.ply, small-2.ply and so on",
     0},
    {"max-error", KEY_MAX_ERROR, "E", 0,
     "Make no contraction whose error is above E, a distance in the mesh's unit: the root mean square from "
     "the planes of the faces and of the boundary (default: no limit)",
     0},
    {"attributes", KEY_ATTRIBUTES, "LIST", 0,
     "The attributes that count in the error, with optional weights, such as color=.02,uv=.1,normal=.01; "
     "none: only the shape counts. Default: all attributes of the mesh; uv and normal have the weights of "
     "this example, color has 2 / sqrt(faces of the result), at most .1",
     0},
    {"pairs", KEY_PAIRS, "TAU", 0,
     "Also contract pairs of points of different bodies that are at most TAU apart, so that near bodies "
     "join; in the mesh's unit (default 0: edges only). Not with --keep-topology, --save-state, --resume, "
     "--contour or --paint",
     0},
    {"primitive", KEY_PRIMITIVE, "WHAT", 0,
     "Contract edges (edge, default) or faces (face: all three corners become one vertex; half as many "
     "steps, larger errors). face excludes --pairs",
     0},
    {"placement", KEY_PLACEMENT, "WHERE", 0,
     "Position of the new vertex: optimal (default), segment (on the edge), ends (either end or the "
     "midpoint) or subset (either end)",
     0},
    {"weights", KEY_WEIGHTS, "HOW", 0,
     "How much a face weighs at its corners: area (default), angle or uniform (the same for all faces)", 0},
    {"boundary", KEY_BOUNDARY, "W", 0,
     "How many times the squared distance of boundaries and borders from their place counts, relative to "
     "that of the surface; 0: nothing holds them (default 3)",
     0},
    {"feature-threshold", KEY_FEATURE, "T", 0,
     "Two faces whose colours differ by more than T in |dr| + |dg| + |db| make a border (default .1; inf: "
     "none)",
     0},
    {"regularize", KEY_REGULARIZE, "G", 0,
     "Weight of the distance to the edge's midpoint, 0 to 1 (default 1e-9)", 0},
    {"lock-border", KEY_LOCK_BORDER, NULL, 0,
     "Keep the vertices of open boundaries, so that tiles still fit exactly", 0},
    {"keep-topology", KEY_TOPOLOGY, NULL, 0, "Refuse contractions that change the topology", 0},
    {"refit", KEY_REFIT, "N", 0, "Passes that fit the vertices to the input afterwards, 0 to 100 (default 2)",
     0},
    {"progressive", KEY_PROGRESSIVE, "FILE", 0,
     "Also write a progressive mesh (.fpm): every level from the result, without refit, to the input. "
     "'facetree level' reads it",
     0},
    {"save-state", KEY_SAVE_STATE, "FILE", 0,
     "Also write the state (.fst): a later run with --resume goes on as if there had been no stop", 0},
    {"resume", KEY_RESUME, "STATE", 0,
     "Go on from a state instead of IN. It keeps its options; --faces, --ratio, --levels, --max-error, "
     "--contour, --paint and --save-state may follow",
     0},
    {"contour", KEY_CONTOUR, "FILE", 0,
     "Edges that hold like a boundary: two vertex numbers per line, from 0, of IN or of the input of the "
     "state",
     0},
    {"paint", KEY_PAINT, "FILE", 0,
     "Weights from 1e-6 to 1e6 for the cost at each vertex, one per line: of IN or, with --resume, of the "
     "mesh that was written with the state. A region of weight W keeps about the cube root of W times as "
     "many faces",
     0},
    {0}};

static const char *const attribute_names[] = {"color", "uv", "normal", NULL};

static error_t parse_attributes(simplify_options *o, char *list, struct argp_state *state) {
    o->attributes_given = true;
    for (int i = 0; i < 3; ++i) o->weights[i] = NAN;
    if (!strcmp(list, "none")) return 0;
    for (char *item = list; item;) {
        char *comma = strchr(item, ',');
        if (comma) *comma = 0;
        char *equals = strchr(item, '=');
        if (equals) *equals = 0;
        int index = 0;
        error_t error = tool_parse_choice(state, "--attributes", item, attribute_names, &index);
        if (error) return error;
        o->weights[index] = -1;
        if (equals) error = tool_parse_real(state, "--attributes", equals + 1, 0, 1e6, &o->weights[index]);
        if (error) return error;
        item = comma ? comma + 1 : NULL;
    }
    return 0;
}

static error_t parse_levels(simplify_options *o, char *list, struct argp_state *state) {
    o->level_count = 0;
    for (char *item = list; item;) {
        char *comma = strchr(item, ',');
        if (comma) *comma = 0;
        if (o->level_count == MOST_LEVELS)
            return tool_usage(state, "--levels: expected at most %d levels, found more", MOST_LEVELS);
        double *level = &o->levels[o->level_count++];
        error_t error = tool_parse_real(state, "--levels", item, 0, FCT_NONE - 1., level);
        if (error) return error;
        if (*level >= 1 && *level != floor(*level))
            return tool_usage(state, "--levels: expected a number of faces or a ratio below 1, found '%s'",
                              item);
        item = comma ? comma + 1 : NULL;
    }
    return 0;
}

/* Notes options that a state has of its own. */
static void note_shaping(simplify_options *o, int key) {
    static const int keys[] = {KEY_ATTRIBUTES, KEY_PRIMITIVE,  KEY_PLACEMENT,   KEY_WEIGHTS,  KEY_BOUNDARY,
                               KEY_FEATURE,    KEY_REGULARIZE, KEY_LOCK_BORDER, KEY_TOPOLOGY, KEY_REFIT};
    for (size_t i = 0; i < sizeof keys / sizeof *keys; ++i)
        for (const struct argp_option *option = simplify_options_table; keys[i] == key && option->name;
             ++option)
            if (option->key == key) o->shaping = option->name;
}

static error_t check_options(const simplify_options *o, struct argp_state *state) {
    if (o->faces_given && o->ratio > 0)
        return tool_usage(state, "expected either --faces or --ratio, found both");
    if (o->level_count > 0 && (o->faces_given || o->ratio > 0 || o->progressive))
        return tool_usage(state, "--levels: expected neither --faces, --ratio nor --progressive");
    if (o->progressive && (o->resume || o->save_state || o->contour || o->paint))
        return tool_usage(state,
                          "--progressive: expected neither --resume, --save-state, --contour nor --paint");
    if (o->def.pair_distance > 0 && o->def.primitive == FCT_PRIMITIVE_FACE)
        return tool_usage(state, "expected either --pairs or --primitive face, found both");
    if (o->def.pair_distance > 0 && o->def.keep_topology)
        return tool_usage(state, "expected either --pairs or --keep-topology, found both");
    if (o->def.pair_distance > 0 && (o->resume || o->save_state || o->contour || o->paint))
        return tool_usage(state, "--pairs: expected neither --resume, --save-state, --contour nor --paint");
    if (o->resume && o->shaping) return tool_usage(state, "--resume: the state has its own --%s", o->shaping);
    return 0;
}

static error_t parse_simplify(int key, char *text, struct argp_state *state) {
    static const char *const placements[] = {"optimal", "segment", "ends", "subset", NULL};
    static const char *const primitives[] = {"edge", "face", NULL};             /* in the order of the enum */
    static const char *const weightings[] = {"area", "angle", "uniform", NULL}; /* in the order of the enum */
    static const fct_placement values[] = {FCT_PLACE_OPTIMAL, FCT_PLACE_SEGMENT, FCT_PLACE_ENDS,
                                           FCT_PLACE_SUBSET};
    simplify_options *o = state->input;
    int index = 0;
    error_t error;
    note_shaping(o, key);
    switch (key) {
    case KEY_FACES:
        o->faces_given = true;
        return tool_parse_count32(state, "--faces", text, 0, FCT_NONE - 1, &o->def.target_faces);
    case KEY_RATIO:
        return tool_parse_ratio(state, "--ratio", text, &o->ratio);
    case KEY_MAX_ERROR:
        o->error_given = true;
        return tool_parse_real(state, "--max-error", text, 0, INFINITY, &o->def.max_error);
    case KEY_ATTRIBUTES:
        return parse_attributes(o, text, state);
    case KEY_PRIMITIVE:
        error = tool_parse_choice(state, "--primitive", text, primitives, &index);
        o->def.primitive = (fct_primitive)index;
        return error;
    case KEY_PLACEMENT:
        error = tool_parse_choice(state, "--placement", text, placements, &index);
        o->def.placement = values[index];
        return error;
    case KEY_WEIGHTS:
        error = tool_parse_choice(state, "--weights", text, weightings, &index);
        o->def.weighting = (fct_weighting)index;
        return error;
    case KEY_BOUNDARY:
        return tool_parse_real(state, "--boundary", text, 0, 1e12, &o->def.boundary_weight);
    case KEY_FEATURE:
        return tool_parse_real(state, "--feature-threshold", text, 0, INFINITY, &o->def.feature_threshold);
    case KEY_REGULARIZE:
        return tool_parse_real(state, "--regularize", text, 0, 1, &o->def.regularization);
    case KEY_LOCK_BORDER:
        o->def.lock_border = true;
        return 0;
    case KEY_TOPOLOGY:
        o->def.keep_topology = true;
        return 0;
    case KEY_REFIT:
        return tool_parse_count32(state, "--refit", text, 0, 100, &o->def.refit_passes);
    case KEY_PROGRESSIVE:
        o->progressive = text;
        return 0;
    case KEY_LEVELS:
        return parse_levels(o, text, state);
    case KEY_PAIRS:
        return tool_parse_real(state, "--pairs", text, 0, INFINITY, &o->def.pair_distance);
    case KEY_RESUME:
        o->resume = text;
        return 0;
    case KEY_SAVE_STATE:
        o->save_state = text;
        return 0;
    case KEY_CONTOUR:
        o->contour = text;
        return 0;
    case KEY_PAINT:
        o->paint = text;
        return 0;
    case ARGP_KEY_END:
        return check_options(o, state);
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* The mesh must have the named attributes. Attributes that are not named get weight 0. */
static int set_attribute_weights(tool *t, simplify_options *o, const fct_mesh *mesh) {
    const void *arrays[3] = {mesh->colors, mesh->texcoords, mesh->normals};
    double *weights[3] = {&o->def.color_weight, &o->def.texcoord_weight, &o->def.normal_weight};
    for (int i = 0; i < 3 && o->attributes_given; ++i) {
        if (isnan(o->weights[i]))
            *weights[i] = 0;
        else if (!arrays[i])
            return tool_fail(t, TOOL_DATA,
                             "%s: expected the attribute %s, which --attributes names, found none",
                             t->inputs[0], attribute_names[i]);
        else if (o->weights[i] >= 0)
            *weights[i] = o->weights[i];
    }
    return TOOL_DONE;
}

static const char *const stop_reasons[] = {
    [FCT_STOP_FACES] = "faces", [FCT_STOP_ERROR] = "error", [FCT_STOP_EXHAUSTED] = "exhausted"};

/* The keys of one result, without times. */
static json_t *pack_result(const fct_mesh *mesh, const fct_simplify_stats *s) {
    return json_pack("{s:I, s:I, s:I, s:s, s:I, s:I, s:f, s:f, s:f, s:f, s:f, s:f, s:f}", "faces_before",
                     (json_int_t)s->faces_before, "faces_after", (json_int_t)s->faces_after, "vertices",
                     (json_int_t)mesh->vertex_count, "stopped_because", stop_reasons[s->stopped_because],
                     "pairs_found", (json_int_t)s->pairs_found, "pairs_joined", (json_int_t)s->pairs_joined,
                     "max_cost", s->max_cost, "distance_rms", s->distance_rms, "distance_max",
                     s->distance_max, "color_rms", s->color_rms, "uv_rms", s->texcoord_rms, "normal_rms",
                     s->normal_rms, "lost_area", s->lost_area);
}

static void say_result(tool *t, const char *path, const fct_simplify_stats *s) {
    char lost[48] = "";
    if (s->lost_area > 0) snprintf(lost, sizeof lost, ", %.3g %% of the area vanished", 100 * s->lost_area);
    tool_say(t, "%s%s%u faces to %u (stopped by %s), distance %.3g (largest %.3g)%s, %.2f s",
             path ? path : "", path ? ": " : "", s->faces_before, s->faces_after,
             stop_reasons[s->stopped_because], s->distance_rms, s->distance_max, lost,
             tool_seconds() - t->start);
}

static int report_simplify(tool *t, const fct_mesh *mesh, const fct_simplify_stats *s) {
    say_result(t, NULL, s);
    json_t *all = pack_result(mesh, s);
    json_object_set_new(all, "seconds",
                        json_pack("{s:f, s:f, s:f, s:f}", "init", s->seconds_init, "contract",
                                  s->seconds_contract, "refit", s->seconds_refit, "total",
                                  tool_seconds() - t->start));
    json_object_set_new(all, "peak_bytes", json_integer((json_int_t)tool_peak_bytes()));
    return tool_json(t, all);
}

/* Whether a second output can be written. option: its name; ending: its kind. */
static int check_second(tool *t, const char *option, const char *path, const char *ending) {
    if (!path) return TOOL_DONE;
    int code = tool_check_kind(t, path, ending, NULL);
    if (code == TOOL_DONE && tool_same_output(path, t->output))
        code = tool_fail(t, TOOL_USAGE, "%s: %s and -o are the same file", path, option);
    return code == TOOL_DONE ? tool_check_output(t, path) : code;
}

static int simplify_mesh(tool *t, const simplify_options *o, const fct_mesh *mesh, fct_mesh *simple,
                         fct_simplify_stats *stats) {
    fct_progressive *progressive;
    if (!o->progressive) return tool_result(t, fct_simplify(&t->env, mesh, &o->def, simple, stats));
    int code = tool_result(t, fct_simplify_progressive(&t->env, mesh, &o->def, simple, stats, &progressive));
    if (code == TOOL_DONE) code = tool_result(t, fct_progressive_save(progressive, o->progressive));
    fct_progressive_destroy(progressive);
    return code;
}

static void warn_exhausted(tool *t, uint32_t target, const fct_simplify_stats *s) {
    if (s->faces_after > target && s->stopped_because == FCT_STOP_EXHAUSTED)
        tool_warn(t, "stopped at %u faces, because no more contractions are allowed", s->faces_after);
}

/* "small.ply" becomes "small-3.ply". The caller frees it. */
static char *name_level(const char *path, uint32_t level) {
    const char *dot = strrchr(path, '.');
    size_t stem = dot ? (size_t)(dot - path) : strlen(path), room = strlen(path) + 16;
    char *name = malloc(room);
    if (name) snprintf(name, room, "%.*s-%u%s", (int)stem, path, level, dot ? dot : "");
    return name;
}

/* Whether each level can be written. */
static int check_levels(tool *t, const simplify_options *o) {
    int code = TOOL_DONE;
    if (o->level_count > 0 && !strcmp(t->output, "-"))
        return tool_fail(t, TOOL_USAGE, "--levels: expected -o FILE, found standard output");
    for (uint32_t i = 1; i <= o->level_count && code == TOOL_DONE; ++i) {
        char *path = name_level(t->output, i);
        code = path ? tool_check_output(t, path) : tool_fail(t, TOOL_MEMORY, "out of memory: a file name");
        free(path);
    }
    return code;
}

/* Writes one level; `results` receives its keys. */
static int save_level(tool *t, fct_gltf *gltf, uint32_t level, const fct_mesh *mesh,
                      const fct_simplify_stats *s, json_t *results) {
    char *path = name_level(t->output, level);
    if (!path) return tool_fail(t, TOOL_MEMORY, "out of memory: a file name");
    int code = gltf ? tool_save_gltf(t, gltf, path, mesh) : tool_save_mesh(t, path, mesh, 1);
    if (code == TOOL_DONE) {
        say_result(t, path, s);
        json_t *keys = pack_result(mesh, s);
        json_object_set_new(keys, "file", json_string(path));
        json_array_append_new(results, keys);
    }
    free(path);
    return code;
}

/* Takes the reference to the results. */
static int report_levels(tool *t, json_t *results) {
    return tool_json(t, json_pack("{s:o, s:{s:f}, s:I}", "levels", results, "seconds", "total",
                                  tool_seconds() - t->start, "peak_bytes", (json_int_t)tool_peak_bytes()));
}

static int run_levels(tool *t, simplify_options *o, fct_gltf *gltf, const fct_mesh *mesh) {
    uint32_t targets[MOST_LEVELS] = {0}, count = o->level_count;
    fct_mesh levels[MOST_LEVELS];
    fct_simplify_stats stats[MOST_LEVELS];
    for (uint32_t i = 0; i < count; ++i) {
        double level = o->levels[i];
        targets[i] = (uint32_t)(level < 1 ? (double)llround(level * mesh->face_count) : level);
    }
    int code = tool_result(t, fct_simplify_levels(&t->env, mesh, &o->def, targets, count, levels, stats));
    if (code != TOOL_DONE) return code;
    json_t *results = json_array();
    for (uint32_t i = 0; i < count && code == TOOL_DONE; ++i) {
        warn_exhausted(t, targets[i], &stats[i]);
        code = save_level(t, gltf, i + 1, &levels[i], &stats[i], results);
    }
    for (uint32_t i = 0; i < count; ++i) fct_mesh_release(&t->env, &levels[i]);
    if (code != TOOL_DONE) {
        json_decref(results);
        return code;
    }
    return report_levels(t, results);
}

/* The faces that level i of the options asks for, of `all` faces of the input. */
static uint32_t find_target(const simplify_options *o, uint32_t i, uint32_t all) {
    double level = o->level_count > 0 ? o->levels[i] : o->ratio > 0 ? o->ratio : o->def.target_faces;
    bool ratio = o->level_count > 0 ? level < 1 : o->ratio > 0;
    return (uint32_t)(ratio ? (double)llround(level * all) : level);
}

static int check_targets(tool *t, const simplify_options *o, uint32_t all) {
    for (uint32_t i = 1; i < o->level_count; ++i) {
        uint32_t faces = find_target(o, i, all), before = find_target(o, i - 1, all);
        if (faces >= before)
            return tool_fail(t, TOOL_DATA, "level %u has %u faces, expected fewer than the %u of level %u",
                             i + 1, faces, before, i);
    }
    return TOOL_DONE;
}

/* Loads the state, or makes one of the mesh; then contour and paint. */
static int open_state(tool *t, simplify_options *o, const fct_mesh *mesh, fct_simplifier **s) {
    int code;
    *s = NULL;
    if (o->resume)
        code = tool_result(t, fct_simplifier_load(&t->env, o->resume, s));
    else {
        o->def.target_faces = find_target(o, 0, mesh->face_count);
        code = tool_result(t, fct_simplifier_create(&t->env, mesh, &o->def, s));
    }
    if (code != TOOL_DONE) return code;
    fct_simplifier_forget(*s);
    fct_paint_level level = o->resume ? FCT_PAINT_CURRENT : FCT_PAINT_INPUT;
    if (o->contour) code = tool_read_contour(t, o->contour, *s);
    if (o->paint && code == TOOL_DONE) code = tool_read_paint(t, o->paint, level, *s);
    return code;
}

/* Runs to one target, and writes its mesh and its report. results: of several levels; NULL: there is one. */
static int run_target(tool *t, const simplify_options *o, fct_gltf *gltf, fct_simplifier *s, uint32_t i,
                      double init, json_t *results) {
    fct_mesh mesh = {0};
    fct_simplify_stats stats;
    uint32_t target = find_target(o, i, fct_simplifier_input_faces(s));
    int code = tool_result(t, fct_simplifier_run(s, target, o->def.max_error, &stats));
    if (code == TOOL_DONE) code = tool_result(t, fct_simplifier_mesh(s, true, &mesh, &stats));
    if (code != TOOL_DONE) return code;
    stats.seconds_init = init;
    warn_exhausted(t, target, &stats);
    if (results)
        code = save_level(t, gltf, i + 1, &mesh, &stats, results);
    else {
        code = gltf ? tool_save_gltf(t, gltf, t->output, &mesh) : tool_save_mesh(t, t->output, &mesh, 1);
        if (code == TOOL_DONE && o->save_state) code = tool_result(t, fct_simplifier_save(s, o->save_state));
        if (code == TOOL_DONE) code = report_simplify(t, &mesh, &stats);
    }
    fct_mesh_release(&t->env, &mesh);
    return code;
}

static int run_with_state(tool *t, simplify_options *o, fct_gltf *gltf, const fct_mesh *mesh) {
    fct_simplifier *s;
    double start = tool_seconds();
    json_t *results = o->level_count > 0 ? json_array() : NULL;
    int code = open_state(t, o, mesh, &s);
    double init = tool_seconds() - start;
    if (code == TOOL_DONE) {
        t->bar.items = fct_simplifier_faces(s);
        code = check_targets(t, o, fct_simplifier_input_faces(s));
    }
    for (uint32_t i = 0; i < (results ? o->level_count : 1) && code == TOOL_DONE; ++i)
        code = run_target(t, o, gltf, s, i, init, results);
    if (code == TOOL_DONE && results && o->save_state)
        code = tool_result(t, fct_simplifier_save(s, o->save_state));
    if (code == TOOL_DONE && results) code = report_levels(t, json_incref(results));
    json_decref(results);
    fct_simplifier_destroy(s);
    return code;
}

/* Either IN or a state. */
static int check_inputs(tool *t, const simplify_options *o) {
    if (!t->input_count == !o->resume)
        return tool_fail(t, TOOL_USAGE, "expected either IN or --resume STATE, found %s",
                         o->resume ? "both" : "none");
    if (o->resume && t->flip_inward)
        return tool_fail(t, TOOL_USAGE, "--resume: the state has its own --flip-inward");
    return TOOL_DONE;
}

static int run_simplify(tool *t, void *options) {
    simplify_options *o = options;
    if (!o->faces_given && !(o->ratio > 0) && !o->error_given && o->level_count == 0)
        return tool_fail(t, TOOL_USAGE, "expected --faces N, --ratio R, --levels LIST or --max-error E");
    fct_mesh mesh, simple = {0};
    fct_gltf *gltf = NULL; /* the document that is kept, if both files are glTF */
    fct_simplify_stats stats;
    int code = check_inputs(t, o);
    if (code == TOOL_DONE) code = check_second(t, "--progressive", o->progressive, "fpm");
    if (code == TOOL_DONE) code = check_second(t, "--save-state", o->save_state, "fst");
    if (code == TOOL_DONE) code = check_levels(t, o);
    if (code != TOOL_DONE) return code;
    if (o->resume) return run_with_state(t, o, NULL, NULL);
    bool keeps = tool_is_gltf(t, t->inputs[0]) && tool_ends(t->output, "glb");
    code = keeps ? tool_open_gltf(t, t->inputs[0], &gltf, &mesh) : tool_load_mesh(t, t->inputs[0], &mesh);
    if (code != TOOL_DONE) return code;
    if (o->ratio > 0) o->def.target_faces = (uint32_t)llround(o->ratio * mesh.face_count);
    t->bar.items = mesh.face_count;
    t->bar.unit = "faces";
    code = set_attribute_weights(t, o, &mesh);
    if (code == TOOL_DONE && (o->save_state || o->contour || o->paint)) {
        code = run_with_state(t, o, gltf, &mesh);
        goto done;
    }
    if (code == TOOL_DONE && o->level_count > 0) {
        code = run_levels(t, o, gltf, &mesh);
        goto done;
    }
    if (code == TOOL_DONE) code = simplify_mesh(t, o, &mesh, &simple, &stats);
    if (code == TOOL_DONE)
        code = gltf ? tool_save_gltf(t, gltf, t->output, &simple) : tool_save_mesh(t, t->output, &simple, 1);
    if (code == TOOL_DONE) warn_exhausted(t, o->def.target_faces, &stats);
    if (code == TOOL_DONE) code = report_simplify(t, &simple, &stats);
done:
    fct_mesh_release(&t->env, &simple);
    fct_mesh_release(&t->env, &mesh);
    fct_gltf_close(gltf);
    return code;
}

int tool_simplify(int argc, char **argv) {
    static const tool_stage stages[] = {{"read", 5},   {"pairs", 2}, {"costs", 3}, {"contract", 76},
                                        {"refit", 12}, {"write", 2}, {0}};
    static const tool_command command = {
        .name = "simplify",
        .synopsis = "IN -o OUT\n--resume STATE -o OUT",
        .summary = "reduce a mesh, keeping its shape and colours",
        .text =
            "IN is a mesh or a hierarchy file (.fct), OUT is a mesh; their endings choose the formats. If "
            "both are glTF, OUT keeps the nodes, names, materials, textures, cameras and lights of IN. Each "
            "mesh counts once, however many nodes place it. Edges are contracted in the order of their "
            "quadric error until the faces are as few as --faces or --ratio says, or until the error would "
            "exceed --max-error.\n\n"
            "JSON keys: faces_before, faces_after, vertices, stopped_because (faces, error or exhausted), "
            "pairs_found and pairs_joined (candidates of --pairs, and contractions of them), max_cost (the "
            "largest error of a contraction), distance_rms, distance_max, color_rms, uv_rms, normal_rms "
            "(errors of the result), lost_area (the share of the area of IN without faces in OUT, except "
            "inner walls that --pairs removed; the errors do not cover it), seconds{init, contract, refit, "
            "total}, peak_bytes. With --levels: levels[] with these keys up to lost_area and file, "
            "seconds{total}, peak_bytes.",
        .examples = "  facetree simplify bunny.obj --ratio .1 -o small.ply\n"
                    "  facetree simplify bunny.obj --faces 10000 -o small.ply --save-state bunny.fst\n"
                    "  facetree simplify --resume bunny.fst --faces 1000 -o smaller.ply\n"
                    "  facetree simplify lit.glb --faces 10000 -o small.glb\n"
                    "  facetree simplify bunny.obj --levels 20000,5000,1000 -o lod.ply\n"
                    "  facetree simplify city.glb --ratio .05 --pairs .5 -o far.glb\n"
                    "  facetree simplify bunny.obj --faces 200 -o small.ply --progressive bunny.fpm",
        .options = simplify_options_table,
        .parse = parse_simplify,
        .run = run_simplify,
        .stages = stages,
        .turns_bodies = true,
        .inputs_min = 0,
        .inputs_max = 1,
        .output = TOOL_OUTPUT_REQUIRED,
        .endings = TOOL_MESHES};
    simplify_options options = {.def = fct_simplify_def_default()};
    return tool_main(&command, argc, argv, &options);
}
