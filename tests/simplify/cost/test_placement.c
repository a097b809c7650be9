/* Groups by brute force; positions, costs and attributes against one dense system over the position and the
 * attributes of all groups. */
#include "../oracle.h"
#include "simplify/cost/constraint.h"
#include "simplify/cost/placement.h"

static fct_env env;

enum { MAX_UNKNOWNS = 3 + SIMPLIFY_MAX_CHANNELS * 16 };

/* The sum that a contraction minimises: f(p, a_1 ... a_G) = sum over groups of Q_g(p, a_g) + ridge_g |a_g -
 * mean_g|^2 + the mean of the squared distances from the held planes, times the area and boundary_weight. */
typedef struct problem {
    const fct_simplifier *s;
    uint32_t count, wedges[16], group_of[16], groups; /* groups numbered by their first wedge */
    bool second[16];
    double mean[16][SIMPLIFY_MAX_CHANNELS], ridge[16], area, planes[POSITION_QUADRIC];
} problem;

static uint32_t list_wedges(const fct_simplifier *s, uint32_t point, uint32_t *out) {
    uint32_t count = 0;
    if (!s->corner_wedges) {
        out[0] = point;
        return 1;
    }
    for (uint32_t w = s->first_wedges[point]; w != FCT_NONE; w = s->next_wedges[w]) out[count++] = w;
    return count;
}

static uint32_t own_wedge(const fct_simplifier *s, uint32_t c) {
    return s->corner_wedges ? s->corner_wedges[c] : s->triangles[c];
}

/* The quadric of a wedge. If no attribute steers, those of the wedges of a point add up to that of the point.
 */
static void load_quadric(const fct_simplifier *s, uint32_t w, double q[MAX_QUADRIC]) {
    memset(q, 0, MAX_QUADRIC * sizeof *q);
    if (s->steering || !s->corner_wedges) {
        memcpy(q, wedge_quadric(s, w), s->quadric_size * sizeof *q);
        return;
    }
    for (uint32_t c = 0; c < 3 * s->mesh->face_count; ++c) {
        if (s->corner_wedges[c] != w) continue;
        v3 p[3];
        for (uint32_t k = 0; k < 3; ++k) p[k] = point_position(s, s->triangles[c - c % 3 + k]);
        v3 normal = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
        double twice = v3_norm(normal);
        quadric_add_plane(q, v3_scale(normal, 1 / twice), p[0], twice / 6);
        q[10] += twice / 6;
    }
}

static void join(problem *p, uint32_t u, uint32_t w) {
    uint32_t i = 0, j = 0;
    while (p->wedges[i] != u) ++i;
    while (p->wedges[j] != w) ++j;
    uint32_t from = p->group_of[j], to = p->group_of[i];
    for (uint32_t k = 0; k < p->count; ++k)
        if (p->group_of[k] == from) p->group_of[k] = to;
}

static problem make_problem(const fct_simplifier *s, uint32_t a, uint32_t b) {
    problem p = {.s = s};
    uint32_t first = list_wedges(s, a, p.wedges), numbers[16];
    p.count = first + list_wedges(s, b, p.wedges + first);
    for (uint32_t i = 0; i < p.count; ++i) p.group_of[i] = i, p.second[i] = i >= first;
    for (uint32_t f = 0; f < s->mesh->face_count; ++f)
        for (uint32_t k = 0; k < 3; ++k)
            for (uint32_t l = 0; l < 3; ++l)
                if (s->triangles[3 * f + k] == a && s->triangles[3 * f + l] == b)
                    join(&p, own_wedge(s, 3 * f + k), own_wedge(s, 3 * f + l));
    if (p.count == 2) join(&p, p.wedges[0], p.wedges[1]);
    memset(numbers, 0xff, sizeof numbers);
    for (uint32_t i = 0; i < p.count; ++i) {
        if (numbers[p.group_of[i]] == FCT_NONE) numbers[p.group_of[i]] = p.groups++;
    }
    for (uint32_t i = 0; i < p.count; ++i) p.group_of[i] = numbers[p.group_of[i]];
    for (uint32_t g = 0; g < p.groups; ++g) {
        uint32_t members = 0;
        double size = 0;
        for (uint32_t i = 0; i < p.count; ++i) {
            if (p.group_of[i] != g) continue;
            double q[MAX_QUADRIC];
            load_quadric(s, p.wedges[i], q);
            ++members;
            size += q[0] + q[3] + q[5] + q[10];
            p.area += q[10];
            for (uint32_t k = 0; k < s->channel_count; ++k)
                p.mean[g][k] += s->attributes[(size_t)s->channel_count * p.wedges[i] + k];
        }
        for (uint32_t k = 0; k < s->channel_count; ++k) p.mean[g][k] /= members;
        p.ridge[g] = s->steering ? s->def->regularization * size : 0;
    }
    for (int end = 0; end < 2; ++end) {
        const fct_constraint *held = constraint_at(s, end ? b : a);
        for (int k = 0; k < POSITION_QUADRIC && held; ++k) p.planes[k] += held->planes[k];
    }
    return p;
}

