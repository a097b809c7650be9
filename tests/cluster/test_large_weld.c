/* Meshes with doubled vertices that are clustered in parts: the weld is that of fct_weld_build, also in
 * several passes, and the tree is that of the mesh with single vertices. */
#define _GNU_SOURCE
#include "check_tree.h"
#include "folder.h"

#include <unistd.h>

#include "cluster/large/large.h"

static fct_env env;

static uint32_t hash_of(uint32_t x) {
    x ^= x >> 16, x *= 0x7FEB352Du, x ^= x >> 15, x *= 0x846CA68Bu;
    return x ^ x >> 16;
}

static fct_mesh make_empty(uint32_t vertices, uint32_t faces) {
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&env, vertices, faces, 0, &mesh), FCT_OK);
    memset(mesh.positions, 0, 12 * (size_t)vertices);
    return mesh;
}

/* Every corner gets a vertex of its own. */
static fct_mesh make_soup(const fct_mesh *mesh) {
    fct_mesh soup = make_empty(3 * mesh->face_count, mesh->face_count);
    for (uint32_t c = 0; c < soup.vertex_count; ++c) {
        soup.triangles[c] = c;
        memcpy(soup.positions + 3 * (size_t)c, mesh->positions + 3 * (size_t)mesh->triangles[c], 12);
    }
    return soup;
}

/* Faces behind x = .3 use a second copy of the vertices, in which 0 is -0. */
static fct_mesh make_seam(const fct_mesh *mesh) {
    uint32_t n = mesh->vertex_count;
    fct_mesh seam = make_empty(2 * n, mesh->face_count);
    for (size_t i = 0; i < 3 * (size_t)n; ++i) {
        float x = mesh->positions[i];
        seam.positions[i] = x, seam.positions[3 * (size_t)n + i] = x == 0 ? -0.0f : x;
    }
    for (size_t c = 0; c < 3 * (size_t)mesh->face_count; ++c) {
        bool behind = mesh->positions[3 * (size_t)mesh->triangles[c - c % 3]] > .3f;
        seam.triangles[c] = mesh->triangles[c] + (behind ? n : 0);
    }
    return seam;
}

/* Two copies of a mesh at one place, and one face of one vertex on each. */
static fct_mesh make_twins(const fct_mesh *mesh) {
    uint32_t n = mesh->vertex_count, corners = 3 * mesh->face_count;
    fct_mesh twins = make_empty(2 * n, 2 * mesh->face_count + 2);
    for (uint32_t k = 0; k < 6; ++k) twins.triangles[2 * (size_t)corners + k] = k < 3 ? 0 : n;
    for (size_t i = 0; i < 6 * (size_t)n; ++i) twins.positions[i] = mesh->positions[i % (3 * (size_t)n)];
    for (uint32_t c = 0; c < 2 * corners; ++c)
        twins.triangles[c] = mesh->triangles[c % corners] + (c < corners ? 0 : n);
    return twins;
}

/* Faces with random corners among `places` places with about four vertices each. */
static fct_mesh make_random(uint32_t faces, uint32_t places, uint32_t seed) {
    fct_mesh mesh = make_empty(4 * places, faces);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        uint32_t place = hash_of(v + seed) % places;
        for (uint32_t k = 0; k < 3; ++k)
            mesh.positions[3 * (size_t)v + k] = (float)(hash_of(3 * place + k) % 8) - 4;
        for (uint32_t k = 0; k < 3; ++k)
            if (v % 2 && mesh.positions[3 * (size_t)v + k] == 0) mesh.positions[3 * (size_t)v + k] = -0.0f;
    }
    for (uint32_t c = 0; c < 3 * faces; ++c) mesh.triangles[c] = hash_of(c * 7 + seed) % mesh.vertex_count;
    return mesh;
}

