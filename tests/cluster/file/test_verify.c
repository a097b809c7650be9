/* fct_tree_verify finds every wrong number of a node, on a sphere, with noise and far from the origin, and
 * accepts correct trees. */
#include "../../bvh/models.h"
#include "../check_tree.h"

#include <float.h>

#include "base/io/file.h"
#include "cluster/file/format.h"
#include "cluster/tree/check/edges.h"
#include "cluster/tree/check/structure.h"
#include "cluster/tree/check/verify.h"

typedef struct mistake {
    const char *message;
    void (*make)(fct_cluster *c, float size);
} mistake;

static void more_area(fct_cluster *c, float size) {
    (void)size;
    c->area *= 1.001F;
}
static void other_vector(fct_cluster *c, float size) {
    (void)size;
    c->area_vector[1] += .001F * c->area;
}
static void other_moment(fct_cluster *c, float size) {
    (void)size;
    c->moment[4] += .001F * c->area;
}
static void other_centroid(fct_cluster *c, float size) {
    c->centroid[2] += .02F * size;
}
static void turned_plane(fct_cluster *c, float size) {
    (void)size;
    for (int i = 0; i < 4; ++i) c->plane[i] = -c->plane[i];
}
static void tilted_plane(fct_cluster *c, float size) {
    (void)size;
    v3 n = v3_load(c->plane), t, b;
    v3_frame(n, &t, &b);
    n = v3_unit(v3_mad(n, .02, v3_add(t, b)));
    v3_store(c->plane, n);
    c->plane[3] = (float)-v3_dot(n, v3_load(c->centroid));
}
static void moved_plane(fct_cluster *c, float size) {
    c->plane[3] += .02F * size;
}
static void long_normal(fct_cluster *c, float size) {
    (void)size;
    for (int i = 0; i < 4; ++i) c->plane[i] *= 1.01F;
}
static void small_box(fct_cluster *c, float size) {
    (void)size;
    c->box_half[1] *= .999F;
}
static void large_box(fct_cluster *c, float size) {
    c->box_half[2] += .02F * size;
}
static void moved_box(fct_cluster *c, float size) {
    c->box_center[0] += .02F * size;
}
static void long_rotation(fct_cluster *c, float size) {
    (void)size;
    for (int i = 0; i < 4; ++i) c->box_rotation[i] *= 1.01F;
}
static void narrow_cone(fct_cluster *c, float size) {
    (void)size;
    c->cone_angle *= .99F;
}
static void wide_cone(fct_cluster *c, float size) {
    (void)size;
    c->cone_angle = 7;
}
static void endless(fct_cluster *c, float size) {
    (void)size;
    c->moment[3] = INFINITY;
}
static void dear(fct_cluster *c, float size) {
    (void)size;
    c->cost = FLT_MAX;
}

static const mistake mistakes[] = {{"an area that is not", more_area},
                                   {"an area vector that is not", other_vector},
                                   {"a moment that is not", other_moment},
                                   {"a centroid that is not", other_centroid},
                                   {"a plane whose normal is against", turned_plane},
                                   {"a plane that is not the best", tilted_plane},
                                   {"a plane that misses", moved_plane},
                                   {"a plane without a unit normal", long_normal},
                                   {"a vertex outside its box", small_box},
                                   {"a box that is too large", large_box},
                                   {"a vertex outside its box", moved_box},
                                   {"a rotation that is none", long_rotation},
                                   {"a face outside its cone", narrow_cone},
                                   {"a cone of no angle", wide_cone},
                                   {"a number that is not finite", endless},
                                   {"cost above that of a later merge", dear}};

