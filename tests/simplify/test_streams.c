/* Light at the vertices beside the colours: it follows every contraction and the refit, also through a file.
 */
#include "handle.h"
#include "oracle.h"
#include "simplify/cost/constraint.h"

static fct_env env;
static uint32_t warnings;

static void count_warning(void *user, fct_severity severity, const char *text) {
    (void)user;
    warnings += severity == FCT_MESSAGE_WARNING && strstr(text, "irradiance") != NULL;
}

enum { LIGHTS = FCT_MESH_IRRADIANCE | FCT_MESH_DIRECT | FCT_MESH_INDIRECT | FCT_MESH_ERROR };

/* A wavy sheet with colours and all light. */
static fct_mesh make_lit(uint32_t n) {
    fct_mesh grid = make_grid(&env, n), mesh = with_arrays(&env, &grid, FCT_MESH_COLORS | LIGHTS);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        double x = (double)mesh.positions[3 * v], y = (double)mesh.positions[3 * v + 1];
        mesh.positions[3 * v + 2] = (float)(.05 * sin(6 * x) * cos(5 * y));
        for (uint32_t k = 0; k < 3; ++k) {
            mesh.colors[3 * v + k] = (float)(1 + .5 * sin(4 * x + k) * cos(3 * y));
            mesh.direct[3 * v + k] = 2 * mesh.colors[3 * v + k];
            mesh.indirect[3 * v + k] = (float)(.2 + x + .5 * k * y);
            mesh.irradiance[3 * v + k] = mesh.direct[3 * v + k] + mesh.indirect[3 * v + k];
        }
        mesh.error[v] = (float)(.1 + .03 * x - .02 * y);
    }
    return mesh;
}

/* The contractions are those of the mesh without the light. Light that is linear in the position stays
 * linear. `direct` stays twice the colours, and `irradiance` stays the sum of its parts. All light stays in
 * its range.
 */
static void light_follows(void **state) {
    (void)state;
    fct_mesh mesh = make_lit(40), plain = mesh;
    plain.irradiance = plain.direct = plain.indirect = plain.error = NULL;
    for (int kind = 0; kind < 4; ++kind) {
        fct_simplify_def def = fct_simplify_def_default();
        def.target_faces = 300, def.color_weight = 0;
        if (kind == 1) def.refit_passes = 0;
        if (kind == 2) def.placement = FCT_PLACE_SUBSET;
        if (kind == 3) def.primitive = FCT_PRIMITIVE_FACE;
        fct_mesh out = simplified(&env, &mesh, &def, NULL), without = simplified(&env, &plain, &def, NULL);
        assert_true(out.irradiance && out.direct && out.indirect && out.error && !without.direct);
        assert_int_equal(out.vertex_count, without.vertex_count);
        assert_memory_equal(out.triangles, without.triangles, 12 * (size_t)out.face_count);
        assert_memory_equal(out.positions, without.positions, 12 * (size_t)out.vertex_count);
        assert_memory_equal(out.colors, without.colors, 12 * (size_t)out.vertex_count);
        double worst = 0, sum = 0, color = 0;
        for (uint32_t v = 0; v < out.vertex_count; ++v) {
            double x = (double)out.positions[3 * v], y = (double)out.positions[3 * v + 1];
            for (uint32_t k = 0; k < 3; ++k) {
                uint32_t i = 3 * v + k;
                color = fmax(color, fabs((double)(out.direct[i] - 2 * out.colors[i])));
                worst = fmax(worst, fabs((double)out.indirect[i] - .2 - x - .5 * k * y));
                sum = fmax(sum, fabs((double)(out.irradiance[i] - out.direct[i] - out.indirect[i])));
            }
            worst = fmax(worst, 10 * fabs((double)out.error[v] - .1 - .03 * x + .02 * y));
            assert_true(out.error[v] >= .0799f && out.error[v] <= .1301f);
        }
        assert_true(color < 1e-5 && worst < (kind == 2 ? 1e-6 : .05) && sum < (kind == 2 ? 1e-6 : .05));
        if (kind == 1) assert_true(worst < .03);
        fct_mesh_release(&env, &out);
        fct_mesh_release(&env, &without);
    }
    fct_mesh_release(&env, &mesh);
}

