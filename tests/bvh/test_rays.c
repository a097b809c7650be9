/* Rays against brute force and closed forms; limits, ties, malformed rays, size, threads, memory. */
#include "models.h"

static void agrees_with_brute_force(const fct_env *env, fct_mesh mesh, size_t count) {
    model m = model_make(env, mesh, FCT_BACKEND_OBB);
    uint64_t seed = 7;
    size_t sure = 0, hits = 0;
    for (size_t i = 0; i < count; ++i) {
        v3 origin = {3 * random_unit(&seed) - 1, 3 * random_unit(&seed) - 1, 3 * random_unit(&seed) - 1};
        v3 aim = {random_unit(&seed), random_unit(&seed), random_unit(&seed)};
        fct_ray ray = make_ray(origin, v3_sub(aim, origin), 0, i % 3 ? INFINITY : .7);
        fct_hit hit;
        double t;
        bool doubtful, found = fct_bvh_closest_hit(m.bvh, &ray, &hit, NULL);
        uint32_t face = brute_closest(&mesh, &ray, 1e-4, &t, &doubtful);
        assert_int_equal(found, hit.face != FCT_NONE);
        assert_int_equal(fct_bvh_any_hit(m.bvh, &ray, NULL), found);
        if (doubtful) continue;
        ++sure;
        if (face == FCT_NONE) {
            assert_false(found);
            continue;
        }
        ++hits;
        assert_true(found);
        assert_float_equal((double)hit.t, t, 1e-5);
        v3 at = v3_mad(v3_load(ray.origin), (double)hit.t, v3_load(ray.direction));
        assert_true(v3_norm(v3_sub(at, hit_point(&mesh, &hit))) < 1e-4);
        assert_true(hit.face == face || fabs((double)hit.t - t) < 1e-5);
    }
    assert_true(sure > count / 2 && hits > count / 20);
    model_release(env, &m);
}

static void closest_hit_agrees_with_brute_force(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    agrees_with_brute_force(&env, make_pebble(&env, 14, 3), 3000);
    agrees_with_brute_force(&env, make_soup(&env, 2000, 5), 3000);
    agrees_with_brute_force(&env, make_grid(&env, 9), 3000);
}

/* One triangle: corners (0,0,0) (1,0,0) (0,1,0). */
static model one_triangle(const fct_env *env, const float *extra_vertex) {
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(env, 3, 1, 0, &mesh), FCT_OK);
    float p[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    if (extra_vertex) memcpy(p + 6, extra_vertex, 12);
    memcpy(mesh.positions, p, sizeof p);
    for (uint32_t i = 0; i < 3; ++i) mesh.triangles[i] = i;
    return model_make(env, mesh, FCT_BACKEND_OBB);
}

static void one_triangle_reports_t_and_barycentrics(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = one_triangle(&env, NULL);
    fct_ray ray = {.origin = {.25f, .5f, 2}, .direction = {0, 0, -4}, .t_max = INFINITY};
    fct_hit hit;
    assert_true(fct_bvh_closest_hit(m.bvh, &ray, &hit, NULL));
    assert_float_equal(hit.t, .5f, 0);
    assert_float_equal(hit.u, .25f, 1e-6f);
    assert_float_equal(hit.v, .5f, 1e-6f);
    assert_int_equal(hit.face, 0);
    assert_float_equal(hit.normal[2], 1, 0);
    ray.t_max = .4999f;
    assert_false(fct_bvh_closest_hit(m.bvh, &ray, &hit, NULL));
    assert_int_equal(hit.face, FCT_NONE);
    ray.t_max = .5f, ray.t_min = .5f;
    assert_true(fct_bvh_closest_hit(m.bvh, &ray, &hit, NULL));
    ray.t_min = .5001f, ray.t_max = 9;
    assert_false(fct_bvh_any_hit(m.bvh, &ray, NULL));
    model_release(&env, &m);
}

