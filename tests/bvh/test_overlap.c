/* Pairs of faces of two models that meet, against all pairs by the test of two triangles. */
#include "pairs.h"

#include "bvh/model.h"
#include "bvh/pair/triangles.h"

typedef struct found_pairs {
    fct_face_pair *pairs;
    size_t count;
} found_pairs;

static int compare_pairs(const void *a, const void *b) {
    const fct_face_pair *x = a, *y = b;
    if (x->face_a != y->face_a) return x->face_a < y->face_a ? -1 : 1;
    return (x->face_b > y->face_b) - (x->face_b < y->face_b);
}

static found_pairs all_pairs(const fct_mesh *a, const fct_mesh *b, const fct_pose *pose) {
    size_t capacity = 1024;
    found_pairs out = {malloc(capacity * sizeof *out.pairs), 0};
    for (uint32_t f = 0; f < a->face_count; ++f)
        for (uint32_t g = 0; g < b->face_count; ++g) {
            v3 p[3], q[3];
            face_corners(a, f, p);
            posed_corners(b, pose, g, q);
            if (!fct_triangles_meet(p, q)) continue;
            if (out.count == capacity) out.pairs = realloc(out.pairs, (capacity *= 2) * sizeof *out.pairs);
            out.pairs[out.count++] = (fct_face_pair){f, g, 0, 0};
        }
    return out;
}

/* All answers about two models under a pose; returns the number of pairs. */
static size_t check_pose(const model *a, const model *b, const fct_pose *pose) {
    found_pairs expected = all_pairs(&a->mesh, &b->mesh, pose);
    size_t room = expected.count + 10;
    fct_face_pair *pairs = malloc(room * sizeof *pairs);
    fct_pair_hint hint = fct_pair_hint_none();
    assert_int_equal(fct_bvh_pairs(a->bvh, b->bvh, pose, SIZE_MAX, room, pairs, NULL, NULL), expected.count);
    const uint32_t *ids_a = fct_tree_get(a->tree).face_ids, *ids_b = fct_tree_get(b->tree).face_ids;
    for (size_t i = 0; i < expected.count; ++i) {
        assert_int_equal(ids_a[pairs[i].place_a], pairs[i].face_a);
        assert_int_equal(ids_b[pairs[i].place_b], pairs[i].face_b);
    }
    /* The first pairs are those of the whole answer. */
    size_t some = expected.count / 2;
    fct_face_pair *first = malloc((some + 1) * sizeof *first);
    assert_int_equal(fct_bvh_pairs(a->bvh, b->bvh, pose, some, some, first, NULL, NULL), some);
    assert_memory_equal(first, pairs, some * sizeof *first);
    free(first);
    assert_int_equal(fct_bvh_pairs(a->bvh, b->bvh, pose, SIZE_MAX, 0, NULL, NULL, NULL), expected.count);
    qsort(pairs, expected.count, sizeof *pairs, compare_pairs);
    for (size_t i = 0; i < expected.count; ++i) {
        assert_int_equal(pairs[i].face_a, expected.pairs[i].face_a);
        assert_int_equal(pairs[i].face_b, expected.pairs[i].face_b);
    }
    assert_int_equal(fct_bvh_overlap(a->bvh, b->bvh, pose, NULL, NULL), expected.count > 0);
    assert_int_equal(fct_bvh_overlap(a->bvh, b->bvh, pose, &hint, NULL), expected.count > 0);
    if (expected.count) {
        fct_contact contact;
        assert_non_null(bsearch(&hint.pair, pairs, expected.count, sizeof hint.pair, compare_pairs));
        assert_true(fct_bvh_contact(a->bvh, b->bvh, pose, &hint.pair, &contact));
        /* The hint alone answers. */
        fct_visits visits = {0, 0, 0};
        assert_true(fct_bvh_overlap(a->bvh, b->bvh, pose, &hint, &visits));
        assert_int_equal(visits.nodes, 0);
    } else {
        assert_int_equal(hint.pair.face_a, FCT_NONE);
    }
    free(pairs);
    free(expected.pairs);
    return expected.count;
}

