/* tools/boxes.c: facetree boxes: the oriented boxes of clusters, as JSON or as a mesh. */
#include "tools/commands.h"

#include <string.h>

#include "tools/kit/command.h"
#include "tools/kit/file.h"
#include "tools/kit/model.h"
#include "tools/kit/options.h"
#include "tools/labels.h"

typedef struct box_options {
    uint32_t clusters; /* 0: not given */
    tool_length max_distance;
} box_options;

enum { KEY_MAX_DISTANCE = TOOL_KEY };

static const struct argp_option box_options_table[] = {
    {"clusters", 'k', "K", 0, "Write the boxes of K clusters", 0},
    {"max-distance", KEY_MAX_DISTANCE, "D", 0,
     "Write the boxes of the fewest clusters whose vertices are all within D of the cluster's plane, in the "
     "mesh's unit; "
     "D% is a share of the diagonal",
     0},
    {0}};

static error_t parse_boxes(int key, char *text, struct argp_state *state) {
    box_options *o = state->input;
    switch (key) {
    case 'k':
        return tool_parse_count32(state, "-k", text, 1, FCT_NONE - 1, &o->clusters);
    case KEY_MAX_DISTANCE:
        return tool_parse_length(state, "--max-distance", text, &o->max_distance);
    default:
        return key == ARGP_KEY_SUCCESS ? 0 : ARGP_ERR_UNKNOWN;
    }
}

/* The plane n.x + d = 0 in the user's coordinates: d changes by -n.origin. */
static json_t *describe_plane(const fct_cluster *cluster, const double origin[3]) {
    double d = cluster->plane[3];
    for (int k = 0; k < 3; ++k) d -= (double)cluster->plane[k] * origin[k];
    json_t *plane = tool_json_floats(cluster->plane, 3);
    json_array_append_new(plane, json_real(d));
    return plane;
}

static json_t *describe_boxes(const fct_cluster *clusters, uint32_t count, const double origin[3]) {
    json_t *list = json_array();
    for (uint32_t i = 0; i < count; ++i) {
        fct_box box;
        const fct_cluster *cluster = &clusters[i];
        fct_cluster_box(cluster, &box);
        json_t *item =
            json_pack("{s:o, s:[o, o, o], s:o, s:o, s:f, s:I}", "center", tool_json_point(box.center, origin),
                      "axes", tool_json_floats(box.axes[0], 3), tool_json_floats(box.axes[1], 3),
                      tool_json_floats(box.axes[2], 3), "half_extents", tool_json_floats(box.half, 3),
                      "plane", describe_plane(cluster, origin), "area", (double)cluster->area, "faces",
                      (json_int_t)cluster->count);
        if (!item || json_array_append_new(list, item)) {
            json_decref(list);
            return NULL;
        }
    }
    return json_pack("{s:I, s:o}", "clusters", (json_int_t)count, "boxes", list);
}

/* digits: 9 for floats, 15 for coordinates relative to an origin. */
static int write_boxes_json(tool *t, json_t *object, size_t digits) {
    tool_writer writer;
    int code = tool_writer_open(t, t->output ? t->output : "-", &writer);
    if (code == TOOL_DONE) {
        if (json_dumpf(object, writer.stream, JSON_INDENT(1) | JSON_REAL_PRECISION(digits)))
            code =
                tool_fail(t, TOOL_OUTPUT, "%s: cannot be written", t->output ? t->output : "standard output");
        fputc('\n', writer.stream);
        code = tool_writer_close(t, &writer, code);
    }
    return code;
}

/* Corner c lies on the positive side of axis i if bit i of c is set. The triangles face outwards if the axes
 * are right-handed. */