static void t_min_may_be_negative(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    for (int backend = 0; backend < 2; ++backend) {
        model m = model_make(&env, make_sphere(&env, 20), backend ? FCT_BACKEND_EMBREE : FCT_BACKEND_OBB);
        fct_ray ray = {.origin = {.01f, .02f, 0}, .direction = {0, 0, 2}, .t_min = -INFINITY, .t_max = 1};
        fct_hit hit;
        assert_true(fct_bvh_closest_hit(m.bvh, &ray, &hit, NULL));
        assert_float_equal(hit.t, -.5f, .01f);
        ray.t_min = -.25f;
        assert_true(fct_bvh_closest_hit(m.bvh, &ray, &hit, NULL));
        assert_float_equal(hit.t, .5f, .01f);
        ray.t_max = .25f;
        assert_false(fct_bvh_closest_hit(m.bvh, &ray, &hit, NULL));
        model_release(&env, &m);
    }
}

static void malformed_rays_hit_nothing(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    for (int backend = 0; backend < 2; ++backend) {
        model m = model_make(&env, make_sphere(&env, 8), backend ? FCT_BACKEND_EMBREE : FCT_BACKEND_OBB);
        fct_ray good = {.origin = {0, 0, 0}, .direction = {1, .1f, .2f}, .t_max = INFINITY};
        fct_hit hit;
        assert_true(fct_bvh_closest_hit(m.bvh, &good, &hit, NULL));
        float bad[3] = {NAN, INFINITY, -INFINITY};
        for (int i = 0; i < 9; ++i) {
            fct_ray ray = good;
            if (i < 3)
                ray.origin[i] = bad[i];
            else if (i < 6)
                ray.direction[i - 3] = bad[i - 3];
            else if (i == 6)
                ray.direction[0] = ray.direction[1] = ray.direction[2] = 0;
            else if (i == 7)
                ray.t_min = NAN;
            else
                ray.t_max = NAN;
            assert_false(fct_bvh_closest_hit(m.bvh, &ray, &hit, NULL));
            assert_int_equal(hit.face, FCT_NONE);
            assert_false(fct_bvh_any_hit(m.bvh, &ray, NULL));
        }
        fct_ray empty = good;
        empty.t_min = 2, empty.t_max = 1;
        assert_false(fct_bvh_any_hit(m.bvh, &empty, NULL));
        model_release(&env, &m);
    }
}

static void faces_without_area_are_never_hit(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    float middle[3] = {.5f, 0, 0}, corner[3] = {1, 0, 0};
    for (int i = 0; i < 2; ++i) {
        model m = one_triangle(&env, i ? middle : corner);
        uint64_t seed = 3;
        for (int k = 0; k < 20000; ++k) {
            v3 target = {k % 3 ? random_unit(&seed) : .5, 0, 0}, origin = random_direction(&seed);
            fct_ray ray = make_ray(origin, v3_sub(target, origin), 0, INFINITY);
            assert_false(fct_bvh_any_hit(m.bvh, &ray, NULL));
        }
        model_release(&env, &m);
    }
}

static void equal_t_goes_to_the_lower_face(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_grid(&env, 8), twice;
    assert_int_equal(fct_mesh_create(&env, mesh.vertex_count, 3 * mesh.face_count, 0, &twice), FCT_OK);
    memcpy(twice.positions, mesh.positions, 12 * (size_t)mesh.vertex_count);
    for (uint32_t i = 0; i < 3; ++i)
        memcpy(twice.triangles + 3 * (size_t)(i * mesh.face_count), mesh.triangles,
               12 * (size_t)mesh.face_count);
    uint32_t count = mesh.face_count;
    fct_mesh_release(&env, &mesh);
    model m = model_make(&env, twice, FCT_BACKEND_OBB);
    uint64_t seed = 11;
    for (int i = 0; i < 5000; ++i) {
        v3 origin = {random_unit(&seed), random_unit(&seed), 1};
        if (i % 4 == 0) origin.x = floor(8 * origin.x) / 8;
        fct_ray ray = make_ray(origin, v3_make(0, 0, -1), 0, INFINITY);
        fct_hit hit;
        assert_true(fct_bvh_closest_hit(m.bvh, &ray, &hit, NULL));
        assert_true(hit.face < count);
    }
    model_release(&env, &m);
}

