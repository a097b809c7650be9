/* Hints along motions, against searches without hints, and against exact times of contact. */
#include "pairs.h"

#include "bvh/model.h"

/* Turns the pose about an axis through the world's origin and moves it. */
static void move_pose(fct_pose *pose, v3 axis, double angle, v3 shift) {
    double sine = sin(angle), cosine = cos(angle);
    for (int j = 0; j < 4; ++j) {
        double *t = pose->translation;
        v3 p = j < 3 ? v3_make(pose->rotation[0][j], pose->rotation[1][j], pose->rotation[2][j])
                     : v3_make(t[0], t[1], t[2]);
        v3 along = v3_scale(axis, (1 - cosine) * v3_dot(axis, p));
        p = v3_add(v3_mad(v3_scale(p, cosine), sine, v3_cross(axis, p)), along);
        if (j == 3) p = v3_add(p, shift);
        for (int i = 0; i < 3; ++i) *(j < 3 ? &pose->rotation[i][j] : &t[i]) = i ? i == 1 ? p.y : p.z : p.x;
    }
}

/* The answers with hints are those without. The last hint serves two questions in turns. Returns whether the
 * surfaces meet. */
static bool check_hints(const model *a, const model *b, const fct_pose *pose, fct_pair_hint hints[5]) {
    fct_face_pair pairs[2][40];
    fct_distance d[2];
    bool meet = fct_bvh_overlap(a->bvh, b->bvh, pose, NULL, NULL);
    assert_int_equal(fct_bvh_overlap(a->bvh, b->bvh, pose, &hints[0], NULL), meet);
    if (meet) {
        fct_contact contact;
        assert_true(fct_bvh_contact(a->bvh, b->bvh, pose, &hints[0].pair, &contact));
        /* Without the pair of faces, their pair of leaves answers. */
        fct_pair_hint leaves = hints[0];
        fct_visits visits = {0, 0, 0};
        leaves.pair = fct_face_pair_none();
        assert_true(fct_bvh_overlap(a->bvh, b->bvh, pose, &leaves, &visits));
        if (hints[0].touching) assert_int_equal(visits.nodes, 0);
    }
    memset(pairs, 0, sizeof pairs);
    size_t count = fct_bvh_pairs(a->bvh, b->bvh, pose, 40, 40, pairs[0], NULL, NULL);
    assert_int_equal(fct_bvh_pairs(a->bvh, b->bvh, pose, 40, 40, pairs[1], &hints[1], NULL), count);
    assert_memory_equal(pairs[0], pairs[1], sizeof pairs[0]);
    assert_true(fct_bvh_distance(a->bvh, b->bvh, pose, NULL, NULL, &d[0], NULL));
    assert_true(fct_bvh_distance(a->bvh, b->bvh, pose, NULL, &hints[2], &d[1], NULL));
    assert_true(d[0].distance == d[1].distance);
    for (int k = -1; k < 2; ++k) {
        double limit = d[0].distance * (1 + k * 1e-9);
        assert_int_equal(fct_bvh_within(a->bvh, b->bvh, pose, limit, &hints[3], NULL),
                         fct_bvh_within(a->bvh, b->bvh, pose, limit, NULL, NULL));
        assert_int_equal(fct_bvh_within(a->bvh, b->bvh, pose, limit, &hints[4], NULL),
                         fct_bvh_within(a->bvh, b->bvh, pose, limit, NULL, NULL));
        assert_int_equal(fct_bvh_overlap(a->bvh, b->bvh, pose, &hints[4], NULL), meet);
    }
    return meet;
}

