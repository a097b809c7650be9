/* tools/partition.c: facetree partition: K clusters as labels or as a mesh of many colours. */
#include "tools/tool.h"

#include <math.h>
#include <string.h>

typedef struct partition_options {
    uint32_t clusters; /* 0: not given */
    double max_cost;   /* negative: not given */
} partition_options;

enum { KEY_MAX_COST = TOOL_KEY };

static const struct argp_option options_table[] = {
    {"clusters", 'k', "K", 0, "Cut into K clusters", 0},
    {"max-cost", KEY_MAX_COST, "C", 0, "Make all merges that cost at most C", 0},
    {0}};

static error_t parse(int key, char *text, struct argp_state *state) {
    partition_options *o = state->input;
    switch (key) {
    case 'k':
        return tool_parse_count32(state, "-k", text, 1, FCT_NONE - 1, &o->clusters);
    case KEY_MAX_COST:
        return tool_parse_real(state, "--max-cost", text, 0, INFINITY, &o->max_cost);
    case ARGP_KEY_SUCCESS:
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static int write_labels(tool *t, const uint32_t *labels, uint32_t count) {
    tool_writer writer;
    int code = tool_writer_open(t, t->output, &writer);
    if (code != TOOL_DONE) return code;
    for (uint32_t f = 0; f < count; ++f) fprintf(writer.stream, "%u\n", labels[f]);
    return tool_writer_close(t, &writer, TOOL_DONE);
}

/* A colour per face, where the format has one. */
static int write_face_colors(tool *t, fct_mesh mesh, const uint32_t *labels) {
    float *colors = tool_allocate(t, mesh.face_count, 3 * sizeof *colors);
    if (!colors) return TOOL_MEMORY;
    for (uint32_t f = 0; f < mesh.face_count; ++f) tool_palette(labels[f], colors + 3 * (size_t)f);
    mesh.face_colors = colors;
    mesh.colors = NULL;
    int code = tool_save_mesh(t, t->output, &mesh, 1);
    tool_release(t, colors);
    return code;
}

/* Numbers the vertices of each cluster for itself: labels do not decrease in the tree's order of places, so
 * one stamp a vertex tells whether it has its copy. Returns how many there are. */
static uint32_t split_vertices(const fct_mesh *mesh, const uint32_t *face_ids, const uint32_t *labels,
                               uint32_t *stamps, uint32_t *copies, uint32_t *triangles, uint32_t *originals) {
    uint32_t count = 0;
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) stamps[v] = FCT_NONE;
    for (uint32_t p = 0; p < mesh->face_count; ++p) {
        const size_t face = face_ids[p];
        for (size_t c = 3 * face; c < 3 * face + 3; ++c) {
            uint32_t v = mesh->triangles[c];
            if (stamps[v] != labels[face]) {
                stamps[v] = labels[face];
                originals[count] = v;
                copies[v] = count++;
            }
            triangles[c] = copies[v];
        }
    }
    return count;
}

/* A colour per vertex, with the vertices on borders doubled, for formats without colours of faces. */
static int write_vertex_colors(tool *t, const fct_mesh *mesh, const uint32_t *face_ids,
                               const uint32_t *labels) {
    const size_t corners = 3 * (size_t)mesh->face_count;
    uint32_t *ids = tool_allocate(t, 2 * ((size_t)mesh->vertex_count + corners), sizeof *ids);
    float *values = tool_allocate(t, corners, 6 * sizeof *values);
    int code = TOOL_MEMORY;
    if (!ids || !values) goto done;
    uint32_t *stamps = ids, *copies = ids + mesh->vertex_count, *triangles = copies + mesh->vertex_count,
             *originals = triangles + corners;
    fct_mesh split = {.face_count = mesh->face_count, .triangles = triangles, .positions = values};
    split.vertex_count = split_vertices(mesh, face_ids, labels, stamps, copies, triangles, originals);
    split.colors = values + 3 * corners;
    for (size_t c = 0; c < corners; ++c) tool_palette(labels[c / 3], split.colors + 3 * (size_t)triangles[c]);
    for (size_t v = 0; v < split.vertex_count; ++v)
        memcpy(values + 3 * v, mesh->positions + 3 * (size_t)originals[v], 3 * sizeof *values);
    code = tool_save_mesh(t, t->output, &split, 1);
done:
    tool_release(t, ids);
    tool_release(t, values);
    return code;
}

static int write_output(tool *t, const fct_tree *tree, const uint32_t *labels) {
    const uint32_t *face_ids = fct_tree_get(tree).face_ids;
    if (!tool_is_mesh_name(t->output)) return write_labels(t, labels, fct_tree_get(tree).face_count);
    fct_mesh mesh;
    int code = tool_result(t, fct_tree_mesh(&t->env, tree, &mesh));
    if (code != TOOL_DONE) return code;
    if (tool_ends(t->output, "ply") || tool_ends(t->output, "off"))
        code = write_face_colors(t, mesh, labels);
    else
        code = write_vertex_colors(t, &mesh, face_ids, labels);
    fct_mesh_release(&t->env, &mesh);
    return code;
}

static int report(tool *t, const fct_tree *tree, const uint32_t *nodes, uint32_t count) {
    fct_partition_quality q;
    int code = tool_result(t, fct_tree_quality(&t->env, tree, nodes, count, &q));
    if (code != TOOL_DONE) return code;
    tool_say(t, "%u clusters%s: fit %.3g, direction %.3g, irregularity %.3g, normal deviation %.3g", count,
             q.connected ? ", each connected" : "", q.mean_fit, q.mean_direction, q.mean_irregularity,
             q.mean_normal_deviation);
    return tool_json(t, json_pack("{s:I, s:f, s:f, s:f, s:f, s:f, s:b}", "clusters", (json_int_t)count,
                                  "mean_fit", q.mean_fit, "mean_direction", q.mean_direction,
                                  "mean_irregularity", q.mean_irregularity, "mean_normal_deviation",
                                  q.mean_normal_deviation, "box_area", q.box_area, "connected", q.connected));
}

static int run(tool *t, void *options) {
    const partition_options *o = options;
    if ((o->clusters > 0) == (o->max_cost >= 0))
        return tool_fail(t, TOOL_USAGE, "expected either -k K or --max-cost C");
    if (tool_ends(t->output, "stl")) return tool_fail(t, TOOL_USAGE, "%s: STL holds no colours", t->output);
    fct_tree *tree;
    uint32_t *nodes = NULL, *labels = NULL;
    int code = tool_open_tree(t, t->inputs[0], NULL, &tree);
    if (code != TOOL_DONE) return code;
    fct_tree_view view = fct_tree_get(tree);
    uint32_t count = o->clusters ? o->clusters : fct_tree_count_at_cost(tree, o->max_cost);
    if (count < view.root_count || count > view.face_count) {
        code = tool_fail(t, TOOL_USAGE, "-k %u: %s can be cut into %u to %u clusters", count, t->inputs[0],
                         view.root_count, view.face_count);
        goto done;
    }
    nodes = tool_allocate(t, count, sizeof *nodes);
    labels = tool_allocate(t, view.face_count, sizeof *labels);
    if (!nodes || !labels) {
        code = TOOL_MEMORY;
        goto done;
    }
    count = fct_tree_partition(tree, count, nodes);
    fct_tree_labels(tree, nodes, count, labels);
    code = write_output(t, tree, labels);
    if (code == TOOL_DONE) code = report(t, tree, nodes, count);
done:
    tool_release(t, nodes);
    tool_release(t, labels);
    fct_tree_destroy(tree);
    return code;
}

int tool_partition(int argc, char **argv) {
    static const tool_command command = {
        .name = "partition",
        .synopsis = "IN -k K -o OUT",
        .summary = "cut a mesh into K clusters",
        .text = "IN is a mesh or a hierarchy file (.fct). OUT receives one cluster number a line, in the "
                "order of the "
                "input's triangles; when it is named as a mesh (.ply, .off, .obj, .glb, .om), it is the mesh "
                "with a "
                "colour for each cluster: on the faces in .ply and .off, else on vertices, doubled along "
                "borders.\n\n"
                "JSON keys: clusters, mean_fit, mean_direction, mean_irregularity, mean_normal_deviation, "
                "box_area, "
                "connected. Means are weighted by area; mean_fit and box_area are over the squared diagonal.",
        .options = options_table,
        .parse = parse,
        .run = run,
        .inputs_min = 1,
        .inputs_max = 1,
        .output = TOOL_OUTPUT_REQUIRED};
    partition_options options = {.max_cost = -1};
    return tool_main(&command, argc, argv, &options);
}
