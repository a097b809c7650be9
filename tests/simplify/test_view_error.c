/* What a view measures: pixels beside projections, sides beside normals, bounds beside an oracle, and the
 * distance on the screen between a cut and the finest level. */
#include "screen.h"

static fct_env env;

static fct_cut_view frame_of(const fct_view *view) {
    static const double origin[3] = {0, 0, 0};
    fct_cut_view frame;
    assert_int_equal(fct_cut_read_view(&env, view, origin, &frame), FCT_OK);
    return frame;
}

static v3 random_unit(uint64_t *seed) {
    v3 x;
    do x = random_vector(seed);
    while (v3_norm(x) > 1 || v3_norm(x) < .1);
    return v3_unit(x);
}

/* A point in the picture at a distance. */
static v3 random_place(uint64_t *seed, const fct_view *view, double distance) {
    v3 eye = {view->position[0], view->position[1], view->position[2]}, x;
    do x = v3_mad(eye, distance, random_unit(seed));
    while (!in_picture(view, x));
    return x;
}

/* Short lengths at places of a sphere have at most the pixels of the bound; at small spheres some have nearly
 * as many. */
static void pixels_bound_projections(void **state) {
    (void)state;
    uint64_t seed = 1;
    for (int i = 0; i < 300; ++i) {
        fct_view view = random_view(&seed, v3_make(0, 0, 0), 2);
        fct_cut_view frame = frame_of(&view);
        double distance = between(&seed, .5, 3), radius = i % 2 ? 1e-3 : between(&seed, .1, .9) * distance;
        v3 center = random_place(&seed, &view, distance);
        fct_bound bound = {
            .radius = (float)radius, .error = (float)(1e-5 * radius), .low = {-1, -1, -1}, .high = {1, 1, 1}};
        v3_store(bound.center, center);
        fct_cut_error e = fct_cut_measure(&frame, &bound);
        double most = 0, size = 0, p[2], q[2], r[2];
        for (int k = 0; k < 3000; ++k) {
            v3 x = v3_mad(center, .999 * radius * cbrt(uniform(&seed)), random_unit(&seed));
            v3 y = v3_mad(x, (double)bound.error, random_unit(&seed));
            if (!in_picture(&view, x) || !project(&view, y, q) || !project(&view, x, p)) continue;
            most = fmax(most, hypot(p[0] - q[0], p[1] - q[1]));
            if (project(&view, center, r)) size = fmax(size, 2 * hypot(p[0] - r[0], p[1] - r[1]));
        }
        assert_true(most <= e.pixels * 1.001);
        assert_false(e.hidden);
        assert_true(e.limit == view.silhouette_tolerance);
        if (i % 2 == 0) continue;
        assert_ratio(most, e.pixels, .02);
        assert_ratio(e.extent, e.pixels * 2e5, 1e-5);
        assert_true(size <= e.extent * 1.02);
    }
}

/* A sphere is outside if none of its points is in the picture, up to the corners of the picture. */
static void spheres_are_outside_of_the_picture(void **state) {
    (void)state;
    uint64_t seed = 2;
    uint32_t outside = 0, found = 0;
    for (int i = 0; i < 2000; ++i) {
        fct_view view = random_view(&seed, v3_make(0, 0, 0), 2);
        view.outside_factor = 3;
        fct_cut_view frame = frame_of(&view);
        v3 center = v3_scale(random_unit(&seed), between(&seed, 0, 8));
        fct_bound bound = {
            .radius = (float)between(&seed, .01, 2), .error = 1e-4f, .low = {-1, -1, -1}, .high = {1, 1, 1}};
        v3_store(bound.center, center);
        fct_cut_error e = fct_cut_measure(&frame, &bound);
        bool seen = false;
        for (int k = 0; k < 500 && !seen; ++k)
            seen = in_picture(
                &view, v3_mad(center, (double)bound.radius * cbrt(uniform(&seed)), random_unit(&seed)));
        assert_false(seen && e.hidden);
        v3 from = v3_sub(center, v3_make(view.position[0], view.position[1], view.position[2]));
        double half = view.vertical_fov * 3.14159265358979 / 360, z = v3_dot(from, frame.forward),
               wide = atan(tan(half) * view.width / view.height),
               away = fmax(fabs(v3_dot(from, frame.right)) * cos(wide) - z * sin(wide),
                           fabs(v3_dot(from, frame.up)) * cos(half) - z * sin(half));
        assert_int_equal(e.hidden, fmax(away, -z) > (double)bound.radius);
        assert_ratio(e.limit, view.silhouette_tolerance * (e.hidden ? 3 : 1), 1e-12);
        outside += e.hidden, found += !seen;
        if (!e.hidden) continue;
        v3 eye = {view.position[0], view.position[1], view.position[2]};
        double near = v3_norm(v3_sub(center, eye)) - (double)bound.radius;
        assert_ratio(e.pixels, near > 0 ? frame.focal * 1e-4 / near : INFINITY, 1e-4);
    }
    assert_true(outside > .9 * found && outside > 500);
}

