/* Planar parts and narrow bodies: by default no face loses its area, none is doubled or folded onto another,
 * and no edge gets a third face. */
#include "shapes.h"

static fct_env env;

enum { CELLS = 12, LAYERS = 2 };

typedef bool mask(int x, int y);

static bool plate(int x, int y) {
    return x >= 0 && y >= 0 && x < CELLS && y < CELLS;
}
static bool holes(int x, int y) {
    return plate(x, y) && !(x % 4 == 2 && y % 3 == 1);
}
static bool angle(int x, int y) {
    return plate(x, y) && (x < 3 || y < 3);
}
static bool bezel(int x, int y) {
    return plate(x, y) && (x < 2 || y < 2 || x >= CELLS - 2 || y >= CELLS - 2);
}
static bool comb(int x, int y) {
    return plate(x, y) && (y < 3 || x % 4 < 2);
}

typedef struct part {
    fct_mesh mesh;
    uint32_t ids[(LAYERS + 1) * (CELLS + 1) * (CELLS + 1)];
} part;

static uint32_t find_vertex(part *p, int x, int y, int z) {
    uint32_t *id = &p->ids[((uint32_t)z * (CELLS + 1) + (uint32_t)y) * (CELLS + 1) + (uint32_t)x];
    if (*id == FCT_NONE) {
        float at[3] = {(float)x / CELLS, (float)y / CELLS, .1f * (float)z / LAYERS};
        memcpy(p->mesh.positions + 3 * (size_t)p->mesh.vertex_count, at, sizeof at);
        *id = p->mesh.vertex_count++;
    }
    return *id;
}

static void add_square(part *p, const int at[3], const int u[3], const int v[3]) {
    uint32_t ids[4];
    for (int k = 0; k < 4; ++k) {
        int i = k == 1 || k == 2, j = k > 1;
        ids[k] = find_vertex(p, at[0] + i * u[0] + j * v[0], at[1] + i * u[1] + j * v[1],
                             at[2] + i * u[2] + j * v[2]);
    }
    const uint32_t two[6] = {ids[0], ids[1], ids[2], ids[0], ids[2], ids[3]};
    memcpy(p->mesh.triangles + 3 * (size_t)p->mesh.face_count, two, sizeof two);
    p->mesh.face_count += 2;
}

/* The cells of the mask, LAYERS high, as a closed surface of squares. */
static fct_mesh make_part(mask *solid) {
    static part p;
    assert_int_equal(fct_mesh_create(&env, sizeof p.ids / 4, 40 * CELLS * CELLS, 0, &p.mesh), FCT_OK);
    p.mesh.vertex_count = p.mesh.face_count = 0;
    memset(p.ids, 0xff, sizeof p.ids);
    const int x1[3] = {1, 0, 0}, y1[3] = {0, 1, 0}, z1[3] = {0, 0, 1};
    for (int y = 0; y < CELLS; ++y)
        for (int x = 0; x < CELLS; ++x) {
            if (!solid(x, y)) continue;
            add_square(&p, (const int[3]){x, y, 0}, y1, x1);
            add_square(&p, (const int[3]){x, y, LAYERS}, x1, y1);
            for (int z = 0; z < LAYERS; ++z) {
                if (!solid(x - 1, y)) add_square(&p, (const int[3]){x, y, z}, z1, y1);
                if (!solid(x + 1, y)) add_square(&p, (const int[3]){x + 1, y, z}, y1, z1);
                if (!solid(x, y - 1)) add_square(&p, (const int[3]){x, y, z}, x1, z1);
                if (!solid(x, y + 1)) add_square(&p, (const int[3]){x, y + 1, z}, z1, x1);
            }
        }
    return p.mesh;
}

/* A ring of N x M squares: point (i, j) is at radius r(i, j) and height h(j). With `teeth` the outer radius
 * steps between two values: a gear. Without, a torus of M sides. */
static fct_mesh make_ring(uint32_t n, uint32_t m, bool teeth) {
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&env, n * m, 2 * n * m, 0, &mesh), FCT_OK);
    for (uint32_t i = 0; i < n; ++i)
        for (uint32_t j = 0; j < m; ++j) {
            double u = 6.283185307179586 * i / n, v = 6.283185307179586 * j / m;
            uint32_t side = 4 * j / m, step = 4 * j % m;
            double t = (double)step / m, outer = i / 2 % 2 ? 1 : .8;
            double across = side == 0 ? t : side == 1 ? 1 : side == 2 ? 1 - t : 0; /* around a rectangle */
            double height = side == 0 ? 0 : side == 1 ? t : side == 2 ? 1 : 1 - t;
            double r = teeth ? .4 + across * (outer - .4) : 1 + .2 * cos(v);
            double z = teeth ? .15 * height : .2 * sin(v);
            float p[3] = {(float)(r * cos(u)), (float)(r * sin(u)), (float)z};
            memcpy(mesh.positions + 3 * (size_t)(i * m + j), p, sizeof p);
            uint32_t a = i * m + j, b = (i + 1) % n * m + j, c = (i + 1) % n * m + (j + 1) % m;
            uint32_t two[6] = {a, b, c, a, c, i * m + (j + 1) % m};
            memcpy(mesh.triangles + 6 * (size_t)a, two, sizeof two);
        }
    return mesh;
}

/* Turns a mesh about two axes, or moves it; 0: neither. */
static void place_mesh(fct_mesh *mesh, int pose) {
    double c = cos(.4), s = sin(.4);
    for (float *p = mesh->positions; p < mesh->positions + 3 * (size_t)mesh->vertex_count; p += 3) {
        double x = p[0], y = p[1], z = p[2];
        if (pose == 1) p[0] = (float)(c * x - s * y), p[1] = (float)(s * x + c * y);
        if (pose == 2) p[0] = (float)(c * x - s * y), p[1] = (float)(c * (s * x + c * y) - s * z);
        if (pose == 2) p[2] = (float)(s * (s * x + c * y) + c * z);
        if (pose == 3) p[0] = (float)(x + .14), p[1] = (float)(y + 5.22), p[2] = (float)(z + 7.69);
    }
}