/* Makes every mistake at several nodes, one at a time. */
static void find_mistakes(const fct_env *env, const recorder *r, fct_tree *tree) {
    assert_int_equal(fct_tree_verify(env, tree), FCT_OK);
    uint32_t tried = 0;
    for (uint32_t i = 1; i < tree->view.node_count; i += 1 + i / 3) {
        fct_cluster *c = &tree->clusters[i], right = *c;
        float size = sqrtf(right.box_half[0] * right.box_half[0] + right.box_half[1] * right.box_half[1] +
                           right.box_half[2] * right.box_half[2]);
        if (right.cone_angle < .01F || right.cone_angle > 3) continue; /* flat, or S is 0 */
        ++tried;
        for (size_t k = 0; k < sizeof mistakes / sizeof *mistakes; ++k) {
            mistakes[k].make(c, size);
            assert_int_equal(fct_tree_verify(env, tree), FCT_ERROR_DATA);
            if (!strstr(r->text, mistakes[k].message))
                fail_msg("expected '%s', found '%s'", mistakes[k].message, r->text);
            *c = right;
        }
    }
    assert_true(tried >= 5);
    assert_int_equal(fct_tree_verify(env, tree), FCT_OK);
}

/* A sphere that is moved by `away`, with radii that vary at random by `noise`. */
static fct_tree *build_ball(const fct_env *env, float away, float noise) {
    fct_mesh mesh = make_sphere(env, 10);
    uint32_t random = 1;
    for (size_t v = 0; v < mesh.vertex_count; ++v) {
        random = random * 1664525 + 1013904223;
        float radius = 1 + noise * (float)(random >> 16) / 65536;
        for (int k = 0; k < 3; ++k) mesh.positions[3 * v + (size_t)k] *= radius;
        mesh.positions[3 * v] += away;
    }
    fct_tree *tree;
    assert_int_equal(fct_tree_build(env, &mesh, NULL, NULL, &tree), FCT_OK);
    fct_mesh_release(env, &mesh);
    return tree;
}

static void every_wrong_number_is_found(void **state) {
    (void)state;
    static const float away[3] = {0, 30, 0}, noise[3] = {0, 0, .7F};
    for (int i = 0; i < 3; ++i) {
        recorder r = {0};
        fct_env env = recorder_env(&r);
        env.thread_count = 1;
        fct_tree *tree = build_ball(&env, away[i], noise[i]);
        find_mistakes(&env, &r, tree);
        fct_tree_destroy(tree);
        assert_int_equal(r.alive, 0);
    }
}

/* The message names the first wrong node, for every thread count. */
static void the_first_mistake_is_told(void **state) {
    (void)state;
    for (uint32_t threads = 1; threads <= 4; ++threads) {
        recorder r = {0};
        fct_env env = recorder_env(&r);
        env.thread_count = threads;
        fct_tree *tree = build_ball(&env, 0, .3F);
        for (uint32_t i = 50; i < tree->view.node_count; ++i) tree->clusters[i].area *= 2;
        assert_int_equal(fct_tree_verify(&env, tree), FCT_ERROR_DATA);
        assert_non_null(strstr(r.text, "node 50 has an area"));
        fct_tree_destroy(tree);
    }
}

static void wrong_counts_are_found(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_tree *tree = build_ball(&env, 0, 0);
    fct_tree_view right = tree->view, *view = &tree->view;
    uint32_t *counts[3] = {&view->boundary_edges, &view->nonmanifold_edges, &view->component_count};
    for (int i = 0; i < 3; ++i) {
        ++*counts[i];
        assert_int_equal(fct_tree_verify(&env, tree), FCT_ERROR_DATA);
        assert_non_null(strstr(r.text, "components, the mesh has"));
        *view = right;
    }
    view->bounds.upper[1] += .01F;
    assert_int_equal(fct_tree_verify(&env, tree), FCT_ERROR_DATA);
    assert_non_null(strstr(r.text, "bounds"));
    *view = right;
    view->inward = !right.inward;
    assert_int_equal(fct_tree_verify(&env, tree), FCT_ERROR_DATA);
    assert_non_null(strstr(r.text, "wound inwards"));
    *view = right;
    ++view->depth;
    assert_int_equal(fct_tree_verify(&env, tree), FCT_ERROR_DATA);
    assert_non_null(strstr(r.text, "deep"));
    *view = right;
    assert_int_equal(fct_tree_verify(&env, tree), FCT_OK);
    fct_tree_destroy(tree);
    assert_int_equal(r.alive, 0);
}

