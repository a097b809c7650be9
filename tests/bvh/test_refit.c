/* A structure that follows moved vertices, against one that is built for them. */
#include "pairs.h"

#include "bvh/build/refit.h"
#include "bvh/model.h"
#include "bvh/near/sign/moments.h"

static float *copy_positions(const fct_mesh *mesh) {
    float *out = malloc(12 * (size_t)mesh->vertex_count);
    memcpy(out, mesh->positions, 12 * (size_t)mesh->vertex_count);
    return out;
}

static void assert_same_structure(const fct_bvh *a, const fct_bvh *b) {
    assert_memory_equal(a->nodes, b->nodes, a->node_bytes);
    assert_memory_equal(a->leaves, b->leaves, a->leaf_bytes);
    assert_memory_equal(a->pairs, b->pairs, a->pair_count * sizeof *a->pairs);
    assert_memory_equal(a->parts, b->parts, a->part_count * sizeof *a->parts);
    assert_memory_equal(a->moments, b->moments, a->moment_bytes);
}

static void unmoved_vertices_change_nothing(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = pair_model_make(&env, make_pebble(&env, 30, 1));
    fct_bvh *same, *again;
    double work = 0;
    assert_int_equal(fct_bvh_refit(&env, m.bvh, m.mesh.positions, &same, &work), FCT_OK);
    assert_same_structure(same, m.bvh);
    assert_true(work == 1);
    assert_true(fct_bvh_bytes(same) >= fct_bvh_bytes(m.bvh) + 12 * (size_t)m.mesh.vertex_count);
    assert_int_equal(fct_bvh_refit(&env, same, m.mesh.positions, &again, NULL), FCT_OK);
    fct_bvh_destroy(same);
    assert_same_structure(again, m.bvh);
    fct_bvh_destroy(again);
    model_release(&env, &m);
}

/* Bent, stretched or moved far away; the answers are those of a new structure. */
static void bend(fct_mesh *mesh, int kind) {
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) {
        float *p = mesh->positions + 3 * (size_t)v;
        double x = p[0], y = p[1], z = p[2], angle = 1.5 * z;
        if (kind == 0)
            p[0] = (float)(cos(angle) * x - sin(angle) * y), p[1] = (float)(sin(angle) * x + cos(angle) * y);
        if (kind == 1) p[0] = (float)(40 * x), p[2] = (float)(.1 * z * z);
        if (kind == 2) p[0] = (float)(x + 3000), p[1] = (float)(-y);
        if (kind == 3 && z < 0) p[2] = (float)(.5 * z);
    }
}

static void answers_follow(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    for (int kind = 0; kind < 4; ++kind) {
        model m = pair_model_make(&env, make_pebble(&env, 24, 2)),
              other = pair_model_make(&env, make_pebble(&env, 9, 3));
        fct_mesh moved = make_pebble(&env, 24, 2);
        bend(&moved, kind);
        fct_bvh *bvh;
        double work;
        assert_int_equal(fct_bvh_refit(&env, m.bvh, moved.positions, &bvh, &work), FCT_OK);
        model fresh = pair_model_make(&env, moved);
        fct_bounds a = fct_bvh_bounds(bvh), b = fct_bvh_bounds(fresh.bvh);
        assert_memory_equal(&a, &b, sizeof a);
        enum { RAYS = 6000 };
        fct_ray *rays = malloc(RAYS * sizeof *rays);
        size_t hits = 0;
        fct_ray_mix(fresh.bvh, 4, RAYS, rays);
        for (int i = 0; i < RAYS; ++i) {
            fct_hit x, y;
            bool hit = fct_bvh_closest_hit(fresh.bvh, &rays[i], &x, NULL);
            assert_int_equal(fct_bvh_closest_hit(bvh, &rays[i], &y, NULL), hit);
            assert_int_equal(fct_bvh_any_hit(bvh, &rays[i], NULL), hit);
            if (!hit) continue;
            assert_true(x.t == y.t && x.face == y.face && x.u == y.u && x.normal[0] == y.normal[0]);
            ++hits;
        }
        assert_true(hits > RAYS / 4);
        for (int i = 0; i < 500; ++i) {
            fct_closest x, y;
            assert_true(fct_bvh_signed_distance(fresh.bvh, rays[12 * i].origin, INFINITY, &x, NULL));
            assert_true(fct_bvh_signed_distance(bvh, rays[12 * i].origin, INFINITY, &y, NULL));
            assert_true(x.distance == y.distance && x.face == y.face);
        }
        fct_pose pose = fct_pose_identity();
        pose.translation[0] = (double)rays[1].origin[0], pose.translation[1] = (double)rays[1].origin[1],
        pose.translation[2] = (double)rays[1].origin[2];
        size_t count = fct_bvh_pairs(fresh.bvh, other.bvh, &pose, SIZE_MAX, 0, NULL, NULL, NULL);
        assert_true(count > 0);
        assert_int_equal(fct_bvh_pairs(bvh, other.bvh, &pose, SIZE_MAX, 0, NULL, NULL, NULL), count);
        free(rays);
        fct_bvh_destroy(bvh);
        model_release(&env, &fresh);
        model_release(&env, &m);
        model_release(&env, &other);
    }
}

/* One vertex moves inside the bounds: only the boxes above its faces change. The same bytes for every thread
 * count. */
