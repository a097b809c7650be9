/* The distance of two models, against all pairs of faces; motions and first contacts; relations; bodies. */
#include "pairs.h"

#include "bvh/model.h"
#include "bvh/pair/triangles.h"

static double brute_distance(const fct_mesh *a, const fct_mesh *b, const fct_pose *pose) {
    double best = INFINITY;
    for (uint32_t f = 0; f < a->face_count; ++f)
        for (uint32_t g = 0; g < b->face_count; ++g) {
            v3 p[3], q[3], pa, pb;
            face_corners(a, f, p);
            posed_corners(b, pose, g, q);
            best = fmin(best, fct_triangles_distance(p, q, &pa, &pb));
        }
    return sqrt(best);
}

static v3 load3(const double p[3]) {
    return v3_make(p[0], p[1], p[2]);
}

/* The points lie on the faces named, and the distance is theirs. */
static void check_answer(const model *a, const model *b, const fct_pose *pose, const fct_distance *d,
                         double size) {
    v3 p[3], q[3];
    face_corners(&a->mesh, d->pair.face_a, p);
    posed_corners(&b->mesh, pose, d->pair.face_b, q);
    v3 at_a = load3(d->point_a), at_b = load3(d->point_b);
    assert_true(v3_norm(v3_sub(plain_closest(at_a, p), at_a)) <= 1e-7 * size);
    assert_true(v3_norm(v3_sub(plain_closest(at_b, q), at_b)) <= 1e-7 * size);
    assert_true(fabs(v3_norm(v3_sub(at_a, at_b)) - d->distance) <= 1e-12 * size);
    assert_int_equal(fct_tree_get(a->tree).face_ids[d->pair.place_a], d->pair.face_a);
    assert_int_equal(fct_tree_get(b->tree).face_ids[d->pair.place_b], d->pair.face_b);
}

static void check_pose(const model *a, const model *b, const fct_pose *pose, double size) {
    double expected = brute_distance(&a->mesh, &b->mesh, pose);
    fct_distance d, e;
    assert_true(fct_bvh_distance(a->bvh, b->bvh, pose, NULL, NULL, &d, NULL));
    assert_true(d.distance == expected);
    check_answer(a, b, pose, &d, size);
    assert_int_equal(d.distance == 0, fct_bvh_overlap(a->bvh, b->bvh, pose, NULL, NULL));
    /* Hints, good and bad. */
    fct_pair_hint hints[3] = {{.pair = d.pair},
                              {.pair = {0, 0, a->mesh.face_count / 2, b->mesh.face_count / 3}},
                              fct_pair_hint_none()};
    for (int k = 0; k < 3; ++k) {
        assert_true(fct_bvh_distance(a->bvh, b->bvh, pose, NULL, &hints[k], &e, NULL));
        assert_true(e.distance == expected);
        assert_memory_equal(&hints[k].pair, &e.pair, sizeof e.pair);
    }
    /* Limits. */
    fct_distance_def def = fct_distance_def_default();
    def.max_distance = expected * (1 - 1e-9) - 1e-300;
    if (expected > 0) assert_false(fct_bvh_distance(a->bvh, b->bvh, pose, &def, NULL, &e, NULL));
    def.max_distance = expected * (1 + 1e-9);
    assert_true(fct_bvh_distance(a->bvh, b->bvh, pose, &def, NULL, &e, NULL) && e.distance == expected);
    if (expected > 0) assert_false(fct_bvh_within(a->bvh, b->bvh, pose, expected * (1 - 1e-9), NULL, NULL));
    assert_true(fct_bvh_within(a->bvh, b->bvh, pose, expected * (1 + 1e-9), NULL, NULL));
    assert_true(fct_bvh_within(a->bvh, b->bvh, pose, INFINITY, NULL, NULL));
    assert_false(fct_bvh_within(a->bvh, b->bvh, pose, NAN, NULL, NULL));
    assert_false(fct_bvh_within(a->bvh, b->bvh, pose, -1, NULL, NULL));
    /* Tolerances. */
    def = fct_distance_def_default();
    for (int k = 0; k < 2; ++k) {
        def.relative = k ? .3 : 0, def.absolute = k ? 0 : .1 * size;
        assert_true(fct_bvh_distance(a->bvh, b->bvh, pose, &def, NULL, &e, NULL));
        assert_true(e.distance >= expected && e.distance <= expected * (1 + def.relative) + def.absolute);
        check_answer(a, b, pose, &e, size);
    }
}

