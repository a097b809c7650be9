/* Power on black black_backs_absorb_power, a_scaled_flat_lamp_is_sampled lamps and neighbours, folds, and the
 * limit of a link's uncertainty. */
#include "place.h"

#include "facetree/radiosity.h"
#include "radiosity/light/lamp.h"
#include "radiosity/solve/oracle.h"
#include "radiosity/solve/transport.h"
#include "radiosity/surface/tessellate.h"
#include "refining.h"

static fct_env plain;
/* A unit plate that emits upwards, and a black one-sided plate above it whose back it lights. */
static void black_backs_absorb_power(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_scene *scene;
    fct_elements set;
    fct_lamps *lamps;
    fct_transport t;
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    uint32_t plate = place_material(scene, 0, 0, false), glow = place_material(scene, 0, 1, false);
    place_sheet(&plain, scene, glow, 8, v3_make(0, 0, 0), v3_make(1, 0, 0), v3_make(0, 1, 0));
    place_sheet(&plain, scene, plate, 8, v3_make(0, 0, 1), v3_make(1, 0, 0), v3_make(0, 1, 0));
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    assert_int_equal(fct_lamps_create(&plain, scene, &lamps), FCT_OK);
    const fct_transport_def def = {.seed = 1, .epsilon = 1e-3, .tolerance = 1e-6, .fineness = 1};
    assert_int_equal(fct_elements_create(&plain, scene, .01, &set), FCT_OK);
    assert_int_equal(fct_transport_solve(&set, lamps, &def, &t), FCT_OK);
    assert_true(fabs(t.absorbed - 3 * .199824896) < .1 * t.absorbed &&
                fabs(t.emitted - t.absorbed - t.escaped) < 1e-5);
    fct_transport_release(&plain, &t);
    fct_elements_release(&set);
    fct_lamps_destroy(lamps);
    fct_scene_destroy(scene);
}

static void a_scaled_flat_lamp_is_sampled(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_scene *scene;
    fct_lamps *lamps;
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    uint32_t plate = place_material(scene, .5, 0, false), glow = place_material(scene, 0, 1, false);
    place_sheet(&plain, scene, plate, 8, v3_make(0, 0, 0), v3_make(1, 0, 0), v3_make(0, 1, 0));
    fct_mesh sheet = make_sheet(&plain, 4, v3_make(0, 0, 1), v3_make(0, 1, 0), v3_make(1, 0, 0));
    const float two[12] = {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0};
    place_mesh(scene, &sheet, glow, two);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    assert_int_equal(fct_lamps_create(&plain, scene, &lamps), FCT_OK);
    assert_int_equal(fct_lamps_count(lamps), 1);
    assert_true(fct_lamps_sampled(lamps, 1));
    fct_mesh_release(&plain, &sheet);
    fct_lamps_destroy(lamps);
    fct_scene_destroy(scene);
}

static void a_fold_with_wrong_winding_is_a_crease(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_scene *scene;
    fct_mesh mesh;
    fct_surface s;
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    assert_int_equal(fct_mesh_create(&plain, 4, 2, 0, &mesh), FCT_OK);
    const float p[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, .1f};
    const uint32_t t[6] = {0, 1, 2, 0, 1, 3};
    memcpy(mesh.positions, p, sizeof p), memcpy(mesh.triangles, t, sizeof t);
    place_mesh(scene, &mesh, place_material(scene, .5, 0, false), NULL);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    assert_int_equal(fct_surface_build(&plain, SHADE(scene, 0), 10, &s), FCT_OK);
    assert_int_equal(s.mesh.vertex_count, 6);
    fct_surface_release(&plain, &s);
    fct_mesh_release(&plain, &mesh);
    fct_scene_destroy(scene);
}

static void a_scaled_neighbour_is_as_near(void **state) {
    (void)state;
    plain = fct_env_default();
    for (int i = 0; i < 2; ++i) {
        uint32_t counts[2];
        for (int own = 0; own < 2; ++own) {
            float k = i ? 8 : .125f;
            fct_scene *scene;
            fct_surface s;
            assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
            uint32_t m = place_material(scene, .5, 0, false);
            place_sheet(&plain, scene, m, 2, v3_make(-2, -2, 0), v3_make(4, 0, 0), v3_make(0, 4, 0));
            fct_mesh ball = make_sphere(&plain, 8);
            for (uint32_t v = 0; v < ball.vertex_count; ++v) {
                float *q = ball.positions + 3 * v;
                q[2] += 1.1f;
                for (int c = 0; c < 3; ++c) q[c] *= own ? 1 : 1 / k;
            }
            const float t[12] = {k, 0, 0, 0, 0, k, 0, 0, 0, 0, k, 0};
            place_mesh(scene, &ball, m, own ? NULL : t);
            assert_int_equal(fct_scene_commit(scene), FCT_OK);
            assert_int_equal(fct_surface_build(&plain, SHADE(scene, 0), .5, &s), FCT_OK);
            counts[own] = s.mesh.vertex_count;
            fct_surface_release(&plain, &s);
            fct_mesh_release(&plain, &ball);
            fct_scene_destroy(scene);
        }
        assert_int_equal(counts[0], counts[1]);
    }
}