/* A sphere is seen from one side only if each normal of the box is, from each of its points: the extreme ones
 * are corners of the box. */
static void sides_are_those_of_all_normals(void **state) {
    (void)state;
    uint64_t seed = 3;
    uint32_t sides[3] = {0};
    for (int i = 0; i < 3000; ++i) {
        fct_view view = random_view(&seed, v3_make(0, 0, 0), 2);
        view.tolerance = 1, view.silhouette_tolerance = .25, view.back_factor = 10, view.outside_factor = 1;
        fct_cut_view frame = frame_of(&view);
        v3 eye = {view.position[0], view.position[1], view.position[2]};
        v3 center = v3_mad(eye, between(&seed, .5, 2), random_unit(&seed)), axis = random_unit(&seed);
        double spread = between(&seed, 0, .6), radius = between(&seed, 0, .7), least = 9, most = -9;
        fct_bound bound = {.radius = (float)radius};
        v3_store(bound.center, center);
        v3_store(bound.low, v3_sub(axis, v3_scale(v3_make(1, .7, .4), spread)));
        v3_store(bound.high, v3_add(axis, v3_scale(v3_make(.3, 1, .5), spread)));
        for (int k = 0; k < 8; ++k) {
            v3 normal = {k & 1 ? bound.low[0] : bound.high[0], k & 2 ? bound.low[1] : bound.high[1],
                         k & 4 ? bound.low[2] : bound.high[2]};
            double middle = v3_dot(normal, v3_sub(center, eye));
            least = fmin(least, middle - radius), most = fmax(most, middle + radius);
        }
        fct_cut_error e = fct_cut_measure(&frame, &bound);
        int side = e.limit == .25 ? 0 : e.limit == 10 ? 1 : e.limit == 1 ? -1 : 2;
        assert_in_range(side + 1, 0, 2);
        ++sides[side + 1];
        if (fabs(least) > 1e-5 && fabs(most) > 1e-5)
            assert_int_equal(side, least > 0 ? 1 : most < 0 ? -1 : 0);
    }
    assert_true(sides[0] > 200 && sides[2] > 200 && sides[1] > 200);
}

/* The distance from x to a triangle: a minimum over a fine grid of its points, refined twice. */
static double search_face(v3 x, const v3 t[3]) {
    double u = .5, v = .5, step = .5, least = INFINITY;
    for (int round = 0; round < 12; ++round, step *= .4) {
        double at_u = u, at_v = v;
        for (int i = -4; i <= 4; ++i)
            for (int j = -4; j <= 4; ++j) {
                double a = fmin(fmax(at_u + i * step / 4, 0), 1), b = fmin(fmax(at_v + j * step / 4, 0), 1);
                if (a + b > 1) a /= a + b, b = 1 - a;
                v3 p = v3_add(v3_scale(t[0], 1 - a - b), v3_add(v3_scale(t[1], a), v3_scale(t[2], b)));
                double d = v3_norm(v3_sub(p, x));
                if (d < least) least = d, u = a, v = b;
            }
    }
    return least;
}

/* Repeats the contractions with a list of samples per face, by the definition in deviation.h. */
typedef struct oracle {
    fct_progressive *m;
    uint32_t *states, *face_of, *nodes; /* per point; FCT_NONE: none */
    double *errors;                     /* per step, with those below it in the tree */
} oracle;

static void load_corners(const oracle *o, uint32_t step, uint32_t f, v3 out[3]) {
    for (uint32_t k = 0; k < 3; ++k)
        out[k] = v3_load(o->m->positions + 3 * o->states[3 * ((size_t)step * o->m->face_count + f) + k]);
}