/* The weld from file to file, with the least table if `several_passes`, is that in memory. */
static void check_weld(const fct_mesh *mesh, bool several_passes) {
    fct_large large = {.env = &env, .path = tree_path, .budget = several_passes ? 0 : SIZE_MAX};
    fct_weld weld;
    assert_int_equal(fct_mesh_save(&env, mesh_path, mesh, NULL), FCT_OK);
    assert_int_equal(fct_stream_open(&env, mesh_path, NULL, tree_path, &large.stream), FCT_OK);
    large.info = fct_stream_get(large.stream);
    assert_int_equal(fct_large_weld(&large), FCT_OK);
    assert_int_equal(fct_weld_build(&env, mesh, &weld), FCT_OK);
    assert_int_equal(large.welded.env != NULL, weld.triangles != NULL);
    if (weld.triangles) {
        size_t size = 12 * (size_t)mesh->face_count;
        uint32_t *triangles = malloc(size);
        assert_int_equal(large.welded.size, size);
        assert_int_equal(fct_spool_read(&large.welded, 0, triangles, size), FCT_OK);
        assert_memory_equal(triangles, weld.triangles, size);
        free(triangles);
    }
    fct_spool_close(&large.welded);
    fct_stream_close(large.stream);
    fct_weld_release(&env, &weld);
}

static fct_tree *build(const fct_mesh *mesh, bool weld, uint32_t part_faces) {
    fct_large_def large = fct_large_def_default();
    fct_tree_def def = fct_tree_def_default();
    fct_tree *tree;
    large.part_faces = part_faces;
    def.weld = weld;
    assert_int_equal(fct_mesh_save(&env, mesh_path, mesh, NULL), FCT_OK);
    assert_int_equal(fct_tree_build_file(&env, mesh_path, tree_path, &def, &large, NULL), FCT_OK);
    assert_int_equal(fct_tree_open(&env, tree_path, &tree), FCT_OK);
    assert_int_equal(fct_tree_verify(&env, tree), FCT_OK);
    check_tree(tree, mesh);
    return tree;
}

/* A tree of the mesh is, but for the names of its vertices, that of the mesh with welded triangles. Its
 * counts of edges are those of a build in memory. */
static void check_parts(const fct_mesh *mesh, uint32_t part_faces) {
    fct_weld weld;
    assert_int_equal(fct_weld_build(&env, mesh, &weld), FCT_OK);
    fct_mesh single = *mesh;
    if (weld.triangles) single.triangles = weld.triangles;
    fct_tree *tree = build(mesh, true, part_faces), *other = build(&single, false, part_faces), *whole;
    assert_int_equal(fct_tree_build(&env, mesh, NULL, NULL, &whole), FCT_OK);
    fct_tree_view a = fct_tree_get(tree), b = fct_tree_get(other), c = fct_tree_get(whole);
    assert_int_equal(a.def.weld, weld.triangles != NULL);
    assert_true(a.boundary_edges == c.boundary_edges && a.nonmanifold_edges == c.nonmanifold_edges);
    assert_int_equal(a.component_count, c.component_count);
    assert_int_equal(a.inward, c.inward);
    assert_int_equal(a.node_count, b.node_count);
    assert_memory_equal(tree->nodes, other->nodes, a.node_count * sizeof *tree->nodes);
    assert_memory_equal(a.face_ids, b.face_ids, 4 * (size_t)a.face_count);
    assert_memory_equal(a.vertex_ids, b.vertex_ids, 4 * (size_t)a.vertex_count);
    fct_tree_destroy(tree);
    fct_tree_destroy(other);
    fct_tree_destroy(whole);
    fct_weld_release(&env, &weld);
}

static void check_all(fct_mesh mesh) {
    check_weld(&mesh, false);
    check_weld(&mesh, true);
    check_parts(&mesh, mesh.face_count / 5 + 1);
    check_parts(&mesh, mesh.face_count);
    fct_mesh_release(&env, &mesh);
}

static void soups_seams_and_twins(void **state) {
    (void)state;
    fct_mesh meshes[] = {make_grid(&env, 24), make_sphere(&env, 28)};
    for (int k = 0; k < 2; ++k) {
        check_all(make_soup(&meshes[k]));
        check_all(make_seam(&meshes[k]));
        check_all(make_twins(&meshes[k]));
        check_all(meshes[k]);
    }
    fct_mesh lonely = make_empty(3, 1); /* all at one place */
    for (uint32_t c = 0; c < 3; ++c) lonely.triangles[c] = c;
    check_all(lonely);
}

static void random_faces(void **state) {
    (void)state;
    for (uint32_t i = 0; i < 6; ++i) {
        fct_mesh mesh = make_random(20u << i, 12u << (i / 2), i);
        check_all(mesh);
    }
}

static void many_vertices_in_several_passes(void **state) {
    (void)state;
    fct_mesh mesh = make_random(20000, 6000, 9);
    check_weld(&mesh, false);
    check_weld(&mesh, true);
    fct_mesh_release(&env, &mesh);
}

