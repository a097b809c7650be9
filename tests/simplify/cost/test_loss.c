/* The nearest point of a triangle by brute force; the loss of a contraction against its definition, evaluated
 * on the whole mesh. */
#include "../oracle.h"
#include "simplify/cost/loss.h"
#include "simplify/cost/nearest.h"
#include "simplify/topology/remain.h"
#include "simplify/topology/ring.h"

static fct_env env;

/* The squared distance by a ternary search over both barycentrics: the distance is convex. */
static double search_distance2(v3 a, v3 b, v3 c, v3 p) {
    double low = 0, high = 1, best = INFINITY;
    for (int i = 0; i < 90; ++i) {
        double u[2] = {low + (high - low) / 3, high - (high - low) / 3}, least[2];
        for (int k = 0; k < 2; ++k) {
            double first = 0, last = 1 - u[k];
            for (int j = 0; j < 90; ++j) {
                double v[2] = {first + (last - first) / 3, last - (last - first) / 3}, d[2];
                for (int l = 0; l < 2; ++l)
                    d[l] =
                        v3_norm2(v3_sub(p, v3_mad(v3_mad(v3_scale(a, 1 - u[k] - v[l]), u[k], b), v[l], c)));
                *(d[0] < d[1] ? &last : &first) = d[0] < d[1] ? v[1] : v[0];
                least[k] = fmin(d[0], d[1]);
            }
            best = fmin(best, least[k]);
        }
        *(least[0] < least[1] ? &high : &low) = least[0] < least[1] ? u[1] : u[0];
    }
    return best;
}

static void nearest_points_are_nearest(void **state) {
    (void)state;
    uint64_t seed = 31;
    for (int round = 0; round < 400; ++round) {
        v3 a = random_vector(&seed), b = random_vector(&seed), c = random_vector(&seed);
        v3 p = v3_scale(random_vector(&seed), 2);
        if (round % 8 == 0) { /* in line; eighths, so that no rounding gives the triangle an area */
            a = (v3){rint(8 * a.x) / 8, rint(8 * a.y) / 8, rint(8 * a.z) / 8};
            b = (v3){rint(8 * b.x) / 8, rint(8 * b.y) / 8, rint(8 * b.z) / 8};
            c = v3_mad(a, rint(between(&seed, -8, 16)) / 8, v3_sub(b, a));
        }
        if (round % 40 == 0) b = c = a;
        triangle t = triangle_make(a, b, c);
        foot got = triangle_nearest(&t, p);
        assert_true(got.u >= 0 && got.v >= 0 && got.u + got.v <= 1 + 1e-12);
        v3 at = v3_add(a, v3_add(v3_scale(v3_sub(b, a), got.u), v3_scale(v3_sub(c, a), got.v)));
        assert_close(got.distance2, v3_norm2(v3_sub(p, at)), 1e-12);
        assert_close(got.distance2, search_distance2(a, b, c, p), 1e-7);
    }
}

static uint32_t find_corner(const fct_simplifier *s, uint32_t f, uint32_t point) {
    for (uint32_t k = 0; k < 3; ++k)
        if (s->triangles[3 * f + k] == point) return k;
    return FCT_NONE;
}

/* Area summed at a point: a third of each of its faces. */
static double point_area(const fct_simplifier *s, uint32_t point) {
    double area = 0;
    for (uint32_t f = 0; f < s->mesh->face_count; ++f) {
        const uint32_t *t = s->triangles + 3 * f;
        if (find_corner(s, f, point) == FCT_NONE) continue;
        v3 a = point_position(s, t[0]);
        area += v3_norm(v3_cross(v3_sub(point_position(s, t[1]), a), v3_sub(point_position(s, t[2]), a))) / 6;
    }
    return area;
}

/* Squared distance from p to the remaining faces around a and b, with their corner at `at`; the nearest
 * point. */
static double remaining_distance2(const fct_simplifier *s, uint32_t a, uint32_t b, v3 at, v3 p, v3 *nearest) {
    double best = v3_norm2(v3_sub(p, at));
    *nearest = at;
    for (uint32_t f = 0; f < s->mesh->face_count; ++f) {
        uint32_t ka = find_corner(s, f, a), kb = find_corner(s, f, b), k = ka != FCT_NONE ? ka : kb;
        if ((ka == FCT_NONE) == (kb == FCT_NONE)) continue;
        triangle t = triangle_make(at, point_position(s, s->triangles[3 * f + (k + 1) % 3]),
                                   point_position(s, s->triangles[3 * f + (k + 2) % 3]));
        foot found = triangle_nearest(&t, p);
        if (found.distance2 >= best) continue;
        best = found.distance2;
        *nearest = v3_add(at, v3_add(v3_scale(t.ab, found.u), v3_scale(t.ac, found.v)));
    }
    return best;
}

