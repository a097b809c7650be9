/* tools/cluster/cluster.c: facetree cluster: from a mesh file to a hierarchy file. */
#include <limits.h>
#include <math.h>
#include <string.h>

#include "tools/cluster/many.h"
#include "tools/cluster/one.h"
#include "tools/commands.h"
#include "tools/kit/command.h"
#include "tools/kit/file.h"

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

static int cluster_one(tool *t, const cluster_options *options) {
    json_t *r = NULL;
    int code = tool_check_kind(t, t->output, "fct", "");
    if (code == TOOL_DONE) code = tool_check_output(t, t->output);
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
    static const tool_stage stages[] = {TOOL_TREE_STAGES, {"write", 18}, {"files", 100}, {0}};
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
        .examples = "  facetree cluster bunny.obj -o bunny.fct\n"
                    "  facetree cluster meshes/ -o trees/\n"
                    "  facetree cluster terrain.ply -o terrain.fct --max-memory 4G\n"
                    "  zcat bunny.obj.gz | facetree cluster - --format obj -o bunny.fct",
        .options = cluster_options_table,
        .parse = parse_cluster,
        .run = run_cluster,
        .stages = stages,
        .builds_tree = true,
        .turns_bodies = true,
        .inputs_min = 1,
        .inputs_max = INT_MAX,
        .output = TOOL_OUTPUT_REQUIRED,
        .output_folder = true};
    cluster_options options = {.def = fct_tree_def_default()};
    return tool_main(&command, argc, argv, &options);
}
