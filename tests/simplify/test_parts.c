/* Scenes with several bodies: small and thin bodies remain, touching bodies stay apart, doubled creases do
 * not crack. */
#include "shapes.h"

static fct_env env;

/* Joins two meshes and releases them. They share no vertices. */
static fct_mesh join_meshes(fct_mesh *a, fct_mesh *b) {
    fct_mesh out;
    uint32_t vertices = a->vertex_count, faces = a->face_count;
    assert_int_equal(fct_mesh_create(&env, vertices + b->vertex_count, faces + b->face_count, 0, &out),
                     FCT_OK);
    memcpy(out.positions, a->positions, 12 * (size_t)vertices);
    memcpy(out.positions + 3 * (size_t)vertices, b->positions, 12 * (size_t)b->vertex_count);
    memcpy(out.triangles, a->triangles, 12 * (size_t)faces);
    for (size_t i = 0; i < 3 * (size_t)b->face_count; ++i)
        out.triangles[3 * (size_t)faces + i] = vertices + b->triangles[i];
    fct_mesh_release(&env, a);
    fct_mesh_release(&env, b);
    return out;
}

static void move(fct_mesh *mesh, const float scale[3], const float offset[3]) {
    for (size_t i = 0; i < 3 * (size_t)mesh->vertex_count; ++i)
        mesh->positions[i] = mesh->positions[i] * scale[i % 3] + offset[i % 3];
}

/* A closed tube of eight sides around the z axis, with a point at each end. */
static fct_mesh make_rod(uint32_t rings, float radius) {
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&env, 8 * rings + 2, 16 * rings, 0, &mesh), FCT_OK);
    uint32_t *t = mesh.triangles;
    for (uint32_t r = 0; r < rings; ++r)
        for (uint32_t i = 0; i < 8; ++i) {
            float *p = mesh.positions + 3 * (8 * r + i);
            p[0] = radius * (float)cos(i * .7853981633974483);
            p[1] = radius * (float)sin(i * .7853981633974483);
            p[2] = (float)r / (float)(rings - 1);
            uint32_t a = 8 * r + i, b = 8 * r + (i + 1) % 8;
            uint32_t quad[6] = {a, b, b + 8, a, b + 8, a + 8};
            if (r + 1 < rings) memcpy(t, quad, sizeof quad), t += 6;
        }
    for (uint32_t i = 0; i < 8; ++i) {
        uint32_t j = (i + 1) % 8, top = 8 * (rings - 1);
        uint32_t caps[6] = {j, i, 8 * rings, top + i, top + j, 8 * rings + 1};
        memcpy(t, caps, sizeof caps), t += 6;
    }
    float *ends = mesh.positions + 24 * (size_t)rings;
    memset(ends, 0, 6 * sizeof *ends);
    ends[5] = 1;
    return mesh;
}

/* The range of z of the vertices with x > 5. */
static void right_extent(const fct_mesh *mesh, float *lower, float *upper) {
    *lower = INFINITY, *upper = -INFINITY;
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) {
        const float *p = mesh->positions + 3 * (size_t)v;
        if (p[0] > 5) *lower = fminf(*lower, p[2]), *upper = fmaxf(*upper, p[2]);
    }
}

/* A dented ball of 80,000 triangles, two units wide, beside a thin rod. */
static void thin_rods_keep_their_length(void **state) {
    (void)state;
    fct_mesh ball = make_sphere(&env, 200), rod = make_rod(40, .004f);
    for (uint32_t v = 0; v < ball.vertex_count; ++v) {
        float *p = ball.positions + 3 * (size_t)v;
        float size = 1 + .05f * sinf(40 * p[0]) * sinf(40 * p[1]) * sinf(40 * p[2]);
        for (int k = 0; k < 3; ++k) p[k] *= size;
    }
    const float one[3] = {1, 1, 1}, aside[3] = {6, 0, 0};
    move(&rod, one, aside);
    fct_mesh both = join_meshes(&ball, &rod);
    for (uint32_t parts = 10; parts <= 40; parts *= 2) {
        fct_simplify_def def = fct_simplify_def_default();
        def.target_faces = both.face_count / parts;
        fct_mesh out = simplified(&env, &both, &def, NULL);
        float lower, upper;
        right_extent(&out, &lower, &upper);
        assert_true(lower < .05f && upper > .95f);
        fct_mesh_release(&env, &out);
    }
    fct_mesh_release(&env, &both);
}

/* The volume of the faces whose first vertex has this red. */
static double volume_of(const fct_mesh *mesh, float red) {
    double volume = 0;
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        uint32_t v = mesh->triangles[3 * (size_t)f];
        if (fabsf(mesh->colors[3 * (size_t)v] - red) < .01f)
            volume += v3_dot(vertex(mesh, v), face_cross(mesh, f)) / 6;
    }
    return volume;
}