static void distances_of_pebbles(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model a = pair_model_make(&env, make_pebble(&env, 9, 1)),
          b = pair_model_make(&env, make_pebble(&env, 8, 2));
    uint64_t seed = 3;
    for (int i = 0; i < (SANITIZED ? 5 : 40); ++i) {
        fct_pose pose = random_pose(&seed, i % 4 ? 2 : 40);
        check_pose(&a, &b, &pose, 1);
        /* Exchanged, the distance is the same to rounding. */
        fct_pose back = invert_pose(&pose);
        fct_distance d, e;
        fct_bvh_distance(a.bvh, b.bvh, &pose, NULL, NULL, &d, NULL);
        fct_bvh_distance(b.bvh, a.bvh, &back, NULL, NULL, &e, NULL);
        assert_true(fabs(d.distance - e.distance) < 1e-12);
    }
    model_release(&env, &a);
    model_release(&env, &b);
}

/* Far apart beside their size, very unequal, sheared, and with degenerate faces. */
static void distances_at_extremes(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    uint64_t seed = 4;
    static const double sizes[] = {1, 1e-4, 1e4}, aways[] = {3, 100, 1e4, 1e7};
    for (size_t s = 0; s < FCT_LENGTH(sizes); ++s) {
        fct_mesh mesh = s == 1 ? make_soup(&env, 120, 5) : make_pebble(&env, 6, 6);
        for (uint32_t i = 0; i < 3 * mesh.vertex_count; ++i) mesh.positions[i] *= (float)sizes[s];
        model a = pair_model_make(&env, make_pebble(&env, 6, 7)), b = pair_model_make(&env, mesh);
        for (size_t w = 0; w < FCT_LENGTH(aways); ++w)
            for (int shear = 0; shear < 2; ++shear) {
                fct_pose pose = random_pose(&seed, 0);
                v3 away = v3_scale(random_direction(&seed), aways[w] * fmax(1, sizes[s]));
                pose.translation[0] = away.x, pose.translation[1] = away.y, pose.translation[2] = away.z;
                if (shear)
                    for (int r = 0; r < 3; ++r) pose.rotation[r][0] += .4 * pose.rotation[r][1];
                check_pose(&a, &b, &pose, aways[w] * fmax(1, sizes[s]));
            }
        model_release(&env, &a);
        model_release(&env, &b);
    }
}

static void distances_of_a_far_sheet(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model a = pair_model_make(&env, make_grid(&env, 8)), b = pair_model_make(&env, make_far_sheet(&env, 8));
    uint64_t seed = 80;
    for (int i = 0; i < (SANITIZED ? 10 : 80); ++i) {
        fct_pose pose = place_far_sheet(&seed);
        check_pose(&a, &b, &pose, 1);
    }
    model_release(&env, &a);
    model_release(&env, &b);
}

/* Any pair is within an infinite tolerance. */
static void infinite_tolerances(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = pair_model_make(&env, make_pebble(&env, 6, 8));
    fct_pose pose = fct_pose_identity();
    pose.translation[0] = 5;
    for (int k = 0; k < 6; ++k) {
        fct_distance_def def = fct_distance_def_default();
        fct_distance d;
        if (k % 3 != 1) def.relative = INFINITY;
        if (k % 3 != 0) def.absolute = INFINITY;
        def.max_distance = k < 3 ? INFINITY : 10;
        assert_true(fct_bvh_distance(m.bvh, m.bvh, &pose, &def, NULL, &d, NULL));
        assert_true(d.distance >= 3 && d.distance <= 7);
        def.max_distance = 2;
        assert_false(fct_bvh_distance(m.bvh, m.bvh, &pose, &def, NULL, &d, NULL));
    }
    model_release(&env, &m);
}

/* Two triangles over [-500, 500]^2 in the plane z = 0. */
static fct_mesh make_floor(const fct_env *env) {
    fct_mesh mesh = make_grid(env, 1);
    for (uint32_t i = 0; i < 3 * mesh.vertex_count; ++i)
        if (i % 3 < 2) mesh.positions[i] = 1000 * mesh.positions[i] - 500;
    return mesh;
}

