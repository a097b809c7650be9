/* tools/partition.c: facetree partition: clusters, flat pieces or charts, as labels or as a mesh of many
 * colours; which of them are neighbours. */
#include "tools/kit/tool.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double degree = 3.14159265358979323846 / 180;

typedef struct partition_options {
    uint32_t clusters; /* 0: not given */
    double max_cost;   /* negative: not given */
    tool_length max_distance;
    double chart_angle;    /* degrees; negative: not given */
    fct_chart_def charts;  /* its other fields */
    bool chart_options;    /* one of them was given */
    const char *adjacency; /* a file, or NULL */
    fct_refine_def refine; /* sweep_count 0: none */
    bool refine_options;   /* one of its other fields was given */
} partition_options;

typedef struct refinement {
    fct_partition_quality before, after;
    fct_refine_stats stats;
} refinement;

/* A number for each face, and what is known of them. */
typedef struct partition {
    fct_tree *tree;
    uint32_t *nodes, *labels; /* nodes: NULL where labels are no cut of the tree */
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

static const struct argp_option options_table[] = {
    {"clusters", 'k', "K", 0, "Cut into K clusters", 0},
    {"max-cost", KEY_MAX_COST, "C", 0, "Make all merges that cost at most C", 0},
    {"max-distance", KEY_MAX_DISTANCE, "D", 0,
     "The fewest clusters of the tree without a vertex farther than D from its cluster's plane; D% is a "
     "share "
     "of the diagonal",
     0},
    {"charts", KEY_CHARTS, "DEGREES", 0,
     "Charts: disks with every face normal within DEGREES of the chart's mean normal", 0},
    {"max-faces", KEY_MAX_FACES, "N", 0, "With --charts: at most N faces in each", 0},
    {"max-area", KEY_MAX_AREA, "A", 0, "With --charts: at most the area A in each of several faces", 0},
    {"any-topology", KEY_ANY_TOPOLOGY, NULL, 0, "With --charts: they need not be disks", 0},
    {"keep-cuts", KEY_KEEP_CUTS, NULL, 0, "With --charts: clusters of the tree, without merging neighbours",
     0},
    {"adjacency", KEY_ADJACENCY, "FILE", 0, "Write neighbours to FILE: A B LENGTH EDGES a line, A < B", 0},
    {"refine", KEY_REFINE, "N", 0,
     "Let what is on borders change sides, in at most N sweeps a cut (4 are plenty)", 0},
    {"perimeter", KEY_PERIMETER, "W", 0, "With --refine: weight of short borders (default 0.1)", 0},
    {"irregularity", KEY_IRREGULARITY, "R", 0,
     "With --refine: irregularity may grow to R times its start, or inf (default 1)", 0},
    {0}};

static error_t parse_chart(int key, char *text, struct argp_state *state, partition_options *o) {
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

static error_t parse(int key, char *text, struct argp_state *state) {
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
        return parse_chart(key, text, state, o);
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

/* --- Making it --- */

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

/* --- Telling of it --- */

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

/* Refines the labels, and measures them before and after with the same ruler. */
static int refine(tool *t, const fct_refine_def *def, partition *p, refinement *out) {
    fct_mesh mesh;
    int code = tool_result(t, fct_tree_mesh(&t->env, p->tree, &mesh));
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
    int code = tool_result(t, fct_tree_mesh(&t->env, p->tree, &mesh));
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
    json_object_set_new(object, "before", quality_json(&r->before, count));
}

static void report_charts(tool *t, const fct_chart_stats *s, json_t *object) {
    tool_say(t,
             "%u charts, %u of them no disk; opened %u clusters for angle, %u for size, %u for topology; %u "
             "merged",
             s->charts, s->non_disks, s->opened_angle, s->opened_limit, s->opened_topology, s->merged);
    tool_say(t, "largest angle %.4g degrees, seams %.6g long, borders of the surface %.6g",
             s->largest_angle / degree, s->seam_length, s->boundary_length);
    json_object_update_new(
        object, json_pack("{s:I, s:I, s:{s:I, s:I, s:I}, s:I, s:I, s:f, s:f, s:f}", "charts",
                          (json_int_t)s->charts, "non_disks", (json_int_t)s->non_disks, "opened", "angle",
                          (json_int_t)s->opened_angle, "limit", (json_int_t)s->opened_limit, "topology",
                          (json_int_t)s->opened_topology, "merged", (json_int_t)s->merged, "largest_faces",
                          (json_int_t)s->largest_faces, "largest_angle", s->largest_angle / degree,
                          "seam_length", s->seam_length, "boundary_length", s->boundary_length));
}

/* Quality of a cut from the tree, of other labels from the mesh. */
static int measure(tool *t, const partition *p, fct_partition_quality *q) {
    if (p->nodes) return tool_result(t, fct_tree_quality(&t->env, p->tree, p->nodes, p->count, q));
    fct_mesh mesh;
    int code = tool_result(t, fct_tree_mesh(&t->env, p->tree, &mesh));
    if (code != TOOL_DONE) return code;
    code = tool_result(t, fct_labels_quality(&t->env, &mesh, p->labels, p->count, q));
    fct_mesh_release(&t->env, &mesh);
    return code;
}

static int report(tool *t, const partition_options *o, const partition *p) {
    bool refined = o->refine.sweep_count > 0;
    fct_partition_quality q = p->refined.after;
    int code = refined ? TOOL_DONE : measure(t, p, &q);
    if (code != TOOL_DONE) return code;
    json_t *object = quality_json(&q, p->count);
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

static int check_options(tool *t, const partition_options *o) {
    int ways = (o->clusters > 0) + (o->max_cost >= 0) + (o->max_distance.value >= 0) + (o->chart_angle >= 0);
    if (ways != 1)
        return tool_fail(t, TOOL_USAGE,
                         "expected one of -k K, --max-cost C, --max-distance D and --charts DEGREES");
    if (o->chart_angle < 0 && o->chart_options)
        return tool_fail(t, TOOL_USAGE, "expected --charts beside its options");
    if (o->refine.sweep_count == 0 && o->refine_options)
        return tool_fail(t, TOOL_USAGE, "expected --refine beside --perimeter and --irregularity");
    if (o->refine.sweep_count > 0 && (o->chart_angle >= 0 || o->max_distance.value >= 0))
        return tool_fail(t, TOOL_USAGE, "--refine would not keep what --charts or --max-distance promise");
    if (tool_ends(t->output, "stl")) return tool_fail(t, TOOL_USAGE, "%s: STL holds no colours", t->output);
    if (o->adjacency && !strcmp(o->adjacency, t->output))
        return tool_fail(t, TOOL_USAGE, "--adjacency: expected another file than that of -o");
    return o->adjacency ? tool_check_output(t, o->adjacency) : TOOL_DONE;
}

static int run(tool *t, void *options) {
    const partition_options *o = options;
    partition p = {0};
    int code = check_options(t, o);
    if (code == TOOL_DONE) code = tool_open_tree(t, t->inputs[0], NULL, &p.tree);
    if (code == TOOL_DONE) code = make_partition(t, o, &p);
    if (code == TOOL_DONE && o->refine.sweep_count > 0) code = refine(t, &o->refine, &p, &p.refined);
    if (code == TOOL_DONE) code = tool_save_labels(t, t->output, p.tree, p.labels, p.count);
    if (code == TOOL_DONE && o->adjacency) code = write_adjacency(t, o->adjacency, &p);
    if (code == TOOL_DONE) code = report(t, o, &p);
    tool_release(t, p.nodes);
    tool_release(t, p.labels);
    fct_tree_destroy(p.tree);
    return code;
}

int tool_partition(int argc, char **argv) {
    static const tool_command command = {
        .name = "partition",
        .synopsis = "IN (-k K | --max-cost C | --max-distance D | --charts DEGREES) -o OUT",
        .summary = "cut a mesh into clusters, flat pieces or charts",
        .text =
            "IN is a mesh or a hierarchy file (.fct). OUT receives one cluster number a line, in the "
            "order of the "
            "input's triangles; when it is named as a mesh (.ply, .off, .obj, .glb, .om), it is the mesh "
            "with a "
            "colour for each cluster: on the faces in .ply and .off, else on vertices, doubled along "
            "borders.\n\n"
            "--max-distance opens clusters from the root until no vertex is farther than D from the plane of "
            "its cluster (least squares; that of `facetree boxes`). D is in the mesh's unit, 0.1% of its "
            "diagonal. Every vertex is measured where the boxes do not decide.\n\n"
            "--charts is for lightmaps and texture atlases. Clusters are opened until each is a disk "
            "(connected through edges, at most two faces an edge, one border, no handle, no vertex where the "
            "border touches itself), of one material, with normals within the angle of its mean normal; then "
            "neighbours whose union still is such a chart are merged. non_disks counts what could not be "
            "made a disk: faces with a vertex twice.\n\n"
            "--adjacency writes the pairs of clusters that share edges of the mesh, with the length of their "
            "common border and the number of its edges; where three faces or more meet at an edge, each face "
            "is a neighbour of the next one only, over half its length.\n\n"
            "--refine starts from that cut and lets what lies on the borders between clusters change sides, "
            "the "
            "most gainful first, so that the squared deviation of normals falls and borders stay short: "
            "first "
            "the clusters of finer cuts, then faces, in at most N sweeps each. Clusters stay in one piece "
            "and "
            "keep at least a face; a face follows only neighbours of its own material. The result is no "
            "longer "
            "a cut of the tree.\n\n"
            "JSON keys: clusters, mean_fit, mean_direction, mean_irregularity, mean_normal_deviation, "
            "box_area, connected; with --refine those of the refined clusters, and sweeps, moves, "
            "seconds{dual,refine} and before{...}, the same keys for the cut; with --max-distance "
            "largest_distance, diagonal; with --charts charts, non_disks, opened{angle,limit,topology} "
            "(clusters opened, by first reason), merged, largest_faces, largest_angle (degrees), seam_length "
            "(of edges between charts), boundary_length (of edges with one face); with --adjacency pairs. "
            "Means are weighted by area; "
            "mean_fit and box_area are over the squared diagonal.",
        .options = options_table,
        .parse = parse,
        .run = run,
        .inputs_min = 1,
        .inputs_max = 1,
        .output = TOOL_OUTPUT_REQUIRED};
    partition_options options = {.max_cost = -1,
                                 .max_distance = {.value = -1},
                                 .chart_angle = -1,
                                 .charts = fct_chart_def_default(),
                                 .refine = fct_refine_def_default()};
    options.refine.sweep_count = 0;
    return tool_main(&command, argc, argv, &options);
}
