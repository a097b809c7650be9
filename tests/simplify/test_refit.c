/* One pass of the refit against dense least-squares systems over all samples and all faces. */
#include "oracle.h"
#include "simplify/contract.h"
#include "simplify/cost/constraint.h"
#include "simplify/refit/refit.h"

static fct_env env;

/* The nearest point of a triangle by its three sides and its inside; barycentrics in b. */
static double nearest(const v3 t[3], v3 p, double b[3]) {
    v3 ab = v3_sub(t[1], t[0]), ac = v3_sub(t[2], t[0]), ap = v3_sub(p, t[0]);
    double m[4] = {v3_norm2(ab), v3_dot(ab, ac), v3_dot(ab, ac), v3_norm2(ac)},
           x[2] = {v3_dot(ab, ap), v3_dot(ac, ap)};
    solve_dense(2, m, x);
    if (x[0] >= 0 && x[1] >= 0 && x[0] + x[1] <= 1) {
        b[0] = 1 - x[0] - x[1], b[1] = x[0], b[2] = x[1];
        return v3_norm2(v3_sub(ap, v3_add(v3_scale(ab, x[0]), v3_scale(ac, x[1]))));
    }
    double best = INFINITY;
    for (int k = 0; k < 3; ++k) {
        v3 from = t[k], side = v3_sub(t[(k + 1) % 3], from);
        double s = fmin(fmax(v3_dot(side, v3_sub(p, from)) / v3_norm2(side), 0), 1);
        double d = v3_norm2(v3_sub(p, v3_mad(from, s, side)));
        if (d >= best) continue;
        best = d;
        b[k] = 1 - s, b[(k + 1) % 3] = s, b[(k + 2) % 3] = 0;
    }
    return best;
}

typedef struct expected {
    double systems[64][12]; /* per point: a 3 x 3 matrix and the right side */
    double sums[96][SIMPLIFY_MAX_CHANNELS], weights[96];
    double residuals[64], amounts[64]; /* per point: squared distances and weights of its samples */
    double near[64];                   /* of the nearest centroid of a face of the point */
    uint32_t faces[64];                /* of this centroid, in the input */
} expected;

/* A sample: the mean position and attributes of `count` corners. */
static void add_expected(const fct_simplifier *s, expected *x, const uint32_t *corners, uint32_t count,
                         double weight) {
    double v[3 + SIMPLIFY_MAX_CHANNELS] = {0}, part[3 + SIMPLIFY_MAX_CHANNELS], best = INFINITY, b[3] = {0};
    uint32_t face = 0;
    for (uint32_t k = 0; k < count; ++k) {
        corner_vector(s, corners[k], s->channel_count, part);
        for (uint32_t i = 0; i < 3 + s->channel_count; ++i) v[i] += part[i] / count;
    }
    v3 p = {v[0], v[1], v[2]}, at = {0, 0, 0};
    for (uint32_t f = 0; f < s->mesh->face_count; ++f) {
        v3 t[3];
        double own[3];
        for (uint32_t k = 0; k < 3; ++k) t[k] = point_position(s, s->triangles[3 * f + k]);
        double d = nearest(t, p, own);
        if (d >= best) continue;
        best = d, face = f;
        memcpy(b, own, sizeof b);
    }
    for (uint32_t k = 0; k < 3; ++k) at = v3_mad(at, b[k], point_position(s, s->triangles[3 * face + k]));
    for (uint32_t k = 0; k < 6 && count == 3; ++k) {
        uint32_t point = s->triangles[k < 3 ? corners[k] : 3 * face + k - 3];
        double away = v3_norm(v3_sub(p, point_position(s, point)));
        if (away < x->near[point]) x->near[point] = away, x->faces[point] = corners[0] / 3;
    }
    double residual = sqrt(best), n[3];
    v3_to_array(v3_scale(v3_sub(p, at), 1 / residual), n);
    for (uint32_t k = 0; k < 3; ++k) {
        uint32_t point = s->triangles[3 * face + k];
        double *system = x->systems[point];
        x->residuals[point] += weight * b[k] * best, x->amounts[point] += weight * b[k];
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) system[3 * i + j] += weight * b[k] * b[k] * n[i] * n[j];
            system[9 + i] += weight * b[k] * residual * n[i];
        }
        if (!s->corner_wedges) continue;
        uint32_t w = s->corner_wedges[3 * face + k];
        x->weights[w] += weight * b[k];
        for (uint32_t i = 0; i < s->channel_count; ++i) {
            double rest = v[3 + i];
            for (uint32_t l = 0; l < 3; ++l)
                rest -= b[l] * s->attributes[(size_t)s->channel_count * s->corner_wedges[3 * face + l] + i];
            x->sums[w][i] += weight * b[k] * rest;
        }
    }
}

/* As scaled_vertex, by the frame of the simplifier. */
static v3 scaled_vertex_of(const fct_simplifier *s, uint32_t v) {
    return v3_scale(v3_sub(v3_load(s->mesh->positions + 3 * (size_t)v), s->center), 1 / s->extent);
}