static double contract(oracle *o, uint32_t step) {
    const fct_progressive *m = o->m;
    double error = 0;
    for (uint32_t p = 0; p < m->point_count; ++p) {
        if (o->face_of[p] == FCT_NONE || !changes_face(m, o->states, step, o->face_of[p])) continue;
        double least = INFINITY;
        v3 x = v3_load(m->positions + 3 * (size_t)o->nodes[p]), t[3];
        uint32_t nearest = FCT_NONE;
        for (uint32_t f = 0; f < m->step_faces[step]; ++f) {
            if (!changes_face(m, o->states, step, f)) continue;
            load_corners(o, step - 1, f, t);
            double d = search_face(x, t);
            if (d < least) least = d, nearest = f;
        }
        assert_int_not_equal(nearest, FCT_NONE);
        error = fmax(error, least);
        o->face_of[p] = nearest;
    }
    return error;
}

static void errors_are_those_of_repeated_contractions(void **state) {
    (void)state;
    for (int kind = 0; kind < 2; ++kind) {
        fct_mesh mesh = kind ? make_torus(&env, 8, false, false) : make_sphere(&env, 9);
        fct_progressive *m = progressive_of(&env, &mesh, fct_simplify_def_default(), 20);
        oracle o = {.m = m, .states = list_states(m)};
        o.face_of = malloc(m->point_count * sizeof *o.face_of),
        o.nodes = malloc(m->point_count * sizeof *o.nodes);
        o.errors = calloc(m->step_count, sizeof *o.errors);
        memset(o.face_of, 0xff, m->point_count * sizeof *o.face_of);
        for (uint32_t c = 3 * m->face_count; c-- > 0;) {
            uint32_t node = o.states[(m->step_count - 1) * 3 * (size_t)m->face_count + c];
            o.face_of[m->points[node]] = c / 3, o.nodes[m->points[node]] = node;
        }
        fct_view view = fct_view_default();
        fct_mesh out = view_mesh(m, &view, NULL);
        double sums[2] = {0, 0};
        for (uint32_t s = m->step_count; s-- > 1;) {
            o.errors[s] = fmax(o.errors[s], contract(&o, s));
            uint32_t parent = 0;
            for (uint32_t n = m->step_nodes[s]; n < m->step_nodes[s + 1]; ++n)
                parent = m->parents[n] == FCT_NONE || step_of_node(m, m->parents[n]) < parent
                             ? parent
                             : step_of_node(m, m->parents[n]);
            assert_int_equal(m->hierarchy->parents[s], parent);
            o.errors[parent] = fmax(o.errors[parent], o.errors[s]);
            sums[0] += o.errors[s], sums[1] += (double)m->hierarchy->bounds[s].error;
            /* Samples that are as near to two faces may go to either one. */
            assert_ratio((double)m->hierarchy->bounds[s].error, o.errors[s], .3);
        }
        assert_ratio(sums[1], sums[0], .02);
        free(o.states), free(o.face_of), free(o.nodes), free(o.errors);
        fct_mesh_release(&env, &out);
        fct_progressive_destroy(m);
        fct_mesh_release(&env, &mesh);
    }
}

/* The bound of a step holds the vertices and the normals of all faces that steps below it in the tree change.
 */
static void bounds_hold_what_is_below(void **state) {
    (void)state;
    fct_mesh mesh = make_torus(&env, 8, false, false);
    fct_progressive *m = progressive_of(&env, &mesh, fct_simplify_def_default(), 20);
    uint32_t *states = list_states(m), closed = 0;
    fct_view view = fct_view_default();
    fct_mesh out = view_mesh(m, &view, NULL);
    oracle o = {.m = m, .states = states};
    for (uint32_t s = 1; s < m->step_count; ++s)
        for (uint32_t up = s; up != 0; up = m->hierarchy->parents[up]) {
            const fct_bound *b = &m->hierarchy->bounds[up], *below = &m->hierarchy->bounds[s];
            assert_true(b->error >= below->error && b->color >= below->color);
            closed += b->high[0] < .99f;
            for (uint32_t f = 0; f < m->step_faces[s]; ++f) {
                v3 t[3];
                if (!changes_face(m, states, s, f)) continue;
                load_corners(&o, s - 1, f, t);
                v3 normal = v3_unit(v3_cross(v3_sub(t[1], t[0]), v3_sub(t[2], t[0])));
                for (int k = 0; k < 3; ++k)
                    assert_true(v3_norm(v3_sub(t[k], v3_load(b->center))) <= (double)b->radius);
                const double n[3] = {normal.x, normal.y, normal.z};
                for (int k = 0; k < 3; ++k)
                    assert_true(n[k] >= (double)b->low[k] - 1e-6 && n[k] <= (double)b->high[k] + 1e-6);
            }
        }
    assert_true(closed > m->step_count / 4);
    free(states);
    fct_mesh_release(&env, &out);
    fct_progressive_destroy(m);
    fct_mesh_release(&env, &mesh);
}