/* The same model 2^90 times larger or smaller is hit on the same faces, at the same barycentrics. */
static void size_of_the_model_does_not_matter(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_pebble(&env, 16, 1);
    for (size_t i = 0; i < 3 * (size_t)mesh.vertex_count; ++i)
        mesh.positions[i] = rintf(mesh.positions[i] * 0x1p20f) * 0x1p-20f;
    model m = model_make(&env, mesh, FCT_BACKEND_OBB);
    size_t count = 12000;
    fct_ray *rays = malloc(count * sizeof *rays);
    fct_ray_mix(m.bvh, 5, count, rays);
    for (int power = -95; power <= 100; power += 65) {
        fct_mesh scaled;
        assert_int_equal(fct_mesh_copy(&env, &m.mesh, &scaled), FCT_OK);
        for (size_t i = 0; i < 3 * (size_t)scaled.vertex_count; ++i)
            scaled.positions[i] = ldexpf(scaled.positions[i], power);
        model other = {.mesh = scaled};
        fct_tree_def def = fct_tree_def_default();
        assert_int_equal(fct_tree_build(&env, &scaled, &def, NULL, &other.tree), FCT_OK);
        assert_int_equal(fct_bvh_create(&env, other.tree, FCT_BACKEND_OBB, &other.bvh), FCT_OK);
        size_t hits = 0;
        for (size_t i = 0; i < count; ++i) {
            /* Where scaling the ray itself is exact. */
            bool exact = true;
            fct_ray ray = rays[i];
            for (int k = 0; k < 3; ++k) {
                ray.origin[k] = ldexpf(ray.origin[k], power);
                exact = exact && ldexpf(ray.origin[k], -power) == rays[i].origin[k];
            }
            ray.t_min = ldexpf(ray.t_min, power), ray.t_max = ldexpf(ray.t_max, power);
            exact = exact && ldexpf(ray.t_min, -power) == rays[i].t_min &&
                    ldexpf(ray.t_max, -power) == rays[i].t_max && isfinite(ray.origin[0]);
            if (!exact) continue;
            fct_hit a, b;
            fct_bvh_closest_hit(m.bvh, &rays[i], &a, NULL);
            fct_bvh_closest_hit(other.bvh, &ray, &b, NULL);
            if (a.face == b.face) {
                ++hits;
                if (a.face == FCT_NONE) continue;
                assert_true(a.u == b.u && a.v == b.v);
                assert_true(b.t == ldexpf(a.t, power) || fabsf(a.t) > 1e20f || fabsf(a.t) < 1e-15f);
            }
        }
        /* Trees may differ where the clustering's tolerances do, and faces where rays meet two at once. */
        assert_true(hits > count * 9 / 10);
        model_release(&env, &other);
    }
    free(rays);
    model_release(&env, &m);
}

static void check_batches(uint32_t n, size_t count) {
    fct_env env = fct_env_default();
    model m = model_make(&env, make_pebble(&env, n, 9), FCT_BACKEND_OBB);
    fct_ray *rays = malloc(count * sizeof *rays);
    fct_hit *hits = malloc(count * sizeof *hits);
    uint64_t *occluded = malloc((count + 63) / 64 * sizeof *occluded);
    fct_ray_mix(m.bvh, 2, count, rays);
    for (size_t i = count / 2; i < count; ++i) { /* as from a camera */
        fct_ray *ray = &rays[i];
        *ray = make_ray(v3_make(0, 0, 3), v3_make(.003 * (double)(i % 128) - .2, .002 * (double)(i % 77), -1),
                        0, INFINITY);
    }
    rays[count / 2].direction[0] = NAN, rays[count / 3].t_max = -1; /* cannot hit */
    for (env.thread_count = 1; env.thread_count <= 4; ++env.thread_count) {
        fct_bvh_closest_hits(m.bvh, count, rays, hits);
        memset(occluded, 0xff, (count + 63) / 64 * sizeof *occluded);
        fct_bvh_any_hits(m.bvh, count, rays, occluded);
        for (size_t i = 0; i < count; ++i) {
            fct_hit hit;
            bool found = fct_bvh_closest_hit(m.bvh, &rays[i], &hit, NULL);
            assert_memory_equal(&hit, &hits[i], sizeof hit);
            assert_int_equal(occluded[i / 64] >> (i % 64) & 1, found);
        }
    }
    free(rays), free(hits), free(occluded);
    model_release(&env, &m);
}

