/* Meshes whose vertices are doubled: trees, cuts, charts, meshlets and quality are those of the mesh with
 * single vertices. */
#include "cluster/shapes.h"
#include "facetree/dual.h"
#include "facetree/partition.h"

static fct_env env;

static fct_mesh copy_mesh(const fct_mesh *from, uint32_t vertices, unsigned arrays) {
    fct_mesh out;
    assert_int_equal(fct_mesh_create(&env, vertices, from->face_count, arrays, &out), FCT_OK);
    memcpy(out.triangles, from->triangles, 12 * (size_t)from->face_count);
    return out;
}

static void copy_vertex(const fct_mesh *from, uint32_t v, fct_mesh *to, uint32_t w) {
    memcpy(to->positions + 3 * (size_t)w, from->positions + 3 * (size_t)v, 12);
}

/* Every corner gets a vertex of its own, with a colour of its face. */
static fct_mesh split_corners(const fct_mesh *mesh) {
    fct_mesh soup = copy_mesh(mesh, 3 * mesh->face_count, FCT_MESH_COLORS);
    for (uint32_t c = 0; c < soup.vertex_count; ++c) {
        copy_vertex(mesh, mesh->triangles[c], &soup, c);
        for (uint32_t k = 0; k < 3; ++k) soup.colors[3 * (size_t)c + k] = (float)(c / 3 % 5) / 5;
        soup.triangles[c] = c;
    }
    return soup;
}

/* Faces on both sides of the plane x = .1 have different vertices, as at a seam of texture coordinates. Some
 * coordinates are -0. */
static fct_mesh make_seam(const fct_mesh *mesh) {
    uint32_t n = mesh->vertex_count;
    fct_mesh seam = copy_mesh(mesh, 2 * n, 0);
    for (uint32_t v = 0; v < 2 * n; ++v) {
        copy_vertex(mesh, v % n, &seam, v);
        for (uint32_t k = 0; k < 3 && v >= n; ++k)
            if (seam.positions[3 * (size_t)v + k] == 0) seam.positions[3 * (size_t)v + k] = -0.0f;
    }
    for (uint32_t f = 0; f < seam.face_count; ++f) {
        uint32_t *t = seam.triangles + 3 * (size_t)f;
        float x = 0;
        for (uint32_t k = 0; k < 3; ++k) x += mesh->positions[3 * (size_t)t[k]];
        for (uint32_t k = 0; k < 3 && x > .3f; ++k) t[k] += n;
    }
    return seam;
}

/* A second copy of the mesh behind the first: two bodies that touch everywhere. */
static fct_mesh make_twins(const fct_mesh *mesh) {
    fct_mesh twins;
    uint32_t n = mesh->vertex_count;
    assert_int_equal(fct_mesh_create(&env, 2 * n, 2 * mesh->face_count, 0, &twins), FCT_OK);
    for (uint32_t v = 0; v < 2 * n; ++v) copy_vertex(mesh, v % n, &twins, v);
    for (uint32_t c = 0; c < 6 * mesh->face_count; ++c)
        twins.triangles[c] = mesh->triangles[c % (3 * mesh->face_count)] + (c < 3 * mesh->face_count ? 0 : n);
    return twins;
}

static fct_tree *build_tree(const fct_mesh *mesh, bool weld) {
    fct_tree_def def = fct_tree_def_default();
    fct_tree *tree;
    assert_true(def.weld);
    def.weld = weld;
    assert_int_equal(fct_tree_build(&env, mesh, &def, NULL, &tree), FCT_OK);
    return tree;
}

typedef struct results {
    uint32_t cut[4000], charts[4000], refined[4000];
    fct_partition_quality quality;
    fct_chart_stats chart_stats;
    fct_meshlets meshlets;
    fct_tree_view view;
} results;

static void make_results(const fct_tree *tree, results *r) {
    uint32_t nodes[24], count;
    r->view = fct_tree_get(tree);
    assert_int_equal(fct_tree_partition(&env, tree, 24, nodes, &count), FCT_OK);
    assert_int_equal(fct_tree_labels(&env, tree, nodes, count, r->cut), FCT_OK);
    assert_int_equal(fct_tree_quality(&env, tree, nodes, count, &r->quality), FCT_OK);
    assert_int_equal(fct_tree_refine(&env, tree, nodes, count, NULL, r->refined, NULL), FCT_OK);
    fct_chart_def def = fct_chart_def_default();
    def.max_angle = .8;
    assert_int_equal(fct_tree_charts(&env, tree, &def, r->charts, &r->chart_stats), FCT_OK);
    assert_int_equal(fct_tree_meshlets(&env, tree, NULL, &r->meshlets), FCT_OK);
    assert_int_equal(fct_tree_verify(&env, tree), FCT_OK);
}

