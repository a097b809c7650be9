/* Faces in balls and convex regions against brute force and closed forms. */
#include "packed.h"

#include "base/math/round.h"
#include "bvh/near/region/clip.h"
#include "bvh/near/triangle.h"

/* A constraint a u + b v + c >= 0 on the barycentrics of a triangle. */
typedef struct constraint {
    double a, b, c;
} constraint;

/* Whether weights exist that satisfy all constraints with `slack`. If any exist, the crossing of two border
 * lines is among them. */
static bool is_feasible(const constraint *list, uint32_t count, double slack) {
    for (uint32_t i = 0; i < count; ++i)
        for (uint32_t j = 0; j < i; ++j) {
            double det = list[i].a * list[j].b - list[j].a * list[i].b;
            double ci = list[i].c + slack, cj = list[j].c + slack;
            if (fabs(det) < 1e-14) continue;
            double u = (list[i].b * cj - list[j].b * ci) / det, v = (list[j].a * ci - list[i].a * cj) / det;
            bool good = true;
            for (uint32_t k = 0; k < count && good; ++k)
                good = list[k].a * u + list[k].b * v + list[k].c >= -slack - 1e-12;
            if (good) return true;
        }
    return false;
}

typedef enum answer { APART, DOUBTFUL, TOUCHING } answer;

static answer brute_touches(const v3 t[3], uint32_t count, const double *planes, bool *between) {
    constraint list[3 + FCT_BVH_PLANES] = {{1, 0, 0}, {0, 1, 0}, {-1, -1, 1}};
    *between = true;
    for (uint32_t i = 0; i < count; ++i) {
        const double *p = planes + 4 * (size_t)i;
        double h[3];
        for (int c = 0; c < 3; ++c) h[c] = p[0] * t[c].x + p[1] * t[c].y + p[2] * t[c].z + p[3];
        list[3 + i] = (constraint){h[1] - h[0], h[2] - h[0], h[0]};
        if (h[0] < 0 && h[1] < 0 && h[2] < 0) *between = false;
    }
    bool wide = is_feasible(list, 3 + count, 1e-9), narrow = is_feasible(list, 3 + count, -1e-9);
    return narrow ? TOUCHING : wide ? DOUBTFUL : APART;
}

/* A box with random axes, a frustum, or random half-spaces near the origin. Returns their number. */
static uint32_t make_planes(uint32_t kind, uint64_t *seed, double *planes) {
    v3 axis[3], middle = v3_scale(random_direction(seed), .8 * random_unit(seed));
    axis[2] = kind == 0 ? v3_make(0, 0, 1) : random_direction(seed);
    v3_frame(axis[2], &axis[0], &axis[1]);
    uint32_t count = kind == 3 ? 1 + (uint32_t)(random_next(seed) % 8) : 6;
    for (uint32_t i = 0; i < count; ++i) {
        double sign = i % 2 ? 1 : -1, half = .4 * random_unit(seed), length = exp2(8 * random_unit(seed) - 4);
        v3 n = v3_scale(axis[i / 2 % 3], sign);
        if (kind == 2 && i < 4) n = v3_unit(v3_add(n, axis[2])); /* four sides that spread along the axis */
        if (kind == 3) n = random_direction(seed);
        v3 on = v3_mad(middle, kind == 2 && i < 4 ? 0 : -half, n);
        planes[4 * i] = length * n.x, planes[4 * i + 1] = length * n.y, planes[4 * i + 2] = length * n.z;
        planes[4 * i + 3] = -length * v3_dot(n, on);
    }
    return count;
}

