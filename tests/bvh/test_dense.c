/* Queries on a dense model, whose leaves are not clusters of the tree: bvh->places names their faces. Each
 * answer is compared with brute force over the faces of the mesh. */
#include "packed.h"
#include "pairs.h"

#include "bvh/near/mapped.h"
#include "bvh/pair/triangles.h"

enum { SHEETS = 56, WIDTH = 5, OWN = 2 * WIDTH, FACES = OWN * SHEETS };

/* Bent squares above each other in the unit cube. A line through the cube meets the boxes of a third. */
static model make_sheets(const fct_env *env, uint64_t seed) {
    const uint32_t vertices = 2 * (WIDTH + 1);
    static const uint32_t corners[6] = {0, 1, 2, 1, 3, 2};
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(env, vertices * SHEETS, FACES, 0, &mesh), FCT_OK);
    for (uint32_t i = 0; i < vertices * SHEETS; ++i) {
        const double height = (i / vertices + .6 * random_unit(&seed)) / SHEETS;
        v3_store(mesh.positions + 3 * i, v3_make(i & 1, (double)(i % vertices / 2) / WIDTH, height));
    }
    for (uint32_t i = 0; i < 3 * FACES; ++i)
        mesh.triangles[i] = vertices * (i / 3 / OWN) + 2 * (i / 6 % WIDTH) + corners[i % 6];
    model m = pair_model_make(env, mesh);
    assert_non_null(m.bvh->places);
    uint32_t moved = 0; /* faces that do not lie where the tree has them */
    for (uint32_t i = 0; i < FACES; ++i) moved += m.bvh->places[i] != i;
    assert_true(moved > FACES / 4);
    return m;
}

/* ---- One model ---- */