static void add_box(const fct_box *box, uint32_t index, fct_mesh *mesh) {
    static const uint8_t sides[12][3] = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                                         {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    for (uint32_t c = 0; c < 8; ++c) {
        size_t vertex = 8 * (size_t)index + c;
        for (int i = 0; i < 3; ++i) {
            double x = box->center[i];
            for (int a = 0; a < 3; ++a) x += (c >> a & 1 ? 1 : -1) * (double)box->half[a] * box->axes[a][i];
            mesh->positions[3 * vertex + (size_t)i] = (float)x;
        }
        tool_palette(index, mesh->colors + 3 * vertex);
    }
    for (uint32_t f = 0; f < 12; ++f)
        for (uint32_t c = 0; c < 3; ++c)
            mesh->triangles[3 * (12 * (size_t)index + f) + c] = 8 * index + sides[f][c];
}

static int write_boxes_mesh(tool *t, const fct_cluster *clusters, uint32_t count, const double origin[3]) {
    fct_mesh mesh;
    if (count > FCT_NONE / 48) return tool_fail(t, TOOL_USAGE, "-k %u: too many boxes for one mesh", count);
    int code = tool_result(t, fct_mesh_create(&t->env, 8 * count, 12 * count, FCT_MESH_COLORS, &mesh));
    if (code != TOOL_DONE) return code;
    for (uint32_t i = 0; i < count; ++i) {
        fct_box box;
        fct_cluster_box(&clusters[i], &box);
        add_box(&box, i, &mesh);
    }
    memcpy(mesh.origin, origin, sizeof mesh.origin);
    code = tool_save_mesh(t, t->output, &mesh, 1);
    fct_mesh_release(&t->env, &mesh);
    return code;
}

static int write_boxes(tool *t, const fct_cluster *clusters, uint32_t count, const double origin[3]) {
    bool far = origin[0] != 0 || origin[1] != 0 || origin[2] != 0;
    bool as_mesh = t->output && tool_is_mesh_name(t->output);
    int code = as_mesh ? write_boxes_mesh(t, clusters, count, origin) : TOOL_DONE;
    json_t *object = as_mesh && !t->json ? NULL : describe_boxes(clusters, count, origin);
    if (code == TOOL_DONE && !object && !as_mesh)
        return tool_fail(t, TOOL_MEMORY, "out of memory for the JSON output");
    if (code == TOOL_DONE && !as_mesh && (t->output || !t->json))
        code = write_boxes_json(t, object, far ? 15 : 9);
    if (code == TOOL_DONE && t->json) return tool_json(t, object);
    json_decref(object);
    return code;
}

/* -k reads only the chosen clusters and their ancestors from a hierarchy file. */
static int choose_clusters(tool *t, const fct_tree *tree, const box_options *o, uint32_t **nodes,
                           uint32_t *count) {
    fct_tree_view view = fct_tree_get(tree);
    if (o->clusters && (o->clusters < view.root_count || o->clusters > view.face_count))
        return tool_fail(t, TOOL_USAGE, "-k %u: %s can be cut into %u to %u clusters", o->clusters,
                         t->inputs[0], view.root_count, view.face_count);
    *nodes = tool_allocate(t, o->clusters ? o->clusters : view.face_count, sizeof **nodes);
    if (!*nodes) return TOOL_MEMORY;
    if (o->clusters) return tool_result(t, fct_tree_partition(&t->env, tree, o->clusters, *nodes, count));
    return tool_result(t, fct_tree_cut_at_distance(&t->env, tree, tool_length_of(tree, o->max_distance),
                                                   *nodes, count, NULL));
}

static int run_boxes(tool *t, void *options) {
    const box_options *o = options;
    if ((o->clusters > 0) == (o->max_distance.value >= 0))
        return tool_fail(t, TOOL_USAGE, "expected either -k K or --max-distance D");
    fct_tree *tree;
    uint32_t *nodes = NULL, count = 0;
    fct_cluster *clusters = NULL;
    int code = tool_open_tree(t, t->inputs[0], NULL, &tree);
    if (code == TOOL_DONE) tool_warn_inward(t, t->inputs[0], fct_tree_get(tree).inward);
    if (code == TOOL_DONE) code = choose_clusters(t, tree, o, &nodes, &count);
    if (code == TOOL_DONE && !(clusters = tool_allocate(t, count, sizeof *clusters))) code = TOOL_MEMORY;
    for (uint32_t i = 0; code == TOOL_DONE && i < count; ++i)
        code = tool_result(t, fct_tree_cluster(tree, nodes[i], &clusters[i]));
    if (code == TOOL_DONE) code = write_boxes(t, clusters, count, fct_tree_get(tree).origin);
    tool_release(t, nodes);
    tool_release(t, clusters);
    fct_tree_destroy(tree);
    return code;
}

int tool_boxes(int argc, char **argv) {
    static const tool_stage stages[] = {TOOL_TREE_STAGES, {"write", 5}, {0}};
    static const tool_command command = {
        .name = "boxes",
        .synopsis = "IN (-k K | --max-distance D) [-o OUT]",
        .summary = "write the oriented boxes of clusters",
        .text = "IN is a mesh or a hierarchy file (.fct). OUT is a JSON file or, if it is named as a mesh, a "
                "mesh of boxes with a "
                "colour per box. Without -o the JSON goes to standard output.\n\n"
                "JSON keys: clusters, boxes[]{center, axes (three unit vectors), half_extents, plane (n, d "
                "with n.x + d = 0), "
                "area (of the surface inside), faces}.",
        .examples = "  facetree boxes bunny.fct -k 200 -o boxes.json\n"
                    "  facetree boxes bunny.obj --max-distance 1% -o boxes.ply",
        .options = box_options_table,
        .parse = parse_boxes,
        .run = run_boxes,
        .stages = stages,
        .builds_tree = true,
        .inputs_min = 1,
        .inputs_max = 1,
        .output = TOOL_OUTPUT_OPTIONAL,
        .endings = "json " TOOL_MESHES,
        .other = ""};
    box_options options = {.max_distance = {.value = -1}};
    return tool_main(&command, argc, argv, &options);
}