static void compare_results(const results *a, const results *b, const fct_mesh *mesh,
                            const fct_mesh *doubled) {
    size_t faces = a->view.face_count;
    assert_memory_equal(a->cut, b->cut, 4 * faces);
    assert_memory_equal(a->charts, b->charts, 4 * faces);
    assert_memory_equal(a->refined, b->refined, 4 * faces);
    assert_memory_equal(&a->quality, &b->quality, offsetof(fct_partition_quality, connected));
    assert_int_equal(a->quality.connected, b->quality.connected);
    assert_int_equal(a->chart_stats.charts, b->chart_stats.charts);
    assert_int_equal(a->chart_stats.non_disks, b->chart_stats.non_disks);
    assert_float_equal(a->chart_stats.seam_length, b->chart_stats.seam_length, 1e-9);
    assert_int_equal(a->view.boundary_edges, b->view.boundary_edges);
    assert_int_equal(a->view.component_count, b->view.component_count);
    assert_int_equal(a->meshlets.count, b->meshlets.count);
    assert_memory_equal(a->meshlets.faces, b->meshlets.faces, 4 * faces);
    assert_int_equal(a->meshlets.vertex_count, b->meshlets.vertex_count);
    assert_memory_equal(a->meshlets.triangles, b->meshlets.triangles, a->meshlets.triangle_bytes);
    for (uint32_t i = 0; i < a->meshlets.vertex_count; ++i)
        assert_memory_equal(mesh->positions + 3 * (size_t)a->meshlets.vertices[i],
                            doubled->positions + 3 * (size_t)b->meshlets.vertices[i], 12);
}

static void doubled_vertices_change_nothing(void **state) {
    (void)state;
    results *a = calloc(1, sizeof *a), *b = calloc(1, sizeof *b);
    for (int closed = 0; closed < 2; ++closed) {
        fct_mesh mesh = closed ? make_sphere(&env, 30) : make_grid(&env, 40);
        roughen(&mesh, .02);
        fct_tree *tree = build_tree(&mesh, true);
        make_results(tree, a);
        assert_int_equal(a->view.component_count, 1);
        for (int kind = 0; kind < 2; ++kind) {
            fct_mesh doubled = kind ? make_seam(&mesh) : split_corners(&mesh);
            fct_tree *other = build_tree(&doubled, true);
            make_results(other, b);
            compare_results(a, b, &mesh, &doubled);
            fct_mesh back; /* ids of the input stay */
            assert_int_equal(fct_tree_mesh(&env, other, &back), FCT_OK);
            assert_int_equal(back.vertex_count, doubled.vertex_count);
            assert_memory_equal(back.triangles, doubled.triangles, 12 * (size_t)doubled.face_count);
            fct_mesh_release(&env, &back);
            fct_meshlets_release(&env, &b->meshlets);
            fct_tree_destroy(other);
            other = build_tree(&doubled, false);
            assert_int_equal(fct_tree_get(other).component_count, kind ? 2 : mesh.face_count);
            assert_int_equal(fct_tree_verify(&env, other), FCT_OK);
            fct_tree_destroy(other);
            fct_mesh_release(&env, &doubled);
        }
        fct_meshlets_release(&env, &a->meshlets);
        fct_tree_destroy(tree);
        fct_mesh_release(&env, &mesh);
    }
    free(a), free(b);
}

/* The choice of the build is in the file. */
static void the_file_keeps_the_choice(void **state) {
    (void)state;
    fct_mesh mesh = make_sphere(&env, 12), soup = split_corners(&mesh);
    for (int weld = 0; weld < 2; ++weld) {
        fct_tree *tree = build_tree(&soup, weld), *opened;
        uint32_t labels[600];
        fct_chart_stats stats;
        assert_int_equal(fct_tree_save(&env, tree, "soup.fct"), FCT_OK);
        assert_int_equal(fct_tree_open(&env, "soup.fct", &opened), FCT_OK);
        assert_int_equal(fct_tree_get(opened).def.weld, weld);
        assert_int_equal(fct_tree_verify(&env, opened), FCT_OK);
        assert_int_equal(fct_tree_charts(&env, opened, NULL, labels, &stats), FCT_OK);
        assert_true(weld ? stats.charts < 60 : stats.charts == soup.face_count);
        fct_tree_destroy(tree);
        fct_tree_destroy(opened);
    }
    fct_mesh_release(&env, &mesh);
    fct_mesh_release(&env, &soup);
}