/* Steps from 2^-18 to 2^-2 of the size, pauses and jumps, into and out of contact. */
static void walks(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model models[3] = {pair_model_make(&env, make_pebble(&env, 16, 1)),
                       pair_model_make(&env, make_pebble(&env, 11, 2)),
                       pair_model_make(&env, make_soup(&env, 150, 3))};
    uint64_t seed = 4;
    size_t met = 0, total = 0;
    for (int walk = 0; walk < (SANITIZED ? 8 : 60); ++walk) {
        const model *a = &models[walk % 3], *b = &models[walk / 3 % 3];
        fct_pair_hint hints[5];
        for (int k = 0; k < 5; ++k) hints[k] = fct_pair_hint_none();
        fct_pose pose = random_pose(&seed, 1);
        double step = exp2(-2 - 16 * random_unit(&seed));
        v3 axis = random_direction(&seed), way = random_direction(&seed);
        for (int i = 0; i < 50; ++i) {
            met += check_hints(a, b, &pose, hints), ++total;
            if (i % 20 == 19) pose = random_pose(&seed, 1.2);
            if (i % 7 == 6) way = random_direction(&seed);
            if (i % 11 == 10) continue; /* a pause */
            move_pose(&pose, axis, walk % 4 ? step * random_unit(&seed) : 0, v3_scale(way, step));
            if (i == 30) /* a change of size, or of side */
                for (int r = 0; r < 9; ++r) pose.rotation[r / 3][r % 3] *= walk % 2 ? 3 : -1;
        }
    }
    assert_in_range(met, total / 10, total * 9 / 10);
    for (int k = 0; k < 3; ++k) model_release(&env, &models[k]);
}

