/* Closest points against closed forms and brute force; choice of faces by normal; number of visits. */
#include "packed.h"

#include "bvh/near/nearest.h"
#include "bvh/near/triangle.h"

/*          \ B /        Each region has points whose nearest point is known: a corner plus a direction that
 *       ab  \ /  bc     leans away from both of its sides, a point of a side plus a direction that leaves the
 *     ______/_\______   triangle, a point inside plus a multiple of the normal.
 *       A  / in \  C
 *         /  ac \                                                                                          */
static v3 point_of_region(const v3 t[3], int region, uint64_t *seed, v3 *nearest) {
    v3 n = v3_unit(v3_cross(v3_sub(t[1], t[0]), v3_sub(t[2], t[0])));
    double s = .05 + .9 * random_unit(seed), height = 2 * random_unit(seed) - 1;
    int i = region % 3, j = (i + 1) % 3, k = (i + 2) % 3;
    if (region == 6) {
        double w = s * random_unit(seed);
        *nearest = v3_add(v3_scale(t[0], 1 - s), v3_add(v3_scale(t[1], s - w), v3_scale(t[2], w)));
        return v3_mad(*nearest, height, n);
    }
    v3 along = v3_unit(v3_sub(t[j], t[i])), out = v3_cross(along, n); /* points away from corner k */
    if (region < 3) {
        *nearest = v3_mad(t[i], s * v3_norm(v3_sub(t[j], t[i])), along);
        return v3_mad(v3_mad(*nearest, random_unit(seed), out), height, n);
    }
    v3 other = v3_unit(v3_sub(t[k], t[i])), other_out = v3_cross(n, other);
    *nearest = t[i];
    v3 away = v3_add(v3_scale(out, random_unit(seed)), v3_scale(other_out, random_unit(seed)));
    /* Between the outward normals of the two sides, directions lean away from both. */
    return v3_mad(v3_add(t[i], away), height, n);
}

static void each_of_the_seven_regions_has_its_point(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    uint64_t seed = 2;
    for (int i = 0; i < 60; ++i) {
        fct_mesh mesh;
        v3 t[3];
        assert_int_equal(fct_mesh_create(&env, 3, 1, 0, &mesh), FCT_OK);
        for (uint32_t c = 0; c < 3; ++c) {
            v3_store(mesh.positions + 3 * c, random_direction(&seed));
            mesh.triangles[c] = c;
        }
        face_corners(&mesh, 0, t);
        model m = model_make(&env, mesh, FCT_BACKEND_OBB);
        for (int k = 0; k < 70; ++k) {
            v3 expected, p = point_of_region(t, k % 7, &seed, &expected);
            float at[3];
            double u, v, distance = v3_norm(v3_sub(expected, p));
            v3 q = fct_triangle_closest(p, t[0], t[1], t[2], &u, &v);
            assert_true(v3_norm(v3_sub(q, expected)) < 1e-9);
            v3 same = v3_add(v3_scale(t[0], 1 - u - v), v3_add(v3_scale(t[1], u), v3_scale(t[2], v)));
            assert_true(v3_norm(v3_sub(q, same)) < 1e-9);
            fct_closest closest;
            v3_store(at, p);
            assert_true(fct_bvh_closest_point(m.bvh, at, INFINITY, &closest, NULL));
            assert_float_equal((double)closest.distance, distance, 1e-6);
            assert_true(v3_norm(v3_sub(v3_load(closest.point), expected)) < 2e-5);
            /* The maximum distance decides within float rounding. */
            assert_true(fct_bvh_closest_point(m.bvh, at, (float)distance + 1e-5f, &closest, NULL));
            assert_false(fct_bvh_closest_point(m.bvh, at, (float)distance - 1e-5f, &closest, NULL));
        }
        model_release(&env, &m);
    }
}

