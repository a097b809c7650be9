/* tests/radiosity/solve/test_paint.c: elements of painted surfaces take the mean of their surface, and their
 * children reflect the same power. */
#include "radiosity/place.h"

#include "radiosity/solve/element.h"

static fct_env plain;

enum { SIDE = 32 };

/* Two triangles with an image of random checks; the second instance has another material, the third is the
 * same as the first but mirrored. */
static fct_scene *make_scene(void) {
    static const float mirror[12] = {-2, 0, 0, 3, 0, 2, 0, 0, 0, 0, 2, 1};
    plain = fct_env_default();
    fct_scene *scene;
    fct_mesh mesh = make_grid(&plain, 1);
    uint8_t pixels[3 * SIDE * SIDE];
    for (size_t i = 0; i < SIDE * SIDE; ++i)
        memset(pixels + 3 * i, (int)(255 * fct_uniform(fct_hash(i / 4 % 8 + 8 * (i / SIDE / 4)))), 3);
    const fct_texture texture = {"checks", SIDE, SIDE, pixels};
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    const uint32_t painted = place_material(scene, .1, 0, true), even = place_material(scene, .25, 0, false);
    fct_paint paint = fct_paint_default();
    assert_int_equal(fct_scene_add_texture(scene, &texture, &paint.texture), FCT_OK);
    assert_int_equal(fct_scene_paint_material(scene, painted, &paint), FCT_OK);
    mesh.texcoords = fct_allocate(&plain, 12, sizeof *mesh.texcoords);
    for (size_t c = 0; c < 6; ++c)
        memcpy(mesh.texcoords + 2 * c, mesh.positions + 3 * (size_t)mesh.triangles[c], 8);
    assert_int_equal(fct_scene_add_object(scene, "sheet", &mesh, NULL, NULL, painted, NULL), FCT_OK);
    assert_int_equal(fct_scene_add_instance(scene, "even", 0, NULL, even), FCT_OK);
    assert_int_equal(fct_scene_add_instance(scene, "mirrored", 0, mirror, FCT_NONE), FCT_OK);
    const uint32_t dim = place_material(scene, .1, 0, false);
    for (int c = 0; c < 3; ++c) paint.factor[c] = .5F;
    assert_int_equal(fct_scene_paint_material(scene, dim, &paint), FCT_OK);
    assert_int_equal(fct_scene_add_instance(scene, "dim", 0, NULL, dim), FCT_OK);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    fct_mesh_release(&plain, &mesh);
    return scene;
}

/* The mean over an element, at its own sample points, which follow its area. */
static double sample_mean(const fct_elements *set, uint32_t id) {
    enum { COUNT = 20000 };
    double sum = 0;
    for (uint64_t k = 0; k < COUNT; ++k) {
        fct_element_point p;
        float rho[3];
        fct_element_sample(set, id, ((double)k + .5) / COUNT, fct_uniform(fct_hash2(k, 1)),
                           fct_uniform(fct_hash2(k, 2)), &p);
        /* u and v of a quarter are those of the quarter: find the point by a ray instead. */
        fct_ray ray = {.t_max = 2};
        fct_scene_hit hit;
        for (int c = 0; c < 3; ++c)
            ray.origin[c] = p.position[c] + p.normal[c], ray.direction[c] = -p.normal[c];
        assert_true(fct_scene_closest_hit(set->scene, &ray, &hit, NULL));
        fct_scene_reflectance(set->scene, set->items[id].instance, hit.place, hit.u, hit.v, 0, rho);
        sum += (double)rho[1] / COUNT;
    }
    return sum;
}

static void children_reflect_what_their_parent_does(void **state) {
    (void)state;
    fct_scene *scene = make_scene();
    fct_elements set;
    assert_int_equal(fct_elements_create(&plain, scene, .05, &set), FCT_OK);
    uint32_t quarters = 0, checked = 0;
    for (uint32_t id = set.view.volume_count; id < set.count && set.count < 3000; ++id) {
        if (!fct_elements_can_split(&set, id)) continue;
        const bool painted = set.items[id].instance != 1;
        assert_int_equal(fct_elements_split(&set, id), FCT_OK);
        const fct_element e = set.items[id];
        double power[3] = {0, 0, 0};
        for (uint32_t c = e.child; c < e.child + e.child_count; ++c)
            for (int k = 0; k < 3; ++k) power[k] += set.items[c].area * set.items[c].reflectance[k];
        for (int k = 0; k < 3; ++k)
            assert_true(fabs(power[k] / (e.area * (double)e.reflectance[k]) - 1) < 1e-5);
        if (!painted) assert_true(e.reflectance[1] == .25F);
        quarters += painted && e.child_count == 4;
        if (!painted || id % 7) continue;
        const double mean = sample_mean(&set, id);
        if (fabs(mean - (double)e.reflectance[1]) > .03 * mean + .002)
            fail_msg("element %u reflects %g, expected %g", id, (double)e.reflectance[1], mean);
        ++checked;
    }
    assert_true(quarters > 50 && checked > 50);
    /* Instances of one model and material share their means; both sides have them. */
    assert_true(set.paints.owned_count == 2 && set.paints.means[0] == set.paints.means[2] &&
                !set.paints.means[1]);
    /* No texel of the noise is clamped at .5, few are at 1. */
    const float dim = set.items[set.roots[3]].reflectance[0], bright = set.items[set.roots[0]].reflectance[0];
    assert_true(dim > .49F * bright && dim < .55F * bright);
    const uint32_t root = set.roots[0];
    assert_memory_equal(set.items[root].reflectance, set.items[root + set.root_counts[0]].reflectance, 12);
    fct_elements_release(&set);
    fct_scene_destroy(scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(children_reflect_what_their_parent_does)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
