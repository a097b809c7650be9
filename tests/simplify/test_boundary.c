/* Boundaries of results: straight ones stay straight, tiles do not crack apart, and max_error is a distance.
 */
#include "shapes.h"

static fct_env env;

static v3 turned(double x, double y, double z) { /* a rotation and a move, so that floats round */
    const v3 u = {2. / 3, -1. / 3, 2. / 3}, v = {2. / 3, 2. / 3, -1. / 3}, w = {-1. / 3, 2. / 3, 2. / 3};
    return v3_add(v3_make(.3, -.2, .7), v3_add(v3_scale(u, x), v3_add(v3_scale(v, y), v3_scale(w, z))));
}

/* A bumpy square beside the line x = 0. The sides y = 0 and y = 1 are curved; the side x = 0 is straight. */
static fct_mesh make_tile(uint32_t n, double side) {
    fct_mesh grid = make_grid(&env, n);
    for (uint32_t i = 0; i < grid.vertex_count; ++i) {
        float *p = grid.positions + 3 * (size_t)i;
        double x = p[0], y = p[1], bump = sin(7 * x + side) * (1 + cos(5 * y) * x) * .1;
        if (p[0] == 0) bump = 0;
        v3_store(p, turned(side * x, y, bump));
    }
    return grid;
}

/* Open sides on the line between the corners: their summed length, and the largest distance of their ends. */
static double border_length(const fct_mesh *mesh, double *farthest) {
    v3 a = v3_load((float[]){0, 0, 0}), b, d;
    float corners[6];
    v3_store(corners, turned(0, 0, 0)), v3_store(corners + 3, turned(0, 1, 0));
    a = v3_load(corners), b = v3_load(corners + 3), d = v3_unit(v3_sub(b, a));
    double length = 0;
    *farthest = 0;
    uint32_t kept = 0;
    for (uint32_t v = 0; v < mesh->vertex_count; ++v)
        kept += !memcmp(mesh->positions + 3 * (size_t)v, corners, 12) ||
                !memcmp(mesh->positions + 3 * (size_t)v, corners + 3, 12);
    assert_int_equal(kept, 2);
    for (uint32_t c = 0; c < 3 * mesh->face_count; ++c) {
        uint32_t i = mesh->triangles[c], j = mesh->triangles[c % 3 == 2 ? c - 2 : c + 1], shared = 0;
        for (uint32_t e = 0; e < 3 * mesh->face_count; ++e)
            shared += mesh->triangles[e] == j && mesh->triangles[e % 3 == 2 ? e - 2 : e + 1] == i;
        double away = fmax(v3_norm(v3_cross(v3_sub(vertex(mesh, i), a), d)),
                           v3_norm(v3_cross(v3_sub(vertex(mesh, j), a), d)));
        if (shared || away > .02) continue;
        *farthest = fmax(*farthest, away);
        length += v3_norm(v3_sub(vertex(mesh, j), vertex(mesh, i)));
    }
    return length;
}

static void tiles_with_a_straight_border_do_not_crack(void **state) {
    (void)state;
    const double ratios[] = {.5, .1, .03};
    for (int side = -1; side <= 1; side += 2)
        for (int kind = 0; kind < 9; ++kind) {
            fct_mesh tile = make_tile(24, side);
            fct_simplify_def def = fct_simplify_def_default();
            def.target_faces = (uint32_t)(ratios[kind % 3] * tile.face_count);
            def.placement = kind < 6 ? FCT_PLACE_OPTIMAL : FCT_PLACE_SEGMENT;
            if (kind / 3 == 1) def.boundary_weight = .01; /* lines do not depend on the weight */
            fct_mesh out = simplified(&env, &tile, &def, NULL);
            assert_in_range(out.face_count, def.target_faces - 1, def.target_faces);
            double away;
            assert_float_equal(border_length(&out, &away), 1, 1e-6);
            assert_true(away < 4e-7);
            fct_mesh_release(&env, &out);
            fct_mesh_release(&env, &tile);
        }
}

/* A flat disc of 1,000 outer edges: only its boundary has an error. It stops where the boundary has moved by
 * max_error, whatever its weight. The distance of a chord of k equal ones from the circle is 1 - cos(pi / k).
 */
static void max_error_is_the_distance_of_boundaries_too(void **state) {
    (void)state;
    enum { N = 1000 };
    fct_mesh fan;
    assert_int_equal(fct_mesh_create(&env, N + 1 + N, 3 * N, 0, &fan), FCT_OK);
    for (uint32_t i = 0; i < N; ++i)
        for (uint32_t ring = 0; ring < 2; ++ring) {
            double turn = 6.283185307179586 * i / N, radius = ring ? 1 : .5;
            const float p[3] = {(float)(radius * cos(turn)), (float)(radius * sin(turn)), 0};
            memcpy(fan.positions + 3 * (ring * N + i), p, sizeof p);
        }
    memset(fan.positions + 3 * 2 * N, 0, 12);
    for (uint32_t i = 0; i < N; ++i) {
        uint32_t j = (i + 1) % N;
        const uint32_t t[9] = {2 * N, i, j, i, N + i, N + j, i, N + j, j};
        memcpy(fan.triangles + 9 * i, t, sizeof t);
    }
    const double weights[] = {.1, 1, 3, 30};
    for (int k = 0; k < 4; ++k) {
        fct_simplify_def def = fct_simplify_def_default();
        def.max_error = .002;
        def.boundary_weight = weights[k];
        fct_simplify_stats stats;
        fct_mesh out = simplified(&env, &fan, &def, &stats);
        assert_int_equal(stats.stopped_because, FCT_STOP_ERROR);
        double farthest = 0;
        uint32_t sides = 0;
        for (uint32_t c = 0; c < 3 * out.face_count; ++c) {
            uint32_t i = out.triangles[c], j = out.triangles[c % 3 == 2 ? c - 2 : c + 1], shared = 0;
            for (uint32_t e = 0; e < 3 * out.face_count; ++e)
                shared += out.triangles[e] == j && out.triangles[e % 3 == 2 ? e - 2 : e + 1] == i;
            if (shared) continue;
            v3 middle = v3_scale(v3_add(vertex(&out, i), vertex(&out, j)), .5);
            farthest = fmax(farthest, fabs(1 - v3_norm(middle)));
            ++sides;
        }
        assert_in_range(sides, 26, 44);
        assert_true(farthest > .001 && farthest < .006);
        assert_true(stats.max_cost <= .002);
        fct_mesh_release(&env, &out);
    }
    fct_mesh_release(&env, &fan);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tiles_with_a_straight_border_do_not_crack),
        cmocka_unit_test(max_error_is_the_distance_of_boundaries_too),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
