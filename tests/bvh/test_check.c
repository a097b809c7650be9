/* Both backends on mixed rays: on made models always, on real ones where they are; and the check finds fault
 * where there is one. */
#include "models.h"

#include "bvh/model.h"

static void backends_agree(const fct_env *env, const fct_mesh *mesh, uint64_t seed, size_t count,
                           const char *name) {
    fct_tree *tree;
    fct_bvh *obb, *embree;
    fct_tree_def def = fct_tree_def_default();
    assert_int_equal(fct_tree_build(env, mesh, &def, NULL, &tree), FCT_OK);
    assert_int_equal(fct_bvh_create(env, tree, FCT_BACKEND_OBB, &obb), FCT_OK);
    assert_int_equal(fct_bvh_create(env, tree, FCT_BACKEND_EMBREE, &embree), FCT_OK);
    fct_ray *rays = malloc(count * sizeof *rays);
    fct_ray_mix(obb, seed, count, rays);
    fct_ray_check check;
    assert_int_equal(fct_bvh_check(env, obb, embree, count, rays, &check), FCT_OK);
    if (check.unexplained || check.occlusion_differences)
        print_error("%s: %zu of %zu differences unexplained, %zu of occlusion\n", name, check.unexplained,
                    check.differences, check.occlusion_differences);
    assert_int_equal(check.unexplained, 0);
    assert_int_equal(check.occlusion_differences, 0);
    assert_int_equal(check.rays, count);
    assert_int_equal(check.differences, check.explained);
    assert_true(check.hits > count / 4 && check.differences < count / 15);
    free(rays);
    fct_bvh_destroy(obb);
    fct_bvh_destroy(embree);
    fct_tree_destroy(tree);
}

static void made_models_have_no_unexplained_difference(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    for (int i = 0; i < 5; ++i) {
        fct_mesh mesh = i < 3    ? make_pebble(&env, 24, 5)
                        : i == 3 ? make_grid(&env, 40)
                                 : make_soup(&env, 5000, 9);
        float scale = i == 1 ? 1e-30f : i == 2 ? 1e30f : 1;
        for (size_t k = 0; k < 3 * (size_t)mesh.vertex_count; ++k) mesh.positions[k] *= scale;
        backends_agree(&env, &mesh, 1, SANITIZED ? 6000 : 60000, "made");
        fct_mesh_release(&env, &mesh);
    }
}

/* With each of these seeds a ray passes a corner at which two silhouettes leave a gap of seven degrees. */
static void a_narrow_gap_beside_a_corner_is_explained(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_pebble(&env, 64, 2);
    backends_agree(&env, &mesh, 107, 6500, "gap");
    backends_agree(&env, &mesh, 122, 42500, "gap");
    fct_mesh_release(&env, &mesh);
}

/* Two triangles, a third one along a part of their side, and faces without area that join them. A ray never
 * hits faces without area. A ray that slips between the triangles by rounding passes through no surface. */
static void a_slit_behind_faces_without_area_is_explained(void **state) {
    (void)state;
    static const float positions[8][3] = {{4, -2, 0}, {6, 0, 0}, {4, 0, 0}, {2, 0, 0},
                                          {1, 0, 0},  {3, 0, 0}, {5, 0, 0}, {3, 2, 0}};
    static const uint32_t triangles[8][3] = {{0, 1, 2}, {0, 2, 3}, {3, 2, 4}, {2, 1, 6},
                                             {2, 6, 4}, {4, 6, 5}, {5, 6, 7}, {4, 5, 7}};
    fct_env env = fct_env_default();
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&env, 8, 8, 0, &mesh), FCT_OK);
    memcpy(mesh.positions, positions, sizeof positions);
    memcpy(mesh.triangles, triangles, sizeof triangles);
    backends_agree(&env, &mesh, 1, SANITIZED ? 50000 : 500000, "slit");
    fct_mesh_release(&env, &mesh);
}

static void real_models_have_no_unexplained_difference(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    const char *names[] = {"cow", "fandisk", "rocker-arm", "spot", "suzanne", "nefertiti", "stanford-bunny"};
    size_t found = 0;
    for (size_t i = 0; i < sizeof names / sizeof *names; ++i) {
        char path[512];
        snprintf(path, sizeof path, "%s/%s.obj", FACETREE_DATA, names[i]);
        if (!file_exists(path) || (SANITIZED && i > 0)) continue;
        fct_mesh mesh;
        assert_int_equal(fct_mesh_load(&env, path, &mesh), FCT_OK);
        backends_agree(&env, &mesh, 1, SANITIZED ? 10000 : 100000, names[i]);
        fct_mesh_release(&env, &mesh);
        ++found;
    }
    if (!found) skip();
}