/* Returns the number of faces that lie beside a corner of the region: no plane alone excludes them. */
static size_t agrees_in_planes(const fct_env *env, fct_mesh mesh, v3 offset, double size) {
    for (uint32_t v = 0; v < mesh.vertex_count; ++v)
        v3_store(mesh.positions + 3 * v, v3_add(offset, v3_scale(v3_load(mesh.positions + 3 * v), size)));
    model m = model_make(env, mesh, FCT_BACKEND_OBB);
    uint32_t *faces = malloc(mesh.face_count * sizeof *faces);
    uint64_t seed = 3;
    size_t touching = 0, apart = 0, corners = 0, doubtful = 0;
    fct_visits visits = {0};
    for (uint32_t i = 0; i < 120; ++i) {
        double planes[4 * FCT_BVH_PLANES];
        uint32_t planes_count = make_planes(i % 4, &seed, planes);
        for (uint32_t k = 0; k < planes_count; ++k) {
            v3 n = {planes[4 * k], planes[4 * k + 1], planes[4 * k + 2]};
            planes[4 * k + 3] = planes[4 * k + 3] * size - v3_dot(n, offset);
        }
        uint32_t count =
            fct_bvh_faces_in_planes(m.bvh, planes_count, planes, mesh.face_count, faces, &visits);
        assert_true(count <= mesh.face_count);
        uint32_t at = 0;
        for (uint32_t f = 0; f < mesh.face_count; ++f) {
            v3 t[3];
            bool between, listed = at < count && faces[at] == f;
            face_corners(&mesh, f, t);
            answer expected = brute_touches(t, planes_count, planes, &between);
            if (expected == DOUBTFUL)
                ++doubtful;
            else
                assert_int_equal(listed, expected == TOUCHING);
            touching += expected == TOUCHING, apart += expected == APART;
            corners += expected == APART && between;
            at += listed;
        }
        assert_int_equal(at, count); /* all are listed once, ascending */
    }
    assert_true(touching > 500 && apart > 5000 && doubtful < 60);
    assert_true(visits.nodes > 100 && visits.triangles < 120 * (uint64_t)mesh.face_count / 2);
    free(faces);
    model_release(env, &m);
    return corners;
}

static void regions_agree_with_brute_force(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    v3 zero = {0, 0, 0}, far = {300, -500, 200};
    size_t corners = agrees_in_planes(&env, make_pebble(&env, 14, 3), zero, 1);
    corners += agrees_in_planes(&env, make_bars(&env, 4, 3), zero, 1);
    corners += agrees_in_planes(&env, make_soup(&env, 900, 3), zero, 1);
    corners += agrees_in_planes(&env, make_pebble(&env, 14, 3), far, 3);
    assert_true(corners > 100);
}

static void balls_agree_with_brute_force(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh meshes[4] = {make_pebble(&env, 20, 3), make_bars(&env, 6, 3), make_soup(&env, 900, 3),
                          make_grid(&env, 20)};
    for (int k = 0; k < 4; ++k) {
        model m = model_make(&env, meshes[k], FCT_BACKEND_OBB);
        uint32_t *faces = malloc(meshes[k].face_count * sizeof *faces), lowest[10];
        uint64_t seed = 4;
        size_t listed_count = 0;
        fct_visits visits = {0};
        for (uint32_t i = 0; i < 200; ++i) {
            float center[3], radius = (float)(1.2 * random_unit(&seed) * random_unit(&seed));
            v3_store(center, v3_scale(random_direction(&seed), 1.3 * random_unit(&seed)));
            FCT_KEEP_STORED(center);
            uint32_t count =
                fct_bvh_faces_in_ball(m.bvh, center, radius, meshes[k].face_count, faces, &visits);
            assert_int_equal(fct_bvh_faces_in_ball(m.bvh, center, radius, 10, lowest, NULL), count);
            assert_memory_equal(lowest, faces, (count < 10 ? count : 10) * sizeof *faces);
            assert_int_equal(fct_bvh_faces_in_ball(m.bvh, center, radius, 0, NULL, NULL), count);
            v3 p = fct_bvh_to_scaled(m.bvh, v3_load(center));
            uint32_t at = 0;
            for (uint32_t f = 0; f < meshes[k].face_count; ++f) {
                v3 t[3];
                double u, v;
                face_corners(&meshes[k], f, t);
                for (int c = 0; c < 3; ++c) t[c] = fct_bvh_to_scaled(m.bvh, t[c]);
                double d2 = v3_norm2(v3_sub(fct_triangle_closest(p, t[0], t[1], t[2], &u, &v), p));
                bool listed = at < count && faces[at] == f;
                assert_int_equal(listed, d2 <= pow((double)radius * m.bvh->scale, 2));
                at += listed;
            }
            assert_int_equal(at, count);
            listed_count += count;
        }
        /* Most faces are decided with their subtree, or in float. */
        assert_true(listed_count > 1000 && visits.triangles < listed_count / 4 + 400);
        free(faces);
        model_release(&env, &m);
    }
}