/* Small models near triangles whose centres are far away, from either side. */
static void distances_from_a_floor(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model few = pair_model_make(&env, make_pebble(&env, 10, 90)),
          many = pair_model_make(&env, make_pebble(&env, 60, 91)),
          ground = pair_model_make(&env, make_floor(&env));
    uint64_t seed = 92;
    fct_visits visits[2] = {{0, 0, 0}, {0, 0, 0}};
    for (int i = 0; i < 20; ++i) {
        fct_pose pose = random_pose(&seed, 300);
        pose.translation[2] = 1.2 + .5 * random_unit(&seed);
        fct_pose back = invert_pose(&pose);
        if (i % 4 == 0) {
            check_pose(&ground, &few, &pose, 1000);
            check_pose(&few, &ground, &back, 1000);
        }
        fct_distance d, e;
        assert_true(fct_bvh_distance(ground.bvh, many.bvh, &pose, NULL, NULL, &d, &visits[0]));
        assert_true(fct_bvh_distance(many.bvh, ground.bvh, &back, NULL, NULL, &e, &visits[1]));
        double least = INFINITY;
        for (uint32_t v = 0; v < many.mesh.vertex_count; ++v)
            least = fmin(least, pose_point(&pose, v3_load(many.mesh.positions + 3 * (size_t)v)).z);
        assert_true(fabs(d.distance - least) < 1e-12 && fabs(e.distance - least) < 1e-10);
    }
    for (int k = 0; k < 2; ++k) {
        /* Measured: 470 and 430 nodes, 549 and 711 triangles. Without pruning: 6220 nodes. */
        assert_in_range(visits[k].nodes, 200, k ? 451 : 493);
        assert_in_range(visits[k].triangles, 200, k ? 746 : 576);
    }
    model_release(&env, &few);
    model_release(&env, &many);
    model_release(&env, &ground);
}

/* Two unit cubes, side by side, over an edge, and over a corner. */
static fct_mesh make_cube(const fct_env *env) {
    static const uint32_t quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                         {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(env, 8, 12, 0, &mesh), FCT_OK);
    for (int v = 0; v < 8; ++v)
        for (int k = 0; k < 3; ++k) mesh.positions[3 * v + k] = (float)(v >> k & 1);
    for (int q = 0; q < 6; ++q) {
        uint32_t two[6] = {quads[q][0], quads[q][1], quads[q][2], quads[q][0], quads[q][2], quads[q][3]};
        memcpy(mesh.triangles + 6 * q, two, sizeof two);
    }
    return mesh;
}

static void distances_of_cubes(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = pair_model_make(&env, make_cube(&env));
    static const struct {
        double shift[3], expected;
    } cases[] = {{{3, .25, .5}, 2}, {{-1.5, .3, 0}, .5}, {{4, 5, .2}, 5},
                 {{3, 3, -2}, 3},   {{1, 0, 0}, 0},      {{1, 1, 1}, 0},
                 {{0, 0, 0}, 0},    {{.5, .5, .5}, 0},   {{0x1.000002p0, 0, 0}, 0x1p-23}};
    for (size_t i = 0; i < FCT_LENGTH(cases); ++i) {
        fct_pose pose = fct_pose_identity();
        memcpy(pose.translation, cases[i].shift, sizeof pose.translation);
        fct_distance d;
        assert_true(fct_bvh_distance(m.bvh, m.bvh, &pose, NULL, NULL, &d, NULL));
        assert_true(fabs(d.distance - cases[i].expected) < 1e-15);
    }
    model_release(&env, &m);
}