/* A leaf whose triangles have been taken out makes holes; all of them are found out. */
static void a_hole_is_an_unexplained_difference(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = model_make(&env, make_pebble(&env, 12, 5), FCT_BACKEND_OBB);
    fct_bvh *embree;
    assert_int_equal(fct_bvh_create(&env, m.tree, FCT_BACKEND_EMBREE, &embree), FCT_OK);
    fct_leaf *leaf = (fct_leaf *)(void *)m.bvh->leaves;
    size_t count = 24000;
    fct_ray *rays = malloc(count * sizeof *rays);
    fct_ray_mix(m.bvh, 1, count, rays);
    fct_ray_check whole, check;
    assert_int_equal(fct_bvh_check(&env, m.bvh, embree, count, rays, &whole), FCT_OK);
    assert_int_equal(whole.unexplained, 0);
    leaf->mask = 0;
    assert_int_equal(fct_bvh_check(&env, m.bvh, embree, count, rays, &check), FCT_OK);
    /* Those that start on the missing faces may be explained. */
    assert_true(check.unexplained > 100 && check.unexplained > (check.differences - whole.differences) / 2);

    /* A ray straight at an inner edge or vertex of the hole is on the rim of every face there. */
    leaf->mask = (uint16_t)((1u << leaf->count) - 1);
    size_t at_rim = 0;
    for (size_t i = 0; i < count; ++i) {
        v3 aim = v3_load(m.mesh.positions + 3 * (i % m.mesh.vertex_count));
        rays[i] = make_ray(v3_make(0, 0, 0), aim, 0, INFINITY);
        fct_hit hit;
        assert_true(fct_bvh_closest_hit(m.bvh, &rays[i], &hit, NULL));
        at_rim += hit.place < leaf->count;
    }
    assert_int_equal(fct_bvh_check(&env, m.bvh, embree, count, rays, &check), FCT_OK);
    assert_int_equal(check.unexplained, 0);
    leaf->mask = 0;
    assert_int_equal(fct_bvh_check(&env, m.bvh, embree, count, rays, &check), FCT_OK);
    assert_true(at_rim > 0 && check.unexplained > 0);
    free(rays);
    fct_bvh_destroy(embree);
    model_release(&env, &m);
}

/* How many of the rays from the inside the check cannot explain. */
static size_t count_unexplained(const fct_env *env, const model *m, const fct_bvh *embree) {
    enum { COUNT = 2000 };
    static fct_ray rays[COUNT];
    uint64_t seed = 4;
    for (int i = 0; i < COUNT; ++i)
        rays[i] = make_ray(v3_make(.1, 0, .2), random_direction(&seed), 0, INFINITY);
    fct_ray_check check;
    assert_int_equal(fct_bvh_check(env, m->bvh, embree, COUNT, rays, &check), FCT_OK);
    assert_int_equal(check.hits, COUNT);
    assert_int_equal(check.explained, check.differences - check.unexplained);
    return check.unexplained;
}

static void change_leaves(const model *m, void (*change)(fct_leaf *leaf)) {
    for (size_t at = 0; at < m->bvh->leaf_bytes;) {
        fct_leaf *leaf = (fct_leaf *)(void *)(m->bvh->leaves + at);
        change(leaf);
        at += fct_leaf_bytes(leaf->count, leaf->vertex_octets);
    }
}

/* Turns b and c of a triangle: u, v and the sign of the normal change, t and the face do not. */
static void swap_corners(fct_leaf *leaf) {
    uint8_t *corners = (uint8_t *)(leaf + 1);
    for (uint32_t o = 0; o < fct_leaf_octets(leaf); ++o)
        for (int i = 0; i < 8; ++i) {
            uint8_t *b = corners + 24 * o + 8 + i, *c = b + 8, was = *b;
            *b = *c, *c = was;
        }
}

/* Turns the corners in a circle: u and v change, the normal does not. */
static void turn_corners(fct_leaf *leaf) {
    uint8_t *corners = (uint8_t *)(leaf + 1);
    for (uint32_t o = 0; o < fct_leaf_octets(leaf); ++o)
        for (int i = 0; i < 8; ++i) {
            uint8_t *a = corners + 24 * o + i, was = a[0];
            a[0] = a[8], a[8] = a[16], a[16] = was;
        }
}

