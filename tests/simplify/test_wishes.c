/* Paint and constraints of the caller: closed forms, and the way back. */
#include "handle.h"
#include "oracle.h"
#include "simplify/cost/placement.h"

static fct_env env;

/* The number of faces whose centroid has x > 0. */
static uint32_t count_right(const fct_mesh *mesh) {
    uint32_t count = 0;
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        const uint32_t *t = mesh->triangles + 3 * (size_t)f;
        count += mesh->positions[3 * t[0]] + mesh->positions[3 * t[1]] + mesh->positions[3 * t[2]] > 0;
    }
    return count;
}

/* A sphere of n x n faces per side of a cube, which has no poles. */
static fct_mesh make_round(uint32_t n) {
    fct_mesh mesh = make_cube(&env, n);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        v3 p = v3_sub(vertex(&mesh, v), (v3){.5, .5, .5});
        v3_store(mesh.positions + 3 * (size_t)v, v3_unit(p));
    }
    return mesh;
}

/* A vertex that has the area A at the curvature k has an error of k^2 A^3 on a smooth surface. With equal
 * costs w k^2 A^3 everywhere, a region of weight w has w^(1/3) times as many faces per area. */
static void painted_regions_keep_more_faces(void **state) {
    (void)state;
    static const double weights[] = {1, 8, 64, 512, .125};
    fct_mesh ball = make_round(60);
    fct_simplify_def def = fct_simplify_def_default();
    float *paint = malloc(ball.vertex_count * sizeof *paint);
    for (size_t i = 0; i < FCT_LENGTH(weights); ++i) {
        fct_simplifier *s = made(&env, &ball, &def);
        for (uint32_t v = 0; v < ball.vertex_count; ++v)
            paint[v] = ball.positions[3 * v] > 0 ? (float)weights[i] : 1;
        assert_int_equal(fct_simplifier_paint(s, FCT_PAINT_INPUT, paint, ball.vertex_count), FCT_OK);
        run_to(s, 2000);
        fct_mesh mesh = mesh_of(s, true);
        double right = count_right(&mesh), ratio = right / (mesh.face_count - right);
        printf("weight %g: %g times as many faces, %g expected\n", weights[i], ratio, cbrt(weights[i]));
        assert_true(fabs(ratio / cbrt(weights[i]) - 1) < .1);
        fct_mesh_release(&env, &mesh);
        fct_simplifier_destroy(s);
    }
    free(paint);
    fct_mesh_release(&env, &ball);
}

/* Paint between runs, on the vertices of the current mesh, acts on the runs after it. */
static void paint_acts_between_runs(void **state) {
    (void)state;
    fct_mesh ball = make_round(60);
    fct_simplify_def def = fct_simplify_def_default();
    fct_simplifier *s = made(&env, &ball, &def);
    run_to(s, 6000);
    fct_mesh mesh = mesh_of(s, false);
    double right = count_right(&mesh);
    assert_true(fabs(right / (mesh.face_count - right) - 1) < .1);
    float *paint = malloc(mesh.vertex_count * sizeof *paint);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) paint[v] = mesh.positions[3 * v] > 0 ? 64 : 1;
    assert_int_equal(fct_simplifier_paint(s, FCT_PAINT_CURRENT, paint, mesh.vertex_count), FCT_OK);
    uint32_t count = mesh.vertex_count;
    fct_mesh_release(&env, &mesh);
    s = stopped(&env, s);
    run_to(s, 1500);
    mesh = mesh_of(s, true);
    right = count_right(&mesh);
    assert_true(fabs(right / (mesh.face_count - right) / 4 - 1) < .1);
    assert_int_equal(fct_simplifier_paint(s, FCT_PAINT_CURRENT, paint, count), FCT_ERROR_DATA);
    assert_int_equal(fct_simplifier_paint(s, FCT_PAINT_INPUT, paint, count), FCT_ERROR_DATA);
    free(paint);
    fct_mesh_release(&env, &mesh);
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &ball);
}