static void only_ends_of_open_sides_are_joined(void **state) {
    (void)state;
    fct_weld weld;
    fct_mesh sphere = make_sphere(&env, 12), twins = make_twins(&sphere), seam = make_seam(&sphere);
    fct_mesh soup = split_corners(&sphere);
    assert_int_equal(fct_weld_build(&env, &sphere, &weld), FCT_OK);
    assert_true(weld.joined == 0 && !weld.triangles);
    assert_int_equal(fct_weld_build(&env, &twins, &weld), FCT_OK);
    assert_true(weld.joined == 0 && !weld.triangles);
    assert_int_equal(fct_weld_build(&env, &soup, &weld), FCT_OK);
    assert_int_equal(weld.joined, soup.vertex_count - sphere.vertex_count);
    for (uint32_t c = 0; c < 3 * soup.face_count; ++c) {
        uint32_t v = weld.triangles[c];
        assert_true(v <= c && sphere.triangles[v] == sphere.triangles[c]);
    }
    fct_weld_release(&env, &weld);
    fct_dual a, b;
    assert_int_equal(fct_weld_build(&env, &seam, &weld), FCT_OK);
    assert_true(weld.joined > 0);
    fct_mesh joined = seam;
    joined.triangles = weld.triangles;
    assert_int_equal(fct_dual_build(&env, &sphere, &a), FCT_OK);
    assert_int_equal(fct_dual_build(&env, &joined, &b), FCT_OK);
    assert_int_equal(a.edge_count, b.edge_count);
    assert_memory_equal(a.edges, b.edges, 8 * (size_t)a.edge_count);
    fct_dual_release(&env, &a);
    fct_dual_release(&env, &b);
    fct_weld_release(&env, &weld);
    fct_mesh *all[] = {&sphere, &twins, &seam, &soup};
    for (int i = 0; i < 4; ++i) fct_mesh_release(&env, all[i]);
}

/* A doubled ladder of 2,000 rungs, whose vertices differ only in z, beside two closed bodies at one place. */
static void the_rest_stays(void **state) {
    (void)state;
    enum { RUNGS = 2000 };
    fct_mesh sphere = make_sphere(&env, 4), twins = make_twins(&sphere), mesh;
    uint32_t first = twins.vertex_count, faces = twins.face_count, rungs = 2 * (RUNGS - 1);
    assert_int_equal(fct_mesh_create(&env, first + 3 * rungs, faces + rungs, 0, &mesh), FCT_OK);
    memcpy(mesh.positions, twins.positions, 12 * (size_t)first);
    memcpy(mesh.triangles, twins.triangles, 12 * (size_t)faces);
    for (uint32_t c = 0; c < 3 * rungs; ++c) {
        static const uint32_t corners[6] = {0, 1, 3, 0, 3, 2};
        uint32_t k = corners[c % 6];
        float p[3] = {5 + (float)(k % 2), 5, (float)(c / 6 + k / 2)};
        memcpy(mesh.positions + 3 * (size_t)(first + c), p, sizeof p);
        mesh.triangles[3 * (size_t)faces + c] = first + c;
    }
    fct_weld weld;
    assert_int_equal(fct_weld_build(&env, &mesh, &weld), FCT_OK);
    assert_int_equal(weld.joined, 3 * rungs - 2 * RUNGS);
    assert_memory_equal(weld.triangles, mesh.triangles, 12 * (size_t)faces);
    for (size_t c = 0; c < 3 * (size_t)mesh.face_count; ++c)
        assert_memory_equal(mesh.positions + 3 * (size_t)weld.triangles[c],
                            mesh.positions + 3 * (size_t)mesh.triangles[c], 12);
    fct_weld_release(&env, &weld);
    fct_mesh *all[] = {&sphere, &twins, &mesh};
    for (int i = 0; i < 3; ++i) fct_mesh_release(&env, all[i]);
}

static void the_nth_allocation_fails(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 8), soup = split_corners(&sphere);
    recorder r = {0};
    fct_env failing = recorder_env(&r);
    fct_result result = FCT_ERROR_MEMORY;
    for (long n = 1; result != FCT_OK; ++n) {
        fct_weld weld;
        r.allocations = 0, r.fail_at = n;
        result = fct_weld_build(&failing, &soup, &weld);
        assert_true(result == FCT_OK || (result == FCT_ERROR_MEMORY && !weld.triangles));
        fct_weld_release(&failing, &weld);
        assert_int_equal(r.alive, 0);
        assert_true(n < 100);
    }
    fct_mesh_release(&env, &sphere);
    fct_mesh_release(&env, &soup);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(doubled_vertices_change_nothing),    cmocka_unit_test(the_file_keeps_the_choice),
        cmocka_unit_test(only_ends_of_open_sides_are_joined), cmocka_unit_test(the_rest_stays),
        cmocka_unit_test(the_nth_allocation_fails),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
