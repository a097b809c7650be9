/* bench/cluster/tree.c: builds our tree of one mesh and prints its time, memory and quality.
 *
 * usage: tree MESH METHOD THREADS [K]
 * METHOD is rounds or greedy. With K, the program judges the partition into K clusters, refines it on one
 * thread and judges it again, and sums the box areas; the time and memory of the build do not include that.
 * grown_bytes is the memory of the build above the loaded mesh; peak_bytes is the whole process.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench/cluster/bench.h"
#include "facetree/partition.h"

typedef struct run {
    double seconds, cpu;
    fct_tree_stats stats;
    size_t grown, peak;
} run;

static fct_tree *build(const fct_mesh *mesh, const fct_env *env, const char *method, run *r) {
    fct_tree_def def = fct_tree_def_default();
    if (strcmp(method, "rounds") != 0 && strcmp(method, "greedy") != 0)
        bench_fail("expected rounds or greedy, found '%s'", method);
    def.method = method[0] == 'r' ? FCT_CLUSTER_ROUNDS : FCT_CLUSTER_GREEDY;
    fct_tree *tree;
    bench_memory before = bench_memory_start();
    double start = bench_seconds(), cpu = bench_cpu_seconds();
    bench_check(fct_tree_build(env, mesh, &def, &r->stats, &tree), "the tree");
    r->seconds = bench_seconds() - start;
    r->cpu = bench_cpu_seconds() - cpu;
    r->grown = bench_memory_grown(before);
    r->peak = bench_memory_peak();
    return tree;
}

static void judge(const fct_mesh *mesh, const fct_tree *tree, uint32_t count) {
    fct_env env = bench_env(2);
    fct_tree_view view = fct_tree_get(tree);
    double diagonal = bench_diagonal(mesh), area = 0;
    for (uint32_t i = 0; i < view.node_count; ++i) {
        fct_cluster cluster;
        bench_check(fct_tree_cluster(tree, i, &cluster), "a cluster");
        const float *h = cluster.box_half;
        double a = (double)h[0], b = (double)h[1], c = (double)h[2];
        area += 8 * (a * b + b * c + c * a);
    }
    if (count > view.face_count) count = view.face_count;
    if (count < view.root_count) count = view.root_count;
    uint32_t *labels = bench_allocate(view.face_count, sizeof *labels);
    uint32_t *nodes = bench_allocate(count, sizeof *nodes), found;
    bench_check(fct_tree_partition(&env, tree, count, nodes, &found), "the partition");
    bench_check(fct_tree_labels(&env, tree, nodes, found, labels), "the labels");
    bench_quality q = bench_judge(&env, mesh, labels, found);
    printf(
        ", \"clusters\": %u, \"deviation\": %.6g, \"fit\": %.6g, \"irregularity\": %.6g, \"box_area\": %.6g",
        q.clusters, q.deviation, q.fit, q.irregularity, area / (diagonal * diagonal));
    fct_env alone = bench_env(1);
    double start = bench_seconds();
    bench_check(fct_tree_refine(&alone, tree, nodes, found, NULL, labels, NULL), "the refinement");
    double seconds = bench_seconds() - start;
    q = bench_judge(&env, mesh, labels, found);
    printf(", \"refine_seconds\": %.6g, \"refined_deviation\": %.6g, \"refined_fit\": %.6g, "
           "\"refined_irregularity\": %.6g",
           seconds, q.deviation, q.fit, q.irregularity);
    free(nodes);
    free(labels);
}

int main(int argc, char **argv) {
    if (argc < 4 || argc > 5) bench_fail("usage: tree MESH rounds|greedy THREADS [K]");
    fct_env env = bench_env(bench_count(argv[3], "THREADS"));
    fct_mesh mesh;
    run r;
    bench_load(&env, argv[1], &mesh);
    fct_tree *tree = build(&mesh, &env, argv[2], &r);
    fct_tree_view view = fct_tree_get(tree);
    printf("{\"faces\": %u, \"seconds\": %.6g, \"cpu\": %.6g, \"dual\": %.6g, \"contract\": %.6g, \"boxes\": "
           "%.6g, "
           "\"grown_bytes\": %zu, \"peak_bytes\": %zu, \"depth\": %u, \"mean_depth\": %.6g",
           mesh.face_count, r.seconds, r.cpu, r.stats.seconds_dual, r.stats.seconds_contract,
           r.stats.seconds_boxes, r.grown, r.peak, view.depth, (double)view.mean_depth);
    if (argc == 5) judge(&mesh, tree, bench_count(argv[4], "K"));
    puts("}");
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
    return 0;
}