/* most_nodes: over those that must be visited; most_triangles: per search. */
static void agrees_with_plain_distances(const fct_env *env, fct_mesh mesh, double spread, double most_nodes,
                                        double most_triangles) {
    model m = model_make(env, mesh, FCT_BACKEND_OBB);
    fct_visits must = {0}, visited = {0};
    uint64_t seed = 31;
    for (int i = 0; i < 400; ++i) {
        v3 p = random_direction(&seed);
        p = v3_scale(p, spread * random_unit(&seed));
        double best = INFINITY;
        uint32_t face = FCT_NONE;
        for (uint32_t f = 0; f < mesh.face_count; ++f) {
            v3 t[3];
            face_corners(&mesh, f, t);
            double distance = v3_norm(v3_sub(plain_closest(p, t), p));
            if (distance < best) best = distance, face = f;
        }
        fct_near near;
        fct_visits ours = {0}, least = {0};
        assert_true(fct_nearest_search(m.bvh, p, NULL, INFINITY, &near, &ours));
        double distance = sqrt(near.distance2);
        assert_true(fabs(distance - best) < 1e-12 * (1 + best));
        assert_true(fabs(v3_norm(v3_sub(near.point, p)) - best) < 1e-12 * (1 + best));
        v3 t[3];
        uint32_t found = m.bvh->view.face_ids[near.place];
        face_corners(&mesh, found, t);
        v3 at = v3_add(v3_scale(t[0], 1 - near.u - near.v),
                       v3_add(v3_scale(t[1], near.u), v3_scale(t[2], near.v)));
        assert_true(v3_norm(v3_sub(at, near.point)) < 1e-12);
        /* Faces at the very same distance: the lowest id, unless rounding tells them apart. */
        face_corners(&mesh, face, t);
        assert_true(found <= face || fabs(v3_norm(v3_sub(plain_closest(p, t), p)) - distance) < 1e-14);
        count_within(m.bvh, m.bvh->root, v3_scale(p, m.bvh->scale), best * m.bvh->scale * (1 - 1e-4), &least);
        assert_true(ours.nodes >= least.nodes && ours.boxes == 8 * ours.nodes && ours.triangles > 0);
        must.nodes += least.nodes, visited.nodes += ours.nodes, visited.triangles += ours.triangles;
    }
    assert_true((double)visited.nodes < most_nodes * (double)must.nodes);
    assert_true((double)visited.triangles < 400 * most_triangles);
    model_release(env, &m);
}

static void searches_agree_with_brute_force(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    /* Measured: 1.02, 1.82, 1.03, 1.02 times the nodes, and 3.7, 2.8, 1.1, 5.9 triangles. */
    agrees_with_plain_distances(&env, make_pebble(&env, 20, 3), 1.5, 1.05, 4);
    agrees_with_plain_distances(&env, make_bars(&env, 12, 3), 1.5, 1.95, 3.2);
    agrees_with_plain_distances(&env, make_soup(&env, 1500, 3), 1.5, 1.06, 1.2);
    agrees_with_plain_distances(&env, make_pebble(&env, 20, 3), 40, 1.05, 6.3);
}

/* Loose triangles with two sides along axes, so that many have exactly the same normal. */
static fct_mesh make_shelves(const fct_env *env, uint32_t n) {
    fct_mesh mesh = make_soup(env, n, 3);
    uint64_t seed = 5;
    for (uint32_t f = 0; f < n; ++f) {
        float *p = mesh.positions + 9 * (size_t)f;
        for (int k = 0; k < 3; ++k) p[k] = (float)floor(32 * random_unit(&seed)) / 32;
        for (int k = 3; k < 9; ++k) p[k] = p[k % 3];
        uint32_t axis = f % 3;
        p[3 + axis] += 1.0f / 16, p[6 + (axis + 1 + f / 3 % 2) % 3] += 1.0f / 8;
        for (uint32_t k = 0; k < 3; ++k) mesh.triangles[3 * (size_t)f + k] = 3 * f + k;
    }
    return mesh;
}

/* Among the faces within reach: the normal nearest to the wanted one, then the nearest, then the lower id. */
static void facing_faces_win(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh meshes[3] = {make_soup(&env, 900, 7), make_pebble(&env, 12, 4), make_shelves(&env, 900)};
    size_t found = 0, empty = 0;
    for (int k = 0; k < 3; ++k) {
        model m = model_make(&env, meshes[k], FCT_BACKEND_OBB);
        uint64_t seed = 13;
        for (int i = 0; i < 300; ++i) {
            v3 p = {random_unit(&seed), random_unit(&seed), random_unit(&seed)}, n = random_direction(&seed);
            double reach = .15 * random_unit(&seed), best = -INFINITY, best_distance = INFINITY;
            for (uint32_t f = 0; f < meshes[k].face_count; ++f) {
                v3 t[3];
                face_corners(&meshes[k], f, t);
                double distance = v3_norm(v3_sub(plain_closest(p, t), p));
                if (distance > reach) continue;
                v3 cross = v3_cross(v3_sub(t[1], t[0]), v3_sub(t[2], t[0]));
                double cosine = v3_norm(cross) > 0 ? v3_dot(cross, n) / v3_norm(cross) : -2;
                if (cosine > best + 1e-12) best_distance = INFINITY;
                if (cosine >= best - 1e-12) best_distance = fmin(best_distance, distance);
                best = fmax(best, cosine);
            }
            fct_near near;
            bool there = fct_nearest_search(m.bvh, p, &n, reach, &near, NULL);
            assert_int_equal(there, best > -INFINITY);
            found += there, empty += !there;
            if (!there) continue;
            v3 t[3];
            face_corners(&meshes[k], m.bvh->view.face_ids[near.place], t);
            v3 cross = v3_cross(v3_sub(t[1], t[0]), v3_sub(t[2], t[0]));
            double cosine = v3_norm(cross) > 0 ? v3_dot(cross, n) / v3_norm(cross) : -2;
            assert_true(fabs(cosine - best) < 1e-11 && fabs(sqrt(near.distance2) - best_distance) < 1e-11);
        }
        model_release(&env, &m);
    }
    assert_true(found > 100 && empty > 20);
}