static double planes_at(const problem *p, v3 at) {
    return p->planes[10] > 0
               ? p->s->def->boundary_weight * p->area / p->planes[10] * quadric_at(p->planes, at)
               : 0;
}

/* f at the unknowns: the position, then the steering attributes of each group. */
static double evaluate(const problem *p, const double *x) {
    uint32_t m = p->s->steering;
    double value = planes_at(p, (v3){x[0], x[1], x[2]});
    for (uint32_t i = 0; i < p->count; ++i) {
        double q[MAX_QUADRIC];
        load_quadric(p->s, p->wedges[i], q);
        value += fct_quadric_value(q, m, (v3){x[0], x[1], x[2]}, x + 3 + m * p->group_of[i]);
    }
    for (uint32_t g = 0; g < p->groups; ++g)
        for (uint32_t k = 0; k < m; ++k) value += p->ridge[g] * pow(x[3 + m * g + k] - p->mean[g][k], 2);
    return value;
}

/* Minimises f + ridge |position - middle|^2 over the unknowns from `first` on. f is quadratic, so differences
 * give its matrix exactly. */
static void minimise(const problem *p, double ridge, v3 middle, uint32_t first, double *x) {
    uint32_t n = 3 + p->s->steering * p->groups, count = n - first;
    static double a[MAX_UNKNOWNS * MAX_UNKNOWNS], b[MAX_UNKNOWNS];
    double at[3];
    v3_to_array(middle, at);
    for (uint32_t i = first; i < n; ++i) x[i] = 0;
    double zero = evaluate(p, x), single[MAX_UNKNOWNS];
    for (uint32_t i = 0; i < count; ++i) {
        double *xi = x + first + i;
        *xi = 1, single[i] = evaluate(p, x);
        *xi = -1;
        double down = evaluate(p, x);
        *xi = 0;
        b[i] = -.5 * (single[i] - down), a[i * count + i] = single[i] + down - 2 * zero;
        if (first + i < 3) b[i] += 2 * ridge * at[i], a[i * count + i] += 2 * ridge;
    }
    for (uint32_t i = 0; i < count; ++i)
        for (uint32_t j = 0; j < i; ++j) {
            x[first + i] = x[first + j] = 1;
            a[i * count + j] = a[j * count + i] = evaluate(p, x) - single[i] - single[j] + zero;
            x[first + i] = x[first + j] = 0;
        }
    if (count) solve_dense((int)count, a, b);
    for (uint32_t i = 0; i < count; ++i) x[first + i] = b[i];
}

/* r(position): f with the best attributes. */
static double reduced(const problem *p, v3 at) {
    double x[MAX_UNKNOWNS];
    v3_to_array(at, x);
    minimise(p, 0, at, 3, x);
    return evaluate(p, x);
}

static v3 along_axis(v3 at, int axis, double step) {
    return (v3){at.x + (axis == 0) * step, at.y + (axis == 1) * step, at.z + (axis == 2) * step};
}

/* Second derivative of r along two axes, halved: an element of A. */
static double curvature(const problem *p, v3 at, int i, int j) {
    v3 up = along_axis(at, i, .5), down = along_axis(at, i, -.5);
    return .5 * (reduced(p, along_axis(up, j, .5)) - reduced(p, along_axis(up, j, -.5)) -
                 reduced(p, along_axis(down, j, .5)) + reduced(p, along_axis(down, j, -.5)));
}

