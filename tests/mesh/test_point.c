/* Attributes at points of faces: by hand on one triangle, and linear fields on a plane. */
#include "support.h"

enum { ALL = FCT_MESH_COLORS | FCT_MESH_NORMALS | FCT_MESH_TEXCOORDS };

static void near(float a, double b) {
    assert_true(fabs((double)a - b) < 1e-6);
}

/* Two triangles that share the side 1 2; the second one turns it. */
static fct_mesh make_pair(const fct_env *env, unsigned arrays) {
    static const float positions[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
    static const uint32_t triangles[6] = {0, 1, 2, 3, 2, 1};
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(env, 4, 2, arrays, &mesh), FCT_OK);
    memcpy(mesh.positions, positions, sizeof positions);
    memcpy(mesh.triangles, triangles, sizeof triangles);
    return mesh;
}

static void attributes_of_vertices_and_corners_are_mixed(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_pair(&env, ALL);
    static const float normals[12] = {0, 0, 2, 0, 2, 0, 2, 0, 0, 0, 0, -1};
    static const float colors[12] = {1, 0, 0, 0, 10, 0, 0, 0, 100, 7, 7, 7};
    memcpy(mesh.normals, normals, sizeof normals);
    memcpy(mesh.colors, colors, sizeof colors);
    for (int c = 0; c < 6; ++c) mesh.texcoords[2 * c] = (float)(c * c), mesh.texcoords[2 * c + 1] = (float)-c;
    fct_surface_point p;
    fct_mesh_point(&mesh, 0, .2f, .3f, &p); /* weights .5 .2 .3 */
    assert_int_equal(p.found, ALL);
    double length = sqrt(1 + .4 * .4 + .6 * .6);
    near(p.normal[0], .6 / length), near(p.normal[1], .4 / length), near(p.normal[2], 1 / length);
    near(p.texcoord[0], .2 * 1 + .3 * 4), near(p.texcoord[1], -.2 - .6);
    near(p.color[0], .5), near(p.color[1], 2), assert_true(fabs((double)p.color[2] - 30) < 1e-4);
    fct_mesh_point(&mesh, 1, .25f, 0, &p); /* corners 3 and 2 */
    near(p.texcoord[0], .75 * 9 + .25 * 16), near(p.texcoord[1], -.75 * 3 - .25 * 4);
    near(p.color[0], .75 * 7);
    length = sqrt(.75 * .75 + .5 * .5);
    near(p.normal[0], .5 / length), near(p.normal[1], 0), near(p.normal[2], -.75 / length);
    fct_mesh_point(&mesh, 0, 0, 0, &p);
    assert_true(p.normal[2] == 1 && p.texcoord[0] == 0 && p.color[0] == 1 && p.color[1] == 0);
    fct_mesh_release(&env, &mesh);
}

static void normals_of_corners_and_colors_of_faces_count(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_pair(&env, FCT_MESH_CORNER_NORMALS | FCT_MESH_FACE_COLORS);
    for (int c = 0; c < 18; ++c) mesh.corner_normals[c] = 0;
    mesh.corner_normals[9] = 1, mesh.corner_normals[13] = 1, mesh.corner_normals[17] = 1;
    mesh.corner_normals[0] = 1, mesh.corner_normals[3] = -1, mesh.corner_normals[6] = 3;
    for (int c = 0; c < 6; ++c) mesh.face_colors[c] = (float)(c + 1);
    fct_surface_point p;
    fct_mesh_point(&mesh, 1, .3f, .6f, &p);
    assert_int_equal(p.found, FCT_MESH_NORMALS | FCT_MESH_COLORS);
    double length = sqrt(.1 * .1 + .3 * .3 + .6 * .6);
    near(p.normal[0], .1 / length), near(p.normal[1], .3 / length), near(p.normal[2], .6 / length);
    near(p.color[0], 4), near(p.color[1], 5), near(p.color[2], 6);
    assert_true(p.texcoord[0] == 0 && p.texcoord[1] == 0);
    fct_mesh_point(&mesh, 0, .5f, 0, &p); /* the normals cancel */
    assert_true(p.normal[0] == 0 && p.normal[1] == 0 && p.normal[2] == 0);
    assert_int_equal(p.found, FCT_MESH_NORMALS | FCT_MESH_COLORS);
    fct_mesh_release(&env, &mesh);
    mesh = make_pair(&env, 0);
    fct_mesh_point(&mesh, 0, .5f, 0, &p);
    assert_int_equal(p.found, 0);
    fct_mesh_release(&env, &mesh);
}

/* Colours and texture coordinates that are linear in x and y have the value of the field at every point. */
static void linear_fields_on_a_plane_are_exact(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh grid = make_grid(&env, 7), mesh;
    assert_int_equal(fct_mesh_create(&env, grid.vertex_count, grid.face_count, ALL, &mesh), FCT_OK);
    memcpy(mesh.positions, grid.positions, 12 * (size_t)grid.vertex_count);
    memcpy(mesh.triangles, grid.triangles, 12 * (size_t)grid.face_count);
    for (size_t v = 0; v < mesh.vertex_count; ++v) {
        const float *p = mesh.positions + 3 * v;
        mesh.colors[3 * v] = 2 * p[0], mesh.colors[3 * v + 1] = p[0] - p[1], mesh.colors[3 * v + 2] = 5;
        mesh.normals[3 * v] = p[1], mesh.normals[3 * v + 1] = p[0], mesh.normals[3 * v + 2] = 1;
    }
    for (size_t c = 0; c < 3 * (size_t)mesh.face_count; ++c) {
        const float *p = mesh.positions + 3 * (size_t)mesh.triangles[c];
        mesh.texcoords[2 * c] = 3 * p[1], mesh.texcoords[2 * c + 1] = 1 - p[0];
    }
    for (uint32_t f = 0; f < mesh.face_count; ++f)
        for (int k = 0; k < 10; ++k) {
            float u = (float)k / 20, v = (float)(k * k) / 200, x[2];
            fct_surface_point p;
            fct_mesh_point(&mesh, f, u, v, &p);
            for (size_t i = 0; i < 2; ++i) {
                const uint32_t *t = mesh.triangles + 3 * (size_t)f;
                x[i] = (1 - u - v) * mesh.positions[3 * (size_t)t[0] + i] +
                       u * mesh.positions[3 * (size_t)t[1] + i] + v * mesh.positions[3 * (size_t)t[2] + i];
            }
            double px = (double)x[0], py = (double)x[1], length = sqrt(px * px + py * py + 1);
            assert_int_equal(p.found, ALL);
            assert_true(fabs((double)p.color[0] - 2 * px) < 1e-5 &&
                        fabs((double)p.color[1] - px + py) < 1e-5);
            assert_true(fabs((double)p.texcoord[0] - 3 * py) < 1e-5);
            assert_true(fabs((double)p.texcoord[1] - 1 + px) < 1e-5);
            assert_true(fabs((double)p.normal[0] - py / length) < 1e-5);
            assert_true(fabs((double)p.normal[1] - px / length) < 1e-5);
        }
    fct_mesh_release(&env, &mesh);
    fct_mesh_release(&env, &grid);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(attributes_of_vertices_and_corners_are_mixed),
        cmocka_unit_test(normals_of_corners_and_colors_of_faces_count),
        cmocka_unit_test(linear_fields_on_a_plane_are_exact),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
