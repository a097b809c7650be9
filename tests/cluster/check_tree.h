/* tests/cluster/check_tree.h: checks every guarantee of a finished tree with slow, plain code. */
#ifndef FCT_TESTS_CHECK_TREE_H
#define FCT_TESTS_CHECK_TREE_H

#include "support.h"

#include "base/math/vec.h"
#include "cluster/tree/tree.h"
#include "cluster/tree/welded.h"
#include "facetree/partition.h"

static inline void check_node_geometry(const fct_tree_view *view, const fct_cluster *c) {
    fct_box box;
    fct_cluster_box(c, &box);
    v3 center = v3_load(box.center), axis = v3_unit(v3_load(c->area_vector));
    double area = 0, largest = 0;
    for (size_t place = c->first; place < (size_t)c->first + c->count; ++place) {
        v3 p[3];
        for (size_t k = 0; k < 3; ++k) {
            p[k] = v3_load(view->positions + 3 * (size_t)view->triangles[3 * place + k]);
            for (int i = 0; i < 3; ++i) {
                double x = v3_dot(v3_sub(p[k], center), v3_load(box.axes[i]));
                assert_true(fabs(x) <= (double)box.half[i]);
            }
            largest = fmax(largest, v3_norm(v3_sub(p[k], center)));
        }
        v3 vector = v3_scale(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])), 0.5);
        area += v3_norm(vector);
        if (v3_norm(vector) > 0 && v3_norm(axis) > 0)
            assert_true(acos(fmin(fmax(v3_dot(v3_unit(vector), axis), -1), 1)) <=
                        (double)c->cone_angle + 1e-7);
    }
    if (area > 1e-30 && area < 1e38) assert_true(fabs((double)c->area - area) <= 1e-6 * area);
    for (int i = 0; i < 3; ++i) { /* tight: the box ends at its farthest vertex, up to rounding */
        double ulp =
            (fabs((double)box.center[0]) + fabs((double)box.center[1]) + fabs((double)box.center[2]));
        assert_true((double)box.half[i] <= largest * (1 + 1e-6) + 1e-6 * ulp + 1e-44);
        for (int k = 0; k < 3; ++k)
            assert_true(fabs(v3_dot(v3_load(box.axes[i]), v3_load(box.axes[k])) - (i == k)) < 1e-6);
    }
    const float *numbers = (const float *)c;
    for (size_t i = 0; i < offsetof(fct_cluster, child) / sizeof(float); ++i)
        assert_true(isfinite(numbers[i]));
}

/* Cuts the tree, which must succeed. Returns the number of clusters. */
static inline uint32_t cut_tree(const fct_tree *tree, uint32_t count, uint32_t *nodes) {
    fct_env env = fct_env_default();
    uint32_t written = 0;
    assert_int_equal(fct_tree_partition(&env, tree, count, nodes, &written), FCT_OK);
    return written;
}

static inline void check_links(const fct_tree *tree) {
    const fct_tree_view *view = &tree->view;
    uint8_t *parents = calloc((size_t)view->node_count + view->face_count, 1);
    for (uint32_t i = 0; i < view->node_count; ++i) {
        const fct_cluster *c = &tree->nodes[i];
        if (i > 0) assert_true(tree->nodes[i - 1].cost >= c->cost);
        uint32_t place = c->first, faces = 0;
        for (int k = 0; k < 2; ++k) {
            uint32_t child = c->child[k];
            assert_true(child > i && child < view->node_count + view->face_count);
            ++parents[child];
            bool leaf = child >= view->node_count;
            assert_int_equal(leaf ? child - view->node_count : tree->nodes[child].first, place);
            place += leaf ? 1 : tree->nodes[child].count;
            faces += leaf ? 1 : tree->nodes[child].count;
        }
        assert_int_equal(faces, c->count);
    }
    uint32_t r = 0;
    for (uint32_t i = 0; i < view->node_count + view->face_count; ++i) {
        assert_true(parents[i] <= 1);
        if (!parents[i]) assert_int_equal(view->roots[r++], i);
    }
    assert_int_equal(r, view->root_count);
    free(parents);
}

/* The permutations are valid, and the mesh of the tree is the input. Vertices are in order of first use in
 * the triangles that connect the faces. */
static inline void check_mesh(const fct_tree_view *view, const fct_mesh *mesh) {
    fct_env env = fct_env_default();
    fct_tree_view welded;
    fct_weld weld;
    assert_int_equal(fct_tree_view_weld(&env, view, &welded, &weld), FCT_OK);
    assert_int_equal(view->face_count, mesh->face_count);
    assert_int_equal(view->vertex_count, mesh->vertex_count);
    uint8_t *seen = calloc((size_t)mesh->vertex_count + mesh->face_count, 1);
    uint32_t used = 0;
    for (size_t p = 0; p < view->face_count; ++p) {
        assert_int_equal(seen[view->face_ids[p]]++, 0);
        for (size_t k = 0; k < 3; ++k) {
            uint32_t v = view->triangles[3 * p + k];
            assert_true(welded.triangles[3 * p + k] <= used);
            if (welded.triangles[3 * p + k] == used) ++used;
            assert_int_equal(view->vertex_ids[v], mesh->triangles[3 * (size_t)view->face_ids[p] + k]);
        }
    }
    for (size_t v = 0; v < view->vertex_count; ++v) {
        assert_int_equal(seen[mesh->face_count + view->vertex_ids[v]]++, 0);
        assert_memory_equal(view->positions + 3 * v, mesh->positions + 3 * (size_t)view->vertex_ids[v], 12);
    }
    fct_weld_release(&env, &weld);
    free(seen);
}

static inline void check_tree(const fct_tree *tree, const fct_mesh *mesh) {
    fct_tree_view view = fct_tree_get(tree);
    check_mesh(&view, mesh);
    check_links(tree);
    assert_int_equal(view.node_count, view.face_count - view.root_count);
    if (view.root_count == 1 && view.face_count > 1)
        assert_true(view.depth <= (uint32_t)(3 * log2(view.face_count)));
    for (uint32_t i = 0; i < view.node_count; ++i) check_node_geometry(&view, &tree->nodes[i]);
    for (uint32_t p = 0; p < view.face_count; p += 1 + view.face_count / 1000) {
        fct_cluster leaf;
        fct_tree_cluster(tree, view.node_count + p, &leaf);
        assert_true(leaf.first == p && leaf.count == 1 && leaf.child[0] == FCT_NONE);
        check_node_geometry(&view, &leaf);
    }
}

#endif