static double trace_of(const problem *p) {
    v3 zero = {0, 0, 0};
    return curvature(p, zero, 0, 0) + curvature(p, zero, 1, 1) + curvature(p, zero, 2, 2);
}

/* The minimum of r + ridge |p - middle|^2 on the segment: a parabola through three points. */
static v3 best_on_segment(const problem *p, v3 a, v3 b, double ridge) {
    v3 middle = v3_scale(v3_add(a, b), .5), side = v3_sub(b, a);
    double low = reduced(p, a), mid = reduced(p, middle), high = reduced(p, b);
    double square = 2 * (low + high - 2 * mid) + ridge * v3_norm2(side), t = -.5 * (high - low) / square;
    return v3_mad(middle, t < -.5 ? -.5 : t > .5 ? .5 : t, side);
}

static void assert_near(v3 got, v3 want, double tolerance) {
    if (v3_norm(v3_sub(got, want)) <= tolerance) return;
    print_error("at (%g, %g, %g), expected (%g, %g, %g)\n", got.x, got.y, got.z, want.x, want.y, want.z);
    fail();
}

static uint32_t reached, fallen_back; /* by the optimum; by the segment */

static v3 expected_position(const problem *p, v3 a, v3 b, bool ends_only, double ridge) {
    fct_placement policy = p->s->def->placement;
    v3 middle = v3_scale(v3_add(a, b), .5), best = a;
    if (ends_only || policy == FCT_PLACE_ENDS || policy == FCT_PLACE_SUBSET) {
        if (reduced(p, b) < reduced(p, best)) best = b;
        if (policy != FCT_PLACE_SUBSET && reduced(p, middle) < reduced(p, best)) best = middle;
        return best;
    }
    if (policy == FCT_PLACE_OPTIMAL) {
        double x[MAX_UNKNOWNS];
        minimise(p, ridge, middle, 0, x);
        v3 at = {x[0], x[1], x[2]};
        if (v3_norm(v3_sub(at, middle)) <= 2 * v3_norm(v3_sub(b, a))) {
            ++reached;
            return at;
        }
        ++fallen_back;
    }
    return best_on_segment(p, a, b, ridge);
}

static void check_attributes(fct_simplifier *s, const problem *p, const fct_candidate *candidate, v3 a, v3 b,
                             const fct_groups *groups) {
    double x[MAX_UNKNOWNS];
    v3_to_array(candidate->at, x);
    minimise(p, 0, candidate->at, 3, x);
    v3 side = v3_sub(b, a);
    double t = fmin(fmax(v3_dot(v3_sub(candidate->at, a), side) / v3_norm2(side), 0), 1);
    for (uint32_t g = 0; g < p->groups; ++g) {
        const double *ends[2];
        for (int end = 0; end < 2; ++end) {
            uint32_t chosen = FCT_NONE;
            for (uint32_t i = 0; i < p->count; ++i)
                if (p->group_of[i] == g && p->second[i] == (end == 1) && chosen == FCT_NONE) chosen = i;
            for (uint32_t i = 0; i < p->count && chosen == FCT_NONE; ++i)
                if (p->group_of[i] == g) chosen = i;
            ends[end] = s->attributes + (size_t)s->channel_count * p->wedges[chosen];
        }
        double got[SIMPLIFY_MAX_CHANNELS];
        fct_place_attributes(s, groups, g, candidate, a, b, got);
        for (uint32_t k = 0; k < s->channel_count; ++k) {
            double want = ends[0][k] + t * (ends[1][k] - ends[0][k]);
            if (k < s->steering) want = x[3 + s->steering * g + k];
            if (k < s->steering) want = fmin(fmax(want, s->channels[k].lower), s->channels[k].upper);
            if (s->def->placement == FCT_PLACE_SUBSET) want = ends[candidate->end][k];
            assert_close(got[k], want, 1e-6);
        }
    }
}

