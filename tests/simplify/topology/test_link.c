/* The link condition and the fold-over test against their definitions. */
#include "../oracle.h"
#include "simplify/topology/link.h"
#include "simplify/topology/remain.h"
#include "simplify/topology/ring.h"

static fct_env env;

enum { POINTS = 12, CONE = POINTS }; /* CONE: the vertex that all boundary edges see */

typedef struct complex {
    uint32_t count, faces[64][3];
    int edge_faces[POINTS + 1][POINTS + 1];
} complex;

static bool has_face(const complex *k, uint32_t a, uint32_t b, uint32_t c) {
    for (uint32_t f = 0; f < k->count; ++f) {
        const uint32_t *t = k->faces[f];
        int found = 0;
        for (int i = 0; i < 3; ++i) found += t[i] == a || t[i] == b || t[i] == c;
        if (found == 3) return true;
    }
    /* Each boundary edge forms a triangle with the tip of the cone. */
    uint32_t v[3] = {a, b, c};
    for (int i = 0; i < 3; ++i)
        if (v[i] == CONE) return k->edge_faces[v[(i + 1) % 3]][v[(i + 2) % 3]] == 1;
    return false;
}

static bool has_edge(const complex *k, uint32_t a, uint32_t b) {
    for (uint32_t x = 0; x <= CONE; ++x)
        if (x != a && x != b && has_face(k, a, b, x)) return true;
    return false;
}

/* Lk(a) and Lk(b) meet in Lk(ab): common neighbours are apexes of the edge, and no edge lies in both links.
 */
static bool link_condition(const complex *k, uint32_t a, uint32_t b) {
    for (uint32_t x = 0; x <= CONE; ++x) {
        if (x == a || x == b) continue;
        if (has_edge(k, a, x) && has_edge(k, b, x) && !has_face(k, a, b, x)) return false;
        for (uint32_t y = 0; y < x; ++y)
            if (y != a && y != b && has_face(k, a, x, y) && has_face(k, b, x, y)) return false;
    }
    return true;
}

static bool is_regular(const complex *k, uint32_t a) {
    for (uint32_t x = 0; x < POINTS; ++x)
        if (k->edge_faces[a][x] > 2) return false;
    return true;
}

static int count_open(const complex *k, uint32_t a) {
    int count = 0;
    for (uint32_t x = 0; x < POINTS; ++x) count += k->edge_faces[a][x] == 1;
    return count;
}

/* Random faces, a closed surface, a part of one, or a tetrahedron. */
static complex make_complex(uint64_t *seed, int kind) {
    static const uint32_t octahedron[8][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                              {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    static const uint32_t tetrahedron[4][3] = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
    complex k = {0};
    if (kind == 3) {
        k.count = 4;
        memcpy(k.faces, tetrahedron, sizeof tetrahedron);
    } else if (kind == 0) {
        uint32_t reach = 5 + (uint32_t)(uniform(seed) * 6), wanted = 3 + (uint32_t)(uniform(seed) * 12);
        for (uint32_t i = 0; i < wanted; ++i) {
            uint32_t t[3];
            for (int j = 0; j < 3; ++j) t[j] = (uint32_t)(uniform(seed) * reach);
            if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0] || has_face(&k, t[0], t[1], t[2])) continue;
            memcpy(k.faces[k.count++], t, sizeof t);
        }
    } else {
        for (uint32_t f = 0; f < 8; ++f) memcpy(k.faces[k.count++], octahedron[f], sizeof octahedron[f]);
        for (uint32_t fresh = 6; fresh < POINTS; ++fresh) { /* cut a face in three, flip nothing */
            uint32_t f = (uint32_t)(uniform(seed) * k.count), t[3];
            memcpy(t, k.faces[f], sizeof t);
            uint32_t parts[3][3] = {{t[0], t[1], fresh}, {t[1], t[2], fresh}, {t[2], t[0], fresh}};
            memcpy(k.faces[f], parts[0], sizeof parts[0]);
            memcpy(k.faces[k.count++], parts[1], sizeof parts[1]);
            memcpy(k.faces[k.count++], parts[2], sizeof parts[2]);
        }
        for (uint32_t f = k.count; f-- > 0 && kind == 2;)
            if (uniform(seed) < .25) memcpy(k.faces[f], k.faces[--k.count], sizeof k.faces[f]);
    }
    for (uint32_t f = 0; f < k.count; ++f)
        for (int i = 0; i < 3; ++i) {
            uint32_t a = k.faces[f][i], b = k.faces[f][(i + 1) % 3];
            ++k.edge_faces[a][b], ++k.edge_faces[b][a];
        }
    return k;
}

