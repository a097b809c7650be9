/* The light of near hits against closed forms. */
#include "../place.h"
#include "radiosity/output/near.h"

static fct_env plain; /* outlives every scene */

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.9g, expected %.9g within %g", value, expected, tolerance);
}

/*     ======== lid or lamp, above the floor by `gap`; it faces down
 *     ======== floor, 2 x 2; it faces up
 */
typedef struct gap {
    fct_scene *scene;
    fct_lamps *lamps;
    fct_elements set;
    float *stored;
} gap;

static gap make_gap(double height, double half, double emission, double stored) {
    gap g;
    plain = fct_env_default();
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &g.scene), FCT_OK);
    place_sheet(&plain, g.scene, place_material(g.scene, .5, 0, false), 1, v3_make(-1, -1, 0),
                v3_make(2, 0, 0), v3_make(0, 2, 0));
    place_sheet(&plain, g.scene, place_material(g.scene, .8, emission, false), 1,
                v3_make(-half, -half, height), v3_make(0, 2 * half, 0), v3_make(2 * half, 0, 0));
    assert_int_equal(fct_scene_commit(g.scene), FCT_OK);
    assert_int_equal(fct_lamps_create(&plain, g.scene, &g.lamps), FCT_OK);
    assert_int_equal(fct_elements_create(&plain, g.scene, 1, &g.set), FCT_OK);
    g.stored = calloc(3 * g.set.count, sizeof *g.stored);
    for (size_t i = 0; i < 3 * g.set.count; ++i)
        g.stored[i] = g.set.items[i / 3].instance == 0 ? (float)stored : 0;
    return g;
}

static void end_gap(gap *g) {
    free(g->stored);
    fct_elements_release(&g->set);
    fct_lamps_destroy(g->lamps);
    fct_scene_destroy(g->scene);
}

/* The mean light and the mean number of rays over `count` paths that start with a ray from (0, .1, height).
 */
static double mean_light(const gap *g, double height, bool up, bool lamps, uint32_t count, double *rays) {
    const float origin[3] = {0, .1F, (float)height}, direction[3] = {0, 0, up ? 1 : -1};
    const fct_source source = {&g->set, NULL, g->stored, INFINITY, lamps ? g->lamps : NULL};
    const fct_found found = fct_transport_look(&g->set, g->stored, origin, direction);
    assert_true(found.leaf != FCT_NONE);
    double sum = 0;
    uint64_t sent = 0;
    for (uint32_t k = 0; k < count; ++k) {
        double light[3];
        fct_near_light(&source, &found, origin, direction, fct_hash(k), light, &sent);
        assert_true(light[0] == light[1] && light[1] == light[2]);
        sum += light[0];
    }
    *rays = (double)sent / count;
    return sum / count;
}

/* Under a small lamp, the near floor has rho times the lamp's light, whatever is stored for it: 7, as in all
 * scenes here; the upper sheet stores 0. One ray goes to the lamp and one on. */
static void near_hits_take_the_light_of_lamps(void **state) {
    (void)state;
    gap g = make_gap(1, .5, 3, 7);
    const double point[3] = {0, .1, 0}, normal[3] = {0, 0, 1};
    double open[3], rays;
    fct_lamps_unoccluded(g.lamps, point, normal, open);
    assert_near(mean_light(&g, .01, false, true, 4096, &rays), .5 * open[0], .01 * open[0]);
    assert_near(rays, 2, 1e-9);
    end_gap(&g);
}

/* The balls around the leaves have the radius of half a diagonal, or of a triangle's: 2 sqrt(5) / 3. */
static void far_hits_take_the_stored_light(void **state) {
    (void)state;
    gap g = make_gap(1, .5, 3, 7);
    double rays, radius = 0;
    for (size_t i = 0; i < g.set.count; ++i)
        if (g.set.items[i].instance == 0) radius = g.set.items[i].radius;
    assert_near(mean_light(&g, .0305 * radius, false, true, 8, &rays), 7, 0);
    assert_near(rays, 0, 0);
    assert_true(mean_light(&g, .0295 * radius, false, true, 8, &rays) < 2);
    assert_near(mean_light(&g, .01, false, false, 8, &rays), 7, 0);
    assert_near(rays, 0, 0);
    end_gap(&g);
}