static void few_boxes_change(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = pair_model_make(&env, make_pebble(&env, 60, 5));
    float *positions = copy_positions(&m.mesh);
    uint32_t vertex = m.mesh.vertex_count / 3;
    for (int k = 0; k < 3; ++k) positions[3 * vertex + (uint32_t)k] *= .7f;
    fct_bvh *one, *five;
    env.thread_count = 1;
    assert_int_equal(fct_bvh_refit(&env, m.bvh, positions, &one, NULL), FCT_OK);
    env.thread_count = 5;
    assert_int_equal(fct_bvh_refit(&env, m.bvh, positions, &five, NULL), FCT_OK);
    assert_same_structure(one, five);
    size_t changed = 0;
    for (uint32_t i = 0; i < one->pair_count; ++i)
        changed += memcmp(&one->pairs[i], &m.bvh->pairs[i], sizeof *one->pairs) != 0;
    assert_in_range(changed, 1, 40);
    fct_bvh_destroy(one);
    fct_bvh_destroy(five);
    free(positions);
    model_release(&env, &m);
}

/* Work: 1 after a rotation, about 1 after a small change, high where neighbours part; and it predicts visits.
 */
static void work_predicts_visits(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = pair_model_make(&env, make_pebble(&env, 60, 6));
    uint64_t seed = 7;
    double works[3], visits[4];
    for (int kind = -1; kind < 3; ++kind) {
        float *positions = copy_positions(&m.mesh);
        for (uint32_t v = 0; v < m.mesh.vertex_count; ++v) {
            float *p = positions + 3 * (size_t)v;
            double size = kind < 0 ? 0 : kind == 0 ? .003 : kind == 1 ? .05 : .4;
            for (int k = 0; k < 3; ++k) p[k] += (float)(size * (random_unit(&seed) - .5));
        }
        fct_bvh *bvh;
        double work;
        assert_int_equal(fct_bvh_refit(&env, m.bvh, positions, &bvh, &work), FCT_OK);
        if (kind >= 0) works[kind] = work;
        fct_visits sum = {0, 0, 0};
        uint64_t rays = 8;
        for (int i = 0; i < 2000; ++i) {
            v3 from = v3_scale(random_direction(&rays), 3), to = v3_scale(random_direction(&rays), .8);
            fct_ray ray = make_ray(from, v3_sub(to, from), 0, INFINITY);
            fct_hit hit;
            fct_bvh_closest_hit(bvh, &ray, &hit, &sum);
        }
        visits[kind + 1] = (double)sum.nodes;
        /* Back in place, the work is that of the first structure. */
        fct_bvh *back;
        assert_int_equal(fct_bvh_refit(&env, bvh, m.mesh.positions, &back, &work), FCT_OK);

        assert_true(work >= 1 - 1e-6 && work < 1.2);
        fct_bvh_destroy(back);
        fct_bvh_destroy(bvh);
        free(positions);
    }
    assert_true(works[0] > .99 && works[0] < 1.03);
    assert_true(works[1] > works[0] && works[2] > 1.5);
    for (int i = 0; i < 3; ++i) {
        double taken = visits[i + 1] / visits[0];
        print_message("work %g visits %g\n", works[i], taken);
        assert_true(taken > .5 * works[i] && taken < 1.3 * works[i]);
    }
    model_release(&env, &m);
}

static void bad_positions(void **state) {
    (void)state;
    recorder r = {.text = ""};
    fct_env env = recorder_env(&r);
    model m = pair_model_make(&env, make_sphere(&env, 4)), single = pair_model_make(&env, make_grid(&env, 1));
    float *positions = copy_positions(&m.mesh);
    fct_bvh *bvh = m.bvh;
    positions[8] = NAN;
    assert_int_equal(fct_bvh_refit(&env, m.bvh, positions, &bvh, NULL), FCT_ERROR_DATA);
    assert_null(bvh);
    assert_string_equal(r.text, "vertex 2: coordinate nan, expected a finite one");
    /* All vertices in one point, and a model of one leaf. */
    double work;
    for (uint32_t i = 0; i < 3 * m.mesh.vertex_count; ++i) positions[i] = 7;
    assert_int_equal(fct_bvh_refit(&env, m.bvh, positions, &bvh, &work), FCT_OK);
    fct_closest closest;
    assert_true(fct_bvh_closest_point(bvh, (float[3]){7, 7, 9}, INFINITY, &closest, NULL) &&
                closest.distance == 2);
    fct_bvh_destroy(bvh);
    for (int i = 0; i < 12; ++i) positions[i] = 2 * single.mesh.positions[i];
    assert_int_equal(fct_bvh_refit(&env, single.bvh, positions, &bvh, &work), FCT_OK);
    assert_true(work == 1);
    assert_true(fct_bvh_closest_point(bvh, (float[3]){2, 2, 3}, INFINITY, &closest, NULL) &&
                closest.distance == 3);
    fct_bvh_destroy(bvh);
    /* Embree. */
    model embree = model_make(&env, make_sphere(&env, 6), FCT_BACKEND_EMBREE);
    float *larger = copy_positions(&embree.mesh);
    for (uint32_t i = 0; i < 3 * embree.mesh.vertex_count; ++i) larger[i] *= 2;
    assert_int_equal(fct_bvh_refit(&env, embree.bvh, larger, &bvh, &work), FCT_OK);
    fct_ray ray = make_ray(v3_make(.1, .1, 9), v3_make(0, 0, -1), 0, INFINITY);
    fct_hit hit;
    assert_true(fct_bvh_closest_hit(bvh, &ray, &hit, NULL) && fabs(hit.t - 7) < .1 && work == 1);
    fct_bvh_destroy(bvh);
    free(larger);
    free(positions);
    model_release(&env, &embree);
    model_release(&env, &m);
    model_release(&env, &single);
    assert_int_equal(r.alive, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(unmoved_vertices_change_nothing),
        cmocka_unit_test(answers_follow),
        cmocka_unit_test(few_boxes_change),
        cmocka_unit_test(work_predicts_visits),
        cmocka_unit_test(bad_positions),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