/* A black sheet close above one corner of a floor of one triangle: no light there, and light in the mirrored
 * place. */
static void the_bare_solution_has_its_shadow_in_place(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_scene *scene;
    fct_mesh mesh, lit;
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    uint32_t grey = place_material(scene, .5, 0, false), black = place_material(scene, 0, 0, true),
             glow = place_material(scene, 0, 1, false);
    assert_int_equal(fct_mesh_create(&plain, 3, 1, 0, &mesh), FCT_OK);
    const float p[9] = {0, 0, 0, 4, 0, 0, 0, 4, 0};
    memcpy(mesh.positions, p, sizeof p);
    for (uint32_t k = 0; k < 3; ++k) mesh.triangles[k] = k;
    place_mesh(scene, &mesh, grey, NULL);
    fct_mesh_release(&plain, &mesh);
    place_sheet(&plain, scene, black, 1, v3_make(1.5, -.5, .3), v3_make(3, 0, 0), v3_make(0, 2, 0));
    place_sheet(&plain, scene, glow, 1, v3_make(1, 1, 4), v3_make(0, .5, 0), v3_make(.5, 0, 0));
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    fct_bake_def def = fct_bake_def_default();
    def.final = FCT_FINAL_NONE, def.max_edge = .5;
    fct_bake *bake;
    assert_int_equal(fct_bake_create(&plain, scene, &def, &bake), FCT_OK);
    assert_int_equal(fct_bake_instance(bake, 0, &lit), FCT_OK);
    double dark = 0, bright = 1;
    int nd = 0, nb = 0;
    for (uint32_t v = 0; v < lit.vertex_count; ++v) {
        double x = lit.positions[3 * v], y = lit.positions[3 * v + 1], c = lit.colors[3 * v + 1];
        if (x > 2.1 && x < 3.2 && y > .1 && y < .6) dark = fmax(dark, c), ++nd;
        if (y > 2.1 && y < 3.2 && x > .1 && x < .6) bright = fmin(bright, c), ++nb;
    }
    assert_true(nd > 3 && nb > 3 && dark < .1 * bright);
    fct_mesh_release(&plain, &lit);
    fct_bake_destroy(bake);
    fct_scene_destroy(scene);
}

/* Links of which a blocker hides a part. */
static void uncertain_links_stay_below_epsilon(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_scene *scene;
    fct_elements set;
    fct_links links;
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    uint32_t dark = place_material(scene, .5, 0, false), bright = place_material(scene, 0, 1, false);
    place_sheet(&plain, scene, dark, 4, v3_make(0, 0, 0), v3_make(1, 0, 0), v3_make(0, 1, 0));
    place_sheet(&plain, scene, bright, 4, v3_make(0, 0, 2), v3_make(0, 1, 0), v3_make(1, 0, 0));
    place_sheet(&plain, scene, dark, 1, v3_make(-1, -1, 1), v3_make(1.4, 0, 0), v3_make(0, 3, 0));
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    assert_int_equal(fct_elements_create(&plain, scene, .001, &set), FCT_OK);
    assert_int_equal(fct_links_create(&plain, &links), FCT_OK);
    const double epsilon = 5e-4;
    assert_int_equal(refine_links(&set, &links, epsilon), FCT_OK);
    uint32_t mixed = 0, above = 0;
    for (size_t i = 0; i < links.count; ++i) {
        const fct_link *l = &links.items[i];
        const fct_element *a = &set.items[l->receiver], *b = &set.items[l->source];
        if (l->rays == 0 || l->near || !(l->weight > 0 && l->weight < 1)) continue;
        if (!(a->child_count || fct_elements_can_split(&set, l->receiver) || b->child_count ||
              fct_elements_can_split(&set, l->source)))
            continue;
        fct_pair pair = fct_pair_place(a, b);
        ++mixed;
        above +=
            fct_pair_flow(a, b, &pair) * sqrt(l->weight * (1 - (double)l->weight)) > epsilon * (1 + 1e-6);
    }
    assert_true(mixed > 5 && above == 0);
    fct_links_release(&plain, &links);
    fct_elements_release(&set);
    fct_scene_destroy(scene);
}
int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(black_backs_absorb_power),
                                       cmocka_unit_test(a_scaled_flat_lamp_is_sampled),
                                       cmocka_unit_test(a_fold_with_wrong_winding_is_a_crease),
                                       cmocka_unit_test(a_scaled_neighbour_is_as_near),
                                       cmocka_unit_test(the_bare_solution_has_its_shadow_in_place),
                                       cmocka_unit_test(uncertain_links_stay_below_epsilon)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