/* The loss of a lost point that gathered `area`. */
static double lost_cost(const fct_simplifier *s, uint32_t a, uint32_t b, const fct_candidate *c, v3 lost,
                        double area, double *planes, v3 probe) {
    v3 nearest;
    double distance2 = remaining_distance2(s, a, b, c->at, lost, &nearest);
    if (distance2 <= 1e-14) return 0;
    v3 n = v3_scale(v3_sub(lost, nearest), 1 / sqrt(distance2));
    const double *r = c->quadric;
    double held = r[0] * n.x * n.x + r[3] * n.y * n.y + r[5] * n.z * n.z +
                  2 * (r[1] * n.x * n.y + r[2] * n.x * n.z + r[4] * n.y * n.z);
    double weight = area * fmax(0, 1 - held / c->area), height = v3_dot(n, v3_sub(probe, lost));
    *planes += weight * height * height;
    return weight * distance2;
}

static double direct_loss(const fct_simplifier *s, uint32_t a, uint32_t b, const fct_candidate *c,
                          double *planes, v3 probe) {
    double cost = 0;
    *planes = 0;
    cost += lost_cost(s, a, b, c, point_position(s, a), point_area(s, a) / 3, planes, probe);
    cost += lost_cost(s, a, b, c, point_position(s, b), point_area(s, b) / 3, planes, probe);
    for (uint32_t f = 0; f < s->mesh->face_count; ++f) {
        uint32_t ka = find_corner(s, f, a), kb = find_corner(s, f, b);
        if (ka == FCT_NONE || kb == FCT_NONE) continue;
        uint32_t apex = s->triangles[3 * f + 3 - ka - kb];
        uint32_t vanishing = 0, valence = 0;
        bool kept = false;
        for (uint32_t g = 0; g < s->mesh->face_count; ++g) {
            bool at_a = find_corner(s, g, a) != FCT_NONE, at_b = find_corner(s, g, b) != FCT_NONE;
            bool at_apex = find_corner(s, g, apex) != FCT_NONE;
            valence += at_apex, vanishing += at_apex && at_a && at_b;
            kept |= at_apex && at_a != at_b;
        }
        if (kept) continue; /* a side to the new point remains */
        v3 p = point_position(s, apex), pa = point_position(s, a), pb = point_position(s, b);
        double face = .5 * v3_norm(v3_cross(v3_sub(pa, p), v3_sub(pb, p)));
        cost += vanishing < valence
                    ? lost_cost(s, a, b, c, v3_scale(v3_add(p, c->at), .5), face / 3, planes, probe)
                    : lost_cost(s, a, b, c, p, point_area(s, apex) / (3 * vanishing), planes, probe);
    }
    return cost;
}

/* A rod of three sides with a tip; a fin of one triangle on a plate, with a flap at a corner of the plate; a
 * lone triangle; a triangle with both sides. */
static fct_mesh make_spikes(unsigned arrays) {
    const float p[][3] = {{0, 0, 0},       {.3f, .05f, 0},   {.1f, .3f, 0},     {0, 0, 2},
                          {.3f, 0, 2},     {.1f, .3f, 2.1f}, {.13f, .1f, 2.9f}, {3, 0, 0},
                          {4, 0, .1f},     {3, 1, 0},        {4, 1.1f, .2f},    {3.5f, .4f, 1},
                          {5, 0, 0},       {6, .2f, 0},      {5, .4f, .3f},     {4.8f, 1.5f, .8f},
                          {4.4f, 1.9f, 1}, {6, 2, 0},        {6.5f, 2.2f, .1f}, {6.1f, 2.9f, 0}};
    const uint32_t t[][3] = {{0, 1, 4},    {0, 4, 3},    {1, 2, 5},    {1, 5, 4},   {2, 0, 3},  {2, 3, 5},
                             {3, 4, 6},    {4, 5, 6},    {5, 3, 6},    {7, 8, 10},  {7, 10, 9}, {7, 10, 11},
                             {12, 13, 14}, {10, 15, 16}, {17, 18, 19}, {17, 19, 18}};
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&env, 20, 16, arrays, &mesh), FCT_OK);
    memcpy(mesh.positions, p, sizeof p);
    memcpy(mesh.triangles, t, sizeof t);
    for (uint32_t i = 0; i < 60 && mesh.colors; ++i) mesh.colors[i] = (float)(i % 7) / 7;
    return mesh;
}