/* Equal weights change the order of nothing; weights of 1 are no paint. */
static void equal_weights_change_nothing(void **state) {
    (void)state;
    fct_mesh torus = make_torus(&env, 10, true, true);
    fct_simplify_def def = fct_simplify_def_default();
    float *paint = malloc(torus.vertex_count * sizeof *paint);
    fct_simplifier *plain = made(&env, &torus, &def);
    run_to(plain, 100);
    for (int i = 0; i < 2; ++i) {
        for (uint32_t v = 0; v < torus.vertex_count; ++v) paint[v] = i ? 1 : 256;
        fct_simplifier *s = made(&env, &torus, &def);
        assert_int_equal(fct_simplifier_paint(s, FCT_PAINT_INPUT, paint, torus.vertex_count), FCT_OK);
        run_to(s, 100);
        assert_true(has_mesh(&env, s, mesh_of(plain, true)));
        if (i) assert_true(has_state(s, state_of(plain)));
        fct_simplifier_destroy(s);
    }
    paint[3] = 0;
    assert_int_equal(fct_simplifier_paint(plain, FCT_PAINT_INPUT, paint, torus.vertex_count), FCT_ERROR_DATA);
    paint[3] = NAN;
    assert_int_equal(fct_simplifier_paint(plain, FCT_PAINT_INPUT, paint, torus.vertex_count), FCT_ERROR_DATA);
    free(paint);
    fct_simplifier_destroy(plain);
    fct_mesh_release(&env, &torus);
}

/* The vertices of a grid of n x n squares along y = y0 (n + 1 vertices, side 1 / n), as pairs. */
static uint32_t *list_row(const fct_mesh *grid, uint32_t n, double y0) {
    uint32_t *pairs = malloc(2 * n * sizeof *pairs), count = 0;
    for (uint32_t i = 0; i < n; ++i)
        for (uint32_t k = 0; k < 2; ++k)
            for (uint32_t v = 0; v < grid->vertex_count; ++v)
                if (fabs(grid->positions[3 * v] - (double)(i + k) / n) < 1e-6 &&
                    fabs(grid->positions[3 * v + 1] - y0) < 1e-6)
                    pairs[count++] = v;
    assert_int_equal(count, 2 * n);
    return pairs;
}

/* A flat grid has no cost, so its inner vertices go anywhere. */
static void make_flat(fct_mesh *grid) {
    for (uint32_t v = 0; v < grid->vertex_count; ++v) grid->positions[3 * v + 2] = 0;
}

/* The length of the segment y = y0, 0 < x < 1 that sides of the mesh cover, apart from `slack`. */
static double covered_length(const fct_mesh *mesh, double y0, double slack) {
    double sum = 0;
    for (uint32_t c = 0; c < 3 * mesh->face_count; ++c) {
        const float *a = mesh->positions + 3 * (size_t)mesh->triangles[c];
        const float *b = mesh->positions + 3 * (size_t)mesh->triangles[c % 3 == 2 ? c - 2 : c + 1];
        if (fabs(a[1] - y0) <= slack && fabs(b[1] - y0) <= slack && a[0] < b[0]) sum += b[0] - a[0];
    }
    return sum;
}

/* A contour across a flat grid stays exactly, with at most one vertex between; without it, it does not.
 * Marked after a run, it is held by planes: a tenth of a square at most. */
static void contours_stay(void **state) {
    (void)state;
    enum { N = 30 };
    fct_mesh grid = make_grid(&env, N);
    make_flat(&grid);
    uint32_t *pairs = list_row(&grid, N, 1. / 3);
    fct_constrain_def marks = fct_constrain_def_default();
    marks.contour = pairs, marks.contour_count = N;
    for (int mode = 0; mode < 3; ++mode) {
        fct_simplify_def def = fct_simplify_def_default();
        fct_simplifier *s = made(&env, &grid, &def);
        if (mode == 2) run_to(s, grid.face_count - 2);
        if (mode > 0) assert_int_equal(fct_simplifier_constrain(s, &marks), FCT_OK);
        if (mode == 1) s = stopped(&env, s);
        run_to(s, 40);
        fct_mesh mesh = mesh_of(s, true);
        double covered = covered_length(&mesh, 1. / 3, mode == 2 ? .1 / N : 1e-7);
        printf("contour %d: %g covered\n", mode, covered);
        if (mode == 0)
            assert_true(covered < .5);
        else
            assert_true(fabs(covered - 1) < 1e-6);
        fct_mesh_release(&env, &mesh);
        fct_simplifier_destroy(s);
    }
    free(pairs);
    fct_mesh_release(&env, &grid);
}