static void colour(fct_mesh *mesh, uint32_t first, float red) {
    for (uint32_t v = first; v < mesh->vertex_count; ++v) mesh->colors[3 * (size_t)v] = red;
}

/* Doubles vertices, so that only faces whose normals have the same main axis share them. */
static fct_mesh double_creases(fct_mesh *mesh) {
    fct_mesh out;
    assert_int_equal(fct_mesh_create(&env, 6 * mesh->vertex_count, mesh->face_count, 0, &out), FCT_OK);
    for (uint32_t v = 0; v < out.vertex_count; ++v)
        memcpy(out.positions + 3 * (size_t)v, mesh->positions + 3 * (size_t)(v / 6), 12);
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        v3 n = face_cross(mesh, f);
        uint32_t axis = fabs(n.x) > fabs(n.y) + fabs(n.z) ? 0 : fabs(n.y) > fabs(n.x) + fabs(n.z) ? 1 : 2;
        uint32_t side = 2 * axis + ((axis == 0 ? n.x : axis == 1 ? n.y : n.z) > 0);
        for (uint32_t k = 0; k < 3; ++k)
            out.triangles[3 * (size_t)f + k] = 6 * mesh->triangles[3 * (size_t)f + k] + side;
    }
    fct_mesh_release(&env, mesh);
    return out;
}

/* Two cubes with a common side or edge, without common vertices. One has red 0, the other red 1. */
static fct_mesh make_pair(bool edge, bool doubled) {
    fct_mesh a = make_cube(&env, 6), b = make_cube(&env, 6);
    const float one[3] = {1, 1, 1}, beside[3] = {1, 0, 0}, across[3] = {1, 1, 0};
    move(&b, one, edge ? across : beside);
    if (doubled) a = double_creases(&a), b = double_creases(&b);
    uint32_t first = a.vertex_count;
    fct_mesh both = join_meshes(&a, &b);
    both = with_arrays(&env, &both, FCT_MESH_COLORS);
    colour(&both, first, 1);
    return both;
}

static void bodies_that_touch_stay_apart(void **state) {
    (void)state;
    const bool kinds[3][2] = {{false, false}, {true, false}, {true, true}};
    for (int kind = 0; kind < 3; ++kind) {
        fct_mesh both = make_pair(kinds[kind][0], kinds[kind][1]);
        fct_simplify_def def = fct_simplify_def_default();
        def.target_faces = 24;
        fct_mesh out = simplified(&env, &both, &def, NULL);
        assert_int_equal(out.face_count, 24);
        assert_float_equal(volume_of(&out, 0), 1, 1e-4);
        assert_float_equal(volume_of(&out, 1), 1, 1e-4);
        assert_int_equal(open_sides(&out, NULL), 0);
        for (uint32_t v = 0; v < out.vertex_count; ++v) {
            float red = out.colors[3 * (size_t)v];
            assert_true(red < 1e-5f || red > 1 - 1e-5f);
        }
        fct_mesh_release(&env, &out);
        fct_mesh_release(&env, &both);
    }
}

static void touching_sides_do_not_hold_each_other(void **state) {
    (void)state;
    fct_mesh both = make_pair(false, false);
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = 24;
    def.keep_topology = true;
    fct_mesh out = simplified(&env, &both, &def, NULL);
    fct_mesh_report report;
    assert_int_equal(fct_mesh_inspect(&env, &out, &report), FCT_OK);
    /* If the touching sides were joined, the edges around them would have four faces and could not be
     * contracted. */
    assert_int_equal(out.face_count, 24);
    assert_int_equal(report.nonmanifold_edges, 0);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &both);
}

static void memory_may_fail_while_creases_are_joined(void **state) {
    (void)state;
    fct_mesh both = make_pair(true, true), out;
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = 24;
    recorder r = {0};
    fct_env recorded = recorder_env(&r);
    fct_result result;
    long n = 0;
    do {
        r.allocations = 0, r.fail_at = ++n;
        result = fct_simplify(&recorded, &both, &def, &out, NULL);
        assert_true(result == FCT_OK || result == FCT_ERROR_MEMORY);
        assert_true(result == FCT_OK || r.alive == 0);
    } while (result != FCT_OK);
    fct_mesh_release(&recorded, &out);
    assert_int_equal(r.alive, 0);
    fct_mesh_release(&env, &both);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(thin_rods_keep_their_length),
        cmocka_unit_test(bodies_that_touch_stay_apart),
        cmocka_unit_test(touching_sides_do_not_hold_each_other),
        cmocka_unit_test(memory_may_fail_while_creases_are_joined),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