/* A grid of 8 x 8 squares, .125 wide: its vertex (.5, .5) has six faces. */
static void touching_counts(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = model_make(&env, make_grid(&env, 8), FCT_BACKEND_OBB);
    uint32_t faces[128];
    float above[3] = {.5f, .5f, .25f};
    assert_int_equal(fct_bvh_faces_in_ball(m.bvh, above, .25f, 128, faces, NULL), 6);
    assert_int_equal(fct_bvh_faces_in_ball(m.bvh, above, .2499999f, 128, faces, NULL), 0);
    assert_int_equal(fct_bvh_faces_in_ball(m.bvh, above, 0, 128, faces, NULL), 0);
    above[2] = 0;
    assert_int_equal(fct_bvh_faces_in_ball(m.bvh, above, 0, 128, faces, NULL), 6);
    /* The box [.5, 2] x [.5, 2] x [0, 1] has 4 x 4 squares, and touches faces at two of its sides. */
    double box[24] = {2, 0, 0, -1, -3, 0, 0, 6, 0, 1, 0, -.5, 0, -1, 0, 2, 0, 0, 1, 0, 0, 0, -1, 1};
    uint32_t count = fct_bvh_faces_in_planes(m.bvh, 6, box, 128, faces, NULL);
    uint32_t expected = 0;
    for (uint32_t f = 0; f < 128; ++f) {
        v3 t[3];
        double x = 0, y = 0;
        face_corners(&m.mesh, f, t);
        /* Triangles of the grid touch the quarter plane exactly if one corner does. */
        for (int c = 0; c < 3; ++c) x = fmax(x, t[c].x), y = fmax(y, t[c].y);
        bool corner = false;
        for (int c = 0; c < 3; ++c) corner = corner || (t[c].x >= .5 && t[c].y >= .5);
        expected += corner;
        if (!corner) assert_true(x <= .5 || y <= .5);
    }
    assert_int_equal(count, expected);
    box[19] = -1e-6; /* above the grid */
    assert_int_equal(fct_bvh_faces_in_planes(m.bvh, 6, box, 128, faces, NULL), 0);
    model_release(&env, &m);
}

static void whole_models_are_taken_without_tests(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = model_make(&env, make_pebble(&env, 20, 3), FCT_BACKEND_OBB);
    uint32_t count = m.mesh.face_count, *faces = malloc(count * sizeof *faces);
    float center[3] = {.1f, 0, 0}, afar[3] = {3e20f, 0, 0};
    double box[24] = {1, 0, 0, 9, -1, 0, 0, 9, 0, 1, 0, 9, 0, -1, 0, 9, 0, 0, 1, 9, 0, 0, -1, 9};
    fct_visits visits = {0};
    assert_int_equal(fct_bvh_faces_in_ball(m.bvh, center, 9, count, faces, &visits), count);
    assert_int_equal(fct_bvh_faces_in_ball(m.bvh, center, INFINITY, count, faces, &visits), count);
    assert_int_equal(fct_bvh_faces_in_planes(m.bvh, 6, box, count, faces, &visits), count);
    assert_int_equal(fct_bvh_faces_in_planes(m.bvh, 0, NULL, count, faces, &visits), count);
    for (uint32_t f = 0; f < count; ++f) assert_int_equal(faces[f], f);
    assert_int_equal(visits.triangles, 0);
    assert_int_equal(visits.boxes, 3 * 8); /* those of the root, once for each region that has a border */
    assert_int_equal(fct_bvh_faces_in_ball(m.bvh, afar, 2e20f, count, faces, NULL), 0);
    assert_int_equal(fct_bvh_faces_in_ball(m.bvh, afar, 4e20f, count, faces, NULL), count);
    free(faces);
    model_release(&env, &m);
}