static void distance_searches_visit_few(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = pair_model_make(&env, make_pebble(&env, 60, 10));
    uint64_t seed = 11;
    fct_visits visits = {0, 0, 0}, hinted = {0, 0, 0}, far = {0, 0, 0}, rough[2] = {{0, 0, 0}, {0, 0, 0}};
    for (int i = 0; i < 60; ++i) {
        fct_pose pose = random_pose(&seed, 0);
        v3 away = v3_scale(random_direction(&seed), 2.2);
        pose.translation[0] = away.x, pose.translation[1] = away.y, pose.translation[2] = away.z;
        fct_distance d;
        fct_pair_hint hint = fct_pair_hint_none();
        fct_bvh_distance(m.bvh, m.bvh, &pose, NULL, &hint, &d, &visits);
        fct_bvh_distance(m.bvh, m.bvh, &pose, NULL, &hint, &d, &hinted);
        for (int k = 0; k < 2; ++k) {
            fct_distance_def def = fct_distance_def_default();
            *(k ? &def.absolute : &def.relative) = .2;
            fct_bvh_distance(m.bvh, m.bvh, &pose, &def, NULL, &d, &rough[k]);
        }
        for (int k = 0; k < 3; ++k) pose.translation[k] *= 1e6;
        fct_bvh_distance(m.bvh, m.bvh, &pose, NULL, NULL, &d, &far);
    }
    /* Measured: 22436, 21838, 51972 nodes, 15125 and 8252 with tolerances; 2116, 2064, 4394 triangles. */
    assert_in_range(rough[0].nodes, 8000, 15870);
    assert_in_range(rough[1].nodes, 4000, 8670);
    assert_in_range(visits.nodes, 18000, 23540);
    assert_in_range(hinted.nodes, 15000, 22900);
    assert_in_range(far.nodes, 40000, 54500);
    assert_in_range(visits.triangles, 1000, 2220);
    assert_in_range(hinted.triangles, 1000, 2160);
    assert_in_range(far.triangles, 3000, 4610);
    model_release(&env, &m);
}

/* A sphere in a sphere: everywhere the surfaces are about equally near, so that the queue of a search is
 * full. The inner one, scaled by s, lies below the planes of the outer faces, at their heights h: the
 * distance is (1 - s) times the least h. */
static void distances_of_nested_spheres(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = pair_model_make(&env, make_sphere(&env, 28));
    double least = INFINITY;
    for (uint32_t f = 0; f < m.mesh.face_count; ++f) {
        v3 p[3];
        face_corners(&m.mesh, f, p);
        least = fmin(least, v3_dot(v3_unit(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]))), p[0]));
    }
    static const double factors[] = {.8, .99};
    for (size_t i = 0; i < FCT_LENGTH(factors); ++i) {
        fct_pose pose = fct_pose_identity();
        for (int k = 0; k < 3; ++k) pose.rotation[k][k] = factors[i];
        fct_distance d;
        fct_visits visits = {0, 0, 0};
        assert_true(fct_bvh_distance(m.bvh, m.bvh, &pose, NULL, NULL, &d, &visits));
        assert_true(fabs(d.distance - (1 - factors[i]) * least) < 1e-7);
        assert_in_range(visits.triangles, 2000, i ? 18400 : 4440); /* measured: 4236 and 17583 */
    }
    model_release(&env, &m);
}

/* A maximum and a tolerance together: within the maximum, a pair is always found. */
static void maximum_and_tolerance(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    uint64_t seed = 60;
    size_t found = 0, total = 0;
    for (int i = 0; i < (SANITIZED ? 100 : 1000); ++i) {
        model a = pair_model_make(&env, make_soup(&env, 12, seed + 1)),
              b = pair_model_make(&env, make_soup(&env, 9, seed));
        fct_pose pose = random_pose(&seed, 2);
        double expected = brute_distance(&a.mesh, &b.mesh, &pose);
        fct_distance_def def = fct_distance_def_default();
        fct_distance d;
        def.relative = .2, def.absolute = .01,
        def.max_distance = expected * (1 + .03 * (random_unit(&seed) - .3));
        bool near = expected <= def.max_distance;
        assert_int_equal(fct_bvh_distance(a.bvh, b.bvh, &pose, &def, NULL, &d, NULL), near);
        if (near) assert_true(d.distance <= def.max_distance && d.distance >= expected);
        assert_true(fct_bvh_distance(a.bvh, b.bvh, &pose, NULL, NULL, &d, NULL) && d.distance == expected);
        found += near, ++total;
        model_release(&env, &a);
        model_release(&env, &b);
    }
    assert_in_range(found, total / 2, total * 9 / 10);
}