static int compare_ids(const void *a, const void *b) {
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

/* All hits of a ray, by their faces. */
static void rays_meet_every_face(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = make_sheets(&env, 1);
    uint64_t seed = 2;
    size_t met = 0;
    for (int i = 0; i < 300; ++i) {
        const v3 from = {random_unit(&seed), random_unit(&seed), -.5};
        const v3 to = {random_unit(&seed), random_unit(&seed), 1.5};
        const fct_ray ray = make_ray(from, v3_sub(to, from), 0, INFINITY);
        fct_hit hits[FACES], other;
        uint32_t expected[FACES], found[FACES], count = 0;
        bool sure = true;
        for (uint32_t f = 0; f < FACES; ++f) {
            v3 p[3];
            face_corners(&m.mesh, f, p);
            const v3 o = v3_load(ray.origin), d = v3_load(ray.direction), q = v3_cross(d, v3_sub(p[2], p[0]));
            const v3 s = v3_sub(o, p[0]), e = v3_sub(p[1], p[0]);
            const double det = v3_dot(e, q), u = v3_dot(s, q) / det, v = v3_dot(d, v3_cross(s, e)) / det;
            const double inside = fmin(fmin(u, v), 1 - u - v);
            sure = sure && fabs(inside) > 1e-6;
            if (inside > 0) expected[count++] = f;
        }
        if (!sure) continue;
        assert_int_equal(fct_bvh_all_hits(m.bvh, &ray, FACES, hits, NULL), count);
        for (uint32_t k = 0; k < count; ++k) found[k] = hits[k].face;
        if (count > 1) {
            assert_true(fct_bvh_closest_hit_except(m.bvh, &ray, found[0], &other, NULL));
            assert_int_equal(other.face, found[1]);
        }
        qsort(found, count, sizeof *found, compare_ids);
        assert_memory_equal(found, expected, count * sizeof *found);
        met += count;
    }
    assert_true(met > 50 * SHEETS);
    model_release(&env, &m);
}

/* A face touches the slab between two planes if its range along the normal meets that of the slab. */
static void slabs_list_their_faces(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = make_sheets(&env, 3);
    uint64_t seed = 4;
    size_t touching = 0;
    for (int i = 0; i < 200; ++i) {
        const v3 n = v3_unit(v3_add(v3_make(0, 0, 2), random_direction(&seed)));
        const double low = 1.4 * random_unit(&seed) - .2, high = low + .2 * random_unit(&seed);
        const double planes[8] = {n.x, n.y, n.z, -low, -n.x, -n.y, -n.z, high};
        uint32_t expected[FACES], found[FACES], count = 0;
        for (uint32_t f = 0; f < FACES; ++f) {
            v3 p[3];
            face_corners(&m.mesh, f, p);
            const double a = v3_dot(n, p[0]), b = v3_dot(n, p[1]), c = v3_dot(n, p[2]);
            if (fmax(a, fmax(b, c)) >= low && fmin(a, fmin(b, c)) <= high) expected[count++] = f;
        }
        assert_int_equal(fct_bvh_faces_in_planes(m.bvh, 2, planes, FACES, found, NULL), count);
        assert_memory_equal(found, expected, count * sizeof *found);
        touching += count;
    }
    assert_in_range(touching, 200 * 100, 200 * 200);
    model_release(&env, &m);
}

/* The solid angle of a triangle over 4 pi (van Oosterom and Strackee 1983). */
static double find_winding(const fct_mesh *mesh, uint32_t face, v3 at) {
    v3 p[3];
    double l[3];
    face_corners(mesh, face, p);
    for (int c = 0; c < 3; ++c) p[c] = v3_sub(p[c], at), l[c] = v3_norm(p[c]);
    const double below = l[0] * l[1] * l[2] + v3_dot(p[0], p[1]) * l[2] + v3_dot(p[1], p[2]) * l[0] +
                         v3_dot(p[2], p[0]) * l[1];
    return atan2(v3_dot(p[0], v3_cross(p[1], p[2])), below) / 6.283185307179586;
}

static void winding_numbers_add_up_all_faces(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = make_sheets(&env, 5);
    uint64_t seed = 6;
    double largest = 0;
    for (int i = 0; i < 200; ++i) {
        const v3 way = random_direction(&seed);
        const v3 p = v3_mad(v3_make(.5, .5, .5), 2 * random_unit(&seed), way);
        float at[3];
        double sum = 0;
        v3_store(at, p);
        for (uint32_t f = 0; f < FACES; ++f) sum += find_winding(&m.mesh, f, v3_load(at));
        assert_float_equal(fct_bvh_winding_number(m.bvh, at, NULL), sum, 3e-3 * (1 + fabs(sum)));
        largest = fmax(largest, fabs(sum));
    }
    assert_true(largest > 5);
    model_release(&env, &m);
}

/* The nearest face under a map that stretches. */
static void mapped_points_find_their_face(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = make_sheets(&env, 7);
    uint64_t seed = 8;
    const float forward[12] = {2, 0, 0, 1, 0, .5f, 0, 2, 0, 0, 4, 3};
    const double backward[12] = {.5, 0, 0, -.5, 0, 2, 0, -4, 0, 0, .25, -.75};
    fct_mapped_frame frame;
    fct_mapped_frame_make(forward, &frame);
    const fct_map map = {forward, backward, &frame};
    for (int i = 0; i < 400; ++i) {
        const v3 p = {1 + 2 * random_unit(&seed), 2 + .5 * random_unit(&seed), 3 + 4 * random_unit(&seed)};
        double best = INFINITY, distances[FACES];
        for (uint32_t f = 0; f < FACES; ++f) {
            v3 t[3];
            face_corners(&m.mesh, f, t);
            for (int c = 0; c < 3; ++c) t[c] = v3_make(2 * t[c].x + 1, .5 * t[c].y + 2, 4 * t[c].z + 3);
            distances[f] = v3_norm(v3_sub(plain_closest(p, t), p));
            best = fmin(best, distances[f]);
        }
        fct_mapped_near near;
        assert_true(fct_mapped_search(m.bvh, &map, p, INFINITY, &near, NULL));
        assert_float_equal(near.distance, best, 1e-9);
        assert_float_equal(distances[m.bvh->view.face_ids[near.place]], best, 1e-9);
    }
    model_release(&env, &m);
}

/* ---- Two models ---- */

/* The number of pairs that meet, and the least distance, unless NULL. */
static size_t meet_all(const model *a, const model *b, const fct_pose *pose, double *distance) {
    size_t count = 0;
    if (distance) *distance = INFINITY;
    for (uint32_t f = 0; f < FACES; ++f)
        for (uint32_t g = 0; g < FACES; ++g) {
            v3 p[3], q[3], at[2];
            face_corners(&a->mesh, f, p);
            posed_corners(&b->mesh, pose, g, q);
            count += fct_triangles_meet(p, q);
            if (distance) *distance = fmin(*distance, sqrt(fct_triangles_distance(p, q, &at[0], &at[1])));
        }
    return count;
}

/* The ids and the places of a pair name faces that meet. */
static void check_pair(const model *a, const model *b, const fct_pose *pose, const fct_face_pair *pair) {
    v3 p[3], q[3];
    face_corners(&a->mesh, pair->face_a, p);
    posed_corners(&b->mesh, pose, pair->face_b, q);
    assert_true(fct_triangles_meet(p, q));
    assert_int_equal(a->bvh->view.face_ids[pair->place_a], pair->face_a);
    assert_int_equal(b->bvh->view.face_ids[pair->place_b], pair->face_b);
}

/* Sheets slide through others, in steps of a hundredth to a quarter of the gap between two. */
static void sheets_that_slide(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model a = make_sheets(&env, 11), b = make_sheets(&env, 12);
    uint64_t seed = 13;
    size_t met = 0, apart = 0, changes = 0;
    for (int walk = 0; walk < (SANITIZED ? 3 : 6); ++walk) {
        fct_pair_hint hint = fct_pair_hint_none(), near_hint = hint;
        fct_pose pose = fct_pose_identity();
        /* Beside the sheets; every other walk turns, so that b comes with an edge first. */
        for (int k = 0; k < 3; ++k) pose.translation[k] = k == walk % 3 ? 1.02 : .2 * random_unit(&seed);
        if (walk % 2) pose.rotation[0][1] = .2, pose.rotation[1][0] = -.2;
        const double step = exp2(-6 - 5 * random_unit(&seed));
        bool before = false;
        for (int i = 0; i < 30; ++i) {
            double distance;
            static fct_face_pair pairs[FACES * FACES];
            const size_t count =
                fct_bvh_pairs(a.bvh, b.bvh, &pose, SIZE_MAX, FACES * FACES, pairs, NULL, NULL);
            for (size_t k = 0; k < count; ++k) check_pair(&a, &b, &pose, &pairs[k]);
            if (i % 5 == 0) assert_int_equal(meet_all(&a, &b, &pose, i % 15 == 5 ? &distance : NULL), count);
            const bool meet = fct_bvh_overlap(a.bvh, b.bvh, &pose, &hint, NULL);
            assert_int_equal(meet, count > 0);
            if (meet) check_pair(&a, &b, &pose, &hint.pair);
            if (i % 15 == 5) {
                fct_distance found;
                assert_true(fct_bvh_distance(a.bvh, b.bvh, &pose, NULL, NULL, &found, NULL));
                assert_float_equal(found.distance, distance, 1e-12);
            }
            const bool near = fct_bvh_within(a.bvh, b.bvh, &pose, .01, NULL, NULL);
            assert_int_equal(fct_bvh_within(a.bvh, b.bvh, &pose, .01, &near_hint, NULL), near);
            if (i % 15 == 5) assert_int_equal(near, distance <= .01);
            met += meet, apart += !meet, changes += meet != before;
            before = meet;
            pose.translation[walk % 3] += i % 15 < 10 ? -step : step;
        }
    }
    assert_true(met > 8 && apart > 8 && changes > 2);
    assert_true(SANITIZED || (met > 20 && apart > 20 && changes > 8));
    model_release(&env, &a);
    model_release(&env, &b);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rays_meet_every_face),
        cmocka_unit_test(slabs_list_their_faces),
        cmocka_unit_test(winding_numbers_add_up_all_faces),
        cmocka_unit_test(mapped_points_find_their_face),
        cmocka_unit_test(sheets_that_slide),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
