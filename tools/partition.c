/* tools/partition.c: facetree partition: clusters, flat pieces or charts, as labels or as a coloured mesh;
 * their neighbours. */
#include "tools/commands.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tools/kit/command.h"
#include "tools/kit/file.h"
#include "tools/kit/model.h"
#include "tools/kit/options.h"
#include "tools/labels.h"

static const double degree = 3.14159265358979323846 / 180;

typedef struct partition_options {
    uint32_t clusters; /* 0: not given */
    double max_cost;   /* negative: not given */
    tool_length max_distance;
    double chart_angle;    /* degrees; negative: not given */
    fct_chart_def charts;  /* all fields except the angle */
    bool chart_options;    /* one of these fields was given */
    const char *adjacency; /* a file, or NULL */
    fct_refine_def refine; /* sweep_count 0: no refinement */
    bool refine_options;   /* a field other than sweep_count was given */
} partition_options;

typedef struct refinement {
    fct_partition_quality before, after;
    fct_refine_stats stats;
} refinement;

/* A label per face, and figures about the clusters. */
typedef struct partition {
    fct_tree *tree;
    uint32_t *nodes, *labels; /* nodes: NULL if the labels are not a cut of the tree */
    uint32_t count;
    double largest_distance;
    fct_chart_stats charts;
    refinement refined;
    uint32_t pairs;
} partition;

enum {
    KEY_MAX_COST = TOOL_KEY,
    KEY_MAX_DISTANCE,
    KEY_CHARTS,
    KEY_MAX_FACES,
    KEY_MAX_AREA,
    KEY_ANY_TOPOLOGY,
    KEY_KEEP_CUTS,
    KEY_ADJACENCY,
    KEY_REFINE,
    KEY_PERIMETER,
    KEY_IRREGULARITY
};

static const struct argp_option partition_options_table[] = {
    {"clusters", 'k', "K", 0, "Cut into K clusters", 0},
    {"max-cost", KEY_MAX_COST, "C", 0,
     "Make all merges that cost at most C (the unit of the cost of the build)", 0},
    {"max-distance", KEY_MAX_DISTANCE, "D", 0,
     "Cut into the fewest clusters of the tree whose vertices are all within D of the cluster's plane, in "
     "the mesh's "
     "unit; D% is a share of the diagonal",
     0},
    {"charts", KEY_CHARTS, "DEGREES", 0,
     "Cut into charts: disks whose face normals are all within DEGREES of the chart's mean normal", 0},
    {"max-faces", KEY_MAX_FACES, "N", 0, "With --charts: at most N faces per chart (default: no limit)", 0},
    {"max-area", KEY_MAX_AREA, "A", 0,
     "With --charts: at most the area A per chart, unless it is one face (default: no limit)", 0},
    {"any-topology", KEY_ANY_TOPOLOGY, NULL, 0, "With --charts: allow charts that are not disks", 0},
    {"keep-cuts", KEY_KEEP_CUTS, NULL, 0,
     "With --charts: keep the clusters of the tree; do not merge neighbours", 0},
    {"adjacency", KEY_ADJACENCY, "FILE", 0,
     "Write pairs of neighbours to FILE, one per line: A B LENGTH EDGES, with A < B", 0},
    {"refine", KEY_REFINE, "N", 0,
     "Move clusters and faces across borders in at most N sweeps per cut (default 0; 4 are plenty)", 0},
    {"perimeter", KEY_PERIMETER, "W", 0, "With --refine: weight of short borders (default 0.1)", 0},
    {"irregularity", KEY_IRREGULARITY, "R", 0,
     "With --refine: let irregularity grow to at most R times its initial value, 1 to inf (default 1)", 0},
    {0}};

static error_t parse_chart_limit(int key, char *text, struct argp_state *state, partition_options *o) {
    o->chart_options = true;
    switch (key) {
    case KEY_MAX_FACES:
        return tool_parse_count32(state, "--max-faces", text, 1, FCT_NONE - 1, &o->charts.max_faces);
    case KEY_MAX_AREA:
        return tool_parse_real(state, "--max-area", text, 0, INFINITY, &o->charts.max_area);
    case KEY_ANY_TOPOLOGY:
        o->charts.any_topology = true;
        return 0;
    default:
        o->charts.keep_cuts = true;
        return 0;
    }
}