/* Moves vertices by 1e-4 of the model: t changes, the face hardly ever. */
static void shrink(fct_leaf *leaf) {
    float *rows = (float *)(void *)((uint8_t *)(leaf + 1) + 24 * (size_t)fct_leaf_octets(leaf));
    for (uint32_t i = 0; i < 24u * leaf->vertex_octets; ++i) rows[i] *= .9999f;
}

/* Each backend names the same face, but ours describes its hit wrongly. */
static void wrong_parts_of_a_hit_are_unexplained(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    void (*changes[])(fct_leaf *) = {swap_corners, turn_corners, shrink};
    for (int i = 0; i < 3; ++i) {
        model m = model_make(&env, make_pebble(&env, 12, 5), FCT_BACKEND_OBB);
        fct_bvh *embree;
        assert_int_equal(fct_bvh_create(&env, m.tree, FCT_BACKEND_EMBREE, &embree), FCT_OK);
        assert_int_equal(count_unexplained(&env, &m, embree), 0);
        change_leaves(&m, changes[i]);
        assert_true(count_unexplained(&env, &m, embree) > 1900);
        fct_bvh_destroy(embree);
        model_release(&env, &m);
    }
}

/* Embree's answers moved to another model's faces are false hits of Embree's, not ours. */
static void a_wrong_peer_is_explained(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = model_make(&env, make_pebble(&env, 12, 5), FCT_BACKEND_OBB);
    fct_mesh other;
    assert_int_equal(fct_mesh_copy(&env, &m.mesh, &other), FCT_OK);
    for (size_t k = 0; k < 3 * (size_t)other.vertex_count; ++k) other.positions[k] *= .9f;
    model peer = model_make(&env, other, FCT_BACKEND_EMBREE);
    size_t count = 1200;
    fct_ray *rays = malloc(count * sizeof *rays);
    for (size_t i = 0; i < count; ++i) {
        v3 aim = v3_load(m.mesh.positions + 3 * (i % m.mesh.vertex_count));
        aim.x += .01, aim.y -= .003;
        rays[i] = make_ray(v3_make(0, 0, 0), aim, 0, INFINITY);
    }
    fct_ray_check check;
    assert_int_equal(fct_bvh_check(&env, m.bvh, peer.bvh, count, rays, &check), FCT_OK);
    assert_int_equal(check.unexplained, 0);
    free(rays);
    model_release(&env, &m);
    model_release(&env, &peer);
}

static void the_mix_is_the_same_for_the_same_seed(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = model_make(&env, make_pebble(&env, 12, 5), FCT_BACKEND_OBB);
    fct_ray a[240], b[240], c[240];
    fct_ray_mix(m.bvh, 1, 240, a);
    fct_ray_mix(m.bvh, 1, 240, b);
    fct_ray_mix(m.bvh, 2, 240, c);
    assert_memory_equal(a, b, sizeof a);
    assert_memory_not_equal(a, c, sizeof a);
    for (int i = 0; i < 240; ++i)
        for (int k = 0; k < 3; ++k) assert_true(isfinite(a[i].origin[k]) && isfinite(a[i].direction[k]));
    model_release(&env, &m);
}

static void failed_allocations_are_reported(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r), plain = fct_env_default();
    model m = model_make(&plain, make_pebble(&plain, 8, 4), FCT_BACKEND_OBB);
    fct_bvh *embree;
    assert_int_equal(fct_bvh_create(&plain, m.tree, FCT_BACKEND_EMBREE, &embree), FCT_OK);
    fct_ray rays[24];
    fct_ray_mix(m.bvh, 1, 24, rays);
    fct_ray_check check;
    long n = 0;
    do {
        r.allocations = 0, r.fail_at = ++n;
        fct_result result = fct_bvh_check(&env, m.bvh, embree, 24, rays, &check);
        assert_int_equal(r.alive, 0);
        if (result == FCT_OK) break;
        assert_int_equal(result, FCT_ERROR_MEMORY);
    } while (n < 100);
    assert_int_equal(n, 4);
    fct_bvh_destroy(embree);
    model_release(&plain, &m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(made_models_have_no_unexplained_difference),
        cmocka_unit_test(a_narrow_gap_beside_a_corner_is_explained),
        cmocka_unit_test(a_slit_behind_faces_without_area_is_explained),
        cmocka_unit_test(real_models_have_no_unexplained_difference),
        cmocka_unit_test(a_hole_is_an_unexplained_difference),
        cmocka_unit_test(wrong_parts_of_a_hit_are_unexplained),
        cmocka_unit_test(a_wrong_peer_is_explained),
        cmocka_unit_test(the_mix_is_the_same_for_the_same_seed),
        cmocka_unit_test(failed_allocations_are_reported),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
