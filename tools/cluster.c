/* tools/cluster.c: facetree cluster: from a mesh file to a hierarchy file. */
#define _GNU_SOURCE
#include "tools/cluster.h"

#include <limits.h>
#include <math.h>
#include <string.h>
#include <sys/stat.h>

#include "tools/commands.h"
#include "tools/kit/command.h"
#include "tools/kit/file.h"
#include "tools/kit/model.h"

enum {
    KEY_METHOD = TOOL_KEY,
    KEY_COST,
    KEY_FIT,
    KEY_DIRECTION,
    KEY_SHAPE,
    KEY_FIT_MEASURE,
    KEY_ROOTS,
    KEY_MAX_COST,
    KEY_TEMPORARY
};

static const struct argp_option cluster_options_table[] = {
    {"method", KEY_METHOD, "NAME", 0,
     "rounds: merge all mutually cheapest pairs at once (default); greedy: merge the cheapest pair first", 0},
    {"cost", KEY_COST, "COST", 0,
     "increment: the growth of the total error (default); mean: the mean error of the union", 0},
    {"fit", KEY_FIT, "W", 0, "Weight of the distance to the plane (default 1e4, with --cost mean 1e6)", 0},
    {"direction", KEY_DIRECTION, "W", 0, "Weight of the deviation of normals (default 1)", 0},
    {"shape", KEY_SHAPE, "W", 0, "Weight of irregular borders (default .002, with --cost mean 1)", 0},
    {"fit-measure", KEY_FIT_MEASURE, "MEASURE", 0,
     "Measure the distance to the plane over the area (default) or over the points, the corners of the faces",
     0},
    {"roots", KEY_ROOTS, "N", 0, "Stop at N clusters (default 1)", 0},
    {"max-cost", KEY_MAX_COST, "C", 0,
     "Make no merge that costs more than C (default: no limit); the remaining clusters are roots", 0},
    {"temporary", KEY_TEMPORARY, "FOLDER", 0,
     "Put the temporary files of a mesh that does not fit into --max-memory in FOLDER (default: the folder "
     "of the "
     "output)",
     0},
    {0}};