static void pebbles_under_random_poses(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model a = pair_model_make(&env, make_pebble(&env, 12, 1)),
          b = pair_model_make(&env, make_pebble(&env, 9, 2));
    uint64_t seed = 3;
    size_t met = 0, apart = 0;
    for (int i = 0; i < (SANITIZED ? 20 : 150); ++i) {
        fct_pose pose = random_pose(&seed, 1.6);
        size_t count = check_pose(&a, &b, &pose);
        if (count)
            ++met;
        else
            ++apart;
    }
    assert_true(met >= 5 && apart >= 5);
    model_release(&env, &a);
    model_release(&env, &b);
}

/* Any matrix: scaled, mirrored, sheared, flat. */
static void any_matrix(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model a = pair_model_make(&env, make_pebble(&env, 9, 4)),
          b = pair_model_make(&env, make_soup(&env, 200, 5));
    uint64_t seed = 6;
    size_t met = 0;
    for (int i = 0; i < (SANITIZED ? 10 : 60); ++i) {
        fct_pose pose = random_pose(&seed, 1);
        double scale = exp2(8 * random_unit(&seed) - 6);
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c) {
                pose.rotation[r][c] *= i % 2 && c == 1 ? -scale : scale;
                if (i % 5 == 3) pose.rotation[r][c] += .5 * random_unit(&seed);
                if (i % 5 == 4 && c == 2) pose.rotation[r][c] = 0;
            }
        met += check_pose(&a, &b, &pose) > 0;
    }
    assert_true(met > (SANITIZED ? 0 : 5));
    model_release(&env, &a);
    model_release(&env, &b);
}

/* Identical models in one place, moved along a face, and stacked boxes: nearly every pair is degenerate. */
static void coincident_models(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model a = pair_model_make(&env, make_sphere(&env, 8)), grid = pair_model_make(&env, make_grid(&env, 12));
    fct_pose pose = fct_pose_identity();
    assert_true(check_pose(&a, &a, &pose) >= a.mesh.face_count);
    size_t same = check_pose(&grid, &grid, &pose);
    assert_true(same > 3 * grid.mesh.face_count);
    assert_int_equal(fct_bvh_pairs(grid.bvh, grid.bvh, NULL, SIZE_MAX, 0, NULL, NULL, NULL), same);
    pose.translation[0] = 1; /* shares an edge of the square */
    assert_true(check_pose(&grid, &grid, &pose) > 12);
    pose.translation[1] = 1; /* a corner */
    assert_true(check_pose(&grid, &grid, &pose) >= 1);
    pose.translation[1] = 0x1.000002p0;
    assert_int_equal(check_pose(&grid, &grid, &pose), 0);
    pose = fct_pose_identity();
    pose.translation[2] = 1e-300;
    assert_int_equal(check_pose(&grid, &grid, &pose), 0);
    model_release(&env, &a);
    model_release(&env, &grid);
}

/* Sizes 1e-6 to 1e6, far offsets, and very unequal sizes. */
static void sizes_and_places(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    uint64_t seed = 7;
    static const double sizes[] = {1e-6, 1, 1e6, 1e-30, 1e30}, ratios[] = {1, 1e-3, 1e4},
                        offsets[] = {0, 30, 1e4};
    size_t met = 0, total = 0;
    for (size_t s = 0; s < FCT_LENGTH(sizes); ++s)
        for (size_t r = 0; r < FCT_LENGTH(ratios); ++r)
            for (size_t o = 0; o < FCT_LENGTH(offsets); ++o) {
                fct_mesh meshes[2] = {make_pebble(&env, 9, s + 1), make_pebble(&env, 7, r + 1)};
                for (int k = 0; k < 2; ++k)
                    for (uint32_t i = 0; i < 3 * meshes[k].vertex_count; ++i) {
                        double x = meshes[k].positions[i] * sizes[s] * (k ? ratios[r] : 1);
                        meshes[k].positions[i] = (float)(x + (i % 3 == 0 ? offsets[o] * sizes[s] : 0));
                    }
                model a = pair_model_make(&env, meshes[0]), b = pair_model_make(&env, meshes[1]);
                for (int i = 0; i < 4; ++i) {
                    /* Turn b about a point of its own, and set it on a's surface. */
                    fct_pose pose = random_pose(&seed, 0);
                    v3 from = pose_point(&pose, v3_load(b.mesh.positions + 3 * (size_t)(i * 5)));
                    v3 to = v3_load(a.mesh.positions + 3 * (size_t)(i * 7));
                    double size = sizes[s] * (i % 2 ? ratios[r] : 0) * .3;
                    pose.translation[0] = to.x - from.x + size, pose.translation[1] = to.y - from.y,
                    pose.translation[2] = to.z - from.z + size;
                    met += check_pose(&a, &b, &pose) > 0, ++total;
                }
                model_release(&env, &a);
                model_release(&env, &b);
            }
    assert_true(met > total / 4);
}

