/* Refinement against the same moves by brute force: the energy is summed again for each possible move.
 *
 * E = 2 sum (A - |S|) + w sum P^2 over the clusters, with A the area, S the area vector and P the perimeter.
 * In a sweep each face moves at most once, in the order of the gains that were known for it.
 */
#include "cluster/shapes.h"

#include "base/math/vec.h"
#include "facetree/dual.h"
#include "facetree/partition.h"

enum { FACES = 200, CLUSTERS = 10 };

typedef struct sums {
    v3 vectors[CLUSTERS];
    double area, perimeters[CLUSTERS];
    uint32_t counts[CLUSTERS];
} sums;

typedef struct model {
    const fct_mesh *mesh;
    const fct_dual *dual;
    double shared[FACES][FACES], weight, most_squares;
    uint32_t labels[FACES];
} model;

static sums sum_up(const model *m) {
    sums s = {0};
    for (uint32_t f = 0; f < m->mesh->face_count; ++f) {
        const uint32_t *t = m->mesh->triangles + 3 * (size_t)f, a = m->labels[f];
        v3 p[3];
        for (int k = 0; k < 3; ++k) p[k] = v3_load(m->mesh->positions + 3 * (size_t)t[k]);
        v3 vector = v3_scale(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])), 0.5);
        s.vectors[a] = v3_add(s.vectors[a], vector);
        s.area += v3_norm(vector);
        s.perimeters[a] += (double)m->dual->perimeters[f];
        ++s.counts[a];
    }
    for (uint32_t e = 0; e < m->dual->edge_count; ++e) {
        uint32_t a = m->labels[m->dual->edges[2 * e]], b = m->labels[m->dual->edges[2 * e + 1]];
        if (a == b) s.perimeters[a] -= 2 * (double)m->dual->lengths[e];
    }
    return s;
}

static double deviation_of(const sums *s) {
    double sum = 2 * s->area;
    for (uint32_t i = 0; i < CLUSTERS; ++i) sum -= 2 * v3_norm(s->vectors[i]);
    return sum;
}

static double squares_of(const sums *s) {
    double sum = 0;
    for (uint32_t i = 0; i < CLUSTERS; ++i) sum += s->perimeters[i] * s->perimeters[i];
    return sum;
}

/* The decrease of the energy by the best move of a face, 0 if none decreases it. */
static double find_gain(model *m, uint32_t face, uint32_t *to) {
    sums before = sum_up(m);
    double best = 0;
    uint32_t own = m->labels[face];
    const uint32_t *materials = m->mesh->materials;
    for (uint32_t label = 0; label < CLUSTERS && before.counts[own] > 1; ++label) {
        bool open = false;
        for (uint32_t f = 0; f < m->mesh->face_count; ++f)
            open = open || (label != own && m->shared[face][f] > 0 && m->labels[f] == label &&
                            (!materials || materials[f] == materials[face]));
        if (!open) continue;
        m->labels[face] = label;
        sums after = sum_up(m);
        m->labels[face] = own;
        double more = squares_of(&after) - squares_of(&before);
        double gain = deviation_of(&before) - deviation_of(&after) - m->weight * more;
        if (gain > 1e-11 * before.area && gain > best && (more <= 0 || squares_of(&after) <= m->most_squares))
            best = gain, *to = label;
    }
    return best;
}

/* Whether the neighbours of a face in its cluster are connected through other faces of the cluster. */
static bool may_leave(const model *m, uint32_t face) {
    uint32_t queue[FACES], begin = 0, end = 0, own = m->labels[face];
    bool seen[FACES] = {false};
    seen[face] = true;
    for (uint32_t f = 0; f < m->mesh->face_count && end == 0; ++f)
        if (m->shared[face][f] > 0 && m->labels[f] == own) queue[end++] = f, seen[f] = true;
    while (begin < end) {
        uint32_t at = queue[begin++];
        for (uint32_t f = 0; f < m->mesh->face_count; ++f)
            if (!seen[f] && m->labels[f] == own && m->shared[at][f] > 0) queue[end++] = f, seen[f] = true;
    }
    for (uint32_t f = 0; f < m->mesh->face_count; ++f)
        if (m->shared[face][f] > 0 && m->labels[f] == own && !seen[f]) return false;
    return true;
}