static void losses_are_distances_to_the_remaining_faces(void **state) {
    (void)state;
    uint64_t seed = 33;
    double largest = 0;
    for (int kind = 0; kind < 4; ++kind) {
        fct_mesh mesh = kind < 2 ? make_spikes(kind ? FCT_MESH_COLORS : 0)
                                 : make_sheet(&env, kind == 3 ? ALL_ARRAYS : 0, 9);
        fct_simplify_def def = fct_simplify_def_default();
        def.boundary_weight = 0;
        def.check_foldover = false;
        fct_simplifier *s = open_simplifier(&env, &mesh, &def);
        for (uint32_t e = 0; e < s->edge_count; ++e) {
            uint32_t a = s->edges[e].ends[0], b = s->edges[e].ends[1];
            fct_candidate c;
            fct_loss loss;
            assert_true(fct_place(s, a, b, false, &c));
            uint32_t count_a = fct_simplify_gather(s, a, s->ring_a),
                     count_b = fct_simplify_gather(s, b, s->ring_b);
            fct_simplify_begin_move(s);
            assert_false(fct_simplify_folds_over(s, s->ring_a, count_a, b, point_position(s, a), c.at));
            assert_false(fct_simplify_folds_over(s, s->ring_b, count_b, a, point_position(s, b), c.at));
            double got = fct_loss_measure(s, a, b, count_a, count_b, &c, &loss), planes;
            v3 probe = random_vector(&seed);
            double want = direct_loss(s, a, b, &c, &planes, probe), q[POSITION_QUADRIC] = {0};
            assert_close(got * 1e3, want * 1e3, 1e-9);
            fct_loss_add(&loss, q);
            assert_close(quadric_at(q, probe) * 1e3, planes * 1e3, 1e-9);
            largest = fmax(largest, want / c.area);
        }
        fct_simplifier_destroy(s);
        fct_mesh_release(&env, &mesh);
    }
    assert_true(largest > 1e-4); /* the loss mattered somewhere */
}

/* Whether the faces that remain form one closed fan, none turns by more than 25.8 degrees, and none lies
 * farther than that from their sum. *margin: the least distance of a cosine from the limit. */
static bool expect_level(const fct_simplifier *s, uint32_t a, uint32_t b, v3 at, double *margin) {
    v3 before[64], after[64], sum = {0, 0, 0};
    uint32_t count = 0, met[128], uses[128], points = 0;
    bool level = true;
    for (uint32_t f = 0; f < s->mesh->face_count; ++f) {
        uint32_t ka = find_corner(s, f, a), kb = find_corner(s, f, b), k = ka != FCT_NONE ? ka : kb;
        if ((ka == FCT_NONE) == (kb == FCT_NONE)) continue;
        v3 p = point_position(s, s->triangles[3 * f + k]), side[2];
        for (uint32_t i = 0; i < 2; ++i) {
            uint32_t x = s->triangles[3 * f + (k + 1 + i) % 3], j = 0;
            side[i] = point_position(s, x);
            while (j < points && met[j] != x) ++j;
            if (j == points) met[points] = x, uses[points++] = 0;
            ++uses[j];
        }
        before[count] = v3_unit(v3_cross(v3_sub(side[0], p), v3_sub(side[1], p)));
        after[count] = v3_cross(v3_sub(side[0], at), v3_sub(side[1], at));
        sum = v3_add(sum, after[count]);
        after[count] = v3_unit(after[count]);
        ++count;
    }
    level &= count > 0;
    for (uint32_t j = 0; j < points; ++j) level &= uses[j] == 2;
    for (uint32_t i = 0; i < count; ++i) {
        double turn = v3_dot(before[i], after[i]), away = v3_dot(after[i], v3_unit(sum));
        level &= turn > .9 && away > .9;
        *margin = fmin(*margin, fmin(fabs(turn - .9), fabs(away - .9)));
    }
    return level;
}

/* On a finely divided sphere nearly every fan is level, and its losses are far below the costs, so they may
 * be left out. */
static void level_fans_lose_nothing(void **state) {
    (void)state;
    fct_mesh meshes[3] = {make_sphere(&env, 24), make_spikes(0), make_sheet(&env, 0, 4)};
    uint32_t level[3] = {0}, all[3] = {0};
    double lost = 0, cost = 0;
    for (int kind = 0; kind < 3; ++kind) {
        fct_simplify_def def = fct_simplify_def_default();
        fct_simplifier *s = open_simplifier(&env, &meshes[kind], &def);
        for (uint32_t e = 0; e < s->edge_count; ++e) {
            uint32_t a = s->edges[e].ends[0], b = s->edges[e].ends[1];
            fct_candidate c;
            fct_loss loss;
            if (!fct_place(s, a, b, false, &c)) continue;
            uint32_t count_a = fct_simplify_gather(s, a, s->ring_a),
                     count_b = fct_simplify_gather(s, b, s->ring_b);
            const fct_move move = {a, b, count_a, count_b, c.at};
            if (!fct_simplify_remains_good(s, &move) || count_a + count_b > 60) continue;
            double margin = INFINITY;
            bool got = fct_simplify_is_level(s), want = expect_level(s, a, b, c.at, &margin);
            if (margin > 1e-9) assert_int_equal(got, want);
            ++all[kind], level[kind] += got;
            if (got) lost += fct_loss_measure(s, a, b, count_a, count_b, &c, &loss), cost += c.error;
        }
        fct_simplifier_destroy(s);
        fct_mesh_release(&env, &meshes[kind]);
    }
    assert_true(level[0] > all[0] - all[0] / 10 && level[2] > 0 && level[2] < all[2]);
    assert_true(lost < .1 * cost);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nearest_points_are_nearest),
        cmocka_unit_test(losses_are_distances_to_the_remaining_faces),
        cmocka_unit_test(level_fans_lose_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