/* Corners of b that arithmetic moves by more than float arithmetic moves boxes. */
static void a_far_sheet(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model a = pair_model_make(&env, make_grid(&env, 8)), b = pair_model_make(&env, make_far_sheet(&env, 8));
    uint64_t seed = 80;
    size_t met = 0;
    const int count = SANITIZED ? 20 : 150;
    for (int i = 0; i < count; ++i) {
        fct_pose pose = place_far_sheet(&seed);
        met += check_pose(&a, &b, &pose) > 0;
    }
    assert_in_range(met, count / 5, count - 1);
    model_release(&env, &a);
    model_release(&env, &b);
}

static void self_pairs(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh meshes[3] = {make_soup(&env, 300, 8), make_pebble(&env, 10, 9), make_sphere(&env, 6)};
    /* A sphere whose half is pushed through the other half. */
    for (uint32_t v = 0; v < meshes[2].vertex_count; ++v)
        if (meshes[2].positions[3 * v] > 0) meshes[2].positions[3 * v] -= .8f;
    for (int k = 0; k < 3; ++k) {
        model m = pair_model_make(&env, meshes[k]);
        const fct_mesh *mesh = &m.mesh;
        size_t room = (size_t)mesh->face_count * mesh->face_count, expected = 0;
        fct_face_pair *pairs = malloc(room * sizeof *pairs), *plain = malloc(room * sizeof *plain);
        for (uint32_t f = 0; f < mesh->face_count; ++f)
            for (uint32_t g = f + 1; g < mesh->face_count; ++g) {
                v3 p[3], q[3];
                bool neighbours = false;
                face_corners(mesh, f, p), face_corners(mesh, g, q);
                for (int i = 0; i < 9; ++i) neighbours |= v3_norm(v3_sub(p[i / 3], q[i % 3])) == 0;
                if (!neighbours && fct_triangles_meet(p, q)) plain[expected++] = (fct_face_pair){f, g, 0, 0};
            }
        assert_int_equal(expected == 0, k == 1);
        assert_int_equal(fct_bvh_self_pairs(m.bvh, SIZE_MAX, room, pairs, NULL), expected);
        if (expected) assert_int_equal(fct_bvh_self_pairs(m.bvh, 1, 0, NULL, NULL), 1);
        qsort(pairs, expected, sizeof *pairs, compare_pairs);
        const uint32_t *ids = fct_tree_get(m.tree).face_ids;
        for (size_t i = 0; i < expected; ++i) {
            assert_int_equal(pairs[i].face_a, plain[i].face_a);
            assert_int_equal(pairs[i].face_b, plain[i].face_b);
            assert_int_equal(ids[pairs[i].place_a], pairs[i].face_a);
            assert_int_equal(ids[pairs[i].place_b], pairs[i].face_b);
        }
        free(pairs);
        free(plain);
        model_release(&env, &m);
    }
}

