/* The other quantities of a bake, against the radiosity and a closed form. */
#include "../place.h"
#include "facetree/radiosity.h"

static fct_env plain; /* outlives every scene */
enum { ALL = FCT_MESH_IRRADIANCE | FCT_MESH_DIRECT | FCT_MESH_INDIRECT | FCT_MESH_ERROR };

static const float reflectance[3] = {.6F, .3F, 0}, emission[3] = {.5F, 0, .25F};

/* A floor that shines a little under a lamp, and a wall that reflects light onto it. */
static fct_scene *make_room(recorder *r, fct_env *env) {
    fct_scene *scene;
    *env = fct_env_default();
    env->message = recorder_message, env->message_user = r;
    assert_int_equal(fct_scene_create(env, FCT_BACKEND_OBB, &scene), FCT_OK);
    fct_material floor = {.name = "floor"};
    memcpy(floor.reflectance, reflectance, sizeof reflectance);
    memcpy(floor.emission, emission, sizeof emission);
    uint32_t id;
    assert_int_equal(fct_scene_add_material(scene, &floor, &id), FCT_OK);
    const uint32_t lamp = place_material(scene, 0, 20, false), wall = place_material(scene, .8, 0, false);
    place_sheet(env, scene, id, 2, v3_make(0, 0, 0), v3_make(2, 0, 0), v3_make(0, 2, 0));
    place_sheet(env, scene, lamp, 1, v3_make(.8, 1.2, 1.5), v3_make(.4, 0, 0), v3_make(0, -.4, 0));
    place_sheet(env, scene, wall, 1, v3_make(0, 0, 0), v3_make(0, 2, 0), v3_make(0, 0, 1.5));
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    return scene;
}

static fct_mesh light_floor(const fct_env *env, const fct_scene *scene, fct_bake_def def) {
    fct_bake *bake;
    fct_mesh mesh;
    def.max_edge = .2;
    def.samples = def.method == FCT_BAKE_REFERENCE ? 64 : 0;
    assert_int_equal(fct_bake_create(env, scene, &def, &bake), FCT_OK);
    assert_int_equal(fct_bake_instance(bake, 0, &mesh), FCT_OK);
    fct_bake_destroy(bake);
    return mesh;
}

/* Radiosity is e + rho E, and E is the sum of its parts. Both parts are there, and the direct one is larger
 * under the lamp. Asking for them changes nothing else. */
static void quantities_add_up(void **state) {
    (void)state;
    recorder r = {0};
    fct_scene *scene = make_room(&r, &plain);
    fct_bake_def def = fct_bake_def_default();
    fct_mesh without = light_floor(&plain, scene, def);
    def.outputs = ALL;
    fct_mesh m = light_floor(&plain, scene, def);
    assert_null(without.irradiance);
    assert_int_equal(m.vertex_count, without.vertex_count);
    assert_memory_equal(m.colors, without.colors, 12 * (size_t)m.vertex_count);
    double sums[2] = {0, 0};
    for (size_t i = 0; i < 3 * (size_t)m.vertex_count; ++i) {
        const double e = m.irradiance[i];
        assert_true(fabs(m.direct[i] + (double)m.indirect[i] - e) <= 1e-6 * e);
        assert_true(fabs(emission[i % 3] + reflectance[i % 3] * e - m.colors[i]) <= 1e-5 * (1 + e));
        sums[0] += m.direct[i], sums[1] += m.indirect[i];
    }
    assert_true(sums[0] > 2 * sums[1] && sums[1] > .01 * sums[0]);
    fct_mesh_release(&plain, &m), fct_mesh_release(&plain, &without);
    /* The indirect part is all that --indirect-only leaves. */
    def.indirect_only = true, def.outputs = FCT_MESH_IRRADIANCE | FCT_MESH_INDIRECT;
    m = light_floor(&plain, scene, def);
    assert_memory_equal(m.irradiance, m.indirect, 12 * (size_t)m.vertex_count);
    double rest = 0;
    for (size_t i = 0; i < 3 * (size_t)m.vertex_count; ++i) rest += m.indirect[i];
    assert_true(rest > 0);
    fct_mesh_release(&plain, &m);
    fct_scene_destroy(scene);
}