static void contractions_keep_the_topology_by_the_link_condition(void **state) {
    (void)state;
    uint64_t seed = 51;
    uint32_t yes = 0, no = 0;
    for (int round = 0; round < 800; ++round) {
        complex k = make_complex(&seed, round % 4);
        if (k.count == 0) continue;
        fct_mesh mesh;
        assert_int_equal(fct_mesh_create(&env, POINTS, k.count, 0, &mesh), FCT_OK);
        for (uint32_t i = 0; i < 3 * POINTS; ++i) mesh.positions[i] = (float)uniform(&seed);
        memcpy(mesh.triangles, k.faces, 12 * (size_t)k.count);
        fct_simplify_def def = fct_simplify_def_default();
        def.keep_topology = true;
        fct_simplifier *s = open_simplifier(&env, &mesh, &def);
        uint32_t vertex_of[POINTS];
        for (uint32_t v = 0; v < POINTS; ++v)
            if (s->point_of[v] != FCT_NONE) vertex_of[s->point_of[v]] = v;
        for (uint32_t e = 0; e < s->edge_count; ++e)
            for (int turn = 0; turn < 2; ++turn) {
                uint32_t a = s->edges[e].ends[turn], b = s->edges[e].ends[1 - turn];
                uint32_t va = vertex_of[a], vb = vertex_of[b];
                uint32_t count_a = fct_simplify_gather(s, a, s->ring_a);
                uint32_t count_b = fct_simplify_gather(s, b, s->ring_b);
                bool got = fct_simplify_link_holds(s, a, b, count_a, count_b);
                bool want = is_regular(&k, va) && is_regular(&k, vb) && link_condition(&k, va, vb);
                assert_true(want || !got);
                /* A point where boundaries meet may be refused although the condition holds. */
                bool simple = count_open(&k, va) <= 2 && count_open(&k, vb) <= 2;
                if (simple) assert_true(got == want);
                ++*(want ? &yes : &no);
                assert_false(fct_simplify_link_holds(s, a, b, 0, count_b));
            }
        fct_simplifier_destroy(s);
        fct_mesh_release(&env, &mesh);
    }
    assert_true(yes > 1000 && no > 1000);
}

/* --- Rings --- */

static void rings_drop_dead_corners(void **state) {
    (void)state;
    fct_mesh mesh = make_sheet(&env, 0, 1);
    fct_simplify_def def = fct_simplify_def_default();
    fct_simplifier *s = open_simplifier(&env, &mesh, &def);
    for (uint32_t f = 0; f < mesh.face_count; f += 3) s->triangles[3 * f] = FCT_NONE;
    for (uint32_t p = 0; p < s->point_count; ++p)
        for (int again = 0; again < 2; ++again) { /* the list that the first call repaired gives the same */
            uint32_t count = fct_simplify_gather(s, p, s->ring_a), want = 0;
            for (uint32_t c = 0; c < 3 * mesh.face_count; ++c) {
                if (c / 3 % 3 == 0 || s->point_of[mesh.triangles[c]] != p) continue;
                assert_true(want < count && s->ring_a[want] == c);
                ++want;
            }
            assert_int_equal(count, want);
            assert_int_equal(point_at(s, p)->last_corner, want ? s->ring_a[want - 1] : FCT_NONE);
        }
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &mesh);
}

/* The cosine between the normals of a face before and after its corner moves; `other` faces do not count. */
static bool folds(const fct_simplifier *s, uint32_t point, uint32_t other, v3 at) {
    for (uint32_t f = 0; f < s->mesh->face_count; ++f) {
        v3 before[3], after[3];
        bool touches = false, vanishes = false;
        for (int k = 0; k < 3; ++k) {
            uint32_t p = s->triangles[3 * f + (uint32_t)k];
            before[k] = after[k] = point_position(s, p);
            if (p == point) touches = true, after[k] = at;
            if (p == other) vanishes = true;
        }
        if (!touches || vanishes) continue;
        v3 n = v3_cross(v3_sub(before[1], before[0]), v3_sub(before[2], before[0]));
        v3 m = v3_cross(v3_sub(after[1], after[0]), v3_sub(after[2], after[0]));
        if (v3_dot(n, m) <= .1 * v3_norm(n) * v3_norm(m)) return true;
    }
    return false;
}

