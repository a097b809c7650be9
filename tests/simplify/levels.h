/* tests/simplify/levels.h: meshes for progressive meshes, and comparisons of levels. */
#ifndef FCT_TESTS_SIMPLIFY_LEVELS_H
#define FCT_TESTS_SIMPLIFY_LEVELS_H

#include "facetree/progressive.h"
#include "shapes.h"

/* A face as floats: per corner position, texture coordinates, colour and normal; then face colour and
 * material. */
enum { FACE_WORDS = 37 };

static inline void describe_face(const fct_mesh *mesh, uint32_t f, float *to) {
    memset(to, 0, FACE_WORDS * sizeof *to);
    for (size_t k = 0; k < 3; ++k, to += 11) {
        size_t c = 3 * (size_t)f + k, v = mesh->triangles[c];
        memcpy(to, mesh->positions + 3 * v, 12);
        if (mesh->texcoords) memcpy(to + 9, mesh->texcoords + 2 * c, 8);
        if (mesh->colors) memcpy(to + 3, mesh->colors + 3 * v, 12);
        if (mesh->normals) memcpy(to + 6, mesh->normals + 3 * v, 12);
    }
    if (mesh->face_colors) memcpy(to, mesh->face_colors + 3 * (size_t)f, 12);
    if (mesh->materials) to[3] = (float)mesh->materials[f];
}

static inline int compare_faces(const void *a, const void *b) {
    return memcmp(a, b, FACE_WORDS * sizeof(float));
}

static inline float *describe_faces(const fct_mesh *mesh) {
    float *faces = calloc((size_t)mesh->face_count + 1, FACE_WORDS * sizeof *faces);
    for (uint32_t f = 0; f < mesh->face_count; ++f) describe_face(mesh, f, faces + FACE_WORDS * (size_t)f);
    qsort(faces, mesh->face_count, FACE_WORDS * sizeof *faces, compare_faces);
    return faces;
}

/* The same faces with the same corners and attributes, in any order. */
static inline bool same_faces(const fct_mesh *a, const fct_mesh *b) {
    if (a->face_count != b->face_count || a->vertex_count != b->vertex_count) return false;
    float *x = describe_faces(a), *y = describe_faces(b);
    bool same = !memcmp(x, y, a->face_count * FACE_WORDS * sizeof *x);
    free(x), free(y);
    return same;
}

static inline bool same_array(const void *a, const void *b, size_t size) {
    return !a == !b && (!a || !memcmp(a, b, size));
}

/* The same bytes. */
static inline bool same_mesh(const fct_mesh *a, const fct_mesh *b) {
    size_t v = a->vertex_count, f = a->face_count;
    return v == b->vertex_count && f == b->face_count && same_array(a->positions, b->positions, 12 * v) &&
           same_array(a->triangles, b->triangles, 12 * f) && same_array(a->colors, b->colors, 12 * v) &&
           same_array(a->normals, b->normals, 12 * v) && same_array(a->texcoords, b->texcoords, 24 * f) &&
           same_array(a->face_colors, b->face_colors, 12 * f) &&
           same_array(a->materials, b->materials, 4 * f);
}

/* The progressive mesh of a simplification to `faces` without refit. */
static inline fct_progressive *progressive_of(const fct_env *env, const fct_mesh *mesh, fct_simplify_def def,
                                              uint32_t faces) {
    fct_progressive *progressive;
    fct_mesh out;
    def.target_faces = faces;
    def.refit_passes = 0;
    assert_int_equal(fct_simplify_progressive(env, mesh, &def, &out, NULL, &progressive), FCT_OK);
    assert_non_null(progressive);
    fct_mesh level;
    assert_int_equal(fct_progressive_mesh(progressive, &level), FCT_OK);
    assert_true(same_faces(&level, &out));
    fct_mesh_release(env, &level);
    fct_mesh_release(env, &out);
    return progressive;
}

static inline fct_mesh level_mesh(fct_progressive *progressive, uint32_t faces) {
    fct_mesh mesh;
    fct_progressive_go(progressive, faces);
    assert_int_equal(fct_progressive_mesh(progressive, &mesh), FCT_OK);
    return mesh;
}

/* A torus of n x 2n squares with colours, normals, materials and colours of faces; with `seams`, texture
 * coordinates with two seams. With `hard`, each square has vertices of its own, with one normal. */
