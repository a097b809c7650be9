/* Attributes: smooth colours and colour borders, wedges on creases and seams, materials, normals. */
#include "shapes.h"

static fct_env env;

typedef void color_of(double x, double y, float rgb[3]);

static void step_color(double x, double y, float rgb[3]) {
    bool lit = x + .3 * y > .62;
    rgb[0] = lit ? .9f : .1f, rgb[1] = lit ? .8f : .05f, rgb[2] = lit ? .7f : .2f;
}

static void smooth_color(double x, double y, float rgb[3]) {
    rgb[0] = (float)(.5 + .3 * x - .2 * y), rgb[1] = (float)(.3 + .2 * sin(3 * x) * y), rgb[2] = .4f;
}

static fct_mesh colored_grid(uint32_t n, color_of *color) {
    fct_mesh grid = make_grid(&env, n);
    grid = with_arrays(&env, &grid, FCT_MESH_COLORS);
    for (uint32_t v = 0; v < grid.vertex_count; ++v)
        color(grid.positions[3 * v], grid.positions[3 * v + 1], grid.colors + 3 * v);
    return grid;
}

/* The colour of a flat mesh over the unit square at (x, y), from the first face that contains the point. */
static bool color_at(const fct_mesh *mesh, double x, double y, double rgb[3]) {
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        const uint32_t *t = mesh->triangles + 3 * (size_t)f;
        v3 a = vertex(mesh, t[0]), b = v3_sub(vertex(mesh, t[1]), a), c = v3_sub(vertex(mesh, t[2]), a);
        double det = b.x * c.y - b.y * c.x, px = x - a.x, py = y - a.y;
        if (det == 0) continue;
        double u = (px * c.y - py * c.x) / det, v = (b.x * py - b.y * px) / det;
        if (u < -1e-5 || v < -1e-5 || u + v > 1 + 2e-5) continue;
        for (int k = 0; k < 3; ++k)
            rgb[k] = (1 - u - v) * mesh->colors[3 * t[0] + k] + u * mesh->colors[3 * t[1] + k] +
                     v * mesh->colors[3 * t[2] + k];
        return true;
    }
    return false;
}

/* The root mean square difference from the colours of the full grid. */
static double color_rms(const fct_mesh *mesh, const fct_mesh *full) {
    double sum = 0;
    uint32_t count = 0;
    for (int j = 0; j < 50; ++j)
        for (int i = 0; i < 50; ++i) {
            double x = (i + .37) / 50, y = (j + .61) / 50, got[3], want[3];
            assert_true(color_at(mesh, x, y, got));
            assert_true(color_at(full, x, y, want));
            for (int k = 0; k < 3; ++k) sum += pow(got[k] - want[k], 2);
            count += 3;
        }
    return sqrt(sum / count);
}

static fct_mesh to_faces(const fct_mesh *mesh, double ratio) {
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = (uint32_t)(ratio * mesh->face_count);
    fct_mesh out = simplified(&env, mesh, &def, NULL);
    assert_in_range(out.face_count, def.target_faces - 1, def.target_faces);
    return out;
}

static void flat_geometry_stays_exact_and_colors_close(void **state) {
    (void)state;
    struct {
        color_of *color;
        double ratio, rms;
    } cases[] = {
        {smooth_color, .1, .0005}, {smooth_color, .02, .003}, {step_color, .1, .03}, {step_color, .02, .05}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        fct_mesh grid = colored_grid(40, cases[i].color), out = to_faces(&grid, cases[i].ratio);
        assert_float_equal(mesh_area(&out), 1, 1e-4);
        for (uint32_t v = 0; v < out.vertex_count; ++v) assert_float_equal(out.positions[3 * v + 2], 0, 1e-6);
        double rms = color_rms(&out, &grid);
        assert_true(rms < cases[i].rms);
        fct_mesh_release(&env, &out);
        fct_mesh_release(&env, &grid);
    }
}

static void disc_color(double x, double y, float rgb[3]) {
    bool lit = hypot(x - .5, y - .5) < .3;
    for (int k = 0; k < 3; ++k) rgb[k] = lit ? .9f : .1f;
}