/* A needle that is sharp at its first corner, and a corner of another face behind its tip. */
static void distances_of_needles(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    uint64_t seed = 61;
    for (int i = 0; i < (SANITIZED ? 100 : 2000); ++i) {
        fct_mesh needle, face;
        assert_int_equal(fct_mesh_create(&env, 3, 1, 0, &needle), FCT_OK);
        assert_int_equal(fct_mesh_create(&env, 3, 1, 0, &face), FCT_OK);
        double thin = exp2(-20 - 6 * random_unit(&seed)), back = -.05 - .3 * random_unit(&seed);
        float corners[9] = {0, 0, 0, 1, 0, 0, 1, (float)thin, 0};
        memcpy(needle.positions, corners, sizeof corners);
        v3_store(face.positions, v3_make(back, .3 * thin * random_unit(&seed), 0));
        for (int c = 1; c < 3; ++c)
            v3_store(face.positions + 3 * c,
                     v3_add(v3_make(back - 1, 0, 0), v3_scale(random_direction(&seed), .7)));
        for (uint32_t c = 0; c < 3; ++c) needle.triangles[c] = face.triangles[c] = c;
        model a = pair_model_make(&env, needle), b = pair_model_make(&env, face);
        fct_pose pose = fct_pose_identity();
        fct_distance d;
        assert_true(fct_bvh_distance(a.bvh, b.bvh, &pose, NULL, NULL, &d, NULL));
        assert_true(d.distance == brute_distance(&a.mesh, &b.mesh, &pose));
        model_release(&env, &a);
        model_release(&env, &b);
    }
}

/* ---- Motions ---- */

static void motions_are_steady(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = pair_model_make(&env, make_pebble(&env, 6, 20));
    uint64_t seed = 21;
    fct_bounds bounds = fct_bvh_bounds(m.bvh);
    v3 center = v3_scale(v3_add(v3_load(bounds.lower), v3_load(bounds.upper)), .5);
    for (int i = 0; i < 200; ++i) {
        fct_motion motion = {random_pose(&seed, 2), random_pose(&seed, 2)};
        if (i % 4 == 0) memcpy(motion.to.rotation, motion.from.rotation, sizeof motion.to.rotation);
        fct_pose ends[2] = {fct_motion_at(m.bvh, &motion, 0), fct_motion_at(m.bvh, &motion, 1)};
        assert_memory_equal(&ends[0], &motion.from, sizeof ends[0]);
        assert_memory_equal(&ends[1], &motion.to, sizeof ends[1]);
        v3 c0 = pose_point(&motion.from, center), c1 = pose_point(&motion.to, center),
           p = v3_add(center, random_direction(&seed));
        double steps[4];
        for (int k = 0; k <= 4; ++k) {
            fct_pose at = fct_motion_at(m.bvh, &motion, k / 4.0),
                     next = fct_motion_at(m.bvh, &motion, (k + 1) / 4.0);
            /* The centre moves along a line, and the rotation stays one. */
            v3 expected = v3_mad(c0, k / 4.0, v3_sub(c1, c0));
            assert_true(v3_norm(v3_sub(pose_point(&at, center), expected)) < 1e-12);
            for (int r = 0; r < 3; ++r)
                for (int s = 0; s < 3; ++s) {
                    double dot = r == s ? -1 : 0;
                    for (int j = 0; j < 3; ++j) dot += at.rotation[r][j] * at.rotation[s][j];
                    assert_true(fabs(dot) < 1e-12);
                }
            if (k == 4) break;
            /* Equal angles in equal times. */
            v3 before = v3_sub(pose_point(&at, p), pose_point(&at, center));
            v3 after = v3_sub(pose_point(&next, p), pose_point(&next, center));
            steps[k] = v3_norm(v3_sub(before, after));
            assert_true(fabs(steps[k] - steps[0]) < 1e-9);
        }
    }
    model_release(&env, &m);
}