static error_t parse_partition(int key, char *text, struct argp_state *state) {
    partition_options *o = state->input;
    switch (key) {
    case 'k':
        return tool_parse_count32(state, "-k", text, 1, FCT_NONE - 1, &o->clusters);
    case KEY_MAX_COST:
        return tool_parse_real(state, "--max-cost", text, 0, INFINITY, &o->max_cost);
    case KEY_MAX_DISTANCE:
        return tool_parse_length(state, "--max-distance", text, &o->max_distance);
    case KEY_CHARTS:
        return tool_parse_real(state, "--charts", text, 0, 180, &o->chart_angle);
    case KEY_MAX_FACES:
    case KEY_MAX_AREA:
    case KEY_ANY_TOPOLOGY:
    case KEY_KEEP_CUTS:
        return parse_chart_limit(key, text, state, o);
    case KEY_ADJACENCY:
        o->adjacency = text;
        return 0;
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

/* --- The partition --- */

static int cut_by_count(tool *t, const partition_options *o, partition *p) {
    fct_tree_view view = fct_tree_get(p->tree);
    uint32_t count = o->clusters ? o->clusters : fct_tree_count_at_cost(p->tree, o->max_cost);
    if (count < view.root_count || count > view.face_count)
        return tool_fail(t, TOOL_USAGE, "-k %u: %s can be cut into %u to %u clusters", count, t->inputs[0],
                         view.root_count, view.face_count);
    p->nodes = tool_allocate(t, count, sizeof *p->nodes);
    if (!p->nodes) return TOOL_MEMORY;
    return tool_result(t, fct_tree_partition(&t->env, p->tree, count, p->nodes, &p->count));
}

static int cut_by_distance(tool *t, const partition_options *o, partition *p) {
    double distance = tool_length_of(p->tree, o->max_distance);
    p->nodes = tool_allocate(t, fct_tree_get(p->tree).face_count, sizeof *p->nodes);
    if (!p->nodes) return TOOL_MEMORY;
    return tool_result(
        t, fct_tree_cut_at_distance(&t->env, p->tree, distance, p->nodes, &p->count, &p->largest_distance));
}

static int make_partition(tool *t, const partition_options *o, partition *p) {
    p->labels = tool_allocate(t, fct_tree_get(p->tree).face_count, sizeof *p->labels);
    if (!p->labels) return TOOL_MEMORY;
    if (o->chart_angle >= 0) {
        fct_chart_def def = o->charts;
        def.max_angle = o->chart_angle * degree;
        int code = tool_result(t, fct_tree_charts(&t->env, p->tree, &def, p->labels, &p->charts));
        p->count = p->charts.charts;
        return code;
    }
    int code = o->max_distance.value >= 0 ? cut_by_distance(t, o, p) : cut_by_count(t, o, p);
    if (code != TOOL_DONE) return code;
    return tool_result(t, fct_tree_labels(&t->env, p->tree, p->nodes, p->count, p->labels));
}

/* --- The report --- */

static json_t *describe_quality(const fct_partition_quality *q, uint32_t count) {
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

/* Refines the labels, and measures them before and after with the same function. */
static int refine_labels(tool *t, const fct_refine_def *def, partition *p, refinement *out) {
    fct_mesh mesh;
    int code = tool_tree_mesh(t, p->tree, &mesh);
    if (code != TOOL_DONE) return code;
    code = tool_result(t, fct_labels_quality(&t->env, &mesh, p->labels, p->count, &out->before));
    if (code == TOOL_DONE)
        code = tool_result(
            t, fct_tree_refine(&t->env, p->tree, p->nodes, p->count, def, p->labels, &out->stats));
    if (code == TOOL_DONE)
        code = tool_result(t, fct_labels_quality(&t->env, &mesh, p->labels, p->count, &out->after));
    fct_mesh_release(&t->env, &mesh);
    return code;
}

static int write_adjacency(tool *t, const char *path, partition *p) {
    fct_mesh mesh;
    fct_adjacency neighbours;
    int code = tool_tree_mesh(t, p->tree, &mesh);
    if (code != TOOL_DONE) return code;
    code = tool_result(t, fct_labels_adjacency(&t->env, &mesh, p->labels, p->count, &neighbours));
    fct_mesh_release(&t->env, &mesh);
    if (code != TOOL_DONE) return code;
    tool_writer writer;
    code = tool_writer_open(t, path, &writer);
    if (code == TOOL_DONE) {
        for (size_t i = 0; i < neighbours.pair_count; ++i)
            fprintf(writer.stream, "%u %u %.9g %u\n", neighbours.pairs[2 * i], neighbours.pairs[2 * i + 1],
                    neighbours.lengths[i], neighbours.edges[i]);
        code = tool_writer_close(t, &writer, TOOL_DONE);
    }
    p->pairs = neighbours.pair_count;
    fct_adjacency_release(&t->env, &neighbours);
    return code;
}

static void report_refined(tool *t, const refinement *r, uint32_t count, json_t *object) {
    const fct_refine_stats *s = &r->stats;
    say_quality(t, " before", &r->before, count);
    say_quality(t, " refined", &r->after, count);
    tool_say(t, "%llu moves in %u sweeps, %.3f s", (unsigned long long)s->moves, s->sweeps,
             s->seconds_sweeps);
    json_object_set_new(object, "sweeps", json_integer(s->sweeps));
    json_object_set_new(object, "moves", json_integer((json_int_t)s->moves));
    json_object_set_new(object, "seconds",
                        json_pack("{s:f, s:f}", "dual", s->seconds_dual, "refine", s->seconds_sweeps));
    json_object_set_new(object, "before", describe_quality(&r->before, count));
}

static void report_charts(tool *t, const fct_chart_stats *s, json_t *object) {
    tool_say(t,
             "%u charts, %u of them not disks; opened %u clusters because of their angle, %u because of "
             "their size, %u because of "
             "their topology; %u merged",
             s->charts, s->non_disks, s->opened_angle, s->opened_limit, s->opened_topology, s->merged);
    tool_say(t, "largest angle %.4g degrees; length of seams %.6g, of the boundary of the surface %.6g",
             s->largest_angle / degree, s->seam_length, s->boundary_length);
    json_object_update_new(
        object, json_pack("{s:I, s:I, s:{s:I, s:I, s:I}, s:I, s:I, s:f, s:f, s:f}", "charts",
                          (json_int_t)s->charts, "non_disks", (json_int_t)s->non_disks, "opened", "angle",
                          (json_int_t)s->opened_angle, "limit", (json_int_t)s->opened_limit, "topology",
                          (json_int_t)s->opened_topology, "merged", (json_int_t)s->merged, "largest_faces",
                          (json_int_t)s->largest_faces, "largest_angle", s->largest_angle / degree,
                          "seam_length", s->seam_length, "boundary_length", s->boundary_length));
}

/* The quality of a cut comes from the tree, that of other labels from the mesh. */
static int measure_quality(tool *t, const partition *p, fct_partition_quality *q) {
    if (p->nodes) return tool_result(t, fct_tree_quality(&t->env, p->tree, p->nodes, p->count, q));
    fct_mesh mesh;
    int code = tool_tree_mesh(t, p->tree, &mesh);
    if (code != TOOL_DONE) return code;
    code = tool_result(t, fct_labels_quality(&t->env, &mesh, p->labels, p->count, q));
    fct_mesh_release(&t->env, &mesh);
    return code;
}

static int report_partition(tool *t, const partition_options *o, const partition *p) {
    bool refined = o->refine.sweep_count > 0;
    fct_partition_quality q = p->refined.after;
    int code = refined ? TOOL_DONE : measure_quality(t, p, &q);
    if (code != TOOL_DONE) return code;
    json_t *object = describe_quality(&q, p->count);
    if (refined)
        report_refined(t, &p->refined, p->count, object);
    else
        say_quality(t, "", &q, p->count);
    if (o->max_distance.value >= 0) {
        double whole = tool_diagonal(p->tree);
        tool_say(t, "largest distance to a plane %.6g, %.4g%% of the diagonal", p->largest_distance,
                 whole > 0 ? 100 * p->largest_distance / whole : 0);
        json_object_set_new(object, "largest_distance", json_real(p->largest_distance));
        json_object_set_new(object, "diagonal", json_real(whole));
    }
    if (o->chart_angle >= 0) report_charts(t, &p->charts, object);
    if (o->adjacency) {
        tool_say(t, "%u pairs of neighbours", p->pairs);
        json_object_set_new(object, "pairs", json_integer(p->pairs));
    }
    return tool_json(t, object);
}

static int check_partition_options(tool *t, const partition_options *o) {
    int ways = (o->clusters > 0) + (o->max_cost >= 0) + (o->max_distance.value >= 0) + (o->chart_angle >= 0);
    if (ways != 1)
        return tool_fail(t, TOOL_USAGE,
                         "expected exactly one of -k K, --max-cost C, --max-distance D and --charts DEGREES");
    if (o->chart_angle < 0 && o->chart_options)
        return tool_fail(t, TOOL_USAGE,
                         "--max-faces, --max-area, --any-topology and --keep-cuts need --charts");
    if (o->refine.sweep_count == 0 && o->refine_options)
        return tool_fail(t, TOOL_USAGE, "--perimeter and --irregularity need --refine");
    if (o->refine.sweep_count > 0 && (o->chart_angle >= 0 || o->max_distance.value >= 0))
        return tool_fail(t, TOOL_USAGE, "--refine would break the limits of --charts and --max-distance");
    if (!o->adjacency) return TOOL_DONE;
    if (tool_same_output(o->adjacency, t->output))
        return tool_fail(t, TOOL_USAGE, "--adjacency: expected a file other than that of -o");
    int code = tool_check_kind(t, o->adjacency, "txt csv", "");
    return code == TOOL_DONE ? tool_check_output(t, o->adjacency) : code;
}

static int run_partition(tool *t, void *options) {
    const partition_options *o = options;
    partition p = {0};
    int code = check_partition_options(t, o);
    if (code == TOOL_DONE) code = tool_open_tree(t, t->inputs[0], NULL, &p.tree);
    if (code == TOOL_DONE) code = make_partition(t, o, &p);
    if (code == TOOL_DONE && o->refine.sweep_count > 0) code = refine_labels(t, &o->refine, &p, &p.refined);
    if (code == TOOL_DONE) code = tool_save_labels(t, t->output, p.tree, p.labels, p.count);
    if (code == TOOL_DONE && o->adjacency) code = write_adjacency(t, o->adjacency, &p);
    if (code == TOOL_DONE) code = report_partition(t, o, &p);
    tool_release(t, p.nodes);
    tool_release(t, p.labels);
    fct_tree_destroy(p.tree);
    return code;
}

int tool_partition(int argc, char **argv) {
    static const tool_stage stages[] = {TOOL_TREE_STAGES, {"sides", 5},      {"refine", 20}, {"charts", 10},
                                        {"merging", 20},  {"distances", 10}, {"write", 5},   {0}};
    static const tool_command command = {
        .name = "partition",
        .synopsis = "IN (-k K | --max-cost C | --max-distance D | --charts DEGREES) -o OUT",
        .summary = "cut a mesh into clusters, flat pieces or charts",
        .text =
            "IN is a mesh or a hierarchy file (.fct). OUT receives one cluster number per line, in the order "
            "of the input's "
            "triangles. If OUT is named as a mesh (.ply, .off, .obj, .glb, .om), it is the mesh with a "
            "colour per cluster: on "
            "the faces in .ply and .off, else on vertices, which are doubled along borders.\n\n"
            "--max-distance opens clusters from the root until no vertex is farther than D from the plane of "
            "its cluster (the "
            "least-squares plane that `facetree boxes` prints). D is in the mesh's unit; 0.1% is a "
            "thousandth of the diagonal. "
            "The distance is measured for each vertex if the boxes cannot decide.\n\n"
            "--charts serves lightmaps and texture atlases. Clusters are opened until each is a disk "
            "(connected through edges, "
            "at most two faces per edge, one border, no handle, no vertex where the border touches itself), "
            "has one material, "
            "and has its normals within the angle of its mean normal. Then neighbours are merged if their "
            "union is such a "
            "chart. non_disks counts charts that cannot be disks, because a face has a vertex twice.\n\n"
            "--adjacency writes the pairs of clusters that share edges of the mesh, with the length of their "
            "common border and "
            "its number of edges. At an edge of three or more faces, each face is a neighbour of the next "
            "face only, over half "
            "of its length.\n\n"
            "--refine starts from the cut. It moves pieces across the borders between clusters, the most "
            "profitable first, so "
            "that the squared deviation of normals decreases and borders stay short: first the clusters of "
            "finer cuts, then "
            "faces, in at most N sweeps each. Clusters stay connected and keep at least one face. A face "
            "moves only to a "
            "neighbour of its own material. The result is no longer a cut of the tree.\n\n"
            "JSON keys: clusters, mean_fit, mean_direction, mean_irregularity, mean_normal_deviation, "
            "box_area, connected. "
            "--refine prints these for the refined clusters, and adds sweeps, moves, seconds{dual, refine} "
            "and before{...}, "
            "the same keys for the cut. --max-distance adds largest_distance and diagonal. --charts adds "
            "charts, non_disks, "
            "opened{angle, limit, topology} (opened clusters by their first reason), merged, largest_faces, "
            "largest_angle "
            "(degrees), seam_length (of edges between charts) and boundary_length (of edges with one face). "
            "--adjacency adds "
            "pairs. Means are weighted by area; mean_fit and box_area are divided by the squared diagonal.",
        .examples = "  facetree partition bunny.fct -k 200 -o labels.txt\n"
                    "  facetree partition bunny.obj -k 200 --refine 4 -o bunny-200.ply\n"
                    "  facetree partition bunny.fct --charts 45 -o charts.glb",
        .options = partition_options_table,
        .parse = parse_partition,
        .run = run_partition,
        .stages = stages,
        .builds_tree = true,
        .inputs_min = 1,
        .inputs_max = 1,
        .output = TOOL_OUTPUT_REQUIRED,
        .endings = TOOL_COLOR_MESHES,
        .other = "another name for labels as text"};
    partition_options options = {.max_cost = -1,
                                 .max_distance = {.value = -1},
                                 .chart_angle = -1,
                                 .charts = fct_chart_def_default(),
                                 .refine = fct_refine_def_default()};
    options.refine.sweep_count = 0;
    return tool_main(&command, argc, argv, &options);
}