/* The reference and the bare solution know the irradiance alone. */
static void others_know_the_irradiance(void **state) {
    (void)state;
    recorder r = {0};
    fct_scene *scene = make_room(&r, &plain);
    for (int kind = 0; kind < 2; ++kind) {
        fct_bake_def def = fct_bake_def_default();
        if (kind)
            def.method = FCT_BAKE_REFERENCE;
        else
            def.final = FCT_FINAL_NONE;
        def.outputs = FCT_MESH_IRRADIANCE;
        fct_mesh m = light_floor(&plain, scene, def);
        for (size_t i = 0; i < 3 * (size_t)m.vertex_count; ++i) {
            const double e = m.irradiance[i];
            assert_true(e >= 0 &&
                        fabs(emission[i % 3] + reflectance[i % 3] * e - m.colors[i]) <= 1e-5 * (1 + e));
        }
        fct_mesh_release(&plain, &m);
        for (int part = 0; part < 2; ++part) {
            fct_bake *bake;
            def.outputs = part ? FCT_MESH_DIRECT : FCT_MESH_INDIRECT;
            assert_int_equal(fct_bake_create(&plain, scene, &def, &bake), FCT_ERROR_DATA);
            assert_null(bake);
            assert_non_null(strstr(r.text, "does not tell direct from indirect light"));
        }
    }
    fct_bake *bake;
    fct_bake_def def = fct_bake_def_default();
    for (int kind = 0; kind < 3; ++kind) {
        def = fct_bake_def_default();
        def.outputs = FCT_MESH_ERROR;
        if (kind == 0) def.method = FCT_BAKE_REFERENCE;
        if (kind == 1) def.final = FCT_FINAL_NONE;
        if (kind == 2) def.keep = FCT_KEEP_FACE;
        assert_int_equal(fct_bake_create(&plain, scene, &def, &bake), FCT_ERROR_DATA);
        assert_non_null(strstr(r.text, kind < 2 ? "error of the light needs" : "found other outputs"));
    }
    def = fct_bake_def_default();
    def.outputs = FCT_MESH_TEXCOORDS;
    assert_int_equal(fct_bake_create(&plain, scene, &def, &bake), FCT_ERROR_DATA);
    def.outputs = FCT_MESH_DIRECT, def.indirect_only = true;
    assert_int_equal(fct_bake_create(&plain, scene, &def, &bake), FCT_ERROR_DATA);
    fct_scene_destroy(scene);
}

/* fct_bake_mesh joins the instances, with their sources if they are wanted. */
static void joined_meshes_have_all(void **state) {
    (void)state;
    recorder r = {0};
    fct_scene *scene = make_room(&r, &plain);
    for (int sources = 0; sources < 2; ++sources) {
        fct_bake_def def = fct_bake_def_default();
        def.outputs = ALL, def.sources = sources, def.max_edge = .5, def.final = FCT_FINAL_DIRECT;
        fct_bake *bake;
        fct_mesh all, part;
        uint32_t counts[3];
        assert_int_equal(fct_bake_create(&plain, scene, &def, &bake), FCT_OK);
        assert_int_equal(fct_bake_mesh(bake, &all, counts), FCT_OK);
        assert_int_equal(fct_bake_instance(bake, 2, &part), FCT_OK);
        const size_t first = all.vertex_count - part.vertex_count, face = counts[0] + counts[1];
        assert_memory_equal(all.direct + 3 * first, part.direct, 12 * (size_t)part.vertex_count);
        assert_memory_equal(all.irradiance + 3 * first, part.irradiance, 12 * (size_t)part.vertex_count);
        assert_memory_equal(all.error + first, part.error, 4 * (size_t)part.vertex_count);
        assert_int_equal(all.source_faces && all.source_uv, sources);
        if (sources)
            assert_memory_equal(all.source_uv + 6 * face, part.source_uv, 24 * (size_t)part.face_count);
        fct_mesh_release(&plain, &all), fct_mesh_release(&plain, &part);
        fct_bake_destroy(bake);
    }
    fct_scene_destroy(scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(quantities_add_up),
        cmocka_unit_test(others_know_the_irradiance),
        cmocka_unit_test(joined_meshes_have_all),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