/* The distance of a point at `at` from the face of the input with the nearest centroid. */
static double near_face(const fct_simplifier *s, const expected *x, uint32_t point, v3 at) {
    v3 t[3];
    double b[3];
    if (x->near[point] == INFINITY) return 0;
    for (uint32_t k = 0; k < 3; ++k)
        t[k] = scaled_vertex(s->mesh, s->mesh->triangles[3 * x->faces[point] + k]);
    return sqrt(nearest(t, at, b));
}

/* Moves the points of the sheet, as contractions would, and lets one pass move them back. */
static void check_pass(unsigned arrays, double amount, uint64_t seed) {
    fct_mesh mesh = make_sheet(&env, arrays & ~(unsigned)FCT_MESH_TEXCOORDS, 7);
    for (uint32_t v = 25; v < 30; ++v) /* without seams, every attribute counts */
        if (mesh.colors) memcpy(mesh.colors + 3 * v, mesh.colors + 3 * ((v - 25) * 5 + 2), 12);
    fct_simplify_def def = fct_simplify_def_default();
    def.refit_passes = 1;
    fct_simplifier *s = open_simplifier(&env, &mesh, &def);
    static expected x;
    memset(&x, 0, sizeof x);
    for (int i = 0; i < 64; ++i) x.near[i] = INFINITY;
    assert_true(s->point_count <= 64 && s->wedge_count <= 96);
    for (uint32_t p = 0; p < s->point_count; ++p)
        point_at(s, p)->at = v3_mad(point_position(s, p), amount, random_vector(&seed));
    for (uint32_t i = 0; i < s->wedge_count * s->channel_count; ++i)
        s->attributes[i] += between(&seed, -.02, .02);
    for (uint32_t f = 0; f < mesh.face_count; ++f) {
        uint32_t corners[3] = {3 * f, 3 * f + 1, 3 * f + 2};
        v3 p[3];
        for (int k = 0; k < 3; ++k) p[k] = scaled_vertex(&mesh, mesh.triangles[3 * f + (uint32_t)k]);
        double area = .5 * v3_norm(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
        add_expected(s, &x, corners, 3, .75 * area);
        for (uint32_t k = 0; k < 3; ++k) add_expected(s, &x, corners + k, 1, area / 12);
    }
    v3 want[64];
    double farthest = 0;
    for (uint32_t p = 0; p < s->point_count; ++p)
        farthest = fmax(farthest, near_face(s, &x, p, point_position(s, p)));
    for (uint32_t p = 0; p < s->point_count; ++p) {
        double *system = x.systems[p], trace = system[0] + system[4] + system[8];
        const fct_constraint *held = constraint_at(s, p);
        for (int i = 0; i < 3 && held; ++i) { /* a tenth of their weight in a contraction */
            double weight = .1 * def.boundary_weight * trace / held->planes[10];
            double row[3][3] = {{held->planes[0], held->planes[1], held->planes[2]},
                                {held->planes[1], held->planes[3], held->planes[4]},
                                {held->planes[2], held->planes[4], held->planes[5]}},
                   at[3];
            v3_to_array(point_position(s, p), at);
            for (int j = 0; j < 3; ++j) {
                system[3 * i + j] += weight * row[i][j];
                system[9 + i] -= weight * row[i][j] * at[j];
            }
            system[9 + i] -= weight * held->planes[6 + i];
        }
        trace = system[0] + system[4] + system[8];
        for (int i = 0; i < 3; ++i) system[4 * i] += .1 * trace;
        solve_dense(3, system, system + 9);
        double limit = fmax(.5 * farthest, near_face(s, &x, p, point_position(s, p)));
        limit = fmax(limit, 2.5 * sqrt(x.residuals[p] / x.amounts[p]));
        v3 step = v3_scale((v3){system[9], system[10], system[11]}, .5);
        int halvings = 0;
        while (halvings < 4 && near_face(s, &x, p, v3_add(point_position(s, p), step)) > limit)
            step = v3_scale(step, ++halvings < 4 ? .5 : 0);
        want[p] = v3_add(point_position(s, p), step);
    }
    double values[96][SIMPLIFY_MAX_CHANNELS];
    for (uint32_t w = 0; w < s->wedge_count && s->channel_count; ++w)
        for (uint32_t i = 0; i < s->channel_count; ++i) {
            double value = s->attributes[(size_t)s->channel_count * w + i] + x.sums[w][i] / x.weights[w];
            values[w][i] = fmin(fmax(value, s->channels[i].lower), s->channels[i].upper);
        }
    assert_int_equal(fct_simplify_refit(s, NULL), FCT_OK);
    for (uint32_t p = 0; p < s->point_count; ++p)
        assert_true(v3_norm(v3_sub(point_position(s, p), want[p])) < 1e-4 * amount);
    for (uint32_t w = 0; w < s->wedge_count && s->channel_count; ++w)
        for (uint32_t i = 0; i < s->channel_count; ++i)
            assert_close(s->attributes[(size_t)s->channel_count * w + i], values[w][i], 1e-6);
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &mesh);
}

static void points_and_attributes_take_a_damped_step(void **state) {
    (void)state;
    for (uint64_t seed = 1; seed <= 6; ++seed) {
        check_pass(0, .02, seed);
        check_pass(ALL_ARRAYS, .02, seed);
    }
}

