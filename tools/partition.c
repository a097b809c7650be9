/* tools/partition.c: facetree partition: K clusters as labels or as a mesh of many colours. */
#include "tools/tool.h"

#include <math.h>
#include <string.h>

typedef struct partition_options {
    uint32_t clusters;     /* 0: not given */
    double max_cost;       /* negative: not given */
    fct_refine_def refine; /* sweep_count 0: none */
    bool refine_options;   /* one of its other fields was given */
} partition_options;

typedef struct refinement {
    fct_partition_quality before, after;
    fct_refine_stats stats;
} refinement;

enum { KEY_MAX_COST = TOOL_KEY, KEY_REFINE, KEY_PERIMETER, KEY_IRREGULARITY };

static const struct argp_option options_table[] = {
    {"clusters", 'k', "K", 0, "Cut into K clusters", 0},
    {"max-cost", KEY_MAX_COST, "C", 0, "Make all merges that cost at most C", 0},
    {"refine", KEY_REFINE, "N", 0, "Let faces on borders change sides, in at most N sweeps (4 are plenty)",
     0},
    {"perimeter", KEY_PERIMETER, "W", 0, "With --refine: weight of short borders (default 0.1)", 0},
    {"irregularity", KEY_IRREGULARITY, "R", 0,
     "With --refine: irregularity may grow to R times its start, or inf (default 1)", 0},
    {0}};

