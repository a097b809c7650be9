/* tests/fuzz/fuzz_bytes.h: a fuzzer's bytes as numbers, as a small mesh and as the tree of that mesh.
 *
 * A mesh is a shape of at most about 80 faces, at any scale and place, with edits: vertices that coincide or
 * are not finite, faces that are doubled, turned, without area or out of range. Bytes that are missing are 0.
 */
#ifndef FCT_TESTS_FUZZ_BYTES_H
#define FCT_TESTS_FUZZ_BYTES_H

#include <math.h>
#include <string.h>

#include "facetree/cluster.h"
#include "fuzz/fuzz.h"

typedef struct fuzz_bytes {
    const uint8_t *next, *end;
} fuzz_bytes;

static inline fuzz_bytes fuzz_begin(const uint8_t *data, size_t size) {
    return (fuzz_bytes){data, data + size};
}

static inline uint32_t fuzz_byte(fuzz_bytes *b) {
    return b->next < b->end ? *b->next++ : 0;
}

/* A number below `limit`, which is at most 65536. */
static inline uint32_t fuzz_below(fuzz_bytes *b, uint32_t limit) {
    uint32_t value = fuzz_byte(b);
    if (limit > 256) value = value << 8 | fuzz_byte(b);
    return value % limit;
}

static inline bool fuzz_flag(fuzz_bytes *b) {
    return fuzz_byte(b) & 1;
}

/* A number in [0, 1], in steps of 1/255. */
static inline double fuzz_share(fuzz_bytes *b) {
    return fuzz_byte(b) / 255.;
}

/* A multiple of 1/16 in [-7.5, 7.5), or any float: also NaN and infinity. */
static inline float fuzz_real(fuzz_bytes *b) {
    uint32_t value = fuzz_byte(b), bits = 0;
    if (value < 240) return ((float)value - 120) / 16;
    for (int i = 0; i < 4; ++i) bits = bits << 8 | fuzz_byte(b);
    float real;
    memcpy(&real, &bits, sizeof real);
    return real;
}

/* --- Shapes --- */

static inline fct_mesh fuzz_allocate_mesh(const fct_env *env, uint32_t vertices, uint32_t faces,
                                          unsigned arrays) {
    fct_mesh mesh;
    fuzz_require(fct_mesh_create(env, vertices, faces, arrays, &mesh) == FCT_OK, "a small mesh");
    return mesh;
}

static inline void fuzz_set_vertex(fct_mesh *mesh, uint32_t v, double x, double y, double z) {
    float *p = mesh->positions + 3 * (size_t)v;
    p[0] = (float)x, p[1] = (float)y, p[2] = (float)z;
}

static inline void fuzz_set_face(fct_mesh *mesh, uint32_t f, uint32_t a, uint32_t b, uint32_t c) {
    uint32_t *t = mesh->triangles + 3 * (size_t)f;
    t[0] = a, t[1] = b, t[2] = c;
}

/* n x m squares of two triangles. `closed`: each row is a ring, and all of its vertices have their own
 * height: a tube. */
static inline fct_mesh fuzz_make_grid(const fct_env *env, uint32_t n, uint32_t m, bool closed,
                                      unsigned arrays) {
    uint32_t columns = closed ? n : n + 1;
    fct_mesh mesh = fuzz_allocate_mesh(env, columns * (m + 1), 2 * n * m, arrays);
    for (uint32_t j = 0; j <= m; ++j)
        for (uint32_t i = 0; i < columns; ++i) {
            double angle = 6.283185307179586 * i / n, height = .25 * ((i * 7 + j * 5) % 4);
            if (closed)
                fuzz_set_vertex(&mesh, j * columns + i, cos(angle), sin(angle), j);
            else
                fuzz_set_vertex(&mesh, j * columns + i, i, j, n % 2 ? 0 : height);
        }
    for (uint32_t j = 0, f = 0; j < m; ++j)
        for (uint32_t i = 0; i < n; ++i, f += 2) {
            uint32_t a = j * columns + i, b = j * columns + (i + 1) % columns;
            if (!closed) b = a + 1;
            fuzz_set_face(&mesh, f, a, b, b + columns);
            fuzz_set_face(&mesh, f + 1, a, b + columns, a + columns);
        }
    return mesh;
}

/* n faces around an edge (`edge`) or around a vertex. */
static inline fct_mesh fuzz_make_fan(const fct_env *env, uint32_t n, bool edge, unsigned arrays) {
    fct_mesh mesh = fuzz_allocate_mesh(env, n + 2, n, arrays);
    fuzz_set_vertex(&mesh, 0, 0, 0, 0);
    fuzz_set_vertex(&mesh, 1, 0, 0, 1);
    for (uint32_t i = 0; i < n; ++i) {
        double angle = 6.283185307179586 * i / n;
        fuzz_set_vertex(&mesh, i + 2, cos(angle), sin(angle), .5);
        fuzz_set_face(&mesh, i, 0, edge ? 1 : i + 2, edge ? i + 2 : (i + 1) % n + 2);
    }
    return mesh;
}

