/* Where the corners of a surface come from: source_faces and source_uv give back every position, and the
 * parts of a face tile it, through tessellation, creases, refinement, mirrors and several materials. */
#include "../place.h"
#include "mesh/mesh.h"
#include "radiosity/surface/refine.h"
#include "radiosity/surface/split.h"
#include "radiosity/surface/tessellate.h"

static fct_env plain; /* outlives every scene */

/* A bumpy ball with a face of two equal corners, one of three equal corners and one without area. */
static fct_mesh make_source(void) {
    fct_mesh ball = make_bumpy(&plain, 4, .3), mesh;
    const uint32_t n = ball.face_count, v = ball.vertex_count;
    assert_int_equal(fct_mesh_create(&plain, v + 2, n + 3, 0, &mesh), FCT_OK);
    memcpy(mesh.positions, ball.positions, 12 * (size_t)v);
    memcpy(mesh.triangles, ball.triangles, 12 * (size_t)n);
    const float far[6] = {2, 0, 0, 4, 0, 0};
    memcpy(mesh.positions + 3 * (size_t)v, far, sizeof far);
    const uint32_t odd[9] = {0, v, 0, 5, 5, 5, 7, v, v + 1};
    memcpy(mesh.triangles + 3 * (size_t)n, odd, sizeof odd);
    v3_store(mesh.positions + 21, v3_make(0, 0, 0)); /* in line with the two new vertices */
    fct_mesh_release(&plain, &ball);
    return mesh;
}

static void expect_sources(const fct_surface *s, const fct_mesh *mesh, const float m[12], bool mirrored) {
    double *area = calloc(mesh->face_count, sizeof *area);
    for (size_t f = 0; f < s->mesh.face_count; ++f) {
        const uint32_t source = s->mesh.source_faces[f];
        const float *uv = s->mesh.source_uv + 6 * f;
        const double part = ((double)uv[2] - uv[0]) * ((double)uv[5] - uv[1]) -
                            ((double)uv[3] - uv[1]) * ((double)uv[4] - uv[0]);
        assert_true(source < mesh->face_count);
        assert_true((mirrored ? -part : part) > -1e-7); /* slivers round to nothing */
        area[source] += mirrored ? -part : part;
        for (size_t k = 0; k < 3; ++k) {
            const double u = uv[2 * k], v = uv[2 * k + 1], weights[3] = {1 - u - v, u, v};
            const float *at = s->mesh.positions + 3 * (size_t)s->mesh.triangles[3 * f + k];
            assert_true(u >= 0 && v >= 0 && u + v <= 1 + 1e-6);
            for (int r = 0; r < 3; ++r) {
                double p = m[4 * r + 3];
                for (size_t j = 0; j < 3; ++j)
                    for (size_t c = 0; c < 3; ++c)
                        p += weights[j] * (double)m[4 * r + (int)c] *
                             (double)mesh->positions[3 * (size_t)mesh->triangles[3 * (size_t)source + j] + c];
                assert_true(fabs(p - at[r]) < 4e-6);
            }
        }
    }
    for (uint32_t f = 0; f < mesh->face_count; ++f) assert_true(fabs(area[f] - 1) < 1e-5);
    free(area);
}

static double cut_some(void *user, uint32_t a, uint32_t b) {
    const uint64_t luck = fct_hash3(*(const uint64_t *)user, a, b) % 5;
    return luck == 0 ? .5 : luck == 1 ? .3 : luck == 2 ? 1. / 256 : 0;
}

static void corners_know_their_place(void **state) {
    (void)state;
    static const float transforms[3][12] = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
                                            {1, .5F, 0, 2, 0, 1, .25F, 0, 0, 0, .75F, -1},
                                            {-1, 0, .5F, 0, 0, 2, 0, 1, 0, 0, 1, 0}};
    plain = fct_env_default();
    for (int kind = 0; kind < 6; ++kind) {
        const float *m = transforms[kind % 3];
        fct_scene *scene;
        fct_mesh mesh = make_source();
        uint32_t *materials = calloc(mesh.face_count, sizeof *materials), split = 0, added = 0;
        assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
        const uint32_t ids[2] = {place_material(scene, .5, 0, false), place_material(scene, .5, 1, false)};
        for (uint32_t f = 0; f < mesh.face_count; ++f) materials[f] = ids[kind >= 3 && f % 3 == 0];
        assert_int_equal(fct_scene_add_object(scene, "ball", &mesh, NULL, m, ids[0], materials), FCT_OK);
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        fct_surface whole[2];
        const uint32_t count = fct_scene_get(scene).instance_count;
        assert_int_equal(count, kind >= 3 ? 2 : 1);
        fct_mesh parts[2];
        for (int round = 0; round < 3; ++round) { /* as built, then refined twice */
            for (uint32_t i = 0; i < count; ++i) {
                uint64_t seed = (uint64_t)(10 * kind + round);
                if (round == 0)
                    assert_int_equal(fct_surface_build(&plain, SHADE(scene, i), .3, &whole[i]), FCT_OK);
                if (round > 0)
                    assert_int_equal(fct_surface_refine(&plain, &whole[i], cut_some, &seed, &added), FCT_OK);
                split += added;
                parts[i] = whole[i].mesh;
            }
            fct_surface joined = {0};
            assert_int_equal(fct_mesh_join(&plain, parts, count, &joined.mesh), FCT_OK);
            expect_sources(&joined, &mesh, m, kind % 3 == 2);
            fct_mesh_turn_over(&joined.mesh);
            expect_sources(&joined, &mesh, m, kind % 3 != 2);
            fct_mesh_release(&plain, &joined.mesh);
        }
        assert_true(split > 1000);
        for (uint32_t i = 0; i < count; ++i) fct_surface_release(&plain, &whole[i]);
        fct_scene_destroy(scene);
        fct_mesh_release(&plain, &mesh);
        free(materials);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(corners_know_their_place)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