static inline fct_mesh make_torus(const fct_env *env, uint32_t n, bool hard, bool seams) {
    fct_mesh mesh;
    uint32_t m = 2 * n, squares = n * m;
    unsigned kinds = FCT_MESH_COLORS | FCT_MESH_NORMALS | (seams ? FCT_MESH_TEXCOORDS : 0) |
                     FCT_MESH_MATERIALS | FCT_MESH_FACE_COLORS;
    assert_int_equal(fct_mesh_create(env, hard ? 4 * squares : squares, 2 * squares, kinds, &mesh), FCT_OK);
    static const uint32_t corners[6] = {0, 1, 2, 0, 2, 3};
    for (uint32_t q = 0; q < squares; ++q)
        for (uint32_t k = 0; k < 4; ++k) {
            uint32_t i = q % m + (k == 1 || k == 2), j = q / m + k / 2, v = i % m + m * (j % n);
            if (hard) v = 4 * q + k;
            double a = 2 * 3.14159265358979 * (i % m) / m, b = 2 * 3.14159265358979 * (j % n) / n;
            double r = 1 + (.4 + .02 * sin(5 * a)) * cos(b);
            float *p = mesh.positions + 3 * v, *c = mesh.colors + 3 * v, *o = mesh.normals + 3 * v;
            p[0] = (float)(r * cos(a)), p[1] = (float)(r * sin(a)), p[2] = (float)(.4 * sin(b));
            c[0] = (float)(.5 + .5 * sin(a)), c[1] = (float)(.5 + .5 * cos(2 * b)), c[2] = .25f;
            v3 unit = {cos(a) * cos(b), sin(a) * cos(b), sin(b)};
            v3_store(o, unit);
            if (hard) memcpy(o, mesh.normals + 3 * (v - k), 12);
            for (uint32_t x = 0; x < 6; ++x) {
                if (corners[x] != k) continue;
                mesh.triangles[6 * q + x] = v;
                if (!seams) continue;
                mesh.texcoords[2 * (6 * q + x)] = (float)i / (float)m;
                mesh.texcoords[2 * (6 * q + x) + 1] = (float)j / (float)n;
            }
        }
    for (uint32_t f = 0; f < 2 * squares; ++f) {
        mesh.materials[f] = f / 2 % m < n;
        for (uint32_t k = 0; k < 3; ++k)
            mesh.face_colors[3 * f + k] = f / 2 / m < n / 2 ? .8f : .1f * (float)k;
    }
    mesh.material_count = 2;
    mesh.origin[1] = 1000;
    return mesh;
}

/* A grid of n x n squares whose columns are flat and rough in turn, ten each, and needles on flat ones. A
 * needle is three faces at a vertex of the grid that it shares; its texture coordinates are its own:
 *
 *     p--q--r--s
 *      \ | | /
 *       \||/
 *     ---v-----   the grid
 *
 * In a sweep over blocks, needles go before the cheaper edges of v if those lie in two blocks. */
static inline fct_mesh make_needles(const fct_env *env, uint32_t n) {
    enum { BAND = 10, EVERY = 8 };
    fct_mesh grid = make_grid(env, n), mesh;
    uint32_t points = grid.vertex_count, needles = points / EVERY, faces = grid.face_count, random = 1;
    assert_int_equal(
        fct_mesh_create(env, points + 4 * needles, faces + 3 * needles, FCT_MESH_TEXCOORDS, &mesh), FCT_OK);
    memcpy(mesh.positions, grid.positions, 12 * (size_t)points);
    memcpy(mesh.triangles, grid.triangles, 12 * (size_t)faces);
    for (uint32_t v = 0; v < points; ++v) {
        random = random * 1664525u + 1013904223u;
        if (v % (n + 1) / BAND % 2)
            mesh.positions[3 * v + 2] = .02f * (float)(random >> 8) / (float)(1 << 24);
    }
    for (uint32_t i = 0; i < needles; ++i) {
        uint32_t v = i * EVERY, first = points + 4 * i;
        while (v % (n + 1) / BAND % 2) v = (v + BAND + 1) % points;
        for (uint32_t k = 0; k < 4; ++k) {
            float *p = mesh.positions + 3 * (first + k);
            memcpy(p, mesh.positions + 3 * v, 12);
            p[0] += .002f * ((float)k - 1.5f), p[1] += .0006f * (float)(k * k);
            p[2] += .002f * (.2f + (float)(i * 7 % 31) / 31);
        }
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t t[3] = {v, first + k, first + k + 1};
            memcpy(mesh.triangles + 3 * (faces + 3 * i + k), t, sizeof t);
        }
    }
    for (uint32_t c = 0; c < 3 * mesh.face_count; ++c)
        for (uint32_t k = 0; k < 2; ++k)
            mesh.texcoords[2 * c + k] = (c < 3 * faces ? 0 : 2) + mesh.positions[3 * mesh.triangles[c] + k];
    fct_mesh_release(env, &grid);
    return mesh;
}

#endif