/* The tip of a cone has all faces, and stays while it is a hub. The largest bound is at least the distance of
 * the rim from the base mesh. If the walk loses a vertex, the error of the step is the diameter of its
 * sphere. That happens in few steps. */
static void errors_at_hubs_are_distances(void **state) {
    (void)state;
    enum { RIM = 700 }; /* more than SIMPLIFY_HUB */
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&env, RIM + 1, RIM, 0, &mesh), FCT_OK);
    for (uint32_t v = 0; v < RIM; ++v) {
        double angle = 2 * 3.14159265358979 * v / RIM;
        v3_store(mesh.positions + 3 * v, (v3){cos(angle), sin(angle), 0});
        const uint32_t t[3] = {RIM, v, (v + 1) % RIM};
        memcpy(mesh.triangles + 3 * v, t, sizeof t);
    }
    v3_store(mesh.positions + (size_t)3 * RIM, (v3){0, 0, 1});
    fct_simplify_def def = fct_simplify_def_default();
    def.boundary_weight = def.regularization = 0;
    fct_progressive *m = progressive_of(&env, &mesh, def, 10);
    fct_view view = fct_view_default();
    fct_mesh out = view_mesh(m, &view, NULL), base = level_mesh(m, 0);
    double bound = 0, distance = 0;
    uint32_t lost = 0;
    for (uint32_t s = 1; s < m->step_count; ++s) {
        const fct_bound *b = &m->hierarchy->bounds[s];
        bound = fmax(bound, (double)b->error);
        lost += b->error > 1.9f * b->radius;
    }
    for (uint32_t v = 0; v < RIM; ++v) {
        double least = INFINITY;
        for (uint32_t f = 0; f < base.face_count; ++f) {
            v3 t[3];
            for (int k = 0; k < 3; ++k) t[k] = vertex(&base, base.triangles[3 * f + (uint32_t)k]);
            least = fmin(least, search_face(vertex(&mesh, v), t));
        }
        distance = fmax(distance, least);
    }
    assert_true(bound > .99 * distance && bound < 1.5 && lost < 4);
    fct_mesh *meshes[] = {&out, &base, &mesh};
    for (int k = 0; k < 3; ++k) fct_mesh_release(&env, meshes[k]);
    fct_progressive_destroy(m);
}

/* Where a sheet ends, its edge is a silhouette from everywhere. */
static void open_boundaries_have_all_normals(void **state) {
    (void)state;
    fct_mesh mesh = make_grid(&env, 12);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) mesh.positions[3 * v + 2] = .01f * (float)(v * 7 % 5);
    fct_progressive *m = progressive_of(&env, &mesh, fct_simplify_def_default(), 20);
    fct_view view = fct_view_default();
    fct_mesh out = view_mesh(m, &view, NULL);
    uint32_t open = 0, closed = 0;
    for (uint32_t s = 1; s < m->step_count; ++s) {
        const fct_bound *b = &m->hierarchy->bounds[s];
        bool any = b->low[2] <= -1 && b->high[2] >= 1, ends = false;
        for (uint32_t n = m->step_nodes[s]; n < m->step_nodes[s + 1]; ++n)
            for (int k = 0; k < 2; ++k) {
                float x = m->positions[3 * (size_t)m->parents[n] + k];
                ends |= x < 1e-6f || x > 1 - 1e-6f;
            }
        if (ends) assert_true(any);
        open += ends, closed += !any;
    }
    assert_true(open > 10 && closed > 10);
    fct_mesh_release(&env, &out);
    fct_progressive_destroy(m);
    fct_mesh_release(&env, &mesh);
}

