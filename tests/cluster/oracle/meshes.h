/* tests/cluster/oracle/meshes.h: meshes of up to a few hundred faces for brute force, and larger ones of the
 * same kinds. Unless a comment says otherwise, coordinates are irregular, so that all costs differ. */
#ifndef FCT_TESTS_ORACLE_MESHES_H
#define FCT_TESTS_ORACLE_MESHES_H

#include "cluster/shapes.h"

static inline void set_vertex(fct_mesh *mesh, uint32_t v, double x, double y, double z) {
    float *p = mesh->positions + 3 * (size_t)v;
    p[0] = (float)x, p[1] = (float)y, p[2] = (float)z;
}
static inline void set_face(fct_mesh *mesh, uint32_t f, uint32_t a, uint32_t b, uint32_t c) {
    uint32_t *t = mesh->triangles + 3 * (size_t)f;
    t[0] = a, t[1] = b, t[2] = c;
}

static inline fct_mesh make_tetrahedron(const fct_env *env) {
    fct_mesh mesh = shape_of(env, 4, 4);
    set_vertex(&mesh, 0, 0, 0, 0), set_vertex(&mesh, 1, 1.1, 0.2, 0);
    set_vertex(&mesh, 2, 0.1, 0.9, 0.05), set_vertex(&mesh, 3, 0.3, 0.2, 1.3);
    set_face(&mesh, 0, 0, 2, 1), set_face(&mesh, 1, 0, 1, 3);
    set_face(&mesh, 2, 1, 2, 3), set_face(&mesh, 3, 2, 0, 3);
    return mesh;
}

/* A box with two triangles per side. Equal extents give a cube, with many ties. */
static inline fct_mesh make_box(const fct_env *env, double x, double y, double z) {
    static const uint32_t quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                         {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    fct_mesh mesh = shape_of(env, 8, 12);
    for (uint32_t v = 0; v < 8; ++v) set_vertex(&mesh, v, x * (v & 1), y * (v >> 1 & 1), z * (v >> 2));
    for (uint32_t q = 0; q < 6; ++q) {
        set_face(&mesh, 2 * q, quads[q][0], quads[q][1], quads[q][2]);
        set_face(&mesh, 2 * q + 1, quads[q][0], quads[q][2], quads[q][3]);
    }
    return mesh;
}

/* A box with n x n quads per side. Sides share no vertices. */
static inline fct_mesh make_fine_box(const fct_env *env, uint32_t n, double x, double y, double z) {
    fct_mesh grid = make_grid(env, n), mesh = shape_of(env, 6 * grid.vertex_count, 6 * grid.face_count);
    const double extents[3] = {x, y, z};
    for (uint32_t side = 0; side < 6; ++side) {
        uint32_t first = side * grid.vertex_count, k = side / 2, i = (k + 1) % 3, j = (k + 2) % 3;
        for (uint32_t v = 0; v < grid.vertex_count; ++v) {
            double p[3];
            p[k] = side % 2 ? extents[k] : 0;
            p[i] = extents[i] * (double)grid.positions[3 * (size_t)v];
            p[j] = extents[j] * (double)grid.positions[3 * (size_t)v + 1];
            set_vertex(&mesh, first + v, p[0], p[1], p[2]);
        }
        for (uint32_t f = 0; f < grid.face_count; ++f) {
            const uint32_t *t = grid.triangles + 3 * (size_t)f;
            set_face(&mesh, side * grid.face_count + f, first + t[0], first + t[side % 2 ? 1 : 2],
                     first + t[side % 2 ? 2 : 1]);
        }
    }
    fct_mesh_release(env, &grid);
    return mesh;
}

/* An uneven grid of n x n quads over [0,1]^2 with hills and noise up to the height. */
static inline fct_mesh make_terrain(const fct_env *env, uint32_t n, double height, uint32_t seed) {
    fct_mesh mesh = make_grid(env, n);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        float *p = mesh.positions + 3 * (size_t)v;
        double x = (double)p[0] + 0.5 * (shape_random(&seed) - 0.5) / n;
        double y = (double)p[1] + 0.5 * (shape_random(&seed) - 0.5) / n;
        double z = height * (sin(5 * x + 1) * cos(4 * y) + 0.3 * sin(17 * x * y) + 0.3 * shape_random(&seed));
        set_vertex(&mesh, v, x, y, z);
    }
    return mesh;
}

/* A strip of 2n triangles along an opening spiral: every union of neighbours is bent. */
static inline fct_mesh make_bent_strip(const fct_env *env, uint32_t n) {
    fct_mesh mesh = shape_of(env, 2 * n + 2, 2 * n);
    uint32_t state = 11;
    for (uint32_t i = 0; i <= n; ++i) {
        double angle = 0.35 * i, radius = 1 + 0.11 * i, width = 0.8 + 0.3 * shape_random(&state);
        set_vertex(&mesh, 2 * i, radius * cos(angle), radius * sin(angle), 0.05 * i);
        set_vertex(&mesh, 2 * i + 1, radius * cos(angle), radius * sin(angle), 0.05 * i + width);
    }
    for (uint32_t i = 0; i < n; ++i) {
        set_face(&mesh, 2 * i, 2 * i, 2 * i + 2, 2 * i + 1);
        set_face(&mesh, 2 * i + 1, 2 * i + 1, 2 * i + 2, 2 * i + 3);
    }
    return mesh;
}

/* `pages` sheets of n x m quads that share a spine of n edges, so 3 or more faces meet at each of its edges.
 */