static uint32_t sweep(model *m) {
    uint32_t faces = m->mesh->face_count, moves = 0, to;
    double gains[FACES];
    bool moved[FACES] = {false};
    for (uint32_t f = 0; f < faces; ++f) gains[f] = find_gain(m, f, &to);
    for (;;) {
        uint32_t face = 0;
        for (uint32_t f = 1; f < faces; ++f)
            if (gains[f] > gains[face]) face = f;
        if (!(gains[face] > 0)) return moves;
        gains[face] = 0;
        if (!(find_gain(m, face, &to) > 0) || !may_leave(m, face)) continue;
        m->labels[face] = to, moved[face] = true;
        ++moves;
        for (uint32_t f = 0; f < faces; ++f)
            if (m->shared[face][f] > 0 && !moved[f]) gains[f] = find_gain(m, f, &to);
    }
}

static void moves_are_those_of_brute_force(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    static model m;
    uint32_t all = 0;
    for (int run = 0; run < 24; ++run) {
        fct_mesh mesh = run % 4 ? make_grid(&env, 7) : make_sphere(&env, 5);
        fct_dual dual;
        fct_refine_stats stats;
        fct_refine_def def = fct_refine_def_default();
        uint32_t labels[FACES], materials[FACES], moves = 0, sweeps = 1 + (uint32_t)run % 3;
        assert_true(mesh.face_count <= FACES);
        roughen(&mesh, 0.03 + 0.01 * run);
        srand((unsigned)run);
        for (uint32_t f = 0; f < mesh.face_count; ++f) materials[f] = f / 30 % 2;
        if (run % 5 == 4) mesh.materials = materials, mesh.material_count = 2;
        assert_int_equal(fct_dual_build(&env, &mesh, &dual), FCT_OK);
        m.mesh = &mesh, m.dual = &dual;
        memset(m.shared, 0, sizeof m.shared);
        for (uint32_t e = 0; e < dual.edge_count; ++e) {
            uint32_t a = dual.edges[2 * e], b = dual.edges[2 * e + 1];
            m.shared[a][b] = m.shared[b][a] = (double)dual.lengths[e];
        }
        /* nearest of random centres */
        double centres[CLUSTERS][3];
        for (int i = 0; i < CLUSTERS; ++i)
            for (int k = 0; k < 3; ++k)
                centres[i][k] =
                    (double)mesh.positions[3 * ((uint32_t)rand() % mesh.vertex_count) + (uint32_t)k];
        for (uint32_t f = 0; f < mesh.face_count; ++f) {
            const float *p = mesh.positions + 3 * (size_t)mesh.triangles[3 * (size_t)f];
            double nearest = INFINITY;
            for (uint32_t i = 0; i < CLUSTERS; ++i) {
                double d = 0;
                for (int k = 0; k < 3; ++k) d += pow((double)p[k] - centres[i][k], 2);
                if (d < nearest) nearest = d, labels[f] = i;
            }
        }
        memcpy(m.labels, labels, sizeof labels);
        def.perimeter_weight = run % 6 ? 0.5 * pow(0.3, run % 6) : 0;
        def.irregularity_limit = run % 3 == 0 ? 1 : run % 3 == 1 ? 1.1 : INFINITY;
        def.sweep_count = sweeps;
        sums before = sum_up(&m);
        m.weight = def.perimeter_weight * deviation_of(&before) / squares_of(&before);
        m.most_squares = squares_of(&before) * def.irregularity_limit;
        while (sweeps > 0) {
            uint32_t more = sweep(&m);
            moves += more;
            sweeps = more > 0 ? sweeps - 1 : 0;
        }
        assert_int_equal(fct_partition_refine(&env, &mesh, CLUSTERS, &def, labels, &stats), FCT_OK);
        for (uint32_t f = 0; f < mesh.face_count; ++f)
            if (labels[f] != m.labels[f]) fail_msg("run %d: face %u has another cluster", run, f);
        assert_int_equal(stats.moves, moves);
        all += moves;
        mesh.materials = NULL;
        fct_dual_release(&env, &dual);
        fct_mesh_release(&env, &mesh);
    }
    assert_true(all > 300);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(moves_are_those_of_brute_force)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
