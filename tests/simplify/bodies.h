/* tests/simplify/bodies.h: several boxes in one mesh, and the bodies of a mesh. */
#ifndef FCT_TESTS_SIMPLIFY_BODIES_H
#define FCT_TESTS_SIMPLIFY_BODIES_H

#include "base/union_find.h"
#include "oracle.h"

/* Copies of the unit cube with n x n squares per side, copy i moved by `places` and scaled by `size`. */
static inline fct_mesh make_boxes(const fct_env *env, const v3 *places, uint32_t count, v3 size, uint32_t n,
                                  unsigned arrays) {
    fct_mesh cube = make_cube(env, n), mesh;
    assert_int_equal(fct_mesh_create(env, count * cube.vertex_count, count * cube.face_count, arrays, &mesh),
                     FCT_OK);
    for (uint32_t i = 0; i < count; ++i) {
        for (uint32_t v = 0; v < cube.vertex_count; ++v) {
            v3 p = vertex(&cube, v);
            v3_store(mesh.positions + 3 * ((size_t)i * cube.vertex_count + v),
                     v3_add(places[i], (v3){size.x * p.x, size.y * p.y, size.z * p.z}));
        }
        for (size_t c = 0; c < 3 * (size_t)cube.face_count; ++c)
            mesh.triangles[3 * (size_t)i * cube.face_count + c] = cube.triangles[c] + i * cube.vertex_count;
    }
    fct_mesh_release(env, &cube);
    return mesh;
}

/* A row of boxes of n x n squares per side with `gap` between them, along x. */
static inline fct_mesh make_row(const fct_env *env, uint32_t count, double gap, uint32_t n, unsigned arrays) {
    v3 places[64];
    for (uint32_t i = 0; i < count; ++i) places[i] = (v3){(1 + gap) * i, 0, 0};
    return make_boxes(env, places, count, (v3){1, 1, 1}, n, arrays);
}

/* Sets of vertices that faces join, compared by places. */
static inline uint32_t count_bodies(const fct_mesh *mesh) {
    uint32_t *parents = malloc(((size_t)mesh->vertex_count + 1) * sizeof *parents), count = 0;
    fct_sets_create(parents, mesh->vertex_count);
    for (uint32_t v = 0; v < mesh->vertex_count; ++v)
        for (uint32_t w = 0; w < v; ++w)
            if (same_place(mesh, v, w)) fct_sets_join(parents, v, w);
    for (size_t c = 0; c < 3 * (size_t)mesh->face_count; c += 3) {
        fct_sets_join(parents, mesh->triangles[c], mesh->triangles[c + 1]);
        fct_sets_join(parents, mesh->triangles[c], mesh->triangles[c + 2]);
    }
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) count += fct_sets_find(parents, v) == v;
    free(parents);
    return count;
}

#endif