/* The search visits what it must and little more: measured, and 5 % above. */
static void searches_visit_few(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = pair_model_make(&env, make_pebble(&env, 60, 10));
    uint64_t seed = 11;
    fct_visits touching = {0, 0, 0}, apart = {0, 0, 0};
    size_t met = 0, missed = 0;
    while (met < 60 || missed < 60) {
        fct_pose pose = random_pose(&seed, 0);
        double far =
            1.55 + .35 * random_unit(&seed); /* a statement each: compilers order arguments as they like */
        v3 away = v3_scale(random_direction(&seed), far);
        pose.translation[0] = away.x, pose.translation[1] = away.y, pose.translation[2] = away.z;
        fct_visits visits = {0, 0, 0};
        if (fct_bvh_overlap(m.bvh, m.bvh, &pose, NULL, &visits)) {
            if (met++ < 60) fct_visits_add(&touching, &visits);
        } else if (missed++ < 60) {
            fct_visits_add(&apart, &visits);
        }
    }
    /* Measured: 1417, 2548, 15257, 8539. */
    assert_in_range(touching.nodes, 1000, 1480);
    assert_in_range(touching.triangles, 1000, 2670);
    assert_in_range(apart.nodes, 12000, 16000);
    assert_in_range(apart.triangles, 5000, 8900);
    assert_true(touching.boxes == 8 * touching.nodes);
    /* A model with itself. Measured: 80759 boxes, 143760 triangles. */
    fct_visits own = {0, 0, 0};
    assert_int_equal(fct_bvh_self_pairs(m.bvh, SIZE_MAX, 0, NULL, &own), 0);
    assert_in_range(own.boxes, 40000, 84800);
    assert_in_range(own.triangles, 100000, 151000);
    model_release(&env, &m);
}

static void calls_without_answers(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = pair_model_make(&env, make_sphere(&env, 4)),
          plain = model_make(&env, make_sphere(&env, 4), FCT_BACKEND_OBB);
    fct_pose pose = fct_pose_identity();
    assert_false(fct_bvh_overlap(m.bvh, plain.bvh, &pose, NULL, NULL));
    assert_int_equal(fct_bvh_pairs(plain.bvh, m.bvh, &pose, 9, 0, NULL, NULL, NULL), 0);
    assert_int_equal(fct_bvh_self_pairs(plain.bvh, 9, 0, NULL, NULL), 0);
    assert_true(fct_bvh_overlap(m.bvh, m.bvh, &pose, NULL, NULL));
    for (int k = 0; k < 12; ++k) {
        double bad[] = {NAN, INFINITY, -INFINITY, 1e300};
        for (size_t i = 0; i < FCT_LENGTH(bad); ++i) {
            fct_pose broken = pose;
            (k < 9 ? &broken.rotation[k / 3][k % 3] : &broken.translation[k - 9])[0] = bad[i];
            fct_distance distance;
            assert_false(fct_bvh_overlap(m.bvh, m.bvh, &broken, NULL, NULL));
            assert_false(fct_bvh_distance(m.bvh, m.bvh, &broken, NULL, NULL, &distance, NULL));
        }
    }
    assert_int_equal(fct_bvh_pairs(m.bvh, m.bvh, NULL, 0, 0, NULL, NULL, NULL), 0);
    /* Ratios up to 1e30 have answers: of the shift beside a, of the shift beside b, and of the models. */
    for (int k = 0; k < 3; ++k)
        for (int beyond = 0; beyond < 2; ++beyond) {
            fct_pose large = fct_pose_identity();
            fct_distance distance;
            double ratio = beyond ? 1e31 : 1e29;
            for (int r = 0; r < 3; ++r)
                if (k) large.rotation[r][r] = k == 1 ? 1e-5 : ratio;
            if (k < 2) large.translation[1] = k ? ratio * 1e-5 : ratio;
            assert_int_equal(fct_bvh_distance(m.bvh, m.bvh, &large, NULL, NULL, &distance, NULL), !beyond);
            if (k < 2 && !beyond) assert_true(fabs(distance.distance / large.translation[1] - 1) < 1e-12);
            assert_false(k < 2 && fct_bvh_overlap(m.bvh, m.bvh, &large, NULL, NULL));
        }
    /* A stale hint is not believed. */
    fct_pair_hint hint = {.pair = {5, 5, 1000000, 3}};
    pose.translation[0] = 9;
    assert_false(fct_bvh_overlap(m.bvh, m.bvh, &pose, &hint, NULL));
    assert_true(fct_bvh_bytes(m.bvh) > fct_bvh_bytes(plain.bvh));
    model_release(&env, &m);
    model_release(&env, &plain);
}