/* A box of the half extents h about c. */
static fct_mesh make_block(const fct_env *env, v3 c, v3 h) {
    static const uint32_t sides[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                         {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(env, 8, 12, 0, &mesh), FCT_OK);
    for (int v = 0; v < 8; ++v) {
        v3 p = v3_make(v & 1 ? h.x : -h.x, v & 2 ? h.y : -h.y, v & 4 ? h.z : -h.z);
        v3_store(mesh.positions + 3 * (size_t)v, v3_add(c, p));
    }
    for (uint32_t s = 0; s < 6; ++s)
        for (uint32_t c0 = 0; c0 < 6; ++c0)
            mesh.triangles[6 * s + c0] = sides[s][c0 < 3 ? c0 : c0 == 3 ? 0 : c0 - 2];
    return mesh;
}

/* Closed form: two squares that face each other touch after a shift by exactly the gap, and not before. So
 * the front may not wait longer than the gap. It waits for most of it, also in many steps. */
static void a_shift_by_the_gap(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    const double scales[] = {1, 0x1p-20, 0x1p40, 1, 1}, factors[] = {1, 1, 1, 4, .25};
    for (size_t s = 0; s < FCT_LENGTH(scales); ++s)
        for (int steps = 1; steps <= 64; steps *= 8) {
            double gap = .5 * scales[s];
            fct_mesh mesh = make_grid(&env, 16);
            for (uint32_t i = 0; i < 3 * mesh.vertex_count; ++i) mesh.positions[i] *= (float)scales[s];
            model m = pair_model_make(&env, mesh);
            fct_pose pose = fct_pose_identity();
            fct_pair_hint hint = fct_pair_hint_none();
            for (int k = 0; k < 3; ++k) pose.rotation[k][k] = factors[s];
            pose.translation[2] = gap;
            assert_false(fct_bvh_overlap(m.bvh, m.bvh, &pose, &hint, NULL));
            for (int i = 1; i <= steps; ++i) {
                fct_visits visits = {0, 0, 0};
                pose.translation[2] = gap * (steps - i) / steps;
                assert_int_equal(fct_bvh_overlap(m.bvh, m.bvh, &pose, &hint, &visits), i == steps);
                if (i <= steps * 9 / 10) assert_int_equal(visits.nodes, 0);
            }
            /* Without the pair of faces, their pair of leaves answers. */
            fct_visits visits = {0, 0, 0};
            hint.pair = fct_face_pair_none();
            assert_true(fct_bvh_overlap(m.bvh, m.bvh, &pose, &hint, &visits));
            assert_int_equal(visits.nodes, 0);
            model_release(&env, &m);
        }
}

static v3 turn_axes(double x, double y, double z, int by) {
    double p[3] = {x, y, z};
    return v3_make(p[(3 - by) % 3], p[(4 - by) % 3], p[(5 - by) % 3]);
}

/* The tip of a bar that turns about its other end comes much farther than its centre, and the centre of the
 * bounds moves although the origin of b does not. Closed form: the tip touches the block at the angle at
 * which its lower corner reaches the height of the block. Along each axis. */
static void a_bar_that_turns(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    double reach = sqrt(64 + .125 * .125), angle = asin(1 / reach) - asin(.125 / reach);
    for (int axis = 0; axis < 3; ++axis) {
        model floor =
            pair_model_make(&env, make_block(&env, turn_axes(7, 0, -2, axis), turn_axes(2, 1, 1, axis)));
        model bar =
            pair_model_make(&env, make_block(&env, turn_axes(4, 0, 0, axis), turn_axes(4, .25, .125, axis)));
        for (int k = 0; k < 2; ++k)
            for (int steps = 1; steps < 40; ++steps) {
                fct_pair_hint hint = fct_pair_hint_none();
                for (int i = 0; i <= steps; ++i) {
                    double turned = angle * (i == steps ? 1 + 1e-9 : (double)i / steps);
                    fct_pose pose = fct_pose_identity(), back;
                    move_pose(&pose, turn_axes(0, 1, 0, axis), turned, v3_make(0, 0, 0));
                    back = invert_pose(&pose);
                    bool meet = k ? fct_bvh_overlap(bar.bvh, floor.bvh, &back, &hint, NULL)
                                  : fct_bvh_overlap(floor.bvh, bar.bvh, &pose, &hint, NULL);
                    assert_int_equal(meet, i == steps);
                }
            }
        model_release(&env, &floor);
        model_release(&env, &bar);
    }
}

/* What a hint knows about other models does not count: exchanged models, and moved vertices. */
static void hints_of_other_models(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model a = pair_model_make(&env, make_block(&env, v3_make(0, 0, 0), v3_make(1, 1, 1))),
          b = pair_model_make(&env, make_block(&env, v3_make(3, 0, 0), v3_make(1, 1, 1)));
    fct_pair_hint hint = fct_pair_hint_none(), twin;
    fct_visits visits = {0, 0, 0};
    assert_false(fct_bvh_overlap(a.bvh, b.bvh, NULL, &hint, NULL));
    twin = hint;
    assert_true(fct_bvh_overlap(a.bvh, a.bvh, NULL, &hint, NULL));
    assert_true(fct_bvh_overlap(b.bvh, b.bvh, NULL, &hint, NULL));
    assert_false(fct_bvh_overlap(b.bvh, a.bvh, NULL, &hint, NULL));
    hint = twin;
    fct_bvh *moved;
    for (uint32_t i = 0; i < 3 * b.mesh.vertex_count; i += 3) b.mesh.positions[i] -= 1;
    assert_int_equal(fct_bvh_refit(&env, b.bvh, b.mesh.positions, &moved, NULL), FCT_OK);
    assert_true(fct_bvh_overlap(a.bvh, moved, NULL, &hint, NULL));
    fct_bvh_destroy(moved);
    /* The same content is the same model. */
    for (uint32_t i = 0; i < 3 * b.mesh.vertex_count; i += 3) b.mesh.positions[i] += 1;
    assert_int_equal(fct_bvh_refit(&env, b.bvh, b.mesh.positions, &moved, NULL), FCT_OK);
    assert_false(fct_bvh_overlap(a.bvh, moved, NULL, &twin, &visits));
    assert_int_equal(visits.nodes, 0);
    fct_bvh_destroy(moved);
    model_release(&env, &a);
    model_release(&env, &b);
}

/* Corners of b that arithmetic moves by more than the steps do. */
static void a_far_sheet(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model a = pair_model_make(&env, make_grid(&env, 8)), b = pair_model_make(&env, make_far_sheet(&env, 8));
    uint64_t seed = 80;
    size_t met = 0;
    const int count = SANITIZED ? 20 : 100;
    for (int i = 0; i < count; ++i) {
        fct_pose pose = place_far_sheet(&seed);
        fct_pair_hint hint = fct_pair_hint_none();
        for (int k = 0; k < 10; ++k) {
            bool meet = fct_bvh_overlap(a.bvh, b.bvh, &pose, NULL, NULL);
            assert_int_equal(fct_bvh_overlap(a.bvh, b.bvh, &pose, &hint, NULL), meet);
            met += meet;
            pose.translation[2] += 2e-5 * (2 * random_unit(&seed) - 1);
            pose.rotation[2][0] += 0x1p-60 * (2 * random_unit(&seed) - 1);
        }
    }
    assert_in_range(met, count, 9 * count);
    model_release(&env, &a);
    model_release(&env, &b);
}

/* The pair of leaves of the contact answers the same question again. */
static void check_leaves(const model *m, const fct_pose *pose, fct_pair_hint *hint) {
    fct_visits visits = {0, 0, 0};
    hint->pair = fct_face_pair_none();
    assert_true(hint->touching);
    assert_true(fct_bvh_overlap(m->bvh, m->bvh, pose, hint, &visits));
    assert_int_equal(visits.nodes, 0);
}

/* A body beside another one moves into contact by one step. Each pair of the front alone, as if b had not
 * come as far as the others, leads to the contacts below it. */
static void contacts_below_a_front(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = pair_model_make(&env, make_pebble(&env, 16, 10));
    uint64_t seed = 21;
    size_t below = 0, total = 0;
    for (int walk = 0; walk < (SANITIZED ? 20 : 60); ++walk) {
        fct_pair_hint hint = fct_pair_hint_none(), before;
        fct_pose pose = random_pose(&seed, 0);
        v3 away = v3_scale(random_direction(&seed), 1.9);
        pose.translation[0] = away.x, pose.translation[1] = away.y, pose.translation[2] = away.z;
        if (fct_bvh_overlap(m.bvh, m.bvh, &pose, &hint, NULL)) continue;
        before = hint;
        for (int k = 0; k < 3; ++k) pose.translation[k] *= .6;
        if (!fct_bvh_overlap(m.bvh, m.bvh, &pose, &hint, NULL)) continue;
        check_leaves(&m, &pose, &hint);
        bool any = false;
        for (uint32_t i = 0; i < before.front_count; ++i) {
            hint = before;
            for (uint32_t k = 0; k < hint.front_count; ++k) hint.front[k].reach = k == i ? -1 : 1e30f;
            hint.effort = 1000; /* so that the front is used */
            if (!fct_bvh_overlap(m.bvh, m.bvh, &pose, &hint, NULL)) continue;
            check_leaves(&m, &pose, &hint);
            any = true, ++below;
        }
        assert_true(any);
        ++total;
    }
    assert_true(total >= 10 && below > total);
    model_release(&env, &m);
}

/* What hints save, measured, and 5 % above: slow bodies close to each other, fast ones, and contact that
 * lasts. */
static void hints_save_visits(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = pair_model_make(&env, make_pebble(&env, 60, 10));
    fct_visits plain[3] = {{0}}, hinted[3] = {{0}}, within = {0};
    for (int kind = 0; kind < 3; ++kind) {
        uint64_t seed = 20;
        for (int walk = 0; walk < 20; ++walk) {
            fct_pair_hint hint = fct_pair_hint_none(), near = hint;
            fct_pose pose = random_pose(&seed, 0);
            v3 away = v3_scale(random_direction(&seed), kind == 2 ? 1.4 : 1.75),
               axis = random_direction(&seed);
            pose.translation[0] = away.x, pose.translation[1] = away.y, pose.translation[2] = away.z;
            for (int i = 0; i < 20; ++i) {
                bool meet = fct_bvh_overlap(m.bvh, m.bvh, &pose, NULL, &plain[kind]);
                assert_int_equal(fct_bvh_overlap(m.bvh, m.bvh, &pose, &hint, &hinted[kind]), meet);
                if (kind == 0) fct_bvh_within(m.bvh, m.bvh, &pose, .02, &near, &within);
                move_pose(&pose, axis, kind == 1 ? .2 : 2e-5, v3_scale(axis, kind == 1 ? .01 : 1e-5));
            }
        }
    }
    /* Measured: 4680, 8976, 3360 nodes; 234, 8215, 168 with hints; 228 within a distance. */
    assert_in_range(within.nodes, 200, 239);
    assert_in_range(hinted[0].nodes, 200, 245);
    assert_in_range(hinted[1].nodes, 7000, 8620);
    assert_in_range(hinted[2].nodes, 140, 176);
    for (int kind = 0; kind < 3; ++kind) assert_true(hinted[kind].nodes < plain[kind].nodes);
    model_release(&env, &m);
}

/* Frames of a tracker give the same bodies as single calls, for every number of threads. */
static void trackers(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model models[2] = {pair_model_make(&env, make_pebble(&env, 8, 40)),
                       pair_model_make(&env, make_block(&env, v3_make(0, 0, 0), v3_make(.4, .5, .6)))};
    enum { COUNT = 40, FRAMES = 30, ROOM = COUNT * COUNT };
    static fct_body_pair pairs[3][ROOM];
    fct_body bodies[COUNT];
    v3 way[COUNT];
    uint64_t seed = 41;
    fct_body_tracker *trackers[2];
    for (int i = 0; i < COUNT; ++i) {
        bodies[i] = (fct_body){models[i % 2].bvh, random_pose(&seed, 2)};
        way[i] = v3_scale(random_direction(&seed), exp2(-2 - 12 * random_unit(&seed)));
    }
    fct_env envs[2] = {env, env};
    envs[0].thread_count = 1, envs[1].thread_count = 3;
    for (int k = 0; k < 2; ++k) assert_int_equal(fct_body_tracker_create(&envs[k], &trackers[k]), FCT_OK);
    size_t total = 0;
    for (int f = 0; f < FRAMES; ++f) {
        uint32_t count = f % 9 == 8 ? COUNT / 2 : COUNT; /* bodies leave and come back */
        size_t found[3];
        if (f == 12) bodies[5].bvh = models[0].bvh;
        assert_int_equal(fct_bodies_touching(&env, count, bodies, ROOM, pairs[2], &found[2]), FCT_OK);
        for (int k = 0; k < 2; ++k)
            assert_int_equal(fct_body_tracker_touching(trackers[k], count, bodies, ROOM, pairs[k], &found[k]),
                             FCT_OK);
        assert_int_equal(found[0], found[2]);
        assert_int_equal(found[1], found[2]);
        assert_memory_equal(pairs[0], pairs[1], found[0] * sizeof *pairs[0]);
        for (size_t i = 0; i < found[0]; ++i) {
            const fct_body_pair *one = &pairs[0][i];
            assert_int_equal(one->body_a, pairs[2][i].body_a);
            assert_int_equal(one->body_b, pairs[2][i].body_b);
        }
        total += found[0];
        for (int i = 0; i < COUNT; ++i)
            for (int k = 0; k < 3; ++k)
                bodies[i].pose.translation[k] += k ? k == 1 ? way[i].y : way[i].z : way[i].x;
    }
    assert_in_range(total, 10 * FRAMES, 300 * FRAMES);
    /* An error leaves the last frame, and nothing touches nothing. */
    size_t none = 1;
    recorder r = {.text = ""};
    fct_env recording = recorder_env(&r);
    fct_body_tracker *last;
    assert_int_equal(fct_body_tracker_create(&recording, &last), FCT_OK);
    bodies[3].pose.translation[0] = NAN;
    assert_int_equal(fct_body_tracker_touching(last, COUNT, bodies, 0, NULL, &none), FCT_ERROR_DATA);
    assert_string_equal(r.text, "the pose of body 3 is not finite");
    assert_int_equal(none, 0);
    assert_int_equal(fct_body_tracker_touching(last, 0, NULL, 0, NULL, &none), FCT_OK);
    fct_body_tracker_destroy(last);
    fct_body_tracker_destroy(NULL);
    for (int k = 0; k < 2; ++k) fct_body_tracker_destroy(trackers[k]);
    for (int k = 0; k < 2; ++k) model_release(&env, &models[k]);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(walks),
        cmocka_unit_test(a_shift_by_the_gap),
        cmocka_unit_test(a_bar_that_turns),
        cmocka_unit_test(hints_of_other_models),
        cmocka_unit_test(a_far_sheet),
        cmocka_unit_test(contacts_below_a_front),
        cmocka_unit_test(hints_save_visits),
        cmocka_unit_test(trackers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