/* The cost of taking one end with its attributes. */
static double subset_error(const problem *p, uint32_t end, v3 at) {
    double x[MAX_UNKNOWNS];
    problem plain = *p;
    v3_to_array(at, x);
    for (uint32_t g = 0; g < p->groups; ++g) {
        uint32_t chosen = FCT_NONE;
        for (uint32_t i = p->count; i-- > 0;)
            if (p->group_of[i] == g &&
                (chosen == FCT_NONE || p->second[i] == (end == 1) || p->second[chosen] != (end == 1)))
                chosen = i;
        for (uint32_t k = 0; k < p->s->steering; ++k)
            x[3 + p->s->steering * g + k] =
                p->s->attributes[(size_t)p->s->channel_count * p->wedges[chosen] + k];
        plain.ridge[g] = 0;
    }
    return evaluate(&plain, x);
}

/* The squared distances of `at` from the planes of the faces around both ends, times a third of their areas
 * for each corner there. Attributes have no part in it. */
static double face_distance2(const fct_simplifier *s, const uint32_t ends[2], v3 at) {
    double sum = 0;
    for (uint32_t c = 0; c < 3 * s->mesh->face_count; ++c) {
        if (s->triangles[c] != ends[0] && s->triangles[c] != ends[1]) continue;
        v3 p[3];
        for (uint32_t k = 0; k < 3; ++k) p[k] = point_position(s, s->triangles[c - c % 3 + k]);
        v3 normal = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
        double twice = v3_norm(normal), away = v3_dot(normal, v3_sub(at, p[0])) / twice;
        sum += twice / 6 * away * away;
    }
    return sum;
}

static void check_edge(fct_simplifier *s, uint32_t e, bool ends_only) {
    uint32_t ends[2] = {s->edges[e].ends[0], s->edges[e].ends[1]};
    v3 a = point_position(s, ends[0]), b = point_position(s, ends[1]);
    problem p = make_problem(s, ends[0], ends[1]);
    fct_candidate got;
    assert_true(fct_place(s, ends[0], ends[1], ends_only, &got));
    double trace = trace_of(&p), ridge = s->def->regularization * trace;
    if (s->def->placement == FCT_PLACE_SUBSET && s->steering) {
        double errors[2] = {subset_error(&p, 0, a), subset_error(&p, 1, b)};
        assert_int_equal(got.end, errors[1] < errors[0]);
        assert_close(got.error, fmin(errors[0], errors[1]), 1e-9);
    } else {
        assert_near(got.at, expected_position(&p, a, b, ends_only, ridge), 1e-5);
        assert_close(got.error, reduced(&p, got.at), 1e-9);
    }
    double weight = s->def->boundary_weight, held = weight > 0 ? planes_at(&p, got.at) / weight : 0;
    assert_close(got.distance2, face_distance2(s, ends, got.at) + held, 1e-9);
    if (got.end < 2) assert_near(got.at, got.end ? b : a, 0);
    assert_close(got.area, p.area, 1e-12);
    double reach = v3_norm2(v3_sub(got.at, a)) + v3_norm2(v3_sub(got.at, b));
    assert_close(got.key, got.error + .5 * ridge * reach, 1e-9);
    static const int axes[6][2] = {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}};
    for (int k = 0; k < 6; ++k)
        assert_close(got.quadric[k], curvature(&p, (v3){0, 0, 0}, axes[k][0], axes[k][1]), 1e-7);
    if (!s->corner_wedges) return;
    fct_groups groups;
    assert_true(fct_groups_find(s, ends[0], ends[1], &groups));
    assert_int_equal(groups.wedge_count, p.count);
    assert_int_equal(groups.group_count, p.groups);
    for (uint32_t i = 0; i < p.count; ++i) {
        assert_int_equal(groups.wedges[i], p.wedges[i]);
        assert_int_equal(groups.group_of[i], p.group_of[i]);
        assert_int_equal(groups.second[i], p.second[i]);
    }
    check_attributes(s, &p, &got, a, b, &groups);
    for (int out = 0; out < 2 && !s->steering; ++out) { /* beyond an end: the attributes of that end */
        fct_candidate beyond = got;
        beyond.at = v3_mad(a, out ? 1.5 : -.5, v3_sub(b, a));
        check_attributes(s, &p, &beyond, a, b, &groups);
    }
}