/* A near lamp reflects the stored light of the floor far below, and its emission is not counted again. */
static void near_lamps_do_not_shine(void **state) {
    (void)state;
    gap g = make_gap(.5, 1, 3, 7);
    double rays;
    /* The form factor from the lamp's point to the floor is between those of the square's inner and outer
     * circle. */
    const double light = mean_light(&g, .49, true, true, 4096, &rays);
    assert_in_range(1e4 * light / (.8 * 7), 1e4 * .8, 1e4 * .9);
    end_gap(&g);
}

/* Between two sheets that nearly touch, light is reflected three times before it counts. The floor stores 7
 * and the lid 0. Up, the third near hit is the lid, and the path ends on the floor: rho_lid rho_floor rho_lid
 * times 7. Down, it ends on the lid, without light. */
static void narrow_gaps_are_dark(void **state) {
    (void)state;
    gap g = make_gap(1e-3, 1, 0, 7);
    double rays;
    for (int up = 0; up < 2; ++up) {
        const double light = mean_light(&g, 5e-4, up, true, 1000, &rays);
        assert_near(light, up ? .8 * .5 * .8 * 7 : 0, .01);
        assert_near(rays, 3, .01);
    }
    end_gap(&g);
}

/* In a closed box whose walls glow with e and reflect rho, all light is e / (1 - rho). The box is no lamp, so
 * a near hit brings its emission: without it, the light would be rho times as much. */
static void near_walls_glow(void **state) {
    (void)state;
    static const uint32_t sides[6][4] = {{0, 2, 1, 3}, {4, 5, 6, 7}, {0, 1, 4, 5},
                                         {2, 6, 3, 7}, {0, 4, 2, 6}, {1, 3, 5, 7}}; /* outwards */
    static const uint32_t halves[6] = {0, 2, 1, 1, 2, 3};                           /* inwards */
    fct_mesh mesh;
    gap g;
    plain = fct_env_default();
    assert_int_equal(fct_mesh_create(&plain, 8, 12, 0, &mesh), FCT_OK);
    for (uint32_t v = 0; v < 8; ++v)
        v3_store(mesh.positions + 3 * v, v3_make(v & 1 ? 1 : -1, v & 2 ? 1 : -1, v & 4 ? 1 : -1));
    for (uint32_t i = 0; i < 36; ++i) mesh.triangles[i] = sides[i / 6][halves[i % 6]];
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &g.scene), FCT_OK);
    place_mesh(g.scene, &mesh, place_material(g.scene, .5, 3, false), NULL);
    assert_int_equal(fct_scene_commit(g.scene), FCT_OK);
    assert_int_equal(fct_lamps_create(&plain, g.scene, &g.lamps), FCT_OK);
    assert_int_equal(fct_lamps_count(g.lamps), 0);
    assert_int_equal(fct_elements_create(&plain, g.scene, 1, &g.set), FCT_OK);
    g.stored = calloc(3 * g.set.count, sizeof *g.stored);
    for (size_t i = 0; i < 3 * g.set.count; ++i) g.stored[i] = 6;
    double rays;
    assert_near(mean_light(&g, -.99, false, true, 1000, &rays), 6, 1e-5);
    assert_in_range(100 * rays, 100, 130);
    end_gap(&g);
    fct_mesh_release(&plain, &mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(near_hits_take_the_light_of_lamps), cmocka_unit_test(far_hits_take_the_stored_light),
        cmocka_unit_test(near_lamps_do_not_shine), cmocka_unit_test(narrow_gaps_are_dark),
        cmocka_unit_test(near_walls_glow)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