/* The planes of a contour that is marked after a contraction are those of one that is marked before. */
static void late_contours_have_the_same_planes(void **state) {
    (void)state;
    fct_mesh ball = make_round(8);
    fct_simplify_def def = fct_simplify_def_default();
    fct_constrain_def marks = fct_constrain_def_default();
    marks.contour = ball.triangles, marks.contour_count = 1, marks.contour_weight = .125;
    fct_simplifier *early = made(&env, &ball, &def), *late = made(&env, &ball, &def);
    assert_int_equal(fct_simplifier_constrain(early, &marks), FCT_OK);
    run_to(late, ball.face_count - 2);
    assert_int_equal(fct_simplifier_constrain(late, &marks), FCT_OK);
    for (int k = 0; k < 2; ++k) {
        uint32_t p = early->point_of[early->sorted.vertex_places[ball.triangles[k]]];
        assert_int_equal(late->point_parents[p], p);
        const double *a = early->constraints[early->constraint_of[p]].planes;
        const double *b = late->constraints[late->constraint_of[p]].planes;
        for (int i = 0; i < POSITION_QUADRIC; ++i) assert_true(fabs(a[i] - b[i]) <= 1e-9 * a[10]);
        assert_true(a[10] > 0);
    }
    fct_simplifier_destroy(early);
    fct_simplifier_destroy(late);
    fct_mesh_release(&env, &ball);
}

/* The position of a contraction with a point constraint minimises the sum of both quadrics, w |v - p|^2 and
 * the midpoint's ridge: a 3 x 3 system from the paper. */
static void point_constraints_pull_by_their_quadric(void **state) {
    (void)state;
    fct_mesh ball = make_round(6);
    uint64_t seed = 5;
    fct_simplify_def def = fct_simplify_def_default();
    for (int i = 0; i < 20; ++i) {
        fct_simplifier *s = made(&env, &ball, &def);
        uint32_t vertex_id = (uint32_t)i * 11, a = s->point_of[s->sorted.vertex_places[vertex_id]];
        v3 at = v3_mad(vertex(&ball, vertex_id), .02, random_vector(&seed));
        float position[3];
        v3_store(position, at);
        double w = pow(10, between(&seed, -3, 0)); /* in the unit of the mesh; its extent is not 1 */
        uint32_t b = s->triangles[corner_next(s->points[a].first_corner)];
        fct_constrain_def marks = fct_constrain_def_default();
        marks.points = &vertex_id, marks.positions = position, marks.point_count = 1, marks.point_weight = w;
        double q[POSITION_QUADRIC], m[9], x[3];
        for (int k = 0; k < POSITION_QUADRIC; ++k) q[k] = s->points[a].quadric[k] + s->points[b].quadric[k];
        assert_int_equal(fct_simplifier_constrain(s, &marks), FCT_OK);
        double scaled = w / (s->extent * s->extent), pull[3];
        v3 p = v3_scale(v3_sub(v3_load(position), s->center), 1 / s->extent);
        v3_to_array(p, pull);
        double ridge = def.regularization * (q[0] + q[3] + q[5] + 3 * scaled), middle[3];
        v3_to_array(v3_scale(v3_add(s->points[a].at, s->points[b].at), .5), middle);
        static const int entry[9] = {0, 1, 2, 1, 3, 4, 2, 4, 5};
        for (int k = 0; k < 9; ++k) m[k] = q[entry[k]] + (k % 4 ? 0 : scaled + ridge);
        for (int k = 0; k < 3; ++k) x[k] = -q[6 + k] + scaled * pull[k] + ridge * middle[k];
        solve_dense(3, m, x);
        fct_candidate candidate;
        assert_true(fct_place(s, a, b, false, &candidate));
        v3 wanted = {x[0], x[1], x[2]};
        double reach = v3_norm(v3_sub(s->points[a].at, s->points[b].at));
        assert_true(v3_norm(v3_sub(candidate.at, wanted)) < 1e-6 * reach);
        double error = quadric_at(q, wanted) + scaled * v3_norm2(v3_sub(wanted, p));
        assert_close(candidate.error, error, 1e-9 * (1e-9 + error));
        assert_close(candidate.distance2, quadric_at(q, wanted), 1e-9 * scaled);
        fct_simplifier_destroy(s);
    }
    fct_mesh_release(&env, &ball);
}

