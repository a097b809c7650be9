/* tools/simplify.c: facetree simplify: fewer triangles, same shape and colours. */
#include "tools/kit/tool.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct simplify_options {
    fct_simplify_def def;
    bool faces_given, error_given, attributes_given;
    double ratio;      /* 0: not given */
    double weights[3]; /* color, uv, normal: negative: the default; NAN: not named */
} simplify_options;

enum {
    KEY_FACES = TOOL_KEY,
    KEY_RATIO,
    KEY_MAX_ERROR,
    KEY_ATTRIBUTES,
    KEY_PLACEMENT,
    KEY_BOUNDARY,
    KEY_FEATURE,
    KEY_REGULARIZE,
    KEY_TOPOLOGY,
    KEY_REFIT
};

static const struct argp_option options_table[] = {
    {"faces", KEY_FACES, "N", 0, "Stop at N faces or fewer", 0},
    {"ratio", KEY_RATIO, "R", 0, "Stop at R times the faces of the input", 0},
    {"max-error", KEY_MAX_ERROR, "E", 0,
     "Make no contraction with a larger error, in the mesh's unit of length", 0},
    {"attributes", KEY_ATTRIBUTES, "LIST", 0,
     "What steers beside the shape: color, uv, normal, each with a weight if wanted: "
     "color=.1,uv=.1,normal=.01; none "
     "for the shape alone. Default: all that the mesh has",
     0},
    {"placement", KEY_PLACEMENT, "WHERE", 0, "Of the new vertex: optimal (default), segment, ends or subset",
     0},
    {"boundary", KEY_BOUNDARY, "W", 0, "Weight that holds boundaries and colour borders (default 1000)", 0},
    {"feature-threshold", KEY_FEATURE, "T", 0,
     "Faces whose colours differ by more make a border (default .1; inf for none)", 0},
    {"regularize", KEY_REGULARIZE, "G", 0, "Weight of the pull to the edge's middle (default 1e-9)", 0},
    {"keep-topology", KEY_TOPOLOGY, NULL, 0, "Join and close nothing", 0},
    {"refit", KEY_REFIT, "N", 0, "Fit the vertices to the input N times afterwards (default 2)", 0},
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

static error_t parse(int key, char *text, struct argp_state *state) {
    static const char *const placements[] = {"optimal", "segment", "ends", "subset", NULL};
    static const fct_placement values[] = {FCT_PLACE_OPTIMAL, FCT_PLACE_SEGMENT, FCT_PLACE_ENDS,
                                           FCT_PLACE_SUBSET};
    simplify_options *o = state->input;
    int index = 0;
    error_t error;
    switch (key) {
    case KEY_FACES:
        o->faces_given = true;
        return tool_parse_count32(state, "--faces", text, 0, FCT_NONE - 1, &o->def.target_faces);
    case KEY_RATIO:
        error = tool_parse_real(state, "--ratio", text, 0, 1, &o->ratio);
        return error          ? error
               : o->ratio > 0 ? 0
                              : tool_usage(state, "--ratio: expected a number above 0, found '%s'", text);
    case KEY_MAX_ERROR:
        o->error_given = true;
        return tool_parse_real(state, "--max-error", text, 0, INFINITY, &o->def.max_error);
    case KEY_ATTRIBUTES:
        return parse_attributes(o, text, state);
    case KEY_PLACEMENT:
        error = tool_parse_choice(state, "--placement", text, placements, &index);
        o->def.placement = values[index];
        return error;
    case KEY_BOUNDARY:
        return tool_parse_real(state, "--boundary", text, 0, 1e12, &o->def.boundary_weight);
    case KEY_FEATURE:
        return tool_parse_real(state, "--feature-threshold", text, 0, INFINITY, &o->def.feature_threshold);
    case KEY_REGULARIZE:
        return tool_parse_real(state, "--regularize", text, 0, 1, &o->def.regularization);
    case KEY_TOPOLOGY:
        o->def.keep_topology = true;
        return 0;
    case KEY_REFIT:
        return tool_parse_count32(state, "--refit", text, 0, 100, &o->def.refit_passes);
    case ARGP_KEY_END:
        if (o->faces_given && o->ratio > 0)
            return tool_usage(state, "expected either --faces or --ratio, found both");
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* Weights of named attributes, which the mesh must have; those not named do not steer. */
static int set_attributes(tool *t, simplify_options *o, const fct_mesh *mesh) {
    const void *arrays[3] = {mesh->colors, mesh->texcoords, mesh->normals};
    double *weights[3] = {&o->def.color_weight, &o->def.texcoord_weight, &o->def.normal_weight};
    for (int i = 0; i < 3 && o->attributes_given; ++i) {
        if (isnan(o->weights[i]))
            *weights[i] = 0;
        else if (!arrays[i])
            return tool_fail(t, TOOL_DATA,
                             "%s: expected a %s on its vertices, as --attributes asks, found none",
                             t->inputs[0], attribute_names[i]);
        else if (o->weights[i] >= 0)
            *weights[i] = o->weights[i];
    }
    return TOOL_DONE;
}

static int report(tool *t, const fct_mesh *mesh, const fct_simplify_stats *s) {
    static const char *const reasons[] = {
        [FCT_STOP_FACES] = "faces", [FCT_STOP_ERROR] = "error", [FCT_STOP_EXHAUSTED] = "exhausted"};
    double total = tool_seconds() - t->start;
    tool_say(t, "%u faces to %u (stopped by %s), largest error %.3g, %.2f s", s->faces_before, s->faces_after,
             reasons[s->stopped_because], s->max_cost, total);
    return tool_json(t, json_pack("{s:I, s:I, s:I, s:s, s:f, s:{s:f, s:f, s:f, s:f}, s:I}", "faces_before",
                                  (json_int_t)s->faces_before, "faces_after", (json_int_t)s->faces_after,
                                  "vertices", (json_int_t)mesh->vertex_count, "stopped_because",
                                  reasons[s->stopped_because], "max_cost", s->max_cost, "seconds", "init",
                                  s->seconds_init, "contract", s->seconds_contract, "refit", s->seconds_refit,
                                  "total", total, "peak_bytes", (json_int_t)tool_peak_bytes()));
}

static int run(tool *t, void *options) {
    simplify_options *o = options;
    if (!o->faces_given && !(o->ratio > 0) && !o->error_given)
        return tool_fail(t, TOOL_USAGE, "expected --faces N, --ratio R or --max-error E");
    if (strcmp(t->output, "-") != 0 && !tool_is_mesh_name(t->output))
        return tool_fail(t, TOOL_USAGE,
                         "%s: expected a name that ends in .ply, .obj, .off, .stl, .om or .glb", t->output);
    fct_mesh mesh, simple = {0};
    fct_simplify_stats stats;
    int code = tool_load_mesh(t, t->inputs[0], &mesh);
    if (code != TOOL_DONE) return code;
    if (o->ratio > 0) o->def.target_faces = (uint32_t)llround(o->ratio * mesh.face_count);
    t->items = mesh.face_count;
    t->unit = "faces";
    code = set_attributes(t, o, &mesh);
    if (code == TOOL_DONE) code = tool_result(t, fct_simplify(&t->env, &mesh, &o->def, &simple, &stats));
    if (code == TOOL_DONE) code = tool_save_mesh(t, t->output, &simple, 1);
    if (code == TOOL_DONE && stats.faces_after > o->def.target_faces &&
        stats.stopped_because == FCT_STOP_EXHAUSTED)
        tool_warn(t, "no contraction is allowed below %u faces", stats.faces_after);
    if (code == TOOL_DONE) code = report(t, &simple, &stats);
    fct_mesh_release(&t->env, &simple);
    fct_mesh_release(&t->env, &mesh);
    return code;
}

int tool_simplify(int argc, char **argv) {
    static const tool_command command = {
        .name = "simplify",
        .synopsis = "IN -o OUT",
        .summary = "reduce a mesh, keeping its shape and colours",
        .text =
            "IN is a mesh or a hierarchy file (.fct), OUT a mesh; their endings choose the formats. Edges "
            "are "
            "contracted in the order of their quadric error, until there are as few faces as --faces or "
            "--ratio "
            "ask for, or the error exceeds --max-error.\n\n"
            "JSON keys: faces_before, faces_after, vertices, stopped_because (faces, error or exhausted), "
            "max_cost, seconds{init, contract, refit, total}, peak_bytes.",
        .options = options_table,
        .parse = parse,
        .run = run,
        .inputs_min = 1,
        .inputs_max = 1,
        .output = TOOL_OUTPUT_REQUIRED};
    simplify_options options = {.def = fct_simplify_def_default()};
    return tool_main(&command, argc, argv, &options);
}