/* Rolls the sheet to a part of a cone. All its planes meet in the apex, which is far from every edge. */
static void roll_to_cone(fct_mesh *mesh) {
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) {
        float *p = mesh->positions + 3 * v;
        double turn = .4 * (p[0] - 5), height = 6 + .5 * p[1];
        p[0] = (float)(height * cos(turn)), p[1] = (float)(height * sin(turn)), p[2] = (float)height;
    }
}

static void candidates_solve_the_dense_system(void **state) {
    (void)state;
    const unsigned arrays[] = {0, FCT_MESH_COLORS, FCT_MESH_COLORS | FCT_MESH_TEXCOORDS};
    reached = fallen_back = 0;
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; ++i)
        for (int policy = FCT_PLACE_OPTIMAL; policy <= FCT_PLACE_SUBSET; ++policy)
            for (int kind = 0; kind < 4; ++kind) {
                fct_mesh mesh = make_sheet(&env, arrays[i], 21 + i);
                if (kind == 3) roll_to_cone(&mesh);
                fct_simplify_def def = fct_simplify_def_default();
                def.placement = (fct_placement)policy;
                def.regularization = kind == 1 ? .1 : kind == 3 ? 1e-9 : 1e-5;
                def.boundary_weight = kind == 3 ? 0 : kind == 2 ? .5 : 4;
                def.color_weight = def.texcoord_weight = kind == 2 ? 0 : 1;
                fct_simplifier *s = open_simplifier(&env, &mesh, &def);
                for (uint32_t e = 0; e < s->edge_count; ++e) {
                    check_edge(s, e, false);
                    if (kind == 1) check_edge(s, e, true);
                }
                fct_simplifier_destroy(s);
                fct_mesh_release(&env, &mesh);
            }
    assert_true(reached > 200 && fallen_back > 5);
}

/* Two coplanar faces leave the edge free in their plane: the point stays at the midpoint. */
static void free_directions_stay_at_the_midpoint(void **state) {
    (void)state;
    fct_mesh mesh = make_grid(&env, 4);
    fct_simplify_def def = fct_simplify_def_default();
    def.boundary_weight = 0;
    fct_simplifier *s = open_simplifier(&env, &mesh, &def);
    for (uint32_t e = 0; e < s->edge_count; ++e) {
        fct_candidate got;
        v3 a = point_position(s, s->edges[e].ends[0]), b = point_position(s, s->edges[e].ends[1]);
        assert_true(fct_place(s, s->edges[e].ends[0], s->edges[e].ends[1], false, &got));
        assert_near(got.at, v3_scale(v3_add(a, b), .5), 1e-9);
        /* gamma trace |b - a|^2 / 4, where the trace is the area */
        assert_ratio(got.key, def.regularization * got.area * v3_norm2(v3_sub(b, a)) / 4, 1e-6);
    }
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &mesh);
}

/* The new point of a side of a bumpy grid lies on the side, at the minimum of the sum along it. */
static void points_of_a_line_slide_along_it(void **state) {
    (void)state;
    fct_mesh grid = make_grid(&env, 4);
    uint64_t seed = 5;
    for (uint32_t v = 5; v < 25; ++v) grid.positions[3 * v + 2] = (float)between(&seed, 0, .1);
    fct_simplify_def def = fct_simplify_def_default();
    for (int policy = FCT_PLACE_OPTIMAL; policy <= FCT_PLACE_SUBSET; ++policy) {
        def.placement = (fct_placement)policy;
        fct_simplifier *s = open_simplifier(&env, &grid, &def);
        for (uint32_t e = 0; e < s->edge_count; ++e) {
            uint32_t ends[2] = {s->edges[e].ends[0], s->edges[e].ends[1]};
            fct_joint joint;
            if (!fct_constraint_join(s, ends[0], ends[1], &joint) || joint.held.hold == HOLD_PLANES) continue;
            v3 a = point_position(s, ends[0]), b = point_position(s, ends[1]);
            fct_candidate got;
            assert_true(fct_place(s, ends[0], ends[1], false, &got));
            problem p = make_problem(s, ends[0], ends[1]);
            assert_close(got.error, reduced(&p, got.at), 1e-12);
            if (joint.held.hold == HOLD_POINT || policy != FCT_PLACE_OPTIMAL) {
                bool second = !joint.ends[0] || (joint.ends[1] && reduced(&p, b) < reduced(&p, a));
                assert_int_equal(got.end, second);
                assert_near(got.at, second ? b : a, 0);
                continue;
            }
            v3 d = s->lines[joint.held.line].direction, end = joint.ends[0] ? a : b;
            assert_near(v3_cross(v3_sub(got.at, end), d), (v3){0, 0, 0}, 1e-15);
            double here = reduced(&p, got.at);
            if (v3_norm(v3_sub(got.at, v3_scale(v3_add(a, b), .5))) > 1.99 * v3_norm(v3_sub(b, a))) continue;
            for (int side = -1; side <= 1 && got.end == 2; side += 2)
                assert_true(reduced(&p, v3_mad(got.at, .01 * side, d)) > here);
        }
        fct_simplifier_destroy(s);
    }
    fct_mesh_release(&env, &grid);
}