/* A cube moves and turns towards a wall: closed forms. */
static void first_contacts_of_cubes(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model cube = pair_model_make(&env, make_cube(&env));
    fct_motion motion = {fct_pose_identity(), fct_pose_identity()};
    motion.from.translation[0] = 5, motion.to.translation[0] = -5;
    motion.from.translation[1] = motion.to.translation[1] = .25;
    fct_first_contact contact;
    double tolerance = 1e-3;
    /* The gap is 4 - 10 t. */
    assert_true(fct_bvh_first_contact(cube.bvh, cube.bvh, &motion, tolerance, &contact, NULL));
    assert_true(contact.time <= .4 - 4e-5 && contact.time >= .4 - 1.01e-4);
    assert_true(contact.nearest.distance <= tolerance && contact.nearest.distance > tolerance * .4);
    assert_true(fabs(contact.pose.translation[0] - (5 - 10 * contact.time)) < 1e-12);
    /* It stops before. */
    motion.to.translation[0] = 1.01;
    assert_false(fct_bvh_first_contact(cube.bvh, cube.bvh, &motion, tolerance, &contact, NULL));
    /* A quarter turn about z beside the wall x = 1: the corner comes nearest at the eighth turn, at the
     * height of sqrt(1/2) from the centre. */
    motion = (fct_motion){fct_pose_identity(), {{{0, -1, 0}, {1, 0, 0}, {0, 0, 1}}, {1, 0, 0}}};
    motion.from.translation[0] = 1.1, motion.to.translation[0] = 2.1;
    assert_true(fct_bvh_first_contact(cube.bvh, cube.bvh, &motion, tolerance, &contact, NULL));
    double phi = contact.time * 1.5707963267948966, reach = 1.6 - sqrt(.5) * cos(.7853981633974483 - phi);
    assert_true(reach - 1 <= tolerance * 1.001 && reach - 1 >= tolerance * .499);
    /* At rest, near and apart; contact at once; not a rotation; no tolerance. */
    motion.to = motion.from = fct_pose_identity();
    motion.to.translation[0] = motion.from.translation[0] = 1.5;
    assert_false(fct_bvh_first_contact(cube.bvh, cube.bvh, &motion, .1, &contact, NULL));
    assert_true(fct_bvh_first_contact(cube.bvh, cube.bvh, &motion, .6, &contact, NULL) && contact.time == 0);
    motion.from.translation[0] = .5;
    assert_true(fct_bvh_first_contact(cube.bvh, cube.bvh, &motion, .1, &contact, NULL) && contact.time == 0);
    assert_false(fct_bvh_first_contact(cube.bvh, cube.bvh, &motion, 0, &contact, NULL));
    motion.to.rotation[0][0] = -1;
    assert_false(fct_bvh_first_contact(cube.bvh, cube.bvh, &motion, .1, &contact, NULL));
    model_release(&env, &cube);
}

/* A rod of length 20 turns by a quarter about its middle and hits a small cube half way. */
static void a_rod_that_turns(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_cube(&env), small = make_cube(&env);
    for (uint32_t v = 0; v < 8; ++v)
        for (uint32_t k = 0; k < 3; ++k) {
            mesh.positions[3 * v + k] = (mesh.positions[3 * v + k] - .5f) * (k == 0 ? 20 : .1f);
            small.positions[3 * v + k] = (small.positions[3 * v + k] - .5f) * .2f + (k < 2 ? 6.9f : 0);
        }
    model rod = pair_model_make(&env, mesh), cube = pair_model_make(&env, small);
    fct_motion motion = {fct_pose_identity(), {{{0, -1, 0}, {1, 0, 0}, {0, 0, 1}}, {0, 0, 0}}};
    fct_first_contact contact;
    assert_true(fct_bvh_first_contact(cube.bvh, rod.bvh, &motion, .001, &contact, NULL));
    /* The corner (7, 6.8) is below the diagonal; the rod is .05 thick on each side. */
    double angle = atan2(6.8, 7) - asin(.05 / hypot(6.8, 7));
    assert_true(fabs(contact.time * 1.5707963267948966 - angle) < .001);
    model_release(&env, &rod);
    model_release(&env, &cube);
}

/* At no sampled time before the first contact are the surfaces nearer than half of the tolerance. */
static void first_contacts_are_first(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model a = pair_model_make(&env, make_pebble(&env, 10, 30)),
          b = pair_model_make(&env, make_pebble(&env, 8, 31));
    uint64_t seed = 32;
    int met = 0;
    for (int i = 0; i < (SANITIZED ? 20 : 60); ++i) {
        fct_motion motion = {random_pose(&seed, 0), random_pose(&seed, 2)};
        motion.from.translation[0] = 4;
        double tolerance = .01;
        fct_first_contact contact = {.time = 1};
        bool found = fct_bvh_first_contact(a.bvh, b.bvh, &motion, tolerance, &contact, NULL);
        met += found;
        if (found) assert_true(contact.nearest.distance <= tolerance);
        for (int k = 0; k < 100; ++k) {
            fct_pose pose = fct_motion_at(b.bvh, &motion, contact.time * k / 100);
            assert_false(
                fct_bvh_within(a.bvh, b.bvh, &pose, found ? tolerance * .499 : tolerance, NULL, NULL));
        }
    }
    assert_in_range(met, SANITIZED ? 3 : 15, 59);
    model_release(&env, &a);
    model_release(&env, &b);
}