/* The lower id of two equal faces, by distance and by normal. */
static void equal_faces_go_to_the_lower_id(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_soup(&env, 400, 5); /* face 10 k + 9 is face 10 k + 8 again */
    model m = model_make(&env, mesh, FCT_BACKEND_OBB);
    uint64_t seed = 3;
    for (uint32_t f = 9; f < 400; f += 10) {
        v3 t[3];
        fct_near near;
        face_corners(&mesh, f, t);
        v3 n = v3_unit(v3_cross(v3_sub(t[1], t[0]), v3_sub(t[2], t[0])));
        double u = random_unit(&seed), v = (1 - u) * random_unit(&seed);
        v3 p = v3_add(v3_scale(t[0], 1 - u - v), v3_add(v3_scale(t[1], u), v3_scale(t[2], v)));
        assert_true(fct_nearest_search(m.bvh, p, NULL, 1, &near, NULL));
        assert_int_not_equal(m.bvh->view.face_ids[near.place], f);
        if (v3_norm(n) == 0) continue;
        assert_true(fct_nearest_search(m.bvh, p, &n, 1e-9, &near, NULL));
        assert_int_not_equal(m.bvh->view.face_ids[near.place], f);
    }
    model_release(&env, &m);
}

/* A batch on a large model takes turns, but not for points that are close to the one before. Every point gets
 * the answer that it gets alone; bad points get none. */
static void points_in_turns_find_the_same(void **state) {
    (void)state;
    enum { COUNT = 603 };
    fct_env env = fct_env_default();
    fct_bvh_def def = fct_bvh_def_default();
    model m = model_make(&env, make_pebble(&env, 24, 5), FCT_BACKEND_OBB);
    fct_bvh *plain = m.bvh, *with_sign;
    def.parts = FCT_BVH_SIGN;
    assert_int_equal(fct_bvh_build(&env, m.tree, &def, &with_sign), FCT_OK);
    plain->leaf_bytes += 64 << 20, with_sign->leaf_bytes += 64 << 20; /* for the choice only */
    uint64_t seed = 6;
    float spread[3 * COUNT], grid[3 * COUNT];
    fct_closest many[COUNT], one;
    for (size_t i = 0; i < COUNT; ++i) {
        v3_store(spread + 3 * i, v3_scale(random_direction(&seed), 3 * random_unit(&seed)));
        v3_store(grid + 3 * i, v3_make(.03 * (double)(i % 67), .2 * (double)(i / 67), .1));
    }
    spread[3 * 7] = NAN, spread[3 * 602] = INFINITY;
    const size_t counts[] = {1, 201, COUNT};
    const float reaches[] = {1, -1};
    size_t found = 0, inside = 0;
    for (size_t c = 0; c < 12; ++c) {
        const size_t count = counts[c % 3];
        const float *points = c / 3 % 2 ? grid : spread, reach = reaches[c / 6];
        fct_bvh_closest_points(plain, count, points, reach, many);
        for (size_t i = 0; i < count; ++i) {
            found += fct_bvh_closest_point(plain, points + 3 * i, reach, &one, NULL);
            assert_memory_equal(&many[i], &one, sizeof one);
        }
        fct_bvh_signed_distances(with_sign, count, points, reach, many);
        for (size_t i = 0; i < count; ++i) {
            fct_bvh_signed_distance(with_sign, points + 3 * i, reach, &one, NULL);
            assert_memory_equal(&many[i], &one, sizeof one);
            inside += one.distance < 0;
        }
        /* Without FCT_BVH_SIGN, no point gets an answer. */
        fct_bvh_signed_distances(plain, count, points, reach, many);
        for (size_t i = 0; i < count; ++i) assert_int_equal(many[i].face, FCT_NONE);
    }
    assert_in_range(found, 1000, 1500);
    assert_in_range(inside, 200, 700);
    fct_bvh_destroy(with_sign);
    model_release(&env, &m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_of_the_seven_regions_has_its_point),
        cmocka_unit_test(searches_agree_with_brute_force),
        cmocka_unit_test(facing_faces_win),
        cmocka_unit_test(equal_faces_go_to_the_lower_id),
        cmocka_unit_test(points_in_turns_find_the_same),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