static void the_screen_shows_at_most_the_tolerance(void **state) {
    (void)state;
    uint64_t seed = 5;
    fct_mesh mesh = make_torus(&env, SANITIZED ? 16 : 40, false, false);
    mesh.origin[1] = 0;
    fct_progressive *m = progressive_of(&env, &mesh, fct_simplify_def_default(), 30);
    fct_mesh finest = level_mesh(m, FCT_NONE);
    double most = 0;
    for (int i = 0; i < 30; ++i) {
        fct_view view = random_view(&seed, v3_make(0, 0, 0), 1.5);
        fct_view_stats stats;
        fct_mesh out = view_mesh(m, &view, &stats);
        screen seen = measure_screen(&env, &finest, &out, &view);
        assert_true(seen.front <= 1.01 && seen.silhouette <= 1.01 &&
                    seen.distance <= 1.03 * stats.error + 1e-6);
        assert_true(stats.pixels <= view.tolerance);
        most = fmax(most, seen.front);
        fct_mesh_release(&env, &out);
    }
    assert_true(most > .6);
    fct_mesh_release(&env, &finest);
    fct_progressive_destroy(m);
    fct_mesh_release(&env, &mesh);
}

/* On a flat sheet nothing but colours is refined: until they are right, or the places are small. */
static void colours_are_refined(void **state) {
    (void)state;
    fct_mesh grid = make_grid(&env, 40), mesh = with_arrays(&env, &grid, FCT_MESH_COLORS);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        double x = (double)mesh.positions[3 * v] - .5, y = (double)mesh.positions[3 * v + 1] - .5;
        mesh.colors[3 * v + 1] = (float)(.5 + .5 * tanh((hypot(x, y) - .3) / .05));
    }
    fct_progressive *m = progressive_of(&env, &mesh, fct_simplify_def_default(), 20);
    fct_view view = fct_view_default();
    view.position[0] = view.position[1] = view.target[0] = view.target[1] = .5, view.position[2] = 2;
    uint32_t last = 0;
    for (double tolerance = .5; tolerance > .01; tolerance /= 2) {
        view.color_tolerance = tolerance;
        fct_view_stats stats;
        fct_mesh out = view_mesh(m, &view, &stats);
        surface s = make_surface(&env, &out);
        for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
            fct_closest near;
            double color = 0;
            fct_bvh_closest_point(s.bvh, mesh.positions + 3 * (size_t)v, INFINITY, &near, NULL);
            const double weights[3] = {1 - (double)near.u - (double)near.v, near.u, near.v};
            for (int k = 0; k < 3; ++k)
                color += weights[k] * (double)out.colors[3 * (size_t)out.triangles[3 * near.face + k] + 1];
            assert_true(fabs(color - (double)mesh.colors[3 * v + 1]) <= 1.01 * tolerance + 1e-4);
        }
        assert_true(out.face_count >= last);
        last = out.face_count;
        fct_bvh_destroy(s.bvh), fct_tree_destroy(s.tree);
        fct_mesh_release(&env, &out);
    }
    assert_true(last > 300 && last < mesh.face_count);
    view.color_tolerance = INFINITY;
    fct_mesh out = view_mesh(m, &view, NULL);
    assert_true(out.face_count < 100);
    fct_mesh_release(&env, &out);
    view.color_tolerance = .02, view.position[2] = 2000;
    out = view_mesh(m, &view, NULL);
    assert_true(out.face_count < 100);
    fct_mesh_release(&env, &out);
    fct_progressive_destroy(m);
    fct_mesh_release(&env, &mesh);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {cmocka_unit_test(pixels_bound_projections),
                                       cmocka_unit_test(spheres_are_outside_of_the_picture),
                                       cmocka_unit_test(sides_are_those_of_all_normals),
                                       cmocka_unit_test(errors_are_those_of_repeated_contractions),
                                       cmocka_unit_test(bounds_hold_what_is_below),
                                       cmocka_unit_test(errors_at_hubs_are_distances),
                                       cmocka_unit_test(open_boundaries_have_all_normals),
                                       cmocka_unit_test(the_screen_shows_at_most_the_tolerance),
                                       cmocka_unit_test(colours_are_refined)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