/* ---- Relations ---- */

/* A large and a small body, the small one also inwards, twice as two parts, and beside the large one. */
static void bodies_in_bodies(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh small = make_pebble(&env, 6, 51), two;
    assert_int_equal(fct_mesh_create(&env, 2 * small.vertex_count, 2 * small.face_count, 0, &two), FCT_OK);
    for (uint32_t i = 0; i < 3 * small.vertex_count; ++i) {
        small.positions[i] *= .1f;
        two.positions[i] = small.positions[i] + (i % 3 == 0 ? 3 : 0);
        two.positions[i + 3 * small.vertex_count] = small.positions[i];
    }
    for (uint32_t i = 0; i < 3 * small.face_count; ++i) {
        two.triangles[i] = small.triangles[i];
        two.triangles[i + 3 * small.face_count] = small.triangles[i] + small.vertex_count;
    }
    model large = pair_model_make(&env, make_pebble(&env, 10, 50)), one = pair_model_make(&env, small),
          both = pair_model_make(&env, two);
    assert_int_equal(both.bvh->part_count, 2);
    assert_int_equal(large.bvh->part_count, 1);
    uint64_t seed = 52;
    for (int i = 0; i < 20; ++i) {
        fct_pose pose = random_pose(&seed, .2), back = invert_pose(&pose);
        assert_int_equal(fct_bvh_relation(large.bvh, one.bvh, &pose, NULL, NULL), FCT_B_INSIDE);
        assert_int_equal(fct_bvh_relation(one.bvh, large.bvh, &back, NULL, NULL), FCT_A_INSIDE);
        /* One of two parts is enough. */
        assert_int_equal(fct_bvh_relation(large.bvh, both.bvh, &pose, NULL, NULL), FCT_B_INSIDE);
        assert_int_equal(fct_bvh_relation(both.bvh, large.bvh, &back, NULL, NULL), FCT_A_INSIDE);
        pose.translation[i % 3] += 5;
        back = invert_pose(&pose);
        assert_int_equal(fct_bvh_relation(large.bvh, one.bvh, &pose, NULL, NULL), FCT_APART);
        assert_int_equal(fct_bvh_relation(one.bvh, large.bvh, &back, NULL, NULL), FCT_APART);
        /* Ten times as large, the small one holds the other. */
        pose = random_pose(&seed, .2);
        for (int r = 0; r < 9; ++r) pose.rotation[r / 3][r % 3] *= i % 2 ? 100 : -100;
        assert_int_equal(fct_bvh_relation(large.bvh, one.bvh, &pose, NULL, NULL), FCT_A_INSIDE);
    }
    fct_pair_hint hint = fct_pair_hint_none();
    fct_pose pose = fct_pose_identity();
    assert_int_equal(fct_bvh_relation(large.bvh, large.bvh, &pose, &hint, NULL), FCT_TOUCHING);
    assert_true(hint.pair.face_a != FCT_NONE);
    memset(pose.rotation[2], 0, sizeof pose.rotation[2]);
    assert_int_equal(fct_bvh_relation(large.bvh, one.bvh, &pose, NULL, NULL), FCT_B_INSIDE);
    fct_mesh_release(&env, &small);
    one.mesh = (fct_mesh){0};
    model_release(&env, &large);
    model_release(&env, &one);
    model_release(&env, &both);
}

/* ---- Bodies ---- */