/* A face without area has no contact, and a hint that meets gets its face ids. */
static void contacts_of_flat_faces(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh flat;
    assert_int_equal(fct_mesh_create(&env, 3, 1, 0, &flat), FCT_OK);
    float corners[9] = {-.5f, .25f, .125f, .5f, .25f, .125f, 0, .25f, .125f};
    memcpy(flat.positions, corners, sizeof corners);
    for (uint32_t c = 0; c < 3; ++c) flat.triangles[c] = c;
    model a = pair_model_make(&env, make_grid(&env, 1)), b = pair_model_make(&env, flat);
    uint64_t seed = 70;
    for (int i = 0; i < 200; ++i) {
        fct_pose pose = random_pose(&seed, .2);
        for (uint32_t place = 0; place < 2; ++place) {
            fct_face_pair pair = {0, 0, place, 0};
            fct_pair_hint only = {.pair = pair};
            fct_contact contact;
            assert_false(fct_bvh_contact(a.bvh, b.bvh, &pose, &pair, &contact));
            assert_false(fct_bvh_overlap(a.bvh, b.bvh, &pose, &only, NULL));
        }
    }
    fct_pair_hint hint = {.pair = {777, 888, 0, 0}};
    assert_true(fct_bvh_overlap(a.bvh, a.bvh, NULL, &hint, NULL));
    assert_int_equal(hint.pair.face_a, fct_tree_get(a.tree).face_ids[0]);
    assert_int_equal(hint.pair.face_b, fct_tree_get(a.tree).face_ids[0]);
    model_release(&env, &a);
    model_release(&env, &b);
}

/* A batch of poses gives the answers of single calls, with any number of threads. */
static void batches(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = pair_model_make(&env, make_pebble(&env, 12, 12));
    enum { COUNT = 333 };
    fct_pose poses[COUNT];
    uint64_t seed = 13, touching[2][(COUNT + 63) / 64];
    static fct_distance distances[2][COUNT];
    fct_distance_def def = fct_distance_def_default();
    def.max_distance = .4;
    for (int i = 0; i < COUNT; ++i) poses[i] = random_pose(&seed, 1.6);
    for (uint32_t k = 0; k < 2; ++k) {
        env.thread_count = k ? 5 : 1;
        fct_bvh_overlaps(m.bvh, m.bvh, COUNT, poses, touching[k]);
        fct_bvh_distances(m.bvh, m.bvh, COUNT, poses, &def, distances[k]);
    }
    assert_memory_equal(touching[0], touching[1], sizeof touching[0]);
    size_t near = 0;
    for (int i = 0; i < COUNT; ++i) {
        fct_distance one;
        bool found = fct_bvh_distance(m.bvh, m.bvh, &poses[i], &def, NULL, &one, NULL);
        assert_int_equal(touching[0][i / 64] >> i % 64 & 1,
                         fct_bvh_overlap(m.bvh, m.bvh, &poses[i], NULL, NULL));
        for (int k = 0; k < 2; ++k) {
            assert_int_equal(found, distances[k][i].pair.face_a != FCT_NONE);
            if (found) assert_true(one.distance == distances[k][i].distance);
            assert_int_equal(distances[k][i].pair.face_a, distances[0][i].pair.face_a);
        }
        near += found;
    }
    assert_in_range(near, 20, COUNT - 20);
    assert_int_equal(touching[0][COUNT / 64] >> COUNT % 64, 0);
    model_release(&env, &m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pebbles_under_random_poses),
        cmocka_unit_test(any_matrix),
        cmocka_unit_test(coincident_models),
        cmocka_unit_test(sizes_and_places),
        cmocka_unit_test(a_far_sheet),
        cmocka_unit_test(self_pairs),
        cmocka_unit_test(searches_visit_few),
        cmocka_unit_test(contacts_of_flat_faces),
        cmocka_unit_test(calls_without_answers),
        cmocka_unit_test(batches),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