/* The tip of a spike goes, and stays if it is pinned (the horns of section 3.6), also with attributes, with
 * subset placement, after a run, and in a file. */
static void pinned_points_stay(void **state) {
    (void)state;
    for (int kind = 0; kind < 8; ++kind) {
        fct_mesh ball = make_round(12);
        uint32_t tip = 100;
        v3_store(ball.positions + 3 * tip, v3_scale(vertex(&ball, tip), 1.15));
        if (kind & 1) {
            ball.colors = fct_allocate_zero(&env, ball.vertex_count, 12);
            for (uint32_t v = 0; v < ball.vertex_count; ++v) ball.colors[3 * v] = ball.positions[3 * v];
        }
        fct_simplify_def def = fct_simplify_def_default();
        if (kind & 2) def.placement = FCT_PLACE_SUBSET;
        double nearest[2] = {INFINITY, INFINITY};
        for (int pinned = 0; pinned < 2; ++pinned) {
            fct_simplifier *s = made(&env, &ball, &def);
            fct_constrain_def marks = fct_constrain_def_default();
            marks.points = &tip, marks.point_count = 1, marks.point_weight = 1000;
            if (kind & 4) run_to(s, ball.face_count - 20);
            if (pinned) assert_int_equal(fct_simplifier_constrain(s, &marks), FCT_OK);
            if (kind & 4) s = stopped(&env, s);
            run_to(s, 20);
            fct_mesh mesh = mesh_of(s, true);
            for (uint32_t v = 0; v < mesh.vertex_count; ++v)
                nearest[pinned] =
                    fmin(nearest[pinned], v3_norm(v3_sub(vertex(&mesh, v), vertex(&ball, tip))));
            fct_mesh_release(&env, &mesh);
            fct_simplifier_destroy(s);
        }
        printf("spike %d: %g, %g pinned\n", kind, nearest[0], nearest[1]);
        assert_true(nearest[0] > .05 && nearest[1] < .01);
        fct_mesh_release(&env, &ball);
    }
}

/* Paint and constraints stay on the way back: as if they had been there then. */
static void wishes_survive_the_way_back(void **state) {
    (void)state;
    fct_mesh ball = make_round(16);
    fct_simplify_def def = fct_simplify_def_default();
    uint32_t f = ball.face_count, pair[2] = {ball.triangles[0], ball.triangles[1]}, tip = 100;
    fct_constrain_def marks = fct_constrain_def_default();
    marks.contour = pair, marks.contour_count = 1, marks.points = &tip, marks.point_count = 1;
    float *paint = malloc(ball.vertex_count * sizeof *paint);
    for (uint32_t v = 0; v < ball.vertex_count; ++v) paint[v] = 1 + (float)(v % 5);
    const uint32_t counts[] = {f, f / 2, f / 3, f / 8};
    for (size_t i = 0; i < FCT_LENGTH(counts); ++i) {
        fct_simplifier *s = made(&env, &ball, &def), *other = made(&env, &ball, &def);
        run_to(s, f / 2);
        run_to(s, f / 4);
        assert_int_equal(fct_simplifier_paint(s, FCT_PAINT_INPUT, paint, ball.vertex_count), FCT_OK);
        run_to(s, f / 16);
        assert_int_equal(fct_simplifier_constrain(s, &marks), FCT_OK);
        assert_int_equal(fct_simplifier_undo(s, counts[i]), FCT_OK);
        if (counts[i] <= f / 2) run_to(other, f / 2);
        if (counts[i] <= f / 2) run_to(other, counts[i] < f / 4 ? f / 4 : counts[i]);
        assert_int_equal(fct_simplifier_paint(other, FCT_PAINT_INPUT, paint, ball.vertex_count), FCT_OK);
        run_to(other, counts[i]);
        assert_int_equal(fct_simplifier_constrain(other, &marks), FCT_OK);
        assert_true(has_state(s, state_of(other)));
        run_to(s, 60);
        run_to(other, 60);
        assert_true(has_state(s, state_of(other)));
        assert_int_equal(fct_simplifier_undo(s, counts[i]), FCT_OK);
        run_to(s, 60);
        assert_true(has_state(s, state_of(other)));
        fct_simplifier_destroy(s);
        fct_simplifier_destroy(other);
    }
    free(paint);
    fct_mesh_release(&env, &ball);
}