/* The share of vertices within .04 of the rim of the disc. This ring is 15 % of the square. */
static double share_at_rim(const fct_mesh *mesh) {
    uint32_t near = 0;
    for (uint32_t v = 0; v < mesh->vertex_count; ++v)
        near += fabs(hypot(mesh->positions[3 * v] - .5, mesh->positions[3 * v + 1] - .5) - .3) < .04;
    return (double)near / mesh->vertex_count;
}

static void triangles_gather_at_the_shadow_border(void **state) {
    (void)state;
    fct_mesh grid = colored_grid(60, disc_color);
    fct_mesh out = to_faces(&grid, .04);
    assert_true(share_at_rim(&out) > .7);
    double rms = color_rms(&out, &grid);
    assert_true(rms < .08);
    fct_mesh_release(&env, &out);

    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = (uint32_t)(.04 * grid.face_count);
    def.color_weight = 0;
    out = simplified(&env, &grid, &def, NULL);
    assert_true(share_at_rim(&out) < .3);
    assert_true(color_rms(&out, &grid) > 1.5 * rms);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &grid);
}

static void colors_stay_within_the_input(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 30);
    sphere = with_arrays(&env, &sphere, FCT_MESH_COLORS);
    for (uint32_t v = 0; v < sphere.vertex_count; ++v) {
        bool lamp = sphere.positions[3 * v + 2] > .9f, dark = sphere.positions[3 * v] > 0;
        for (int k = 0; k < 3; ++k)
            sphere.colors[3 * v + k] = lamp ? 40.f : dark ? 0.f : .5f + .1f * (float)k;
    }
    fct_mesh out = to_faces(&sphere, .05);
    for (uint32_t i = 0; i < 3 * out.vertex_count; ++i)
        assert_true(out.colors[i] >= 0 && out.colors[i] <= 40);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &sphere);
}

static void weight_zero_lets_colors_ride_along(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 30), plain;
    fct_mesh colored;
    assert_int_equal(fct_mesh_copy(&env, &sphere, &plain), FCT_OK);
    colored = with_arrays(&env, &sphere, FCT_MESH_COLORS);
    for (uint32_t v = 0; v < colored.vertex_count; ++v) colored.colors[3 * v] = colored.positions[3 * v];
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = 200;
    fct_mesh a = simplified(&env, &plain, &def, NULL);
    def.color_weight = 0;
    fct_mesh b = simplified(&env, &colored, &def, NULL);
    assert_int_equal(a.vertex_count, b.vertex_count);
    assert_memory_equal(a.positions, b.positions, 12 * a.vertex_count);
    for (uint32_t v = 0; v < b.vertex_count; ++v)
        assert_float_equal(b.colors[3 * v], b.positions[3 * v], .15);
    fct_mesh_release(&env, &a);
    fct_mesh_release(&env, &b);
    fct_mesh_release(&env, &plain);
    fct_mesh_release(&env, &colored);
}

/* A roof: two slopes meet at the ridge x = .5. The vertices of the ridge are doubled, with one colour per
 * slope. */
static fct_mesh make_roof(uint32_t n) {
    fct_mesh grid = make_grid(&env, n), roof;
    uint32_t extra = n + 1, old = grid.vertex_count;
    assert_int_equal(fct_mesh_create(&env, old + extra, grid.face_count, FCT_MESH_COLORS, &roof), FCT_OK);
    for (uint32_t v = 0; v < old + extra; ++v) {
        const float *p = grid.positions + 3 * (v < old ? v : (v - old) * (n + 1) + n / 2);
        float x = p[0], y = p[1];
        bool right = v >= old || x > .5f;
        float at[3] = {x, y, .4f - fabsf(x - .5f)};
        float rgb[3] = {right ? .2f + .3f * y : .8f, right ? .1f : .7f - .2f * y, .3f};
        memcpy(roof.positions + 3 * v, at, sizeof at);
        memcpy(roof.colors + 3 * v, rgb, sizeof rgb);
    }
    for (uint32_t f = 0; f < grid.face_count; ++f) {
        bool right = false;
        for (int k = 0; k < 3; ++k) right |= grid.positions[3 * grid.triangles[3 * f + k]] > .5f;
        for (int k = 0; k < 3; ++k) {
            uint32_t v = grid.triangles[3 * f + k];
            roof.triangles[3 * f + k] = right && v % (n + 1) == n / 2 ? old + v / (n + 1) : v;
        }
    }
    fct_mesh_release(&env, &grid);
    return roof;
}