static error_t parse(int key, char *text, struct argp_state *state) {
    partition_options *o = state->input;
    switch (key) {
    case 'k':
        return tool_parse_count32(state, "-k", text, 1, FCT_NONE - 1, &o->clusters);
    case KEY_MAX_COST:
        return tool_parse_real(state, "--max-cost", text, 0, INFINITY, &o->max_cost);
    case KEY_REFINE:
        return tool_parse_count32(state, "--refine", text, 0, FCT_NONE - 1, &o->refine.sweep_count);
    case KEY_PERIMETER:
        o->refine_options = true;
        return tool_parse_real(state, "--perimeter", text, 0, 1e6, &o->refine.perimeter_weight);
    case KEY_IRREGULARITY:
        o->refine_options = true;
        return tool_parse_real(state, "--irregularity", text, 1, INFINITY, &o->refine.irregularity_limit);
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

/* Numbers the vertices of each cluster for itself: labels do not decrease along face_ids, so one stamp a
 * vertex tells whether it has its copy. Returns how many there are. */
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

/* The faces grouped by label, in order of label. */
static uint32_t *group_faces(tool *t, const uint32_t *labels, uint32_t faces, uint32_t count) {
    uint32_t *order = tool_allocate(t, faces, sizeof *order);
    uint32_t *ends = tool_allocate(t, (size_t)count + 1, sizeof *ends);
    if (order && ends) {
        memset(ends, 0, ((size_t)count + 1) * sizeof *ends);
        for (uint32_t f = 0; f < faces; ++f) ++ends[labels[f] + 1];
        for (uint32_t i = 0; i < count; ++i) ends[i + 1] += ends[i];
        for (uint32_t f = 0; f < faces; ++f) order[ends[labels[f]]++] = f;
    } else {
        tool_release(t, order);
        order = NULL;
    }
    tool_release(t, ends);
    return order;
}

static int write_output(tool *t, const fct_tree *tree, const uint32_t *labels, uint32_t count) {
    uint32_t faces = fct_tree_get(tree).face_count;
    if (!tool_is_mesh_name(t->output)) return write_labels(t, labels, faces);
    fct_mesh mesh;
    int code = tool_result(t, fct_tree_mesh(&t->env, tree, &mesh));
    if (code != TOOL_DONE) return code;
    if (tool_ends(t->output, "ply") || tool_ends(t->output, "off")) {
        code = write_face_colors(t, mesh, labels);
    } else {
        uint32_t *order = group_faces(t, labels, faces, count);
        code = order ? write_vertex_colors(t, &mesh, order, labels) : TOOL_MEMORY;
        tool_release(t, order);
    }
    fct_mesh_release(&t->env, &mesh);
    return code;
}

static json_t *quality_json(const fct_partition_quality *q, uint32_t count) {
    return json_pack("{s:I, s:f, s:f, s:f, s:f, s:f, s:b}", "clusters", (json_int_t)count, "mean_fit",
                     q->mean_fit, "mean_direction", q->mean_direction, "mean_irregularity",
                     q->mean_irregularity, "mean_normal_deviation", q->mean_normal_deviation, "box_area",
                     q->box_area, "connected", q->connected);
}

static void say_quality(tool *t, const char *what, const fct_partition_quality *q, uint32_t count) {
    tool_say(t, "%u clusters%s%s: fit %.3g, direction %.3g, irregularity %.3g, normal deviation %.3g", count,
             what, q->connected ? ", each connected" : "", q->mean_fit, q->mean_direction,
             q->mean_irregularity, q->mean_normal_deviation);
}

static int report(tool *t, const fct_tree *tree, const uint32_t *nodes, uint32_t count) {
    fct_partition_quality q;
    int code = tool_result(t, fct_tree_quality(&t->env, tree, nodes, count, &q));
    if (code != TOOL_DONE) return code;
    say_quality(t, "", &q, count);
    return tool_json(t, quality_json(&q, count));
}

/* Refines the labels, and measures them before and after with the same ruler. */
static int refine(tool *t, const fct_tree *tree, const fct_refine_def *def, uint32_t *labels, uint32_t count,
                  refinement *out) {
    fct_mesh mesh;
    int code = tool_result(t, fct_tree_mesh(&t->env, tree, &mesh));
    if (code != TOOL_DONE) return code;
    code = tool_result(t, fct_labels_quality(&t->env, &mesh, labels, count, &out->before));
    if (code == TOOL_DONE)
        code = tool_result(t, fct_partition_refine(&t->env, &mesh, count, def, labels, &out->stats));
    if (code == TOOL_DONE)
        code = tool_result(t, fct_labels_quality(&t->env, &mesh, labels, count, &out->after));
    fct_mesh_release(&t->env, &mesh);
    return code;
}

static int report_refined(tool *t, const refinement *r, uint32_t count) {
    const fct_refine_stats *s = &r->stats;
    say_quality(t, " before", &r->before, count);
    say_quality(t, " refined", &r->after, count);
    tool_say(t, "%llu moves in %u sweeps, %.3f s", (unsigned long long)s->moves, s->sweeps,
             s->seconds_sweeps);
    json_t *object = quality_json(&r->after, count);
    json_object_set_new(object, "sweeps", json_integer(s->sweeps));
    json_object_set_new(object, "moves", json_integer((json_int_t)s->moves));
    json_object_set_new(object, "seconds",
                        json_pack("{s:f, s:f}", "dual", s->seconds_dual, "refine", s->seconds_sweeps));
    json_object_set_new(object, "before", quality_json(&r->before, count));
    return tool_json(t, object);
}

static int run(tool *t, void *options) {
    const partition_options *o = options;
    if ((o->clusters > 0) == (o->max_cost >= 0))
        return tool_fail(t, TOOL_USAGE, "expected either -k K or --max-cost C");
    if (o->refine.sweep_count == 0 && o->refine_options)
        return tool_fail(t, TOOL_USAGE, "expected --refine beside --perimeter and --irregularity");
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
    refinement refined;
    if (o->refine.sweep_count > 0) code = refine(t, tree, &o->refine, labels, count, &refined);
    if (code == TOOL_DONE) code = write_output(t, tree, labels, count);
    if (code == TOOL_DONE)
        code = o->refine.sweep_count > 0 ? report_refined(t, &refined, count) : report(t, tree, nodes, count);
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
        .text =
            "IN is a mesh or a hierarchy file (.fct). OUT receives one cluster number a line, in the "
            "order of the "
            "input's triangles; when it is named as a mesh (.ply, .off, .obj, .glb, .om), it is the mesh "
            "with a "
            "colour for each cluster: on the faces in .ply and .off, else on vertices, doubled along "
            "borders.\n\n"
            "--refine starts from that cut and lets faces on the borders between clusters change sides, the "
            "most gainful first, so that the squared deviation of normals falls and borders stay short. "
            "Clusters stay in one piece and keep at least a face; a face follows only neighbours of its own "
            "material. The result is no longer a cut of the tree.\n\n"
            "JSON keys: clusters, mean_fit, mean_direction, mean_irregularity, mean_normal_deviation, "
            "box_area, connected; with --refine those of the refined clusters, and sweeps, moves, "
            "seconds{dual,refine} and before{...}, the same keys for the cut. Means are weighted by area; "
            "mean_fit and box_area are over the squared diagonal.",
        .options = options_table,
        .parse = parse,
        .run = run,
        .inputs_min = 1,
        .inputs_max = 1,
        .output = TOOL_OUTPUT_REQUIRED};
    partition_options options = {.max_cost = -1, .refine = fct_refine_def_default()};
    options.refine.sweep_count = 0;
    return tool_main(&command, argc, argv, &options);
}