/* In the large model, rays of a batch take turns. */
static void batches_equal_single_rays_for_every_thread_count(void **state) {
    (void)state;
    check_batches(20, 10007);
    check_batches(200, SANITIZED ? 1003 : 10007);
}

/* The hits of a ray in order of faces, each from a mesh of that face alone. */
static size_t find_hits_one_by_one(const fct_env *env, const fct_mesh *mesh, const fct_ray *ray,
                                   fct_hit *hits) {
    size_t found = 0;
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        fct_mesh one;
        assert_int_equal(fct_mesh_create(env, 3, 1, 0, &one), FCT_OK);
        for (uint32_t c = 0; c < 3; ++c) {
            memcpy(one.positions + 3 * c, mesh->positions + 3 * (size_t)mesh->triangles[3 * f + c], 12);
            one.triangles[c] = c;
        }
        model m = model_make(env, one, FCT_BACKEND_OBB);
        fct_hit hit;
        if (fct_bvh_closest_hit(m.bvh, ray, &hit, NULL)) hit.face = f, hits[found++] = hit;
        model_release(env, &m);
    }
    return found;
}

static void all_hits_are_sorted_and_complete(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    env.thread_count = 1;
    /* Large faces, so that a ray hits many. */
    fct_mesh mesh = make_soup(&env, 120, 5);
    for (uint32_t i = 0; i < 3 * 3 * mesh.face_count; ++i) {
        float corner = mesh.positions[9 * (i / 9) + i % 3];
        mesh.positions[i] = corner + 12 * (mesh.positions[i] - corner);
    }
    model m = model_make(&env, mesh, FCT_BACKEND_OBB);
    enum { RAYS = 60 };
    fct_ray rays[RAYS];
    fct_hit hits[120], fewer[120], single[120];
    size_t total = 0, crowded = 0, ties = 0, differ = 0;
    /* Kinds 3 and 10 aim at the inside of a face. Rays at its rim may decide differently in a mesh of one
     * face, which has another scale. */
    fct_ray mixed[12 * RAYS / 2];
    fct_ray_mix(m.bvh, 4, 12 * RAYS / 2, mixed);
    for (int r = 0; r < RAYS; ++r) rays[r] = mixed[12 * (r / 2) + (r % 2 ? 3 : 10)];
    for (int r = 0; r < RAYS; ++r) {
        size_t count = fct_bvh_all_hits(m.bvh, &rays[r], 120, hits, NULL);
        size_t expected = find_hits_one_by_one(&env, &m.mesh, &rays[r], single);
        differ += count != expected;
        fct_hit closest;
        assert_int_equal(fct_bvh_closest_hit(m.bvh, &rays[r], &closest, NULL), count > 0);
        assert_int_equal(fct_bvh_all_hits(m.bvh, &rays[r], 0, NULL, NULL), count);
        if (count) {
            assert_true(closest.face == hits[0].face && closest.t == hits[0].t && closest.u == hits[0].u);
            assert_true(closest.v == hits[0].v && closest.place == hits[0].place);
            assert_memory_equal(closest.normal, hits[0].normal, sizeof closest.normal);
            bool other = fct_bvh_closest_hit_except(m.bvh, &rays[r], hits[0].face, &closest, NULL);
            assert_int_equal(other, count > 1);
            assert_int_equal(closest.face, count > 1 ? hits[1].face : FCT_NONE);
            assert_true(fct_bvh_closest_hit_except(m.bvh, &rays[r], FCT_NONE, &closest, NULL));
            assert_int_equal(closest.face, hits[0].face);
        }
        for (size_t i = 0; i + 1 < count; ++i) {
            ties += hits[i].t == hits[i + 1].t;
            assert_true(hits[i].t < hits[i + 1].t ||
                        (hits[i].t == hits[i + 1].t && hits[i].face < hits[i + 1].face));
        }
        for (size_t capacity = 1; capacity < count; ++capacity) {
            memset(fewer, 0x5a, sizeof fewer);
            assert_int_equal(fct_bvh_all_hits(m.bvh, &rays[r], capacity, fewer, NULL), count);
            assert_memory_equal(fewer, hits, capacity * sizeof *hits);
            assert_int_equal(((unsigned char *)&fewer[capacity])[0], 0x5a);
        }
        for (size_t i = 0; i < expected && count == expected; ++i) {
            size_t at = 0;
            while (at < count && hits[at].face != single[i].face) ++at;
            assert_true(at < count);
            assert_true(fabsf(hits[at].t - single[i].t) <= 1e-5f * (1 + fabsf(single[i].t)));
        }
        total += count, crowded += count > 4;
    }
    assert_true(total > 100 && crowded > 5 && ties > 2 && differ <= 3);
    model_release(&env, &m);
}

