/* tools/boxes.c: facetree boxes: the oriented boxes of K clusters, as JSON or as a mesh of boxes. */
#include "tools/tool.h"

#include <string.h>

static const struct argp_option options_table[] = {{"clusters", 'k', "K", 0, "The boxes of K clusters", 0},
                                                   {0}};

static error_t parse(int key, char *text, struct argp_state *state) {
    if (key == 'k') return tool_parse_count32(state, "-k", text, 1, FCT_NONE - 1, state->input);
    return key == ARGP_KEY_SUCCESS ? 0 : ARGP_ERR_UNKNOWN;
}

static json_t *numbers(const float *values, int count) {
    json_t *array = json_array();
    for (int i = 0; i < count; ++i) json_array_append_new(array, json_real(values[i]));
    return array;
}

static json_t *describe(const fct_cluster *clusters, uint32_t count) {
    json_t *list = json_array();
    for (uint32_t i = 0; i < count; ++i) {
        fct_box box;
        const fct_cluster *cluster = &clusters[i];
        fct_cluster_box(cluster, &box);
        json_t *item =
            json_pack("{s:o, s:[o, o, o], s:o, s:o, s:f, s:I}", "center", numbers(box.center, 3), "axes",
                      numbers(box.axes[0], 3), numbers(box.axes[1], 3), numbers(box.axes[2], 3),
                      "half_extents", numbers(box.half, 3), "plane", numbers(cluster->plane, 4), "area",
                      (double)cluster->area, "faces", (json_int_t)cluster->count);
        if (!item || json_array_append_new(list, item)) {
            json_decref(list);
            return NULL;
        }
    }
    return json_pack("{s:I, s:o}", "clusters", (json_int_t)count, "boxes", list);
}

static int write_json(tool *t, json_t *object) {
    tool_writer writer;
    int code = tool_writer_open(t, t->output ? t->output : "-", &writer);
    if (code == TOOL_DONE) {
        if (json_dumpf(object, writer.stream, JSON_INDENT(1) | JSON_REAL_PRECISION(9)))
            code = tool_fail(t, TOOL_OUTPUT, "%s: cannot be written", writer.path);
        fputc('\n', writer.stream);
        code = tool_writer_close(t, &writer, code);
    }
    return code;
}

/* Corner c is at the side of axis i that bit i of c tells; the sides' triangles look outwards when the axes
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

static int write_mesh(tool *t, const fct_cluster *clusters, uint32_t count) {
    fct_mesh mesh;
    if (count > FCT_NONE / 48) return tool_fail(t, TOOL_USAGE, "-k %u: too many boxes for one mesh", count);
    int code = tool_result(t, fct_mesh_create(&t->env, 8 * count, 12 * count, FCT_MESH_COLORS, &mesh));
    if (code != TOOL_DONE) return code;
    for (uint32_t i = 0; i < count; ++i) {
        fct_box box;
        fct_cluster_box(&clusters[i], &box);
        add_box(&box, i, &mesh);
    }
    code = tool_save_mesh(t, t->output, &mesh, 1);
    fct_mesh_release(&t->env, &mesh);
    return code;
}

static int write_boxes(tool *t, const fct_cluster *clusters, uint32_t count) {
    bool as_mesh = t->output && tool_is_mesh_name(t->output);
    int code = as_mesh ? write_mesh(t, clusters, count) : TOOL_DONE;
    json_t *object = as_mesh && !t->json ? NULL : describe(clusters, count);
    if (code == TOOL_DONE && !object && !as_mesh)
        return tool_fail(t, TOOL_MEMORY, "out of memory for the JSON output");
    if (code == TOOL_DONE && !as_mesh && (t->output || !t->json)) code = write_json(t, object);
    if (code == TOOL_DONE && t->json) return tool_json(t, object);
    json_decref(object);
    return code;
}

/* The clusters of the partition; of a hierarchy file nothing but these and those above them is read. */
static int read_clusters(tool *t, const fct_tree *tree, uint32_t wanted, fct_cluster *clusters,
                         uint32_t *nodes) {
    uint32_t count;
    int code = tool_result(t, fct_tree_partition(&t->env, tree, wanted, nodes, &count));
    for (uint32_t i = 0; code == TOOL_DONE && i < count; ++i)
        code = tool_result(t, fct_tree_cluster(tree, nodes[i], &clusters[i]));
    return code;
}

static int run(tool *t, void *options) {
    uint32_t wanted = *(const uint32_t *)options;
    if (!wanted) return tool_fail(t, TOOL_USAGE, "expected -k K");
    fct_tree *tree;
    int code = tool_open_tree(t, t->inputs[0], NULL, &tree);
    if (code != TOOL_DONE) return code;
    fct_tree_view view = fct_tree_get(tree);
    uint32_t *nodes = NULL;
    fct_cluster *clusters = NULL;
    if (wanted < view.root_count || wanted > view.face_count)
        code = tool_fail(t, TOOL_USAGE, "-k %u: %s can be cut into %u to %u clusters", wanted, t->inputs[0],
                         view.root_count, view.face_count);
    else if (!(nodes = tool_allocate(t, wanted, sizeof *nodes)) ||
             !(clusters = tool_allocate(t, wanted, sizeof *clusters)))
        code = TOOL_MEMORY;
    if (code == TOOL_DONE) code = read_clusters(t, tree, wanted, clusters, nodes);
    if (code == TOOL_DONE) code = write_boxes(t, clusters, wanted);
    tool_release(t, nodes);
    tool_release(t, clusters);
    fct_tree_destroy(tree);
    return code;
}

int tool_boxes(int argc, char **argv) {
    static const tool_command command = {
        .name = "boxes",
        .synopsis = "IN -k K [-o OUT]",
        .summary = "oriented boxes of K clusters",
        .text =
            "IN is a mesh or a hierarchy file (.fct). OUT is JSON, or, when it is named as a mesh, a mesh of "
            "boxes "
            "with a colour for each. Without -o the JSON goes to standard output.\n\n"
            "JSON keys: clusters, boxes[]{center, axes (three unit vectors), half_extents, plane (n, d with "
            "n.x + d = 0), area (of the surface inside), faces}.",
        .options = options_table,
        .parse = parse,
        .run = run,
        .inputs_min = 1,
        .inputs_max = 1,
        .output = TOOL_OUTPUT_OPTIONAL};
    uint32_t clusters = 0;
    return tool_main(&command, argc, argv, &clusters);
}