/* Pairs of faces at an edge with less than 20 degrees between them. Contractions make none with less than 26,
 * but turns of less than 4 degrees at a fixed side are not checked. Quadratic. */
static uint32_t count_folds(const fct_mesh *mesh) {
    uint32_t folds = 0;
    for (uint32_t f = 0; f < mesh->face_count; ++f)
        for (uint32_t g = 0; g < f; ++g) {
            uint32_t common = 0;
            for (uint32_t k = 0; k < 9; ++k)
                common += mesh->triangles[3 * f + k / 3] == mesh->triangles[3 * g + k % 3];
            v3 n = face_cross(mesh, f), m = face_cross(mesh, g);
            folds += common == 2 && v3_dot(n, m) < -.94 * v3_norm(n) * v3_norm(m);
        }
    return folds;
}

static void check_faces(const fct_mesh *out) {
    fct_mesh_report report;
    assert_int_equal(fct_mesh_inspect(&env, out, &report), FCT_OK);
    assert_int_equal(report.degenerate_faces, 0);
    assert_int_equal(report.duplicate_faces, 0);
    assert_int_equal(report.nonmanifold_edges, 0);
    assert_int_equal(report.boundary_edges, 0);
    assert_int_equal(count_folds(out), 0);
}

static void planar_parts_keep_good_faces(void **state) {
    (void)state;
    mask *const masks[] = {plate, holes, angle, bezel, comb, NULL};
    for (int kind = 0; kind < 6; ++kind)
        for (int pose = 0; pose < 4; ++pose) {
            fct_mesh mesh = masks[kind] ? make_part(masks[kind]) : make_ring(48, 16, true);
            place_mesh(&mesh, pose);
            check_faces(&mesh);
            fct_simplify_def def = fct_simplify_def_default();
            for (int option = 0; option < 16; ++option) {
                const double ratios[] = {.1, .25, .5, .75};
                def.target_faces = (uint32_t)(ratios[option % 4] * mesh.face_count);
                def.keep_topology = option & 4, def.refit_passes = option & 8 ? 0 : 2;
                fct_simplify_stats stats;
                fct_mesh out = simplified(&env, &mesh, &def, &stats);
                assert_true(stats.stopped_because == FCT_STOP_FACES || option % 4 == 0);
                check_faces(&out);
                fct_mesh_release(&env, &out);
            }
            fct_mesh_release(&env, &mesh);
        }
}

/* A torus of three sides has necks of three edges without a face: a contraction there would give an edge four
 * faces. */
static void narrow_rings_are_not_pinched(void **state) {
    (void)state;
    for (uint32_t sides = 3; sides < 6; ++sides) {
        fct_mesh mesh = make_ring(40, sides, false);
        fct_simplify_def def = fct_simplify_def_default();
        for (uint32_t target = 0; target < 120; target += 10) {
            def.target_faces = target;
            fct_mesh out = simplified(&env, &mesh, &def, NULL);
            check_faces(&out);
            assert_true(out.face_count >= 14); /* no torus has fewer */
            fct_mesh_release(&env, &out);
        }
        fct_mesh_release(&env, &mesh);
    }
}

/* Small boxes beside each other vanish one after the other, as a whole. */
static void small_bodies_vanish_as_a_whole(void **state) {
    (void)state;
    enum { BODIES = 20 };
    fct_mesh box = make_cube(&env, 2), mesh;
    uint32_t vertices = box.vertex_count, faces = box.face_count;
    assert_int_equal(
        fct_mesh_create(&env, BODIES * vertices, BODIES * faces, FCT_MESH_COLORS | FCT_MESH_TEXCOORDS, &mesh),
        FCT_OK);
    memset(mesh.colors, 0, 12 * (size_t)mesh.vertex_count);
    for (uint32_t b = 0; b < BODIES; ++b) {
        for (uint32_t i = 0; i < 3 * vertices; ++i)
            mesh.positions[3 * b * vertices + i] =
                box.positions[i] * (float)(b + 1) + (i % 3 ? 0 : (float)(b * b));
        for (uint32_t i = 0; i < 3 * faces; ++i) {
            mesh.triangles[3 * b * faces + i] = box.triangles[i] + b * vertices;
            mesh.texcoords[6 * b * faces + 2 * i] = (float)(i / 9 % 2);
            mesh.texcoords[6 * b * faces + 2 * i + 1] = (float)(i % 3);
        }
    }
    for (uint32_t wanted = BODIES * 8; wanted > 0; wanted /= 2) {
        fct_simplify_def def = fct_simplify_def_default();
        def.target_faces = wanted;
        fct_simplify_stats stats;
        fct_mesh out = simplified(&env, &mesh, &def, &stats);
        fct_mesh_report report;
        assert_int_equal(fct_mesh_inspect(&env, &out, &report), FCT_OK);
        assert_int_equal(report.duplicate_faces + report.nonmanifold_edges, 0);
        assert_int_equal(open_sides(&out, NULL), 0);
        assert_int_equal(stats.stopped_because, FCT_STOP_FACES);
        assert_true(out.face_count <= wanted);
        fct_mesh_release(&env, &out);
    }
    fct_mesh_release(&env, &mesh);
    fct_mesh_release(&env, &box);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(planar_parts_keep_good_faces),
        cmocka_unit_test(narrow_rings_are_not_pinched),
        cmocka_unit_test(small_bodies_vanish_as_a_whole),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
