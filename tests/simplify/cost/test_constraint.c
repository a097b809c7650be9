/* The planes that hold each point against the direct sum over its held sides; the lines of straight curves;
 * and the rules for two held points. */
#include "../oracle.h"
#include "simplify/cost/constraint.h"

static fct_env env;

/* Whether corner d begins a side between the same two points as side c; *same_way: in the same direction. */
static bool side_is_shared(const fct_simplifier *s, uint32_t c, uint32_t d, bool *same_way) {
    const uint32_t *t = s->triangles;
    uint32_t c2 = c - c % 3 + (c + 1) % 3, d2 = d - d % 3 + (d + 1) % 3;
    *same_way = t[c] == t[d] && t[c2] == t[d2];
    return *same_way || (t[c] == t[d2] && t[c2] == t[d]);
}

static double gap_between(const fct_simplifier *s, uint32_t c, uint32_t d) {
    double sum = 0;
    for (uint32_t i = 0; i < s->channel_count; ++i) {
        double low = INFINITY, high = -INFINITY;
        for (uint32_t k = 0; k < 3 * s->mesh->face_count; ++k) {
            double value = raw_value(s->mesh, &s->channels[i], k);
            low = fmin(low, value), high = fmax(high, value);
        }
        double difference = raw_value(s->mesh, &s->channels[i], c) - raw_value(s->mesh, &s->channels[i], d);
        if (s->channels[i].source == CHANNEL_COLOR) /* the range that scales the colours */
            low = 0, high = s->channels[i].unit / s->channels[i].factor;
        if (high > low) sum += difference * difference / ((high - low) * (high - low));
    }
    return fmin(sum, 1);
}

static bool faces_have_a_border(const fct_mesh *mesh, uint32_t f, uint32_t g, double threshold) {
    double sum = 0;
    for (int k = 0; k < 3 && mesh->face_colors; ++k)
        sum += fabs((double)mesh->face_colors[3 * f + k] - mesh->face_colors[3 * g + k]);
    return (mesh->materials && mesh->materials[f] != mesh->materials[g]) || sum > threshold;
}

/* 1 at boundaries and borders, the squared gap at seams, else 0. */
static double side_strength(const fct_simplifier *s, uint32_t c) {
    const fct_mesh *mesh = s->mesh;
    double strength = 0;
    bool open = true;
    uint32_t c2 = c - c % 3 + (c + 1) % 3;
    for (uint32_t d = 0; d < 3 * mesh->face_count; ++d) {
        bool same_way;
        if (d / 3 == c / 3 || !side_is_shared(s, c, d, &same_way)) continue;
        uint32_t d2 = d - d % 3 + (d + 1) % 3, apex_c = c - c % 3 + (c + 2) % 3,
                 apex_d = d - d % 3 + (d + 2) % 3;
        if (s->triangles[apex_c] != s->triangles[apex_d]) open = false;
        if (faces_have_a_border(mesh, c / 3, d / 3, s->def->feature_threshold)) strength = 1;
        if (!s->channel_count) continue;
        strength = fmax(strength, gap_between(s, c, same_way ? d : d2));
        strength = fmax(strength, gap_between(s, c2, same_way ? d2 : d));
    }
    return open ? 1 : strength;
}

/* The squared distances of p from the planes through the held sides at a point, times strength and length.
 * *length: the sum of the lengths. */
static double direct_sum(const fct_simplifier *s, uint32_t point, v3 p, double *length) {
    double sum = 0;
    *length = 0;
    for (uint32_t c = 0; c < 3 * s->mesh->face_count; ++c) {
        uint32_t f = c - c % 3, next = f + (c + 1) % 3;
        if (s->triangles[c] != point && s->triangles[next] != point) continue;
        v3 corner[3];
        for (uint32_t k = 0; k < 3; ++k) corner[k] = scaled_vertex(s->mesh, s->mesh->triangles[f + k]);
        v3 normal = v3_cross(v3_sub(corner[1], corner[0]), v3_sub(corner[2], corner[0]));
        double strength = side_strength(s, c);
        if (strength == 0 || v3_norm(normal) == 0) continue;
        v3 side = v3_sub(corner[next - f], corner[c - f]), across = v3_unit(v3_cross(v3_unit(normal), side));
        sum += strength * v3_norm(side) * pow(v3_dot(across, v3_sub(p, corner[c - f])), 2);
        *length += v3_norm(side);
    }
    return sum;
}