/* Build, fct_tree_count_edges and fct_mesh_inspect agree on the counts of edges and components: a pinched
 * strip, two equal faces, three faces at one edge, a face that is a point, a separate triangle. */
static void a_build_counts_as_verifying_does(void **state) {
    (void)state;
    static const uint32_t faces[][3] = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 3, 5}, {0, 1, 2},
                                        {6, 6, 6}, {7, 8, 9}, {7, 8, 8}, {9, 8, 10}};
    enum { FACES = sizeof faces / sizeof *faces, VERTICES = 11 };
    float positions[3 * VERTICES];
    for (uint32_t i = 0; i < 3 * VERTICES; ++i) positions[i] = (float)(i * i % 17) + .25F * (float)(i % 5);
    for (uint32_t used = 1; used <= FACES; ++used) {
        recorder r = {0};
        fct_env env = recorder_env(&r);
        fct_mesh mesh = {.vertex_count = VERTICES,
                         .face_count = used,
                         .positions = positions,
                         .triangles = (uint32_t *)(uintptr_t)faces};
        fct_mesh_report report;
        fct_tree *tree;
        assert_int_equal(fct_tree_build(&env, &mesh, NULL, NULL, &tree), FCT_OK);
        assert_int_equal(fct_tree_verify(&env, tree), FCT_OK);
        assert_int_equal(fct_mesh_inspect(&env, &mesh, &report), FCT_OK);
        for (uint32_t portion = 1; portion < 32; portion *= 3) { /* large portions make a single lot */
            fct_edge_counts counts;
            assert_int_equal(fct_tree_count_edges(&env, &tree->view, portion, &counts), FCT_OK);
            assert_int_equal(counts.boundary, report.boundary_edges);
            assert_int_equal(counts.nonmanifold, report.nonmanifold_edges);
            assert_int_equal(counts.components, report.components);
        }
        fct_tree_view view = fct_tree_get(tree);
        assert_int_equal(view.boundary_edges, report.boundary_edges);
        assert_int_equal(view.nonmanifold_edges, report.nonmanifold_edges);
        assert_int_equal(view.component_count, report.components);
        assert_memory_equal(&view.bounds, &report.bounds, sizeof view.bounds);
        fct_tree_destroy(tree);
        assert_int_equal(r.alive, 0);
    }
}

