/* tests/memory/calls_partition.c: calls of partition.h. */
#include "tests/memory/calls.h"

enum { FACES = 72, PARTS = 6 };

static uint32_t nodes[FACES], labels[FACES], node_count;

/* Cuts the tree of the sheet into PARTS clusters. */
static void cut(void) {
    assert_int_equal(inputs.sheet.face_count, FACES);
    assert_int_equal(fct_tree_partition(&inputs.env, inputs.tree, PARTS, nodes, &node_count), FCT_OK);
    assert_int_equal(fct_tree_labels(&inputs.env, inputs.tree, nodes, node_count, labels), FCT_OK);
}

static fct_result partition_tree(const fct_env *env) {
    fct_tree *tree;
    assert_int_equal(fct_tree_open(env, IN "sheet.fct", &tree), FCT_OK);
    fct_result result = STARVE(fct_tree_partition(env, tree, PARTS, nodes, &node_count));
    fct_tree_destroy(tree);
    return result;
}

static fct_result cut_at_distance(const fct_env *env) {
    return STARVE(fct_tree_cut_at_distance(env, inputs.tree, .01, nodes, &node_count, NULL));
}

static fct_result label_faces(const fct_env *env) {
    cut();
    return STARVE(fct_tree_labels(env, inputs.tree, nodes, node_count, labels));
}

static fct_result measure_cut(const fct_env *env) {
    fct_partition_quality quality;
    cut();
    return STARVE(fct_tree_quality(env, inputs.tree, nodes, node_count, &quality));
}

static fct_result measure_labels(const fct_env *env) {
    fct_partition_quality quality;
    cut();
    return STARVE(fct_labels_quality(env, &inputs.sheet, labels, node_count, &quality));
}

static fct_result fit_planes(const fct_env *env) {
    float planes[4 * PARTS];
    cut();
    return STARVE(fct_labels_planes(env, &inputs.sheet, labels, node_count, planes));
}

/* A failed call leaves the labels unchanged. */
static fct_result check_labels(const uint32_t *before, fct_result result) {
    if (result != FCT_OK) assert_memory_equal(before, labels, sizeof labels);
    return result;
}

static fct_result refine_labels(const fct_env *env) {
    uint32_t before[FACES];
    cut();
    memcpy(before, labels, sizeof labels);
    return check_labels(before,
                        STARVE(fct_partition_refine(env, &inputs.sheet, node_count, NULL, labels, NULL)));
}

static fct_result refine_cut(const fct_env *env) {
    uint32_t before[FACES];
    cut();
    memcpy(before, labels, sizeof labels);
    return check_labels(before,
                        STARVE(fct_tree_refine(env, inputs.tree, nodes, node_count, NULL, labels, NULL)));
}

static fct_result make_charts(const fct_env *env) {
    return STARVE(fct_tree_charts(env, inputs.tree, NULL, labels, NULL));
}

static fct_result make_meshlets(const fct_env *env) {
    static const fct_meshlets none;
    fct_meshlets meshlets;
    fct_meshlet_def def = fct_meshlet_def_default();
    def.max_triangles = 20;
    fct_result result = STARVE(fct_tree_meshlets(env, inputs.tree, &def, &meshlets));
    if (result != FCT_OK) assert_memory_equal(&meshlets, &none, sizeof none);
    fct_meshlets_release(env, &meshlets);
    return result;
}

static fct_result find_neighbours(const fct_env *env) {
    static const fct_adjacency none;
    fct_adjacency adjacency;
    cut();
    fct_result result = STARVE(fct_labels_adjacency(env, &inputs.sheet, labels, node_count, &adjacency));
    if (result != FCT_OK) assert_memory_equal(&adjacency, &none, sizeof none);
    fct_adjacency_release(env, &adjacency);
    return result;
}

const memory_call partition_calls[] = {{"fct_tree_partition", "", partition_tree, false},
                                       {"fct_tree_cut_at_distance", "", cut_at_distance, false},
                                       {"fct_tree_labels", "", label_faces, false},
                                       {"fct_tree_quality", "", measure_cut, false},
                                       {"fct_labels_quality", "", measure_labels, false},
                                       {"fct_labels_planes", "", fit_planes, false},
                                       {"fct_partition_refine", "", refine_labels, false},
                                       {"fct_tree_refine", "", refine_cut, false},
                                       {"fct_tree_charts", "", make_charts, false},
                                       {"fct_tree_meshlets", "", make_meshlets, false},
                                       {"fct_labels_adjacency", "", find_neighbours, false},
                                       {NULL, NULL, NULL, false}};