static void colors_and_materials_of_a_soup(void **state) {
    (void)state;
    fct_mesh grid = make_grid(&env, 12), soup;
    fct_mesh plain = make_soup(&grid), back;
    assert_int_equal(fct_mesh_create(&env, plain.vertex_count, plain.face_count,
                                     FCT_MESH_COLORS | FCT_MESH_MATERIALS, &soup),
                     FCT_OK);
    memcpy(soup.positions, plain.positions, 12 * (size_t)plain.vertex_count);
    memcpy(soup.triangles, plain.triangles, 12 * (size_t)plain.face_count);
    for (size_t i = 0; i < 3 * (size_t)soup.vertex_count; ++i) soup.colors[i] = (float)(i % 97) / 97;
    for (uint32_t f = 0; f < soup.face_count; ++f) soup.materials[f] = f % 24 < 10;
    soup.material_count = 2;
    fct_tree *tree = build(&soup, true, 60);
    assert_int_equal(fct_tree_get(tree).component_count, 1);
    assert_int_equal(fct_tree_mesh(&env, tree, &back), FCT_OK);
    assert_memory_equal(back.colors, soup.colors, 12 * (size_t)soup.vertex_count);
    assert_memory_equal(back.materials, soup.materials, 4 * (size_t)soup.face_count);
    assert_memory_equal(back.triangles, soup.triangles, 12 * (size_t)soup.face_count);
    fct_mesh_release(&env, &back);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &soup);
    fct_mesh_release(&env, &plain);
    fct_mesh_release(&env, &grid);
}

static void turn_face(fct_mesh *mesh, size_t f) {
    uint32_t *t = mesh->triangles + 3 * f, swap = t[1];
    t[1] = t[2], t[2] = swap;
}

/* A soup that is turned inside out is reported by both builds; one whose halves wind differently is not,
 * whatever the volume about a far corner of the bounds. */
static void inward_bodies(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 10), soup = make_soup(&sphere);
    for (int turn = 0; turn < 4; ++turn) {
        fct_tree *tree = build(&soup, true, 40), *whole;
        assert_int_equal(fct_tree_get(tree).inward, turn == 1);
        assert_int_equal(fct_tree_get(tree).boundary_edges, 0);
        assert_int_equal(fct_tree_build(&env, &soup, NULL, NULL, &whole), FCT_OK);
        assert_int_equal(fct_tree_get(whole).inward, turn == 1);
        fct_tree_destroy(tree);
        fct_tree_destroy(whole);
        for (size_t f = 0; f < soup.face_count; ++f)
            if (turn != 1 ||
                soup.positions[9 * f + 2] + soup.positions[9 * f + 5] + soup.positions[9 * f + 8] > 0)
                turn_face(&soup, f);
    }
    fct_mesh_release(&env, &soup);
    fct_mesh_release(&env, &sphere);
}

static void no_memory_anywhere(void **state) {
    (void)state;
    recorder r = {0};
    fct_env failing = recorder_env(&r);
    failing.thread_count = 1;
    fct_mesh grid = make_grid(&env, 5), soup = make_soup(&grid);
    assert_int_equal(fct_mesh_save(&env, mesh_path, &soup, NULL), FCT_OK);
    fct_large_def large = fct_large_def_default();
    large.part_faces = 20;
    for (long n = 1;; ++n) {
        r = (recorder){.fail_at = n};
        fct_result result = fct_tree_build_file(&failing, mesh_path, tree_path, NULL, &large, NULL);
        assert_int_equal(r.alive, 0);
        if (result == FCT_OK) break;
        assert_int_equal(result, FCT_ERROR_MEMORY);
        assert_true(r.messages > 0);
    }
    fct_mesh_release(&env, &soup);
    fct_mesh_release(&env, &grid);
}

int main(void) {
    env = fct_env_default();
    env.thread_count = 1;
    const struct CMUnitTest tests[] = {cmocka_unit_test(soups_seams_and_twins),
                                       cmocka_unit_test(random_faces),
                                       cmocka_unit_test(many_vertices_in_several_passes),
                                       cmocka_unit_test(colors_and_materials_of_a_soup),
                                       cmocka_unit_test(inward_bodies),
                                       cmocka_unit_test(no_memory_anywhere)};
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