static void visits_are_added_up(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = model_make(&env, make_sphere(&env, 20), FCT_BACKEND_OBB);
    fct_ray ray = {.origin = {.1f, .2f, .3f}, .direction = {1, .1f, .2f}, .t_max = INFINITY};
    fct_visits once = {0}, twice = {0};
    fct_hit hit;
    fct_bvh_closest_hit(m.bvh, &ray, &hit, &once);
    fct_bvh_closest_hit(m.bvh, &ray, &hit, &twice);
    fct_bvh_closest_hit(m.bvh, &ray, &hit, &twice);
    assert_true(once.nodes > 0 && once.triangles > 0 && once.triangles < m.mesh.face_count / 4);
    assert_int_equal(twice.boxes, 2 * once.boxes);
    assert_true(fct_bvh_bytes(m.bvh) > 20 * m.mesh.face_count);
    model_release(&env, &m);
}

static void every_failed_allocation_is_reported(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh mesh = make_pebble(&env, 8, 4);
    fct_tree *tree;
    fct_tree_def def = fct_tree_def_default();
    assert_int_equal(fct_tree_build(&env, &mesh, &def, NULL, &tree), FCT_OK);
    for (int backend = 0; backend < 2; ++backend) {
        long alive = r.alive, n = 0;
        fct_result result;
        do {
            fct_bvh *bvh = NULL;
            r.text[0] = 0;
            r.allocations = 0, r.fail_at = ++n;
            result = fct_bvh_create(&env, tree, (fct_backend)backend, &bvh);
            assert_int_equal(result == FCT_OK, bvh != NULL);
            if (result != FCT_OK) {
                assert_int_equal(result, FCT_ERROR_MEMORY);
                assert_string_not_equal(r.text, "");
                assert_int_equal(r.alive, alive);
            }
            fct_bvh_destroy(bvh);
        } while (result != FCT_OK);
        assert_true(n > 3);
        assert_int_equal(r.alive, alive);
    }
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
    assert_int_equal(r.alive, 0);
}

static bool stop(void *user, const char *phase, double done) {
    (void)user, (void)phase;
    return done < .2;
}

static void creation_can_be_cancelled(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = model_make(&env, make_pebble(&env, 8, 4), FCT_BACKEND_OBB);
    env.progress = stop;
    fct_bvh *bvh;
    assert_int_equal(fct_bvh_create(&env, m.tree, FCT_BACKEND_OBB, &bvh), FCT_ERROR_CANCELLED);
    assert_null(bvh);
    assert_int_equal(fct_bvh_create(&env, m.tree, FCT_BACKEND_EMBREE, &bvh), FCT_ERROR_CANCELLED);
    assert_null(bvh);
    env.progress = NULL;
    model_release(&env, &m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(closest_hit_agrees_with_brute_force),
        cmocka_unit_test(one_triangle_reports_t_and_barycentrics),
        cmocka_unit_test(t_min_may_be_negative),
        cmocka_unit_test(malformed_rays_hit_nothing),
        cmocka_unit_test(faces_without_area_are_never_hit),
        cmocka_unit_test(equal_t_goes_to_the_lower_face),
        cmocka_unit_test(size_of_the_model_does_not_matter),
        cmocka_unit_test(batches_equal_single_rays_for_every_thread_count),
        cmocka_unit_test(all_hits_are_sorted_and_complete),
        cmocka_unit_test(visits_are_added_up),
        cmocka_unit_test(every_failed_allocation_is_reported),
        cmocka_unit_test(creation_can_be_cancelled),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
