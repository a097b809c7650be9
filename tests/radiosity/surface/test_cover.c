/* Covered points by brute force, and a crate on a floor: no darkness shows beside it, and no light under it.
 */
#include "../place.h"
#include "../soup.h"
#include "facetree/radiosity.h"
#include "radiosity/sample.h"
#include "radiosity/surface/cover.h"
#include "radiosity/surface/tessellate.h"

static fct_env plain; /* outlives every scene */

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.9g, expected %.9g within %g", value, expected, tolerance);
}

/* A closed box, wound outwards. */
static void place_box(fct_scene *scene, uint32_t material, v3 lower, v3 upper) {
    fct_mesh mesh;
    static const uint32_t sides[36] = {0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1,
                                       2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3};
    assert_int_equal(fct_mesh_create(&plain, 8, 12, 0, &mesh), FCT_OK);
    for (uint32_t i = 0; i < 8; ++i)
        v3_store(mesh.positions + 3 * (size_t)i,
                 v3_make(i & 4 ? upper.x : lower.x, i & 2 ? upper.y : lower.y, i & 1 ? upper.z : lower.z));
    memcpy(mesh.triangles, sides, sizeof sides);
    place_mesh(scene, &mesh, material, NULL);
    fct_mesh_release(&plain, &mesh);
}

static fct_scene *begin(void) {
    fct_scene *scene;
    plain = fct_env_default();
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    return scene;
}

/* The first ray that does not see a back ends the search; there are at most eight. */
static void points_equal_brute_force(void **state) {
    (void)state;
    fct_scene *scene = begin();
    uint32_t one = place_material(scene, .5, 0, false), both = place_material(scene, .5, 0, true);
    place_box(scene, one, v3_make(0, 0, 0), v3_make(1, 1, 1));
    place_box(scene, one, v3_make(.5, .2, .3), v3_make(1.6, .8, .9));
    place_box(scene, both, v3_make(2, 0, 0), v3_make(3, 1, 1));
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    soup all = list_triangles(scene);
    const size_t one_sided = 24;
    int covered = 0, late = 0;
    for (uint64_t k = 0; k < 3000; ++k) {
        float point[3], normal[3], nearest, offset = (float)(.1 * fct_uniform(fct_hash2(k, 9)));
        v3 p = v3_make(3.4 * fct_uniform(fct_hash2(k, 0)) - .2, 1.4 * fct_uniform(fct_hash2(k, 1)) - .2,
                       1.4 * fct_uniform(fct_hash2(k, 2)) - .2);
        v3_store(point, p);
        v3_store(normal, v3_unit(v3_make(fct_uniform(fct_hash2(k, 3)) - .5, fct_uniform(fct_hash2(k, 4)) - .5,
                                         fct_uniform(fct_hash2(k, 5)) - .5)));
        float origin[3];
        v3_store(origin, v3_mad(v3_load(point), offset, v3_load(normal)));
        bool expected = true;
        double least = INFINITY;
        uint64_t rays = 0, sent = 7;
        while (expected && rays < 8) {
            double uv[2];
            float direction[3];
            bool back, sheet;
            fct_plane_point((uint32_t)rays++, k, uv);
            v3_store(direction, fct_cosine_direction(v3_load(normal), uv[0], uv[1]));
            soup part = {all.corners, one_sided}, rest = {all.corners + 3 * one_sided, all.count - one_sided};
            double t, other;
            find_nearest(&part, v3_load(origin), v3_load(direction), &t, &back);
            find_nearest(&rest, v3_load(origin), v3_load(direction), &other, &sheet);
            expected = t < other && back;
            least = fmin(least, fmin(t, other));
        }
        assert_int_equal(fct_point_is_covered(scene, point, normal, offset, k, &nearest, &sent), expected);
        assert_int_equal(sent, 7 + rays);
        if (least < INFINITY)
            assert_near(nearest, least, 1e-5);
        else
            assert_true(nearest == INFINITY);
        covered += expected, late += !expected && rays > 1;
    }
    printf("    %d covered, %d seen after the first ray\n", covered, late);
    assert_true(covered > 200 && late > 30);
    free(all.corners);
    fct_scene_destroy(scene);
}

/* Distance of a floor vertex from the crate and the ball's circle on the floor; negative inside. */
static double measure_outside(const fct_mesh *mesh, uint32_t v) {
    v3 p = v3_load(mesh->positions + 3 * (size_t)v);
    double crate = fmax(fmax(.63 - p.x, p.x - 1.57), fmax(.71 - p.y, p.y - 1.84));
    return fmin(crate, hypot(p.x - 2.8, p.y - 2.6) - .4); /* sqrt(.5^2 - .3^2) */
}

/* A crate stands on a lit floor, and a ball is sunk in it. The floor is black under them and lit beside them,
 * and the edges between black and lit vertices are short. */
static void contacts_are_sharp(void **state) {
    (void)state;
    fct_scene *scene = begin();
    uint32_t grey = place_material(scene, .5, 0, false);
    place_sheet(&plain, scene, grey, 3, v3_make(0, 0, 0), v3_make(4, 0, 0), v3_make(0, 4, 0));
    place_sheet(&plain, scene, place_material(scene, .5, 5, false), 1, v3_make(1, 1, 3), v3_make(0, 2, 0),
                v3_make(2, 0, 0));
    place_box(scene, grey, v3_make(.63, .71, 0), v3_make(1.57, 1.84, 1));
    fct_mesh ball = make_sphere(&plain, 24);
    const float lowered[12] = {.5F, 0, 0, 2.8F, 0, .5F, 0, 2.6F, 0, 0, .5F, .3F};
    place_mesh(scene, &ball, grey, lowered);
    fct_mesh_release(&plain, &ball);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    /* the diagonal of all but the lamp, from the ball's lowest point to the crate's top */
    assert_near(72 * fct_surface_default_edge(scene), sqrt(4 * 4 + 4 * 4 + 1.2 * 1.2), 1e-2);
    fct_bake_def def = fct_bake_def_default();
    def.error = 1e-3, def.max_edge = .3;
    fct_bake *bake;
    fct_mesh mesh;
    assert_int_equal(fct_bake_create(&plain, scene, &def, &bake), FCT_OK);
    assert_int_equal(fct_bake_instance(bake, 0, &mesh), FCT_OK);
    int dark = 0, lit = 0, edges = 0, wide = 0;
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        double outside = measure_outside(&mesh, v);
        const float b = mesh.colors[3 * (size_t)v];
        if (outside < -.01) assert_true(b == 0), ++dark;
        if (outside > .002) assert_true(b > 0), ++lit;
    }
    for (size_t c = 0; c < 3 * (size_t)mesh.face_count; ++c) {
        const uint32_t a = mesh.triangles[c], b = mesh.triangles[c % 3 == 2 ? c - 2 : c + 1];
        if ((mesh.colors[3 * (size_t)a] > 0) == (mesh.colors[3 * (size_t)b] > 0)) continue;
        wide += fabs(measure_outside(&mesh, a) - measure_outside(&mesh, b)) > .005;
        ++edges;
    }
    printf("    %d vertices under a body, %d beside; %d of %d edges between them are wide\n", dark, lit, wide,
           edges);
    assert_true(dark > 50 && lit > 500 && edges > 100 && wide < edges / 50);
    fct_mesh_release(&plain, &mesh);
    fct_bake_destroy(bake);
    fct_scene_destroy(scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(points_equal_brute_force),
        cmocka_unit_test(contacts_are_sharp),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