/* The file holds the records of leaves in the cut. A wrong one is found although the checksums are right. */
static void wrong_faces_of_the_cut_are_found(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    const char *path = "test_verify.fct";
    fct_mesh ball = make_sphere(&env, 10), mesh; /* and a separate face, which the last merge joins */
    assert_int_equal(fct_mesh_create(&env, ball.vertex_count + 3, ball.face_count + 1, 0, &mesh), FCT_OK);
    memcpy(mesh.positions, ball.positions, 12 * (size_t)ball.vertex_count);
    memcpy(mesh.triangles, ball.triangles, 12 * (size_t)ball.face_count);
    const float apart[9] = {20, 0, 0, 21, 0, 0, 20, 1, 0};
    memcpy(mesh.positions + 3 * (size_t)ball.vertex_count, apart, sizeof apart);
    for (uint32_t k = 0; k < 3; ++k) mesh.triangles[3 * (size_t)ball.face_count + k] = ball.vertex_count + k;
    fct_mesh_release(&env, &ball);
    fct_tree *tree, *back;
    fct_file file;
    assert_int_equal(fct_tree_build(&env, &mesh, NULL, NULL, &tree), FCT_OK);
    assert_int_equal(fct_tree_save(&env, tree, path), FCT_OK);
    assert_int_equal(fct_file_open(&env, path, &file), FCT_OK);
    fct_format_header h;
    unsigned char *bytes = malloc(file.size);
    memcpy(bytes, file.data, file.size);
    memcpy(&h, bytes, sizeof h);
    uint32_t entry = h.cut_count - 1, id; /* ids ascend, so the last entry is a leaf */
    memcpy(&id, bytes + h.sections[FCT_SECTION_CUT_IDS].offset + 4 * entry, 4);
    assert_true(id >= h.node_count);
    fct_cluster *leaf = (fct_cluster *)(bytes + h.sections[FCT_SECTION_CUT].offset) + entry;
    leaf->area *= 2;
    fct_format_section *cut = &h.sections[FCT_SECTION_CUT];
    uint64_t hash;
    fct_format_hash_blocks(&env, bytes + cut->offset, cut->size, &hash);
    cut->checksum = fct_format_fold(&hash, 1);
    memcpy(bytes, &h, sizeof h);
    h.checksum = fct_format_head_checksum(bytes, h.head_size);
    memcpy(bytes, &h, sizeof h);
    assert_int_equal(fct_tree_parse(&env, "cut", bytes, file.size, &back), FCT_OK);
    assert_int_equal(fct_tree_verify(&env, back), FCT_ERROR_DATA);
    assert_non_null(strstr(r.text, "has an area that is not"));
    fct_tree_destroy(back);
    fct_tree_destroy(tree);
    fct_file_close(&env, &file);
    fct_mesh_release(&env, &mesh);
    free(bytes);
    remove(path);
    assert_int_equal(r.alive, 0);
}

/* Trees in which each node adds one face are F - 1 deep; from 12 faces on, that is more than 3 log2 F. */
static void deep_trees_are_found(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    for (uint32_t faces = 8; faces <= 16; ++faces) {
        fct_tree *tree;
        fct_mesh mesh = make_grid(&env, 3);
        mesh.face_count = faces;
        assert_int_equal(fct_tree_build(&env, &mesh, NULL, NULL, &tree), FCT_OK);
        uint32_t nodes = tree->view.node_count, total = faces - 1;
        for (uint32_t i = 0; i < nodes; ++i) {
            fct_cluster *c = &tree->clusters[i];
            c->first = i, c->count = faces - i, c->cost = 1, total += i + 1;
            c->child[0] = nodes + i, c->child[1] = i + 1 < nodes ? i + 1 : nodes + i + 1;
        }
        tree->view.depth = faces - 1, tree->view.mean_depth = (double)total / faces;
        r.text[0] = 0;
        fct_result result = fct_tree_check_structure(&env, tree);
        assert_int_equal(result, faces >= 12 ? FCT_ERROR_DATA : FCT_OK);
        assert_true(faces < 12 || strstr(r.text, "3 log2"));
        fct_tree_destroy(tree);
        fct_mesh_release(&env, &mesh);
    }
    assert_int_equal(r.alive, 0);
}

/* Loose faces, thin ones, doubled ones, and faces without area. */
static void trees_of_thin_faces_are_correct(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    for (uint64_t seed = 1; seed < 20; ++seed) {
        fct_mesh mesh = make_soup(&env, 400, seed);
        fct_tree *tree;
        assert_int_equal(fct_tree_build(&env, &mesh, NULL, NULL, &tree), FCT_OK);
        assert_int_equal(fct_tree_verify_contents(&env, tree), FCT_OK);
        fct_tree_destroy(tree);
        fct_mesh_release(&env, &mesh);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(trees_of_thin_faces_are_correct),
                                       cmocka_unit_test(every_wrong_number_is_found),
                                       cmocka_unit_test(the_first_mistake_is_told),
                                       cmocka_unit_test(wrong_counts_are_found),
                                       cmocka_unit_test(a_build_counts_as_verifying_does),
                                       cmocka_unit_test(wrong_faces_of_the_cut_are_found),
                                       cmocka_unit_test(deep_trees_are_found)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