static void check_points(const fct_mesh *mesh, const fct_simplify_def *def) {
    fct_simplifier *s = open_simplifier(&env, mesh, def);
    uint64_t seed = 7;
    for (uint32_t p = 0; p < s->point_count; ++p) {
        const fct_constraint *held = constraint_at(s, p);
        for (int k = 0; k < 3; ++k) {
            v3 at = v3_scale(random_vector(&seed), .6);
            double length, want = direct_sum(s, p, at, &length);
            assert_true(held || length == 0);
            if (!held) continue;
            if (length == 0) assert_true(constraint_weight(s, held, 2) == 0);
            if (length == 0) continue;
            assert_ratio(quadric_at(held->planes, at), want, 1e-6);
            assert_ratio(held->planes[10], length, 1e-9);
            assert_ratio(constraint_weight(s, held, 2), def->boundary_weight * 2 / length, 1e-9);
        }
    }
    fct_simplifier_destroy(s);
}

static void planes_are_direct_sums(void **state) {
    (void)state;
    for (size_t i = 0; i < ARRAY_SETS; ++i)
        for (int kind = 0; kind < 2; ++kind) {
            fct_mesh mesh = make_sheet(&env, array_sets[i], 11 + i);
            fct_simplify_def def = fct_simplify_def_default();
            if (kind == 1) def.color_weight = .7, def.texcoord_weight = .3, def.normal_weight = 0;
            check_points(&mesh, &def);
            fct_mesh_release(&env, &mesh);
        }
}

/* A seam from black to white differs by more than 1 in sum, and is held like a boundary. */
static void strong_seams_are_held_like_boundaries(void **state) {
    (void)state;
    fct_mesh mesh = make_sheet(&env, FCT_MESH_COLORS, 13);
    for (uint32_t v = 25; v < 30; ++v)
        for (uint32_t k = 0; k < 3; ++k)
            mesh.colors[3 * v + k] = 1, mesh.colors[3 * ((v - 25) * 5 + 2) + k] = 0;
    fct_simplify_def def = fct_simplify_def_default();
    check_points(&mesh, &def);
    fct_mesh_release(&env, &mesh);
}

/* A duplicate of a boundary face leaves its open sides open; a face without area adds nothing. */
static void duplicates_and_slivers(void **state) {
    (void)state;
    fct_mesh mesh = make_slivers(&env);
    fct_simplify_def def = fct_simplify_def_default();
    check_points(&mesh, &def);
    fct_mesh_release(&env, &mesh);
}

/* The sides of a grid of 4 x 4 squares are lines between its corners. One point is moved out of its side,
 * which makes two lines beside it, one of a single point:
 *
 *     P---l---l---l---P
 *     l               l
 *     l               P
 *     l                o   moved to the right: it lies on no line
 *     P---l---l---l---P
 */
static void straight_sides_are_lines(void **state) {
    (void)state;
    for (int moved = 0; moved < 2; ++moved) {
        fct_mesh grid = make_grid(&env, 4);
        if (moved) grid.positions[3 * 9] += .1f;
        fct_simplify_def def = fct_simplify_def_default();
        fct_simplifier *s = open_simplifier(&env, &grid, &def);
        assert_int_equal(s->line_count, 4);
        for (uint32_t v = 0; v < 25; ++v) {
            const fct_constraint *held = constraint_at(s, s->point_of[v]);
            bool x = v % 5 == 0 || v % 5 == 4, y = v / 5 == 0 || v / 5 == 4;
            assert_true((held != NULL) == (x || y));
            if (!held) continue;
            int hold = x && y ? HOLD_POINT : HOLD_LINE;
            if (moved && v == 9) hold = HOLD_PLANES;
            if (moved && v == 14) hold = HOLD_POINT;
            if (moved && v == 4) hold = HOLD_POINT;
            assert_int_equal(held->hold, hold);
            if (hold != HOLD_LINE) continue;
            const fct_line *line = &s->lines[held->line];
            assert_close(fabs(x ? line->direction.y : line->direction.x), 1, 1e-12);
            v3 from = v3_sub(point_position(s, s->point_of[v]), line->origin);
            assert_true(v3_norm(v3_cross(from, line->direction)) < 1e-7);
        }
        fct_simplifier_destroy(s);
        fct_mesh_release(&env, &grid);
    }
}

/* An arc of so many edges that every point seems straight: no line leaves the arc by more than a rounding
 * error. */
