/* Locked vertices keep every bit of their position and attributes, whatever the target. */
#include "oracle.h"

static fct_env env;

/* Whether `out` has a vertex with the bits of vertex v, and a corner there with the texture coordinates of
 * corner c. */
static bool has_vertex(const fct_mesh *out, const fct_mesh *mesh, uint32_t v, uint32_t c) {
    for (uint32_t k = 0; k < 3 * out->face_count; ++k) {
        uint32_t w = out->triangles[k];
        if (memcmp(out->positions + 3 * w, mesh->positions + 3 * v, 12)) continue;
        if (out->colors && memcmp(out->colors + 3 * w, mesh->colors + 3 * v, 12)) continue;
        if (out->normals && memcmp(out->normals + 3 * w, mesh->normals + 3 * v, 12)) continue;
        if (out->texcoords && memcmp(out->texcoords + 2 * k, mesh->texcoords + 2 * c, 8)) continue;
        return true;
    }
    return false;
}

static void check_locked(const fct_mesh *mesh, const fct_simplify_def *def, const uint8_t *locked) {
    fct_simplify_stats stats;
    fct_mesh out = simplified(&env, mesh, def, &stats);
    assert_true(out.face_count < mesh->face_count);
    for (uint32_t c = 0; c < 3 * mesh->face_count; ++c)
        if (locked[mesh->triangles[c]]) assert_true(has_vertex(&out, mesh, mesh->triangles[c], c));
    fct_mesh_release(&env, &out);
}

/* Every combination of attributes, with seams and creases, down to as few faces as the locks allow. */
static void locked_vertices_keep_their_bits(void **state) {
    (void)state;
    const unsigned arrays[] = {0, FCT_MESH_COLORS, FCT_MESH_COLORS | FCT_MESH_NORMALS, FCT_MESH_TEXCOORDS,
                               ALL_ARRAYS};
    for (size_t i = 0; i < FCT_LENGTH(arrays); ++i)
        for (uint64_t seed = 1; seed <= 12; ++seed) {
            fct_mesh mesh = make_sheet(&env, arrays[i], seed);
            uint8_t locks[64] = {0};
            uint64_t state2 = seed;
            for (uint32_t v = 0; v < mesh.vertex_count; ++v)
                locks[v] = uniform(&state2) < (seed % 2 ? .15 : .4);
            fct_simplify_def def = fct_simplify_def_default();
            def.locks = locks;
            def.target_faces = seed % 3 ? 0 : 8;
            def.placement = seed % 4 == 3 ? FCT_PLACE_SUBSET : FCT_PLACE_OPTIMAL;
            if (seed % 5 == 0) def.boundary_weight = 0;
            check_locked(&mesh, &def, locks);
            fct_mesh_release(&env, &mesh);
        }
}

/* Both tiles of a wavy border keep its vertices and sides, so they fit. */
static void tiles_with_a_locked_border_fit(void **state) {
    (void)state;
    fct_mesh grid = make_grid(&env, 16);
    uint8_t border[17 * 17] = {0};
    for (uint32_t v = 0; v < grid.vertex_count; ++v) {
        float *p = grid.positions + 3 * v;
        border[v] = v % 17 == 0 || v % 17 == 16 || v / 17 == 0 || v / 17 == 16;
        p[2] = .1f * (float)(sin(9 * p[0]) * cos(7 * p[1]));
    }
    for (int kind = 0; kind < 2; ++kind) {
        fct_simplify_def def = fct_simplify_def_default();
        def.lock_border = true;
        def.target_faces = kind ? 0 : 140;
        check_locked(&grid, &def, border);
        fct_simplify_stats stats;
        fct_mesh out = simplified(&env, &grid, &def, &stats);
        assert_int_equal(open_sides(&out, NULL), 64);
        assert_int_equal(stats.stopped_because, kind ? FCT_STOP_EXHAUSTED : FCT_STOP_FACES);
        if (kind)
            assert_in_range(out.face_count, 62, 70); /* 62: a polygon of 64 sides without a point inside */
        fct_mesh_release(&env, &out);
    }
    fct_mesh_release(&env, &grid);
}

/* A closed body with one locked point cannot vanish. */
static void a_body_with_a_lock_stays(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 8);
    uint8_t *locks = calloc(sphere.vertex_count, 1);
    locks[3] = 1;
    fct_simplify_def def = fct_simplify_def_default();
    def.locks = locks;
    check_locked(&sphere, &def, locks);
    fct_simplify_stats stats;
    fct_mesh out = simplified(&env, &sphere, &def, &stats);
    assert_int_equal(out.face_count, 4);
    assert_int_equal(stats.stopped_because, FCT_STOP_EXHAUSTED);
    fct_mesh_release(&env, &out);
    locks[3] = 0;
    out = simplified(&env, &sphere, &def, &stats);
    assert_int_equal(out.face_count, 0);
    fct_mesh_release(&env, &out);
    free(locks);
    fct_mesh_release(&env, &sphere);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(locked_vertices_keep_their_bits),
        cmocka_unit_test(tiles_with_a_locked_border_fit),
        cmocka_unit_test(a_body_with_a_lock_stays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