static bool inside_square(v3 a, v3 b) {
    v3 m = v3_scale(v3_add(a, b), .5);
    return m.x > 1e-4 && m.x < 1 - 1e-4 && m.y > 1e-4 && m.y < 1 - 1e-4;
}

static void doubled_creases_do_not_crack(void **state) {
    (void)state;
    fct_mesh roof = make_roof(32);
    for (double ratio = .3; ratio > .005; ratio /= 3) {
        fct_mesh out = to_faces(&roof, ratio);
        assert_int_equal(open_sides(&out, inside_square), 0);
        assert_float_equal(mesh_area(&out), sqrt(2), 1e-3);
        uint32_t ridge[2] = {0, 0};
        for (uint32_t v = 0; v < out.vertex_count; ++v) {
            if (fabs(out.positions[3 * v] - .5) < 1e-4) ++ridge[out.colors[3 * v] > .65f];
            double z = .4 - fabs(out.positions[3 * v] - .5);
            assert_float_equal(out.positions[3 * v + 2], z, 1e-4);
            /* Each slope keeps its own colours. */
            double y = out.positions[3 * v + 1], r = out.colors[3 * v];
            assert_true(fabs(r - .8) < 1e-3 || fabs(r - (.2 + .3 * y)) < 2e-3);
        }
        assert_true(ridge[0] >= 2 && ridge[0] == ridge[1]);
        fct_mesh_release(&env, &out);
    }
    fct_mesh_release(&env, &roof);
}

static void equal_doubles_become_one_vertex(void **state) {
    (void)state;
    /* A soup: each face of a sphere has its own vertices. */
    fct_mesh sphere = make_sphere(&env, 20), soup;
    uint32_t corners = 3 * sphere.face_count;
    assert_int_equal(fct_mesh_create(&env, corners, sphere.face_count, 0, &soup), FCT_OK);
    for (uint32_t c = 0; c < corners; ++c) {
        memcpy(soup.positions + 3 * c, sphere.positions + 3 * sphere.triangles[c], 12);
        soup.triangles[c] = c;
    }
    fct_mesh out = to_faces(&soup, .1);
    assert_int_equal(open_sides(&out, NULL), 0);
    assert_int_equal(out.vertex_count, out.face_count / 2 + 2);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &soup);
    fct_mesh_release(&env, &sphere);
}

static void texture_seams_are_kept(void **state) {
    (void)state;
    /* A cylinder: u runs once around it, with a seam where u jumps from 1 to 0. */
    enum { N = 48, M = 16 };
    fct_mesh tube;
    assert_int_equal(fct_mesh_create(&env, N * (M + 1), 2 * N * M, FCT_MESH_TEXCOORDS, &tube), FCT_OK);
    for (uint32_t j = 0; j <= M; ++j)
        for (uint32_t i = 0; i < N; ++i) {
            double u = 6.283185307179586 * i / N;
            float p[3] = {(float)cos(u), (float)sin(u), 2 * (float)j / M};
            memcpy(tube.positions + 3 * (j * N + i), p, sizeof p);
        }
    for (uint32_t j = 0; j < M; ++j)
        for (uint32_t i = 0; i < N; ++i) {
            uint32_t two[6] = {j * N + i, j * N + (i + 1) % N,       (j + 1) * N + (i + 1) % N,
                               j * N + i, (j + 1) * N + (i + 1) % N, (j + 1) * N + i};
            float l = (float)i / N, r = (float)(i + 1) / N, b = (float)j / M, t = (float)(j + 1) / M;
            float uv[12] = {l, b, r, b, r, t, l, b, r, t, l, t};
            memcpy(tube.triangles + 6 * (j * N + i), two, sizeof two);
            memcpy(tube.texcoords + 12 * (j * N + i), uv, sizeof uv);
        }
    fct_mesh out = to_faces(&tube, .08);
    uint32_t seam = 0;
    for (uint32_t c = 0; c < 3 * out.face_count; ++c) {
        v3 p = vertex(&out, out.triangles[c]);
        double u = atan2(p.y, p.x) / 6.283185307179586, got = out.texcoords[2 * c];
        double off = got - u - floor(got - u + .5);
        assert_true(fabs(off) < .02);
        assert_float_equal(out.texcoords[2 * c + 1], p.z / 2, .02);
    }
    for (uint32_t f = 0; f < out.face_count; ++f) {
        double low = 2, high = -1;
        for (int k = 0; k < 3; ++k) {
            low = fmin(low, out.texcoords[6 * f + 2 * k]), high = fmax(high, out.texcoords[6 * f + 2 * k]);
            seam += out.texcoords[6 * f + 2 * k] > .999f;
        }
        assert_true(high - low < .5); /* no face spans the whole texture */
    }
    assert_true(seam >= 2);
    /* The seam doubles no vertex. */
    for (uint32_t v = 0; v < out.vertex_count; ++v)
        for (uint32_t w = v + 1; w < out.vertex_count; ++w) assert_false(same_place(&out, v, w));
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &tube);
}

