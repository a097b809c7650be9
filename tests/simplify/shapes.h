/* tests/simplify/shapes.h: meshes and measures for the tests of the simplifier. */
#ifndef FCT_TESTS_SIMPLIFY_SHAPES_H
#define FCT_TESTS_SIMPLIFY_SHAPES_H

#include "base/math/vec.h"
#include "facetree/simplify.h"
#include "support.h"

/* Simplifies, and checks properties that every result has. */
static inline fct_mesh simplified(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def,
                                  fct_simplify_stats *stats) {
    fct_mesh out;
    fct_simplify_stats own;
    if (!stats) stats = &own;
    assert_int_equal(fct_simplify(env, mesh, def, &out, stats), FCT_OK);
    assert_int_equal(fct_mesh_validate(env, &out), FCT_OK);
    assert_int_equal(stats->faces_before, mesh->face_count);
    assert_int_equal(stats->faces_after, out.face_count);
    assert_true(!out.colors == !mesh->colors && !out.normals == !mesh->normals);
    assert_true(!out.texcoords == !mesh->texcoords && !out.face_colors == !mesh->face_colors);
    assert_true(!out.materials == !mesh->materials);
    bool *used = calloc(out.vertex_count + 1, 1);
    for (size_t c = 0; c < 3 * (size_t)out.face_count; ++c) used[out.triangles[c]] = true;
    for (uint32_t v = 0; v < out.vertex_count; ++v) assert_true(used[v]);
    free(used);
    return out;
}

static inline v3 vertex(const fct_mesh *mesh, uint32_t v) {
    return v3_load(mesh->positions + 3 * (size_t)v);
}

static inline v3 face_cross(const fct_mesh *mesh, uint32_t f) {
    const uint32_t *t = mesh->triangles + 3 * (size_t)f;
    v3 a = vertex(mesh, t[0]);
    return v3_cross(v3_sub(vertex(mesh, t[1]), a), v3_sub(vertex(mesh, t[2]), a));
}

static inline double mesh_area(const fct_mesh *mesh) {
    double area = 0;
    for (uint32_t f = 0; f < mesh->face_count; ++f) area += .5 * v3_norm(face_cross(mesh, f));
    return area;
}

static inline double mesh_volume(const fct_mesh *mesh) {
    double volume = 0;
    for (uint32_t f = 0; f < mesh->face_count; ++f)
        volume += v3_dot(vertex(mesh, mesh->triangles[3 * (size_t)f]), face_cross(mesh, f)) / 6;
    return volume;
}

static inline bool same_place(const fct_mesh *mesh, uint32_t a, uint32_t b) {
    return !memcmp(mesh->positions + 3 * (size_t)a, mesh->positions + 3 * (size_t)b, 3 * sizeof(float));
}

/* The number of sides that no other face has, compared by places. Quadratic. */
static inline uint32_t open_sides(const fct_mesh *mesh, bool (*counts)(v3 a, v3 b)) {
    uint32_t open = 0, corners = 3 * mesh->face_count;
    for (uint32_t c = 0; c < corners; ++c) {
        uint32_t a = mesh->triangles[c], b = mesh->triangles[c % 3 == 2 ? c - 2 : c + 1];
        bool met = false;
        for (uint32_t d = 0; d < corners && !met; ++d) {
            uint32_t x = mesh->triangles[d], y = mesh->triangles[d % 3 == 2 ? d - 2 : d + 1];
            if (d / 3 == c / 3) continue;
            met = (same_place(mesh, a, x) && same_place(mesh, b, y)) ||
                  (same_place(mesh, a, y) && same_place(mesh, b, x));
        }
        open += !met && (!counts || counts(vertex(mesh, a), vertex(mesh, b)));
    }
    return open;
}

/* The unit cube, each side n x n squares, vertices shared on the edges of the cube. */
static inline fct_mesh make_cube(const fct_env *env, uint32_t n) {
    fct_mesh mesh;
    uint32_t m = n + 1, count = 0;
    uint32_t *ids = malloc((size_t)m * m * m * sizeof *ids);
    for (uint32_t i = 0; i < m * m * m; ++i) {
        uint32_t x = i % m, y = i / m % m, z = i / m / m;
        bool outside = x == 0 || x == n || y == 0 || y == n || z == 0 || z == n;
        ids[i] = outside ? count++ : FCT_NONE;
    }
    assert_int_equal(fct_mesh_create(env, count, 12 * n * n, 0, &mesh), FCT_OK);
    for (uint32_t i = 0; i < m * m * m; ++i) {
        if (ids[i] == FCT_NONE) continue;
        float *p = mesh.positions + 3 * (size_t)ids[i];
        p[0] = (float)(i % m) / (float)n, p[1] = (float)(i / m % m) / (float)n;
        p[2] = (float)(i / m / m) / (float)n;
    }
    uint32_t step[3] = {1, m, m * m}, *t = mesh.triangles;
    for (uint32_t axis = 0; axis < 3; ++axis)
        for (uint32_t side = 0; side < 2; ++side)
            for (uint32_t j = 0; j < n; ++j)
                for (uint32_t i = 0; i < n; ++i, t += 6) {
                    uint32_t u = step[(axis + 1) % 3], v = step[(axis + 2) % 3];
                    uint32_t corner = side * n * step[axis] + i * u + j * v;
                    uint32_t a = ids[corner], b = ids[corner + (side ? u : v)];
                    uint32_t c = ids[corner + u + v], d = ids[corner + (side ? v : u)];
                    uint32_t two[6] = {a, b, c, a, c, d};
                    memcpy(t, two, sizeof two);
                }
    free(ids);
    return mesh;
}

/* Moves a mesh to one with the given optional arrays, which are zero. */
static inline fct_mesh with_arrays(const fct_env *env, fct_mesh *mesh, unsigned arrays) {
    fct_mesh out;
    assert_int_equal(fct_mesh_create(env, mesh->vertex_count, mesh->face_count, arrays, &out), FCT_OK);
    memcpy(out.positions, mesh->positions, (size_t)mesh->vertex_count * 12);
    memcpy(out.triangles, mesh->triangles, (size_t)mesh->face_count * 12);
    if (out.colors) memset(out.colors, 0, (size_t)mesh->vertex_count * 12);
    if (out.normals) memset(out.normals, 0, (size_t)mesh->vertex_count * 12);
    if (out.texcoords) memset(out.texcoords, 0, (size_t)mesh->face_count * 24);
    if (out.face_colors) memset(out.face_colors, 0, (size_t)mesh->face_count * 12);
    if (out.materials) memset(out.materials, 0, (size_t)mesh->face_count * 4);
    fct_mesh_release(env, mesh);
    return out;
}

#endif