/* Vertices at one place that differ in one of the arrays stay two. */
static void seams_of_light_stay(void **state) {
    (void)state;
    for (uint32_t stream = STREAM_IRRADIANCE; stream < STREAM_COUNT; ++stream) {
        fct_mesh grid = make_grid(&env, 12), mesh = with_arrays(&env, &grid, LIGHTS), twice;
        fct_mesh parts[2];
        for (uint32_t i = 0; i < mesh.vertex_count; ++i)
            for (uint32_t s = STREAM_IRRADIANCE; s < STREAM_COUNT; ++s)
                for (uint32_t k = 0; k < stream_width(s); ++k)
                    (*stream_slot(&mesh, s))[stream_width(s) * i + k] = .5f;
        for (int i = 0; i < 2; ++i) {
            assert_int_equal(fct_mesh_copy(&env, &mesh, &parts[i]), FCT_OK);
            for (uint32_t v = 0; v < mesh.vertex_count; ++v) parts[i].positions[3 * v] += (float)i;
        }
        uint32_t width = stream_width(stream);
        for (uint32_t v = 0; v < mesh.vertex_count; ++v) (*stream_slot(&parts[1], stream))[width * v] = 2;
        assert_int_equal(fct_mesh_join(&env, parts, 2, &twice), FCT_OK);
        fct_simplify_def def = fct_simplify_def_default();
        def.target_faces = 4;
        fct_mesh out = simplified(&env, &twice, &def, NULL);
        assert_int_equal(out.face_count, 4);
        assert_int_equal(out.vertex_count, 8);
        for (uint32_t v = 0; v < 8; ++v) {
            float x = out.positions[3 * v], value = stream_values(&out, stream)[width * v];
            assert_true(value == .5f || value == 2);
            if (x < .99f) assert_true(value == .5f);
            if (x > 1.01f) assert_true(value == 2);
        }
        assert_ratio(mesh_area(&out), 2, 1e-6);
        /* One vertex with far more light does not hide the seam. */
        (*stream_slot(&twice, stream))[width * 3] = 6;
        fct_simplifier *s = open_simplifier(&env, &twice, &def);
        for (uint32_t v = 0; v < twice.vertex_count; ++v) {
            if (twice.positions[3 * v] != 1) continue;
            const fct_constraint *held = constraint_at(s, s->point_of[v]);
            assert_true(held && held->hold >= HOLD_LINE);
        }
        fct_simplifier_destroy(s);
        fct_mesh *all[] = {&out, &twice, &parts[0], &parts[1], &mesh};
        for (size_t i = 0; i < FCT_LENGTH(all); ++i) fct_mesh_release(&env, all[i]);
    }
}

/* A state keeps the light; a progressive mesh leaves it out and says so. */
static void files_keep_light(void **state) {
    (void)state;
    fct_mesh mesh = make_lit(30), out;
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = 400;
    fct_simplifier *whole = made(&env, &mesh, &def), *part = made(&env, &mesh, &def);
    part = stopped(&env, part);
    run_to(part, 800), run_to(whole, 800);
    part = stopped(&env, part);
    run_to(part, 200), run_to(whole, 200);
    assert_true(has_state(part, state_of(whole)));
    fct_mesh a = mesh_of(part, true), b = mesh_of(whole, true);
    for (uint32_t i = 0; i < STREAM_COUNT; ++i)
        if (i != STREAM_NORMALS)
            assert_memory_equal(stream_values(&a, i), stream_values(&b, i),
                                4 * stream_width(i) * a.vertex_count);
    fct_simplifier_destroy(part), fct_simplifier_destroy(whole);
    fct_env own = env;
    own.message = count_warning;
    fct_progressive *m;
    assert_int_equal(fct_simplify_progressive(&own, &mesh, &def, &out, NULL, &m), FCT_OK);
    assert_int_equal(warnings, 1);
    assert_true(out.error != NULL);
    fct_mesh level = level_mesh(m, 1000);
    assert_true(level.colors && !level.direct && !level.error);
    fct_progressive_destroy(m);
    fct_mesh *all[] = {&a, &b, &out, &level, &mesh};
    for (size_t i = 0; i < FCT_LENGTH(all); ++i) fct_mesh_release(&env, all[i]);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(light_follows),
        cmocka_unit_test(seams_of_light_stay),
        cmocka_unit_test(files_keep_light),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