static inline fct_mesh make_pages(const fct_env *env, uint32_t pages, uint32_t n, uint32_t m) {
    fct_mesh mesh = shape_of(env, (n + 1) * (1 + pages * m), 2 * pages * n * m);
    uint32_t state = 5, face = 0;
    for (uint32_t i = 0; i <= n; ++i) set_vertex(&mesh, i, 0, 0, (double)i / n);
    for (uint32_t p = 0; p < pages; ++p)
        for (uint32_t j = 1; j <= m; ++j)
            for (uint32_t i = 0; i <= n; ++i) {
                double angle = 2 * pi * p / pages + 0.2 * shape_random(&state),
                       r = 0.5 * j + 0.1 * shape_random(&state);
                set_vertex(&mesh, (n + 1) * (1 + p * m + j - 1) + i, r * cos(angle), r * sin(angle),
                           (i + 0.2 * shape_random(&state)) / n);
            }
    for (uint32_t p = 0; p < pages; ++p)
        for (uint32_t j = 0; j < m; ++j)
            for (uint32_t i = 0; i < n; ++i) {
                uint32_t a = j ? (n + 1) * (1 + p * m + j - 1) + i : i, b = (n + 1) * (1 + p * m + j) + i;
                set_face(&mesh, face++, a, b, b + 1);
                set_face(&mesh, face++, a, b + 1, a + 1);
            }
    return mesh;
}

/* A terrain with degenerate faces: two equal corners, two corners in one place, doubled faces. */
static inline fct_mesh make_degenerate(const fct_env *env, uint32_t n) {
    fct_mesh terrain = make_terrain(env, n, 0.2, 23),
             mesh = shape_of(env, terrain.vertex_count + n, terrain.face_count + 3 * n);
    memcpy(mesh.positions, terrain.positions, 12 * (size_t)terrain.vertex_count);
    memcpy(mesh.triangles, terrain.triangles, 12 * (size_t)terrain.face_count);
    for (uint32_t i = 0; i < n; ++i) {
        uint32_t first = terrain.face_count + 3 * i, v = terrain.vertex_count + i, a = i, b = i + 1;
        memcpy(mesh.positions + 3 * (size_t)v, mesh.positions + 3 * (size_t)a, 12);
        set_face(&mesh, first, a, v, b);
        set_face(&mesh, first + 1, a + n + 1, a + n + 1, b + n + 1);
        memcpy(mesh.triangles + 3 * (size_t)(first + 2), mesh.triangles + 3 * (size_t)(7 * i), 12);
    }
    fct_mesh_release(env, &terrain);
    return mesh;
}

/* Triangles between any of 50 vertices: most edges have several faces, some faces are equal or have no area.
 */
static inline fct_mesh make_tangle(const fct_env *env, uint32_t n) {
    fct_mesh mesh = shape_of(env, 60, n);
    uint32_t state = 9;
    for (uint32_t v = 0; v < 60; ++v)
        set_vertex(&mesh, v, shape_random(&state), shape_random(&state), shape_random(&state));
    for (uint32_t i = 0; i < 3 * n; ++i) mesh.triangles[i] = 5 + (uint32_t)(50 * shape_random(&state));
    return mesh;
}

/* Three faces whose corners are one vertex each: neither area nor perimeter. */
static inline fct_mesh make_points(const fct_env *env) {
    fct_mesh mesh = shape_of(env, 3, 3);
    set_vertex(&mesh, 0, 0, 0, 0), set_vertex(&mesh, 1, 0.3, 0.1, 0), set_vertex(&mesh, 2, 1, 0.8, 0.5);
    for (uint32_t f = 0; f < 3; ++f) set_face(&mesh, f, f, f, f);
    return mesh;
}

/* Copies of a mesh, each moved along x and enlarged. Releases the mesh. */
static inline fct_mesh make_copies(const fct_env *env, fct_mesh one, uint32_t copies) {
    fct_mesh mesh = shape_of(env, copies * one.vertex_count, copies * one.face_count);
    for (uint32_t c = 0; c < copies; ++c) {
        for (uint32_t v = 0; v < one.vertex_count; ++v) {
            const float *p = one.positions + 3 * (size_t)v;
            double s = 1 + 0.3 * c;
            set_vertex(&mesh, c * one.vertex_count + v, s * (double)p[0] + 2.1 * c * c,
                       s * (double)p[1] + 0.2 * c, s * (double)p[2]);
        }
        for (size_t i = 0; i < 3 * (size_t)one.face_count; ++i)
            mesh.triangles[3 * (size_t)(c * one.face_count) + i] = c * one.vertex_count + one.triangles[i];
    }
    fct_mesh_release(env, &one);
    return mesh;
}

/* Rotates a mesh so that no side is parallel to an axis of the world. */
static inline void turn(fct_mesh *mesh) {
    static const double rows[3][3] = {
        {2.0 / 3, -2.0 / 3, 1.0 / 3}, {1.0 / 3, 2.0 / 3, 2.0 / 3}, {-2.0 / 3, -1.0 / 3, 2.0 / 3}};
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) {
        const float *p = mesh->positions + 3 * (size_t)v;
        double q[3];
        for (int i = 0; i < 3; ++i)
            q[i] = rows[i][0] * (double)p[0] + rows[i][1] * (double)p[1] + rows[i][2] * (double)p[2];
        set_vertex(mesh, v, q[0], q[1], q[2]);
    }
}

/* Gives the faces `count` materials in stripes of `width` faces. */
static inline void paint_stripes(const fct_env *env, fct_mesh *mesh, uint32_t count, uint32_t width) {
    mesh->materials = fct_allocate(env, mesh->face_count, sizeof *mesh->materials);
    for (uint32_t f = 0; f < mesh->face_count; ++f) mesh->materials[f] = f / width % count;
    mesh->material_count = count;
}

#endif