static void material_borders_stay_where_they_are(void **state) {
    (void)state;
    for (int kind = 0; kind < 2; ++kind) {
        fct_mesh grid = make_grid(&env, 40);
        grid = with_arrays(&env, &grid, kind ? FCT_MESH_FACE_COLORS : FCT_MESH_MATERIALS);
        double area[2] = {0, 0};
        for (uint32_t f = 0; f < grid.face_count; ++f) {
            double x = 0, y = 0;
            for (int k = 0; k < 3; ++k) {
                x += vertex(&grid, grid.triangles[3 * f + k]).x / 3 - 1. / 6;
                y += vertex(&grid, grid.triangles[3 * f + k]).y / 3 - 1. / 6;
            }
            bool disc = x * x + y * y < .09;
            if (kind)
                grid.face_colors[3 * f] = disc ? 1 : 0;
            else
                grid.materials[f] = disc;
            area[disc] += .5 * v3_norm(face_cross(&grid, f));
        }
        grid.material_count = kind ? 0 : 2;
        fct_mesh out = to_faces(&grid, .15);
        double left[2] = {0, 0};
        for (uint32_t f = 0; f < out.face_count; ++f)
            left[kind ? out.face_colors[3 * f] > .5f : out.materials[f]] += .5 * v3_norm(face_cross(&out, f));
        assert_float_equal(left[0] + left[1], 1, 1e-4);
        assert_float_equal(left[1], area[1], .01 * area[1]);
        fct_mesh_release(&env, &out);
        fct_mesh_release(&env, &grid);
    }
}

static void normals_come_out_of_unit_length(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 30);
    sphere = with_arrays(&env, &sphere, FCT_MESH_NORMALS);
    memcpy(sphere.normals, sphere.positions, 12 * sphere.vertex_count);
    fct_mesh out = to_faces(&sphere, .1);
    for (uint32_t v = 0; v < out.vertex_count; ++v) {
        v3 n = v3_load(out.normals + 3 * v), p = v3_unit(vertex(&out, v));
        assert_float_equal(v3_norm(n), 1, 1e-6);
        assert_true(v3_dot(n, p) > .99);
    }
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &sphere);
}

static void names_and_polygons_come_along(void **state) {
    (void)state;
    fct_mesh grid = make_grid(&env, 10);
    grid = with_arrays(&env, &grid, FCT_MESH_MATERIALS | FCT_MESH_SOURCE_FACES);
    char *names[2] = {"stone", "glass"};
    for (uint32_t f = 0; f < grid.face_count; ++f) grid.materials[f] = f & 1, grid.source_faces[f] = 7 * f;
    grid.material_count = 2; /* the mesh does not own the names */
    fct_mesh view = grid;
    view.material_names = names;
    fct_mesh out = to_faces(&view, .5);
    assert_int_equal(out.material_count, 2);
    assert_string_equal(out.material_names[1], "glass");
    for (uint32_t f = 0; f < out.face_count; ++f)
        assert_int_equal(out.source_faces[f] / 7 & 1, out.materials[f]);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &grid);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(flat_geometry_stays_exact_and_colors_close),
        cmocka_unit_test(triangles_gather_at_the_shadow_border),
        cmocka_unit_test(colors_stay_within_the_input),
        cmocka_unit_test(weight_zero_lets_colors_ride_along),
        cmocka_unit_test(doubled_creases_do_not_crack),
        cmocka_unit_test(equal_doubles_become_one_vertex),
        cmocka_unit_test(texture_seams_are_kept),
        cmocka_unit_test(material_borders_stay_where_they_are),
        cmocka_unit_test(normals_come_out_of_unit_length),
        cmocka_unit_test(names_and_polygons_come_along),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