static void bad_regions_hold_nothing(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = model_make(&env, make_pebble(&env, 8, 3), FCT_BACKEND_OBB);
    float good[3] = {0, 0, 0}, bad[3] = {0, NAN, 0}, endless[3] = {0, INFINITY, 0};
    double space[4] = {0, 0, 0, 1}, nothing[4] = {0, 0, 0, -1}, lost[4] = {1, 0, 0, NAN},
           steep[4] = {INFINITY, 0, 0, 0}, many[4 * 33] = {0}, tiny[4] = {1e-310, 0, 0, 2e-310};
    uint32_t face, all = m.mesh.face_count;
    assert_int_equal(fct_bvh_faces_in_ball(m.bvh, bad, 5, 1, &face, NULL), 0);
    assert_int_equal(fct_bvh_faces_in_ball(m.bvh, endless, INFINITY, 1, &face, NULL), 0);
    assert_int_equal(fct_bvh_faces_in_ball(m.bvh, good, -1, 1, &face, NULL), 0);
    assert_int_equal(fct_bvh_faces_in_ball(m.bvh, good, NAN, 1, &face, NULL), 0);
    assert_int_equal(fct_bvh_faces_in_planes(m.bvh, 1, space, 1, &face, NULL), all);
    assert_int_equal(fct_bvh_faces_in_planes(m.bvh, 1, tiny, 1, &face, NULL), all);
    assert_int_equal(fct_bvh_faces_in_planes(m.bvh, 1, nothing, 1, &face, NULL), 0);
    assert_int_equal(fct_bvh_faces_in_planes(m.bvh, 1, lost, 1, &face, NULL), 0);
    assert_int_equal(fct_bvh_faces_in_planes(m.bvh, 1, steep, 1, &face, NULL), 0);
    assert_int_equal(fct_bvh_faces_in_planes(m.bvh, 32, many, 1, &face, NULL), all);
    assert_int_equal(fct_bvh_faces_in_planes(m.bvh, 33, many, 1, &face, NULL), 0);
    model_release(&env, &m);
}

/* One plane again and again, with other lengths, and its neighbours in the last place. */
static void repeated_planes(void **state) {
    (void)state;
    uint64_t seed = 80;
    for (int i = 0; i < 20000; ++i) {
        v3 p[3], n = random_direction(&seed);
        double d = .3 * (random_unit(&seed) - .5);
        fct_half_space h[FCT_BVH_PLANES];
        for (int c = 0; c < 3; ++c) p[c] = random_direction(&seed);
        for (int k = 0; k < FCT_BVH_PLANES; ++k) {
            double factor = exp2(8 * random_unit(&seed) - 4);
            h[k] = (fct_half_space){v3_scale(n, factor), d * factor};
        }
        bool touches = false;
        double nearest = INFINITY;
        for (int c = 0; c < 3; ++c) {
            touches |= v3_dot(n, p[c]) + d >= 0;
            nearest = fmin(nearest, fabs(v3_dot(n, p[c]) + d));
        }
        if (nearest > 1e-12) assert_int_equal(fct_clip_touches(p, h, UINT32_MAX), touches);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(repeated_planes),
        cmocka_unit_test(regions_agree_with_brute_force),
        cmocka_unit_test(balls_agree_with_brute_force),
        cmocka_unit_test(touching_counts),
        cmocka_unit_test(whole_models_are_taken_without_tests),
        cmocka_unit_test(bad_regions_hold_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