/* Vertices on the corners of a box, each with an own copy for each of its faces if `loose`. */
static inline fct_mesh fuzz_make_box(const fct_env *env, bool loose, unsigned arrays) {
    static const uint8_t sides[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                        {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    fct_mesh mesh = fuzz_allocate_mesh(env, loose ? 24 : 8, 12, arrays);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        uint32_t corner = loose ? sides[v / 4][v % 4] : v;
        fuzz_set_vertex(&mesh, v, corner & 1, corner >> 1 & 1, corner >> 2);
    }
    for (uint32_t i = 0; i < 6; ++i) {
        uint32_t v[4];
        for (uint32_t k = 0; k < 4; ++k) v[k] = loose ? 4 * i + k : sides[i][k];
        fuzz_set_face(&mesh, 2 * i, v[0], v[1], v[2]);
        fuzz_set_face(&mesh, 2 * i + 1, v[0], v[2], v[3]);
    }
    return mesh;
}

/* Vertices and corners from the bytes. */
static inline fct_mesh fuzz_make_free(const fct_env *env, fuzz_bytes *b, uint32_t vertices, uint32_t faces,
                                      unsigned arrays) {
    fct_mesh mesh = fuzz_allocate_mesh(env, vertices, faces, arrays);
    for (uint32_t i = 0; i < 3 * vertices; ++i) mesh.positions[i] = fuzz_real(b);
    for (uint32_t i = 0; i < 3 * faces; ++i) mesh.triangles[i] = fuzz_below(b, vertices);
    return mesh;
}

static inline fct_mesh fuzz_make_shape(const fct_env *env, fuzz_bytes *b, unsigned arrays) {
    uint32_t kind = fuzz_below(b, 7), size = fuzz_byte(b), n = size % 6 + 1, m = size / 6 % 6 + 1;
    switch (kind) {
    case 0:
        return fuzz_make_grid(env, n, m, false, arrays);
    case 1:
        return fuzz_make_grid(env, n + 1, m, true, arrays);
    case 2:
        return fuzz_make_fan(env, size % 24 + 1, true, arrays);
    case 3:
        return fuzz_make_fan(env, size % 24 + 1, false, arrays);
    case 4:
        return fuzz_make_box(env, false, arrays);
    case 5:
        return fuzz_make_box(env, true, arrays);
    default:
        return fuzz_make_free(env, b, n + 2, m * 2, arrays);
    }
}

/* --- Edits --- */

static inline float *fuzz_pick_attribute(fuzz_bytes *b, const fct_mesh *mesh) {
    uint32_t which = fuzz_below(b, 4), v = fuzz_below(b, 3 * mesh->vertex_count);
    float *arrays[4] = {mesh->colors, mesh->normals, NULL, NULL};
    if (which < 2) return arrays[which] ? arrays[which] + v : NULL;
    if (which == 2) return mesh->texcoords ? mesh->texcoords + v % (6 * mesh->face_count) : NULL;
    return mesh->face_colors ? mesh->face_colors + v % (3 * mesh->face_count) : NULL;
}

static inline void fuzz_edit(fuzz_bytes *b, fct_mesh *mesh) {
    uint32_t kind = fuzz_below(b, 9), v = fuzz_below(b, mesh->vertex_count),
             f = fuzz_below(b, mesh->face_count), k = fuzz_below(b, 3), swap;
    float *p = mesh->positions + 3 * (size_t)v, *attribute;
    uint32_t *t = mesh->triangles + 3 * (size_t)f;
    switch (kind) {
    case 0:
        p[k] = fuzz_real(b);
        break;
    case 1: /* the position of another vertex */
        memcpy(p, mesh->positions + 3 * (size_t)fuzz_below(b, mesh->vertex_count), 3 * sizeof *p);
        break;
    case 2:
        t[k] = v;
        break;
    case 3: /* the corners of another face */
        memcpy(t, mesh->triangles + 3 * (size_t)fuzz_below(b, mesh->face_count), 3 * sizeof *t);
        break;
    case 4:
        swap = t[k], t[k] = t[(k + 1) % 3], t[(k + 1) % 3] = swap;
        break;
    case 5: /* a smallest step */
        p[k] = nextafterf(p[k], fuzz_flag(b) ? INFINITY : -INFINITY);
        break;
    case 6: /* a sliver or a needle */
        for (int i = 0; i < 3; ++i)
            p[i] = mesh->positions[3 * (size_t)t[k] % (3 * mesh->vertex_count) + (size_t)i] + p[i] * 1e-6F;
        break;
    case 7:
        attribute = fuzz_pick_attribute(b, mesh);
        if (attribute) *attribute = fuzz_real(b);
        break;
    default: /* out of range, rarely */
        t[k] = fuzz_byte(b) == 255 ? mesh->vertex_count : t[(k + 1) % 3];
    }
}

static inline void fuzz_fill_attributes(fct_mesh *mesh) {
    for (uint32_t i = 0; mesh->colors && i < 3 * mesh->vertex_count; ++i)
        mesh->colors[i] = (float)(i * 37 % 16) / 16;
    for (uint32_t i = 0; mesh->normals && i < 3 * mesh->vertex_count; ++i) mesh->normals[i] = i % 3 == 2;
    for (uint32_t i = 0; mesh->texcoords && i < 6 * mesh->face_count; ++i)
        mesh->texcoords[i] = mesh->positions[3 * (size_t)mesh->triangles[i / 2] + i % 2];
    for (uint32_t i = 0; mesh->face_colors && i < 3 * mesh->face_count; ++i)
        mesh->face_colors[i] = (float)(i * 11 % 8) / 8;
    for (uint32_t f = 0; mesh->materials && f < mesh->face_count; ++f) mesh->materials[f] = f / 3 % 3;
    mesh->material_count = mesh->materials ? 3 : 0;
    for (uint32_t f = 0; mesh->source_faces && f < mesh->face_count; ++f) mesh->source_faces[f] = f / 2;
}

/* Most meshes keep their size. */
static inline void fuzz_place(fuzz_bytes *b, fct_mesh *mesh) {
    static const double scales[16] = {1,   1,    1,     1,     1,     1,    1,    1,
                                      .01, 1e-6, 1e-18, 1e-30, 1e-42, 1e10, 1e20, 5e37},
                        offsets[8] = {0, 0, 0, 0, 0, 1e3, 1e7, 1e30};
    uint32_t place = fuzz_byte(b);
    double scale = scales[place % 16], offset = offsets[place / 16 % 8];
    for (uint32_t i = 0; i < 3 * mesh->vertex_count; ++i)
        mesh->positions[i] = (float)(mesh->positions[i] * scale + offset);
}

/* A mesh with at least one face, which may be invalid. The caller releases it. */
static inline fct_mesh fuzz_make_mesh(const fct_env *env, fuzz_bytes *b) {
    unsigned arrays = fuzz_byte(b) % 64;
    fct_mesh mesh = fuzz_make_shape(env, b, arrays);
    fuzz_fill_attributes(&mesh);
    fuzz_place(b, &mesh);
    for (uint32_t edits = fuzz_below(b, 24); edits > 0; --edits) fuzz_edit(b, &mesh);
    return mesh;
}

/* --- Promises --- */

static inline bool fuzz_all_finite(const float *values, size_t count) {
    for (size_t i = 0; values && i < count; ++i)
        if (!isfinite(values[i])) return false;
    return true;
}

/* Whether the mesh is valid, by plain code; the library must say the same. */
static inline bool fuzz_check_mesh(const fct_env *env, const fct_mesh *mesh) {
    size_t vertices = mesh->vertex_count, faces = mesh->face_count;
    bool valid = fuzz_all_finite(mesh->positions, 3 * vertices) &&
                 fuzz_all_finite(mesh->colors, 3 * vertices) &&
                 fuzz_all_finite(mesh->normals, 3 * vertices) &&
                 fuzz_all_finite(mesh->texcoords, 6 * faces) && fuzz_all_finite(mesh->face_colors, 3 * faces);
    for (size_t c = 0; c < 3 * faces; ++c) valid = valid && mesh->triangles[c] < vertices;
    fuzz_require(fct_mesh_validate(env, mesh) == (valid ? FCT_OK : FCT_ERROR_DATA),
                 "a mesh of finite numbers and corners in range is valid, and no other");
    return valid;
}

/* The tree of a mesh with options from the bytes; NULL if the mesh is not valid. */
static inline fct_tree *fuzz_make_tree(const fct_env *env, fuzz_bytes *b, const fct_mesh *mesh) {
    bool valid = fuzz_check_mesh(env, mesh);
    uint32_t options = fuzz_byte(b);
    fct_tree_def def = fct_tree_def_default();
    fct_tree *tree;
    if (options & 1) def.method = FCT_CLUSTER_GREEDY;
    if (options & 2) def.cost = FCT_COST_MEAN;
    if (options & 4) def.fit_measure = FCT_FIT_POINTS;
    if (options & 8) def.weld = false;
    if (options & 16)
        def.root_count = options >> 5;
    else if (options & 32)
        def.max_cost = options >> 6;
    fct_result result = fct_tree_build(env, mesh, &def, NULL, &tree);
    fuzz_require(result == (valid ? FCT_OK : FCT_ERROR_DATA), "a valid mesh has a tree, and no other");
    return tree;
}

#endif
