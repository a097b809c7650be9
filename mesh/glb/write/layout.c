/* mesh/glb/layout.c: see layout.h. */
#include "mesh/glb/write/layout.h"

#include <string.h>

#include "base/env.h"

enum { LONGEST_CHAIN = 64 };

/* Returns the copy of `vertex` that has these texture coordinates, or appends one. The search stops after
 * LONGEST_CHAIN copies, so that it takes constant time; it may then append a copy that already exists. */
static uint32_t place_corner(const float *uv, uint32_t vertex, fct_glb_layout *l, uint32_t *next,
                             unsigned char *used) {
    uint32_t at = vertex;
    if (!used[vertex]) {
        used[vertex] = 1;
        memcpy(l->texcoords + 2 * (size_t)vertex, uv, 2 * sizeof(float));
        return vertex;
    }
    for (int steps = 0; at != FCT_NONE && steps < LONGEST_CHAIN; ++steps, at = next[at])
        if (!memcmp(l->texcoords + 2 * (size_t)at, uv, 2 * sizeof(float))) return at;
    uint32_t added = l->vertex_count++;
    memcpy(l->texcoords + 2 * (size_t)added, uv, 2 * sizeof(float));
    l->origins[added] = vertex;
    next[added] = next[vertex];
    next[vertex] = added;
    return added;
}

static fct_result split_vertices(const fct_sink *sink, fct_glb_layout *l) {
    const fct_env *env = sink->env;
    const fct_mesh *m = sink->mesh;
    size_t most = (size_t)m->vertex_count + 3 * (size_t)m->face_count;
    if (most >= FCT_NONE) return fct_fail(env, FCT_ERROR_DATA, "%s: too many vertices for GLB", sink->name);
    l->vertex_count = m->vertex_count;
    uint32_t *next;
    unsigned char *used;
    const fct_array arrays[] = {FCT_ARRAY(l->origins, most), FCT_ARRAY_ZERO(l->texcoords, 2 * most),
                                FCT_ARRAY(l->corners, 3 * (size_t)m->face_count), FCT_ARRAY(next, most),
                                FCT_ARRAY_ZERO(used, m->vertex_count)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "texture coordinates");
    if (result == FCT_OK) {
        for (uint32_t v = 0; v < m->vertex_count; ++v) l->origins[v] = v, next[v] = FCT_NONE;
        for (size_t i = 0; i < 3 * (size_t)m->face_count; ++i)
            l->corners[i] = place_corner(m->texcoords + 2 * i, m->triangles[i], l, next, used);
    }
    fct_release(env, next);
    fct_release(env, used);
    return result;
}

/* Counting sort of the faces by material. */
static fct_result order_faces(const fct_sink *sink, fct_glb_layout *l) {
    const fct_mesh *m = sink->mesh;
    const fct_array arrays[] = {FCT_ARRAY(l->order, m->face_count),
                                FCT_ARRAY_ZERO(l->firsts, (size_t)m->material_count + 2)};
    fct_result result = fct_allocate_all(sink->env, arrays, FCT_LENGTH(arrays), "materials");
    if (result != FCT_OK) return result;
    /* While faces are placed, firsts[i + 1] is the next place of material i. It ends as the first of i + 1.
     */
    for (uint32_t f = 0; f < m->face_count; ++f) ++l->firsts[m->materials[f] + 2];
    for (uint32_t i = 2; i <= m->material_count; ++i) l->firsts[i] += l->firsts[i - 1];
    for (uint32_t f = 0; f < m->face_count; ++f) l->order[l->firsts[m->materials[f] + 1]++] = f;
    return FCT_OK;
}

fct_result fct_glb_layout_build(const fct_sink *sink, fct_glb_layout *out) {
    const fct_mesh *m = sink->mesh;
    *out = (fct_glb_layout){.vertex_count = m->vertex_count};
    fct_result result = m->texcoords ? split_vertices(sink, out) : FCT_OK;
    if (result == FCT_OK && m->materials && m->material_count) result = order_faces(sink, out);
    if (result != FCT_OK) fct_glb_layout_release(sink->env, out);
    return result;
}

void fct_glb_layout_release(const fct_env *env, fct_glb_layout *l) {
    fct_release(env, l->origins);
    fct_release(env, l->texcoords);
    fct_release(env, l->corners);
    fct_release(env, l->order);
    fct_release(env, l->firsts);
    *l = (fct_glb_layout){0};
}
