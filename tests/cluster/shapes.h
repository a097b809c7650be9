/* tests/cluster/shapes.h: small meshes of every topology, for tests of cuts, charts and meshlets. */
#ifndef FCT_TESTS_SHAPES_H
#define FCT_TESTS_SHAPES_H

#include "support.h"

#include "facetree/cluster.h"

static const double pi = 3.14159265358979323846;

static inline fct_mesh shape_of(const fct_env *env, uint32_t vertices, uint32_t faces) {
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(env, vertices, faces, 0, &mesh), FCT_OK);
    return mesh;
}

static inline double shape_random(uint32_t *state) {
    *state = *state * 1664525u + 1013904223u;
    return (*state >> 8) / 16777216.0;
}

/* A ring of n x m quads. twist: its ends meet after half a turn (a Moebius strip if `closed` is false). */
static inline fct_mesh make_ring(const fct_env *env, uint32_t n, uint32_t m, bool closed, bool twist) {
    uint32_t rows = closed ? m : m + 1;
    fct_mesh mesh = shape_of(env, n * rows, 2 * n * m);
    for (uint32_t i = 0; i < n; ++i)
        for (uint32_t j = 0; j < rows; ++j) {
            double a = 2 * pi * i / n, b = closed ? 2 * pi * j / m : twist ? pi * i / n : pi / 2;
            double s = closed ? 1 : 2.0 * j / m - 1, r = 3 + s * cos(b);
            float *p = mesh.positions + 3 * (size_t)(i * rows + j);
            p[0] = (float)(r * cos(a)), p[1] = (float)(r * sin(a)), p[2] = (float)(s * sin(b));
        }
    uint32_t *t = mesh.triangles;
    for (uint32_t i = 0; i < n; ++i)
        for (uint32_t j = 0; j < m; ++j, t += 6) {
            uint32_t k = (i + 1) % n, up = closed ? (j + 1) % m : j + 1;
            bool flip = twist && k == 0;
            uint32_t a = i * rows + j, b = i * rows + up, c = k * rows + (flip ? m - j : j),
                     d = k * rows + (flip ? m - up : up);
            uint32_t two[6] = {a, c, d, a, d, b};
            memcpy(t, two, sizeof two);
        }
    return mesh;
}

/* k triangles around one edge. */
static inline fct_mesh make_book(const fct_env *env, uint32_t k) {
    fct_mesh mesh = shape_of(env, k + 2, k);
    memset(mesh.positions, 0, 6 * sizeof(float));
    mesh.positions[5] = 1;
    for (uint32_t f = 0; f < k; ++f) {
        float *p = mesh.positions + 3 * (size_t)(f + 2);
        p[0] = (float)cos(2 * pi * f / k), p[1] = (float)sin(2 * pi * f / k), p[2] = 0.5f;
        uint32_t t[3] = {0, 1, f + 2};
        memcpy(mesh.triangles + 3 * (size_t)f, t, sizeof t);
    }
    return mesh;
}

/* A flat grid with each face twice. */
static inline fct_mesh make_doubled(const fct_env *env, uint32_t n) {
    fct_mesh grid = make_grid(env, n), mesh = shape_of(env, grid.vertex_count, 2 * grid.face_count);
    memcpy(mesh.positions, grid.positions, 12 * (size_t)grid.vertex_count);
    memcpy(mesh.triangles, grid.triangles, 12 * (size_t)grid.face_count);
    memcpy(mesh.triangles + 3 * (size_t)grid.face_count, grid.triangles, 12 * (size_t)grid.face_count);
    fct_mesh_release(env, &grid);
    return mesh;
}

/* Loose triangles. Some have no area, some have two or three equal vertices. */
static inline fct_mesh make_soup(const fct_env *env, uint32_t n, bool odd) {
    fct_mesh mesh = shape_of(env, 3 * n, n);
    uint32_t state = 7;
    for (uint32_t f = 0; f < n; ++f) {
        for (uint32_t i = 0; i < 9; ++i)
            mesh.positions[9 * (size_t)f + i] = (float)(0.05 * shape_random(&state) + (i % 3 == 0   ? f % 16
                                                                                       : i % 3 == 1 ? f / 16
                                                                                                    : 0));
        for (uint32_t k = 0; k < 3; ++k) mesh.triangles[3 * (size_t)f + k] = 3 * f + k;
        if (odd && f % 5 == 1) mesh.triangles[3 * (size_t)f + 1] = 3 * f;
        if (odd && f % 5 == 2) memcpy(mesh.positions + 9 * (size_t)f, mesh.positions + 9 * (size_t)f + 3, 12);
        if (odd && f % 5 == 3) mesh.triangles[3 * (size_t)f + 1] = mesh.triangles[3 * (size_t)f + 2] = 3 * f;
    }
    return mesh;
}

/* Two squares in one plane that share one corner. */
static inline fct_mesh make_bowtie(const fct_env *env) {
    static const float points[7][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                       {2, 1, 0}, {2, 2, 0}, {1, 2, 0}};
    static const uint32_t faces[4][3] = {{0, 1, 2}, {0, 2, 3}, {2, 4, 5}, {2, 5, 6}};
    fct_mesh mesh = shape_of(env, 7, 4);
    memcpy(mesh.positions, points, sizeof points);
    memcpy(mesh.triangles, faces, sizeof faces);
    return mesh;
}

/* Bumps of every size, so that no two faces are equal. */
static inline void roughen(fct_mesh *mesh, double height) {
    uint32_t state = 3;
    for (size_t i = 0; i < 3 * (size_t)mesh->vertex_count; ++i)
        mesh->positions[i] += (float)(height * (shape_random(&state) - 0.5));
}

enum { SHAPES = 12 };

static inline fct_mesh make_shape(const fct_env *env, int which) {
    fct_mesh mesh;
    switch (which) {
    case 0:
        return make_grid(env, 20);
    case 1:
        return make_sphere(env, 16);
    case 2:
        return make_ring(env, 40, 20, true, false); /* torus */
    case 3:
        return make_ring(env, 40, 6, false, false); /* tube */
    case 4:
        return make_ring(env, 40, 6, false, true); /* Moebius strip */
    case 5:
        return make_book(env, 40);
    case 6:
        return make_doubled(env, 8);
    case 7:
        return make_soup(env, 300, true);
    case 8:
        return make_bowtie(env);
    case 9:
        return make_grid(env, 1);
    case 10:
        mesh = make_sphere(env, 20);
        roughen(&mesh, 0.05);
        return mesh;
    default:
        mesh = make_grid(env, 1);
        mesh.face_count = 1;
        return mesh;
    }
}

static inline fct_tree *tree_of(const fct_env *env, const fct_mesh *mesh, uint32_t roots) {
    fct_tree_def def = fct_tree_def_default();
    def.root_count = roots;
    fct_tree *tree;
    def.weld = false; /* the checks go by vertices, and some shapes have two at one place */
    assert_int_equal(fct_tree_build(env, mesh, &def, NULL, &tree), FCT_OK);
    return tree;
}

#endif