static error_t parse_cluster(int key, char *text, struct argp_state *state) {
    static const char *const methods[] = {"greedy", "rounds", NULL},
                             *const costs[] = {"increment", "mean", NULL},
                             *const measures[] = {"area", "points", NULL};
    static const fct_cluster_method method_values[] = {FCT_CLUSTER_GREEDY, FCT_CLUSTER_ROUNDS};
    static const fct_cluster_cost cost_values[] = {FCT_COST_INCREMENT, FCT_COST_MEAN};
    static const fct_fit_measure measure_values[] = {FCT_FIT_AREA, FCT_FIT_POINTS};
    cluster_options *options = state->input;
    fct_tree_def *def = &options->def;
    int index = 0;
    error_t error;
    switch (key) {
    case KEY_METHOD:
        error = tool_parse_choice(state, "--method", text, methods, &index);
        def->method = method_values[index];
        return error;
    case KEY_COST:
        error = tool_parse_choice(state, "--cost", text, costs, &index);
        def->cost = cost_values[index];
        return error;
    case KEY_FIT_MEASURE:
        error = tool_parse_choice(state, "--fit-measure", text, measures, &index);
        def->fit_measure = measure_values[index];
        return error;
    case KEY_FIT:
        return tool_parse_real(state, "--fit", text, 0, 1e30, &def->fit_weight);
    case KEY_DIRECTION:
        return tool_parse_real(state, "--direction", text, 0, 1e30, &def->direction_weight);
    case KEY_SHAPE:
        return tool_parse_real(state, "--shape", text, 0, 1e30, &def->shape_weight);
    case KEY_ROOTS:
        return tool_parse_count32(state, "--roots", text, 1, FCT_NONE - 1, &def->root_count);
    case KEY_MAX_COST:
        return tool_parse_real(state, "--max-cost", text, 0, INFINITY, &def->max_cost);
    case KEY_TEMPORARY:
        options->temporary = text;
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* --- One file --- */

static json_t *describe_build(const fct_large_stats *s, double total, const char *output) {
    struct stat status;
    bool regular = strcmp(output, "-") != 0 && stat(output, &status) == 0 && S_ISREG(status.st_mode);
    return json_pack("{s:I, s:I, s:I, s:I, s:f, s:I, s:{s:f, s:f, s:f, s:f, s:f, s:f}, s:I, s:I}", "faces",
                     (json_int_t)s->face_count, "vertices", (json_int_t)s->vertex_count, "roots",
                     (json_int_t)s->root_count, "depth", (json_int_t)s->depth, "mean_depth", s->mean_depth,
                     "parts", (json_int_t)s->part_count, "seconds", "read", s->seconds_read, "dual",
                     s->seconds_dual, "contract", s->seconds_contract, "boxes", s->seconds_boxes, "write",
                     s->seconds_write, "total", total, "peak_bytes", (json_int_t)tool_peak_bytes(),
                     "file_bytes", (json_int_t)(regular ? status.st_size : 0));
}

static int check_faces(tool *t, const fct_tree_def *def, const char *input, uint32_t faces) {
    if (faces == 0) return tool_fail(t, TOOL_DATA, "%s: expected at least one face, found none", input);
    if (def->root_count > faces)
        return tool_fail(t, TOOL_USAGE, "--roots %u: %s has only %u faces", def->root_count, input, faces);
    return TOOL_DONE;
}

/* Bytes that --max-memory still allows. */
static size_t find_memory_left(const tool *t) {
    if (!t->max_memory) return SIZE_MAX;
    return t->max_memory > t->memory_now ? t->max_memory - t->memory_now : 0;
}

static bool fits_memory(const tool *t, const fct_tree_def *def, uint32_t faces, uint32_t vertices) {
    return fct_tree_build_need(faces, vertices, def).in_memory <= find_memory_left(t);
}

/* Builds the whole tree in memory. If it does not fit, sets *large and returns TOOL_DONE. */
static int cluster_in_memory(tool *t, const fct_tree_def *def, const char *input, const char *output,
                             bool *large, fct_large_stats *s) {
    fct_mesh mesh = {0};
    fct_tree *tree = NULL;
    fct_tree_stats stats = {0};
    double start = tool_seconds();
    int code = tool_load_mesh(t, input, &mesh);
    if (code == TOOL_DONE) code = check_faces(t, def, input, mesh.face_count);
    if (code != TOOL_DONE) goto done;
    *large =
        strcmp(input, "-") != 0 && !fits_memory(t, def, mesh.face_count, 0); /* the mesh is loaded already */
    if (*large) goto done;
    t->items = mesh.face_count;
    t->unit = "faces";
    double read = tool_seconds();
    code = tool_result(t, fct_tree_build(&t->env, &mesh, def, &stats, &tree));
    *large = code == TOOL_MEMORY && t->max_memory && strcmp(input, "-") != 0;
    if (*large) { /* the build needed more than the estimate */
        t->error[0] = 0, t->memory_refused = false;
        code = TOOL_DONE;
        goto done;
    }
    if (tool_context(t, code, input) != TOOL_DONE) goto done;
    double built = tool_seconds();
    code = tool_result(t, fct_tree_save(&t->env, tree, output));
    fct_tree_view view = fct_tree_get(tree);
    *s = (fct_large_stats){view.face_count,     view.vertex_count,
                           view.root_count,     view.depth,
                           view.mean_depth,     1,
                           view.root_count,     read - start,
                           stats.seconds_dual,  stats.seconds_contract,
                           stats.seconds_boxes, tool_seconds() - built};
done:
    fct_tree_destroy(tree);
    fct_mesh_release(&t->env, &mesh);
    return code;
}

int tool_cluster_file(tool *t, const cluster_options *options, const char *input, const char *output,
                      json_t **out) {
    fct_tree_def def = options->def;
    fct_large_stats stats = {0};
    double start = tool_seconds();
    bool standard = strcmp(input, "-") == 0, known = false, large = false;
    uint32_t faces = 0, vertices = 0;
    int code = standard ? TOOL_DONE : tool_hash_file(t, input, &def.source_hash);
    if (code == TOOL_DONE && t->max_memory && tool_ends(input, "ply"))
        code = tool_result(t, fct_mesh_file_counts(&t->env, input, &known, &faces, &vertices));
    if (code == TOOL_DONE && known) code = check_faces(t, &def, input, faces);
    if (code != TOOL_DONE) return code;
    const char *slash = strrchr(input, '/');
    def.source = standard ? "standard input" : slash ? slash + 1 : input;
    double hashed = tool_seconds() - start;
    large = known && !fits_memory(t, &def, faces, vertices);
    if (!large) code = cluster_in_memory(t, &def, input, output, &large, &stats);
    if (large) {
        fct_large_def limits = fct_large_def_default();
        limits.max_memory = find_memory_left(t);
        uint64_t least = known ? fct_tree_build_need(faces, vertices, &def).in_parts : 0;
        if (limits.max_memory < least)
            return tool_fail(
                t, TOOL_MEMORY, "%s: --max-memory %zu: a tree of %u faces needs at least %llu bytes", input,
                t->max_memory, faces, (unsigned long long)(least + (t->max_memory - limits.max_memory)));
        limits.temporary_folder = options->temporary;
        t->items = faces;
        t->unit = "faces";
        code = tool_result(t, fct_tree_build_file(&t->env, input, output, &def, &limits, &stats));
        tool_context(t, code, input);
    }
    stats.seconds_read += hashed;
    if (code == TOOL_DONE) *out = describe_build(&stats, tool_seconds() - start, output);
    return code;
}

double tool_cluster_number(const json_t *object, const char *key) {
    return json_number_value(json_object_get(object, key));
}

void tool_cluster_say(tool *t, const char *input, const json_t *r) {
    tool_say(t, "%s: %.0f faces, %.0f root%s, depth %.0f (mean %.1f), %.2f s, %.1f MB", input,
             tool_cluster_number(r, "faces"), tool_cluster_number(r, "roots"),
             tool_cluster_number(r, "roots") == 1 ? "" : "s", tool_cluster_number(r, "depth"),
             tool_cluster_number(r, "mean_depth"),
             tool_cluster_number(json_object_get(r, "seconds"), "total"),
             tool_cluster_number(r, "file_bytes") / 1e6);
}

static int cluster_one(tool *t, const cluster_options *options) {
    json_t *r = NULL;
    int code = tool_check_output(t, t->output);
    if (code == TOOL_DONE) code = tool_cluster_file(t, options, t->inputs[0], t->output, &r);
    if (code != TOOL_DONE) return code;
    tool_cluster_say(t, t->inputs[0], r);
    return tool_json(t, r);
}

static int run_cluster(tool *t, void *options) {
    size_t length = strlen(t->output);
    bool several = t->input_count > 1 || tool_is_folder(t->inputs[0]) || tool_is_folder(t->output) ||
                   t->output[length - 1] == '/';
    return several ? tool_cluster_many(t, options) : cluster_one(t, options);
}

int tool_cluster(int argc, char **argv) {
    static const tool_command command = {
        .name = "cluster",
        .synopsis = "IN... -o OUT.fct",
        .summary = "build the hierarchy of face clusters of a mesh",
        .text = "IN is a mesh file (OBJ, PLY, OFF, STL, OM, GLB; - reads a PLY), OUT.fct is the hierarchy "
                "file. Several files, or a "
                "folder of them, are clustered on all cores; -o then names a folder, which receives one "
                "NAME.fct per file. A "
                "scene that finds NAME.fct beside a model NAME.ply opens it.\n\n"
                "A mesh that does not fit into --max-memory (about 225 bytes per triangle) is cut into "
                "parts, which are clustered "
                "one by one. Temporary files then take as much disk space as OUT.fct. Only binary PLY files "
                "of triangles can be "
                "larger than memory themselves. 100 million triangles need at least 1 GB. More memory makes "
                "fewer parts, not "
                "better clusters.\n\n"
                "JSON keys: faces, vertices, roots, depth, mean_depth, parts, seconds{read, dual, contract, "
                "boxes, write, total}, "
                "peak_bytes, file_bytes; for several files their sums, and files[].",
        .options = cluster_options_table,
        .parse = parse_cluster,
        .run = run_cluster,
        .inputs_min = 1,
        .inputs_max = INT_MAX,
        .output = TOOL_OUTPUT_REQUIRED,
        .output_folder = true};
    cluster_options options = {.def = fct_tree_def_default()};
    return tool_main(&command, argc, argv, &options);
}