static void a_fine_arc_is_not_one_line(void **state) {
    (void)state;
    enum { N = 20000 };
    fct_mesh fan;
    assert_int_equal(fct_mesh_create(&env, N + 2, N, 0, &fan), FCT_OK);
    for (uint32_t i = 0; i <= N; ++i) {
        double turn = 1.5 * i / N;
        const float p[3] = {(float)cos(turn), (float)sin(turn), 0};
        memcpy(fan.positions + 3 * i, p, sizeof p);
    }
    memset(fan.positions + 3 * (N + 1), 0, 12);
    for (uint32_t i = 0; i < N; ++i) {
        const uint32_t t[3] = {N + 1, i, i + 1};
        memcpy(fan.triangles + 3 * i, t, sizeof t);
    }
    fct_simplify_def def = fct_simplify_def_default();
    fct_simplifier *s = open_simplifier(&env, &fan, &def);
    assert_in_range(s->line_count, 100, N / 2);
    for (uint32_t i = 1; i < N; ++i) {
        const fct_constraint *held = constraint_at(s, s->point_of[i]);
        assert_int_not_equal(held->hold, HOLD_POINT);
        if (held->hold != HOLD_LINE) continue;
        const fct_line *line = &s->lines[held->line];
        v3 from = v3_sub(point_position(s, s->point_of[i]), line->origin);
        assert_true(v3_norm(v3_cross(from, line->direction)) < 1e-6);
    }
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &fan);
}

static void check_joint(fct_simplifier *s, uint32_t v, uint32_t w, int hold, bool first, bool second) {
    fct_joint joint;
    uint32_t a = s->point_of[v], b = s->point_of[w];
    assert_true(fct_constraint_join(s, a, b, &joint));
    assert_int_equal(joint.held.hold, hold);
    assert_true(joint.ends[0] == first && joint.ends[1] == second);
    const fct_constraint *parts[2] = {constraint_at(s, a), constraint_at(s, b)};
    for (int k = 0; k < POSITION_QUADRIC; ++k) {
        double sum = 0;
        for (int i = 0; i < 2; ++i) sum += parts[i] ? parts[i]->planes[k] : 0;
        assert_close(joint.held.planes[k], sum, 1e-12);
    }
    if (hold != HOLD_LINE) return;
    const fct_constraint *from = parts[0] && parts[0]->hold == HOLD_LINE ? parts[0] : parts[1];
    assert_int_equal(joint.held.line, from->line);
}

/* Vertices of the grid: 0 and 4 are corners of the lower side, 24 and 20 of the upper one. */
static void two_held_points_keep_what_both_obey(void **state) {
    (void)state;
    fct_mesh grid = make_grid(&env, 4);
    fct_simplify_def def = fct_simplify_def_default();
    fct_simplifier *s = open_simplifier(&env, &grid, &def);
    fct_joint joint;
    assert_false(fct_constraint_join(s, s->point_of[6], s->point_of[7], &joint));
    const struct {
        uint32_t v, w;
        int hold;
        bool first, second;
    } cases[] = {
        {1, 2, HOLD_LINE, true, true},    {1, 6, HOLD_LINE, true, false},  {6, 1, HOLD_LINE, false, true},
        {0, 1, HOLD_POINT, true, false},  {1, 0, HOLD_POINT, false, true}, {0, 6, HOLD_POINT, true, false},
        {6, 0, HOLD_POINT, false, true},  {1, 5, HOLD_PLANES, true, true}, {0, 4, HOLD_PLANES, true, true},
        {24, 1, HOLD_PLANES, true, true}, {1, 24, HOLD_PLANES, true, true}};
    for (size_t i = 0; i < FCT_LENGTH(cases); ++i)
        check_joint(s, cases[i].v, cases[i].w, cases[i].hold, cases[i].first, cases[i].second);
    fct_constraint_merge(s, s->point_of[6], s->point_of[1]);
    assert_int_equal(constraint_at(s, s->point_of[6])->hold, HOLD_LINE);
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &grid);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(planes_are_direct_sums),     cmocka_unit_test(strong_seams_are_held_like_boundaries),
        cmocka_unit_test(duplicates_and_slivers),     cmocka_unit_test(straight_sides_are_lines),
        cmocka_unit_test(a_fine_arc_is_not_one_line), cmocka_unit_test(two_held_points_keep_what_both_obey),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