/* Runs over few faces, of which only the first one would keep a snapshot without the paint between them. */
static void runs_are_repeated_with_their_own_paint(void **state) {
    (void)state;
    fct_mesh ball = make_round(12);
    fct_simplify_def def = fct_simplify_def_default();
    uint32_t f = ball.face_count;
    float *paint = malloc(ball.vertex_count * sizeof *paint);
    for (uint32_t v = 0; v < ball.vertex_count; ++v) paint[v] = ball.positions[3 * v] > 0 ? 64 : 1;
    fct_simplifier *s = made(&env, &ball, &def), *other = made(&env, &ball, &def);
    for (int i = 0; i < 2; ++i) {
        fct_simplifier *which = i ? other : s;
        run_to(which, f - f / 10);
        assert_int_equal(fct_simplifier_paint(which, FCT_PAINT_INPUT, paint, ball.vertex_count), FCT_OK);
        run_to(which, f - f / 5);
        run_to(which, i ? f - f / 4 : f - f / 3);
    }
    assert_int_equal(fct_simplifier_undo(s, f - f / 4), FCT_OK);
    assert_true(has_state(s, state_of(other)));
    free(paint);
    fct_simplifier_destroy(s);
    fct_simplifier_destroy(other);
    fct_mesh_release(&env, &ball);
}

static recorder heard;

static void check_refused(fct_simplifier *s, fct_constrain_def marks, const char *message) {
    state_bytes before = state_of(s);
    heard = (recorder){0};
    assert_int_equal(fct_simplifier_constrain(s, &marks), FCT_ERROR_DATA);
    assert_string_equal(heard.text, message);
    assert_true(has_state(s, before));
}

static void bad_constraints_are_refused(void **state) {
    (void)state;
    fct_mesh grid = make_grid(&env, 4);
    fct_simplify_def def = fct_simplify_def_default();
    fct_env own = recorder_env(&heard);
    fct_simplifier *s = made(&own, &grid, &def);
    uint32_t far_pair[4] = {grid.triangles[0], grid.triangles[1], 0, 24}, beyond = 25;
    float nowhere[3] = {0, NAN, 0};
    for (int priced = 0; priced < 2; ++priced) {
        fct_constrain_def marks = fct_constrain_def_default();
        marks.contour = far_pair, marks.contour_count = 2;
        check_refused(s, marks, "pair 1 of the contour is no edge of the input");
        marks.contour_count = 1, marks.contour_weight = 0;
        check_refused(s, marks, "contour_weight is 0, expected above 0 and at most 1e12");
        marks = fct_constrain_def_default();
        marks.points = &beyond, marks.point_count = 1;
        check_refused(s, marks, "point 0: vertex 25, expected below 25");
        beyond = 24, marks.positions = nowhere;
        check_refused(s, marks, "point 0: its position is too far away");
        beyond = 25, marks.point_weight = INFINITY;
        check_refused(s, marks, "point_weight is inf, expected above 0 and at most 1e12");
        marks.size = 3;
        heard = (recorder){0};
        assert_int_equal(fct_simplifier_constrain(s, &marks), FCT_ERROR_DATA);
        run_to(s, grid.face_count - 4);
    }
    fct_simplifier_destroy(s);
    def.boundary_weight = 0;
    s = made(&own, &grid, &def);
    fct_constrain_def marks = fct_constrain_def_default();
    marks.contour = far_pair, marks.contour_count = 1;
    check_refused(s, marks, "a contour needs a boundary_weight above 0, found 0");
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &grid);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {cmocka_unit_test(painted_regions_keep_more_faces),
                                       cmocka_unit_test(paint_acts_between_runs),
                                       cmocka_unit_test(equal_weights_change_nothing),
                                       cmocka_unit_test(contours_stay),
                                       cmocka_unit_test(late_contours_have_the_same_planes),
                                       cmocka_unit_test(point_constraints_pull_by_their_quadric),
                                       cmocka_unit_test(pinned_points_stay),
                                       cmocka_unit_test(wishes_survive_the_way_back),
                                       cmocka_unit_test(runs_are_repeated_with_their_own_paint),
                                       cmocka_unit_test(bad_constraints_are_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