static void bodies_that_touch(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model models[2] = {pair_model_make(&env, make_pebble(&env, 8, 40)),
                       pair_model_make(&env, make_cube(&env))};
    enum { COUNT = 60 };
    fct_body bodies[COUNT];
    uint64_t seed = 41;
    for (int i = 0; i < COUNT; ++i) {
        bodies[i] = (fct_body){models[i % 2].bvh, random_pose(&seed, i == 7 ? 40 : 4)};
        if (i % 5 == 0)
            for (int r = 0; r < 9; ++r) bodies[i].pose.rotation[r / 3][r % 3] *= 1.5;
    }
    static fct_body_pair pairs[COUNT * COUNT], again[COUNT * COUNT];
    size_t found, count = 0, same;
    assert_int_equal(fct_bodies_touching(&env, COUNT, bodies, COUNT * COUNT, pairs, &found), FCT_OK);
    for (uint32_t i = 0; i < COUNT; ++i)
        for (uint32_t j = i + 1; j < COUNT; ++j) {
            /* All faces in the world: the sign of each pair is safe beside the rounding of the relative pose.
             */
            bool meet = false;
            const fct_mesh *a = &models[i % 2].mesh, *b = &models[j % 2].mesh;
            for (uint32_t f = 0; f < a->face_count && !meet; ++f)
                for (uint32_t g = 0; g < b->face_count && !meet; ++g) {
                    v3 p[3], q[3];
                    posed_corners(a, &bodies[i].pose, f, p);
                    posed_corners(b, &bodies[j].pose, g, q);
                    meet = fct_triangles_meet(p, q);
                }
            if (!meet) continue;
            assert_true(count < found);
            assert_int_equal(pairs[count].body_a, i);
            assert_int_equal(pairs[count].body_b, j);
            v3 p[3], q[3];
            posed_corners(a, &bodies[i].pose, pairs[count].faces.face_a, p);
            posed_corners(b, &bodies[j].pose, pairs[count].faces.face_b, q);
            assert_true(fct_triangles_meet(p, q));
            ++count;
        }
    assert_int_equal(count, found);
    assert_in_range(found, 20, COUNT * COUNT / 4);
    env.thread_count = 3;
    assert_int_equal(fct_bodies_touching(&env, COUNT, bodies, 5, again, &same), FCT_OK);
    assert_int_equal(same, found);
    assert_memory_equal(again, pairs, 5 * sizeof *pairs);
    assert_int_equal(fct_bodies_touching(&env, 0, NULL, 0, NULL, &same), FCT_OK);
    assert_int_equal(same, 0);
    recorder r = {.text = ""};
    fct_env recording = recorder_env(&r);
    bodies[3].pose.rotation[0][0] = NAN;
    assert_int_equal(fct_bodies_touching(&recording, COUNT, bodies, 0, NULL, &same), FCT_ERROR_DATA);
    assert_string_equal(r.text, "the pose of body 3 is not finite");
    bodies[3].pose = fct_pose_identity();
    memset(bodies[4].pose.rotation[0], 0, sizeof bodies[4].pose.rotation[0]);
    assert_int_equal(fct_bodies_touching(&recording, COUNT, bodies, 0, NULL, &same), FCT_ERROR_DATA);
    assert_string_equal(r.text, "the rotation of body 4 has no inverse");
    model plain = model_make(&env, make_cube(&env), FCT_BACKEND_OBB);
    bodies[2].bvh = plain.bvh;
    assert_int_equal(fct_bodies_touching(&recording, COUNT, bodies, 0, NULL, &same), FCT_ERROR_DATA);
    assert_string_equal(r.text, "body 2 has no FCT_BVH_PAIRS");
    env.thread_count = 0;
    model_release(&env, &plain);
    model_release(&env, &models[0]);
    model_release(&env, &models[1]);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(distances_of_pebbles),
        cmocka_unit_test(distances_at_extremes),
        cmocka_unit_test(distances_of_a_far_sheet),
        cmocka_unit_test(infinite_tolerances),
        cmocka_unit_test(distances_from_a_floor),
        cmocka_unit_test(distances_of_cubes),
        cmocka_unit_test(maximum_and_tolerance),
        cmocka_unit_test(distances_of_needles),
        cmocka_unit_test(distance_searches_visit_few),
        cmocka_unit_test(distances_of_nested_spheres),
        cmocka_unit_test(motions_are_steady),
        cmocka_unit_test(first_contacts_of_cubes),
        cmocka_unit_test(a_rod_that_turns),
        cmocka_unit_test(first_contacts_are_first),
        cmocka_unit_test(bodies_in_bodies),
        cmocka_unit_test(bodies_that_touch),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
