/* The graph of runs of faces against sums over the edges of the dual graph. */
#include "cluster/shapes.h"

#include "base/math/vec.h"
#include "partition/units.h"

typedef struct border {
    double length;
    uint32_t count;
} border;

/* Number of pieces of unit u by flooding over edges inside it. */
static uint32_t count_pieces(const fct_units *faces, const uint32_t *unit_of, uint32_t u) {
    bool *seen = calloc(faces->count, 1);
    uint32_t *queue = malloc(4 * (size_t)faces->count), pieces = 0;
    for (uint32_t f = 0; f < faces->count; ++f) {
        if (unit_of[f] != u || seen[f]) continue;
        uint32_t begin = 0, end = 0;
        ++pieces;
        queue[end++] = f, seen[f] = true;
        while (begin < end) {
            uint32_t at = queue[begin++];
            for (uint32_t i = faces->first[at]; i < faces->first[at + 1]; ++i) {
                uint32_t next = faces->neighbours[i];
                if (unit_of[next] == u && !seen[next]) queue[end++] = next, seen[next] = true;
            }
        }
    }
    free(seen), free(queue);
    return pieces;
}

/* Each pair of units with a common border is listed once from each side, with the length of all its edges. */
static void check_borders(const fct_units *units, const fct_dual *dual, const uint32_t *unit_of) {
    uint32_t count = units->count, pairs = 0;
    border *borders = calloc((size_t)count * count, sizeof *borders);
    for (uint32_t e = 0; e < dual->edge_count; ++e) {
        uint32_t a = unit_of[dual->edges[2 * e]], b = unit_of[dual->edges[2 * e + 1]];
        if (a == b) continue;
        for (int k = 0; k < 2; ++k) {
            border *x = &borders[k ? a * count + b : b * count + a];
            pairs += x->count++ == 0;
            x->length += (double)dual->lengths[e];
        }
    }
    assert_int_equal(units->first[0], 0);
    assert_int_equal(units->first[count], pairs);
    for (uint32_t a = 0; a < count; ++a)
        for (uint32_t i = units->first[a]; i < units->first[a + 1]; ++i) {
            border *x = &borders[a * count + units->neighbours[i]];
            assert_true(x->count > 0 && fabs(units->lengths[i] - x->length) <= 1e-12 * x->length);
            x->count = 0;
        }
    free(borders);
}

static void check_sums(const fct_mesh *mesh, const fct_units *units, const fct_units *faces,
                       const uint32_t *unit_of) {
    for (uint32_t u = 0; u < units->count; ++u) {
        v3 vector = {0, 0, 0};
        double perimeter = 0, size = 0;
        uint32_t material = FCT_NONE;
        bool mixed = false;
        for (uint32_t f = 0; f < mesh->face_count; ++f) {
            if (unit_of[f] != u) continue;
            v3 p[3];
            for (int k = 0; k < 3; ++k)
                p[k] = v3_load(mesh->positions + 3 * (size_t)mesh->triangles[3 * f + k]);
            v3 cross = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
            vector = v3_mad(vector, 0.5, cross), size += v3_norm(cross);
            perimeter += (double)faces->dual.perimeters[f];
            for (uint32_t i = faces->first[f]; i < faces->first[f + 1]; ++i)
                if (unit_of[faces->neighbours[i]] == u) perimeter -= (double)faces->face_lengths[i];
            uint32_t own = mesh->materials ? mesh->materials[f] : 0;
            mixed = mixed || (material != FCT_NONE && material != own);
            material = own;
        }
        assert_true(v3_norm(v3_sub(units->vectors[u], vector)) <= 1e-12 * size);
        assert_true(fabs(units->perimeters[u] - perimeter) <= 1e-9);
        bool fixed = mixed || count_pieces(faces, unit_of, u) > 1;
        assert_int_equal(units->materials[u], fixed ? FCT_NONE : material);
        assert_int_equal(fct_unit_fixed(units, u), fixed);
    }
}

static void runs_equal_sums_over_faces(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    srand(3);
    uint32_t fixed = 0, loose = 0;
    for (int run = 0; run < 60; ++run) {
        fct_mesh mesh = run % 3 ? make_grid(&env, 3 + (uint32_t)run / 6) : make_sphere(&env, 6);
        fct_units faces, units;
        fct_dual dual;
        roughen(&mesh, 0.02);
        uint32_t *materials = malloc(4 * (size_t)mesh.face_count);
        for (uint32_t f = 0; f < mesh.face_count; ++f) materials[f] = f * 5 / mesh.face_count;
        if (run % 2) mesh.materials = materials;
        uint32_t *unit_of = malloc(4 * (size_t)mesh.face_count),
                 *scratch = malloc(8 * (size_t)mesh.face_count);
        uint32_t u = 0, longest = 1 + (uint32_t)run / 4;
        for (uint32_t f = 0, left = 1; f < mesh.face_count; ++f, --left) {
            if (left == 0) ++u, left = 1 + (uint32_t)rand() % longest;
            unit_of[f] = u;
        }
        assert_int_equal(fct_dual_build(&env, &mesh, &dual), FCT_OK);
        assert_int_equal(fct_units_of_faces(&env, &mesh, NULL, NULL, &faces), FCT_OK);
        assert_int_equal(fct_units_of_runs(&env, &faces, unit_of, u + 1, scratch, &units), FCT_OK);
        check_borders(&units, &dual, unit_of);
        check_sums(&mesh, &units, &faces, unit_of);
        for (uint32_t i = 0; i <= u; ++i) *(fct_unit_fixed(&units, i) ? &fixed : &loose) += 1;
        fct_units_release(&env, &units);
        fct_units_release(&env, &faces);
        fct_dual_release(&env, &dual);
        mesh.materials = NULL;
        free(materials), free(unit_of), free(scratch);
        fct_mesh_release(&env, &mesh);
    }
    assert_true(fixed > 50 && loose > 50);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(runs_equal_sums_over_faces)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