static void faces_may_turn_by_84_degrees(void **state) {
    (void)state;
    uint64_t seed = 53;
    uint32_t yes = 0, no = 0;
    fct_mesh mesh = make_sheet(&env, 0, 2);
    fct_simplify_def def = fct_simplify_def_default();
    fct_simplifier *s = open_simplifier(&env, &mesh, &def);
    for (int round = 0; round < 3000; ++round) {
        uint32_t p = (uint32_t)(uniform(&seed) * s->point_count),
                 e = (uint32_t)(uniform(&seed) * s->edge_count);
        uint32_t other = round % 2 ? FCT_NONE : s->edges[e].ends[0];
        if (other == p) continue;
        v3 from = point_position(s, p), at = v3_mad(from, .4, random_vector(&seed));
        uint32_t count = fct_simplify_gather(s, p, s->ring_a);
        fct_simplify_begin_move(s);
        bool got = fct_simplify_folds_over(s, s->ring_a, count, other, from, at);
        assert_true(got == folds(s, p, other, at));
        ++*(got ? &yes : &no);
    }
    assert_true(yes > 300 && no > 300);
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &mesh);

    /* Just on both sides of the limit: cosines .105 and .095. */
    for (int over = 0; over < 2; ++over) {
        float p[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
        assert_int_equal(fct_mesh_create(&env, 3, 1, 0, &mesh), FCT_OK);
        memcpy(mesh.positions, p, sizeof p);
        for (uint32_t c = 0; c < 3; ++c) mesh.triangles[c] = c;
        s = open_simplifier(&env, &mesh, &def);
        double cosine = over ? .095 : .105;
        v3 from = point_position(s, s->point_of[2]), at = {from.x, -.5 + cosine, sqrt(1 - cosine * cosine)};
        uint32_t count = fct_simplify_gather(s, s->point_of[2], s->ring_a);
        fct_simplify_begin_move(s);
        assert_true(fct_simplify_folds_over(s, s->ring_a, count, FCT_NONE, from, at) == over);
        fct_simplifier_destroy(s);
        fct_mesh_release(&env, &mesh);
    }
}

/* Height over the longest side. */
static double find_height(v3 a, v3 b, v3 c) {
    double longest = fmax(v3_norm(v3_sub(b, a)), fmax(v3_norm(v3_sub(c, b)), v3_norm(v3_sub(a, c))));
    return v3_norm(v3_cross(v3_sub(b, a), v3_sub(c, a))) / longest;
}

/* A corner moves in the plane of its face, so that nothing turns. */
static void faces_may_not_become_thin(void **state) {
    (void)state;
    uint64_t seed = 59;
    uint32_t yes = 0, no = 0;
    fct_mesh mesh = make_sheet(&env, 0, 2);
    mesh.face_count = 1;
    fct_simplify_def def = fct_simplify_def_default();
    fct_simplifier *s = open_simplifier(&env, &mesh, &def);
    const double least = s->least_height;
    for (int round = 0; round < 40000; ++round) {
        uint32_t turn = (uint32_t)(3 * uniform(&seed)), points[3];
        v3 x = v3_unit(random_vector(&seed)), y = v3_unit(v3_cross(x, random_vector(&seed))), at[4];
        for (uint32_t k = 0; k < 3; ++k) points[k] = s->triangles[(k + turn) % 3];
        at[0] = v3_scale(random_vector(&seed), .2);
        at[1] = v3_mad(at[0], least * pow(10, between(&seed, -.5, 4)), x);
        for (int k = 2; k < 4; ++k) {
            double along = least * pow(10, between(&seed, -1, 4)),
                   up = least * pow(10, between(&seed, -1, 4));
            at[k] = v3_mad(v3_mad(at[0], uniform(&seed) < .5 ? along : -along, x), up, y);
        }
        for (int k = 0; k < 3; ++k) point_at(s, points[k])->at = at[k];
        double before = find_height(at[0], at[1], at[2]) / least,
               after = find_height(at[0], at[1], at[3]) / least;
        if (before < 1.001 || fabs(after - 1) < .001) continue;
        uint32_t count = fct_simplify_gather(s, points[2], s->ring_a);
        fct_simplify_begin_move(s);
        assert_int_equal(fct_simplify_folds_over(s, s->ring_a, count, FCT_NONE, at[2], at[3]), after < 1);
        ++*(after < 1 ? &yes : &no);
    }
    assert_true(yes > 1000 && no > 1000);
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &mesh);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(contractions_keep_the_topology_by_the_link_condition),
        cmocka_unit_test(rings_drop_dead_corners),
        cmocka_unit_test(faces_may_turn_by_84_degrees),
        cmocka_unit_test(faces_may_not_become_thin),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