/* A short edge limits the step of its ends to half of its length. */
static void steps_are_at_most_half_the_shortest_edge(void **state) {
    (void)state;
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&env, 6, 4, 0, &mesh), FCT_OK);
    const float p[18] = {0, 0, 0, 2, 0, 0, 2, 2, 0, 0, 2, 0, 1, 1, 0, 1.02f, 1, 0};
    const uint32_t t[12] = {0, 1, 4, 1, 5, 4, 2, 3, 5, 3, 4, 5};
    memcpy(mesh.positions, p, sizeof p);
    memcpy(mesh.triangles, t, sizeof t);
    fct_simplify_def def = fct_simplify_def_default();
    def.refit_passes = 1;
    fct_simplifier *s = open_simplifier(&env, &mesh, &def);
    for (uint32_t k = 4; k < 6; ++k) point_at(s, s->point_of[k])->at.z += .05;
    v3 from = point_position(s, s->point_of[4]);
    assert_int_equal(fct_simplify_refit(s, NULL), FCT_OK);
    double step = v3_norm(v3_sub(point_position(s, s->point_of[4]), from));
    assert_ratio(step, .5 * .02 / 2, 1e-4); /* half of .02, in the unit cube */
    assert_int_equal(point_at(s, s->point_of[4])->source, FCT_NONE);
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &mesh);
}

/* The largest distance of the live points from the input, and of the input's vertices and centroids from the
 * live faces. */
static double farthest_point(const fct_simplifier *s) {
    double most = 0, b[3];
    for (uint32_t p = 0; p < s->point_count; ++p) {
        double best = INFINITY;
        for (uint32_t f = 0; f < s->mesh->face_count && point_at(s, p)->valence > 0; ++f) {
            v3 t[3];
            for (uint32_t k = 0; k < 3; ++k) t[k] = scaled_vertex_of(s, s->mesh->triangles[3 * f + k]);
            best = fmin(best, nearest(t, point_position(s, p), b));
        }
        if (point_at(s, p)->valence > 0) most = fmax(most, best);
    }
    return sqrt(most);
}

static double farthest_sample(const fct_simplifier *s) {
    double most = 0, b[3];
    for (uint32_t i = 0; i < s->mesh->vertex_count + s->mesh->face_count; ++i) {
        v3 p = {0, 0, 0};
        if (i < s->mesh->vertex_count)
            p = scaled_vertex_of(s, i);
        else
            for (uint32_t k = 0; k < 3; ++k)
                p = v3_mad(p, 1. / 3,
                           scaled_vertex_of(s, s->mesh->triangles[3 * (i - s->mesh->vertex_count) + k]));
        double best = INFINITY;
        for (uint32_t f = 0; f < s->mesh->face_count; ++f) {
            v3 t[3];
            if (corner_dead(s, 3 * f)) continue;
            for (uint32_t k = 0; k < 3; ++k) t[k] = point_position(s, s->triangles[3 * f + k]);
            best = fmin(best, nearest(t, p, b));
        }
        most = fmax(most, best);
    }
    return sqrt(most);
}

/* The flanks of spikes pull their tips outwards. However many passes, no point ends farther from the input
 * than one of them was before, or than the farthest sample. */
static void points_stay_near_the_input(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 24);
    for (uint32_t v = 0; v < sphere.vertex_count; ++v) {
        float *p = sphere.positions + 3 * v;
        double x = fabs(p[0]), y = fabs(p[1]), z = fabs(p[2]), top = fmax(x, fmax(y, z));
        double length = v3_norm(v3_load(p)), turn = acos(fmin(top / length, 1));
        v3_store(p, v3_scale(v3_load(p), 1 + fmax(0, 1 - turn / .5)));
    }
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = 90;
    def.refit_passes = 8;
    def.placement = FCT_PLACE_ENDS;
    fct_simplifier *s = open_simplifier(&env, &sphere, &def);
    fct_stop stop;
    assert_int_equal(fct_simplify_contract(s, &stop), FCT_OK);
    double before = farthest_point(s), sample = farthest_sample(s);
    assert_int_equal(fct_simplify_refit(s, NULL), FCT_OK);
    double after = farthest_point(s);
    assert_true(after <= fmax(before, sample));
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &sphere);
}

/* Points at their places do not move, not even by rounding: they keep the bits of the input. */
static void nothing_moves_without_a_residual(void **state) {
    (void)state;
    fct_mesh mesh = make_sheet(&env, 0, 3);
    fct_simplify_def def = fct_simplify_def_default();
    fct_simplifier *s = open_simplifier(&env, &mesh, &def);
    assert_int_equal(fct_simplify_refit(s, NULL), FCT_OK);
    for (uint32_t p = 0; p < s->point_count; ++p) assert_true(point_at(s, p)->source != FCT_NONE);
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &mesh);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(points_and_attributes_take_a_damped_step),
        cmocka_unit_test(steps_are_at_most_half_the_shortest_edge),
        cmocka_unit_test(points_stay_near_the_input),
        cmocka_unit_test(nothing_moves_without_a_residual),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