static void a_hub_does_not_move(void **state) {
    (void)state;
    enum { N = SIMPLIFY_HUB + 1 };
    fct_mesh fan;
    assert_int_equal(fct_mesh_create(&env, N + 1, N, 0, &fan), FCT_OK);
    for (uint32_t i = 0; i < N; ++i) {
        double turn = 6.283185307179586 * i / N;
        float p[3] = {(float)cos(turn), (float)sin(turn), 0};
        uint32_t t[3] = {N, i, (i + 1) % N};
        memcpy(fan.positions + 3 * i, p, sizeof p);
        memcpy(fan.triangles + 3 * i, t, sizeof t);
    }
    float top[3] = {0, 0, 1};
    memcpy(fan.positions + 3 * N, top, sizeof top);
    for (int smaller = 0; smaller < 2; ++smaller) {
        fan.face_count = N - (uint32_t)smaller;
        fct_simplify_def def = fct_simplify_def_default();
        fct_simplifier *s = open_simplifier(&env, &fan, &def);
        uint32_t hub = s->point_of[N];
        fct_candidate got;
        for (int order = 0; order < 2; ++order) {
            uint32_t other = s->point_of[40];
            assert_true(fct_place(s, order ? other : hub, order ? hub : other, false, &got));
            bool stays = v3_norm(v3_sub(got.at, point_position(s, hub))) == 0;
            assert_true(stays == !smaller);
            if (!smaller) assert_int_equal(got.end, order);
        }
        fct_simplifier_destroy(s);
    }
    fct_mesh_release(&env, &fan);
}

/* The first wedge of a group at an end, or its first wedge if it has none there: all groups of three of four
 * wedges. */
static void a_group_has_the_attributes_of_its_end(void **state) {
    (void)state;
    double attributes[4] = {10, 11, 12, 13};
    fct_simplifier s = {.attributes = attributes, .channel_count = 1};
    for (uint32_t bits = 0; bits < 16; ++bits)
        for (uint32_t other = 0; other < 4; ++other)
            for (uint32_t end = 0; end < 2; ++end) {
                fct_groups g = {.wedge_count = 4, .group_count = 2, .wedges = {0, 1, 2, 3}};
                uint32_t first = FCT_NONE, at_end = FCT_NONE;
                for (uint32_t i = 4; i-- > 0;) {
                    g.second[i] = bits >> i & 1, g.group_of[i] = i == other;
                    if (i == other) continue;
                    first = i;
                    if ((bits >> i & 1) == end) at_end = i;
                }
                double wanted = attributes[at_end == FCT_NONE ? first : at_end];
                assert_true(*fct_groups_end(&s, &g, 0, end) == wanted);
            }
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(candidates_solve_the_dense_system),
        cmocka_unit_test(free_directions_stay_at_the_midpoint),
        cmocka_unit_test(points_of_a_line_slide_along_it),
        cmocka_unit_test(a_hub_does_not_move),
        cmocka_unit_test(a_group_has_the_attributes_of_its_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
