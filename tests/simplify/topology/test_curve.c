/* Sorting along a Morton curve: nothing is lost, and what is near in space is near in the order. */
#include "../oracle.h"
#include "simplify/topology/curve.h"

static fct_env env;

/* Bit i of each coordinate's cell among 1024, from the highest to the lowest: z, y, x. */
static uint64_t find_code(const fct_mesh *mesh, uint32_t v) {
    float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    double extent = 0;
    uint64_t code = 0;
    for (uint32_t i = 0; i < 3 * mesh->vertex_count; ++i) {
        low[i % 3] = fminf(low[i % 3], mesh->positions[i]);
        high[i % 3] = fmaxf(high[i % 3], mesh->positions[i]);
    }
    for (int k = 0; k < 3; ++k) extent = fmax(extent, (double)high[k] - low[k]);
    for (int bit = 9; bit >= 0; --bit)
        for (int k = 2; k >= 0; --k) {
            uint32_t cell =
                (uint32_t)((mesh->positions[3 * v + (uint32_t)k] - (double)low[k]) * (1023 / extent));
            code = code << 1 | (cell >> bit & 1);
        }
    return code;
}

static void check_corner(const fct_mesh *from, const fct_mesh *to, uint32_t f, uint32_t g, uint32_t k) {
    uint32_t c = 3 * f + k, d = 3 * g + k, v = from->triangles[c], w = to->triangles[d];
    assert_memory_equal(from->positions + 3 * v, to->positions + 3 * w, 12);
    assert_memory_equal(from->colors + 3 * v, to->colors + 3 * w, 12);
    assert_memory_equal(from->normals + 3 * v, to->normals + 3 * w, 12);
    assert_memory_equal(from->texcoords + 2 * c, to->texcoords + 2 * d, 8);
    assert_memory_equal(from->face_colors + 3 * f, to->face_colors + 3 * g, 12);
    assert_int_equal(from->materials[f], to->materials[g]);
}

static void everything_is_kept_in_the_order_of_the_curve(void **state) {
    (void)state;
    for (uint64_t seed = 1; seed < 6; ++seed) {
        fct_mesh mesh = make_sheet(&env, ALL_ARRAYS, seed);
        uint64_t dice = seed;
        for (uint32_t i = 0; i < 3 * mesh.vertex_count; ++i) mesh.positions[i] = (float)between(&dice, -1, 1);
        uint8_t *locks = malloc(mesh.vertex_count);
        bool *met = calloc(mesh.face_count, 1);
        for (uint32_t v = 0; v < mesh.vertex_count; ++v) locks[v] = uniform(&dice) < .3;
        fct_sorted sorted;
        assert_int_equal(fct_simplify_sort(&env, &mesh, locks, &sorted), FCT_OK);
        for (uint32_t v = 1; v < mesh.vertex_count; ++v)
            assert_true(find_code(&sorted.mesh, v - 1) <= find_code(&sorted.mesh, v));
        uint32_t last = 0;
        for (uint32_t f = 0; f < mesh.face_count; ++f) {
            uint32_t g = sorted.places[f], low = FCT_NONE;
            assert_true(g < mesh.face_count && !met[g]);
            met[g] = true;
            for (uint32_t k = 0; k < 3; ++k) {
                check_corner(&mesh, &sorted.mesh, f, g, k);
                assert_int_equal(locks[mesh.triangles[3 * f + k]],
                                 sorted.locks[sorted.mesh.triangles[3 * g + k]]);
                uint32_t other = sorted.mesh.triangles[3 * f + k]; /* of the face at place f */
                low = other < low ? other : low;
            }
            assert_true(low >= last);
            last = low;
        }
        fct_simplify_release_sorted(&env, &sorted);
        assert_int_equal(fct_simplify_sort(&env, &mesh, NULL, &sorted), FCT_OK);
        assert_null(sorted.locks);
        fct_simplify_release_sorted(&env, &sorted);
        fct_mesh_release(&env, &mesh);
        free(locks);
        free(met);
    }
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {cmocka_unit_test(everything_is_kept_in_the_order_of_the_curve)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
