/* radiosity/surface/refine.c: see refine.h.
 *
 * An edge on a crease exists once per side, with its own vertices at the same positions. A mark on one side
 * also splits the other, so that no T-junction opens along the crease.
 */
#include "radiosity/surface/refine.h"

#include "base/env.h"
#include "radiosity/surface/split.h"

#include <string.h>

/* The edges to split, by the lowest vertices at their ends. */
typedef struct cut_list {
    const fct_mesh *mesh;
    uint32_t *first;      /* per vertex: the lowest one at its position */
    fct_edge_table edges; /* -> place in `shares` */
    float *shares;        /* of the way from the lower to the higher end */
} cut_list;

static uint32_t next_corner(const uint32_t *t, size_t c) {
    return t[c % 3 == 2 ? c - 2 : c + 1];
}

/* The share of the way from vertex a to b at which their edge is split. */
static double find_share(const cut_list *c, uint32_t a, uint32_t b) {
    const uint32_t *place = fct_edge_table_find(&c->edges, c->first[a], c->first[b]);
    double share = c->shares[*place];
    return c->first[a] < c->first[b] ? share : 1 - share;
}

/* Collects the edges to split, and marks them: bit k of a face is the edge from corner k to corner k + 1. */
static fct_result collect_cuts(const fct_env *env, fct_edge_cut *cut, void *user, uint8_t *marks,
                               cut_list *out) {
    const uint32_t *t = out->mesh->triangles, *first = out->first;
    const size_t corners = 3 * (size_t)out->mesh->face_count;
    float *shares = fct_allocate(env, corners, sizeof *shares);
    size_t wanted = 0;
    if (!shares) return fct_fail_memory(env, "a refined surface");
    memset(marks, 0, out->mesh->face_count);
    for (size_t c = 0; c < corners; ++c) {
        uint32_t a = t[c], b = next_corner(t, c);
        if (first[a] == first[b]) continue;
        double share = a < b ? cut(user, a, b) : cut(user, b, a);
        if (share <= 0) continue;
        shares[c] = (float)((a < b) == (first[a] < first[b]) ? share : 1 - share);
        marks[c / 3] |= (uint8_t)(1 << c % 3);
        ++wanted;
    }
    fct_result result = fct_edge_table_init(env, wanted, &out->edges);
    if (result == FCT_OK && !(out->shares = fct_allocate(env, wanted, sizeof *out->shares)))
        result = fct_fail_memory(env, "a refined surface");
    uint32_t count = 0;
    for (size_t c = 0; result == FCT_OK && c < corners; ++c) {
        if (!(marks[c / 3] >> c % 3 & 1)) continue;
        bool fresh;
        uint32_t *place = fct_edge_table_insert(&out->edges, first[t[c]], first[next_corner(t, c)], &fresh);
        if (!fresh) continue;
        *place = count;
        out->shares[count++] = shares[c];
    }
    for (size_t c = 0; result == FCT_OK && wanted && c < corners; ++c)
        if (fct_edge_table_find(&out->edges, first[t[c]], first[next_corner(t, c)]))
            marks[c / 3] |= (uint8_t)(1 << c % 3);
    fct_release(env, shares);
    return result;
}

/* The point at a share of the way from a to b; the same from both sides where the share is 1/2. */
static v3 mix(v3 a, v3 b, double share) {
    return v3_add(v3_scale(a, 1 - share), v3_scale(b, share));
}

/* Sets the barycentrics of the parts' corners in their source faces. */
static void copy_uv(const fct_surface *old, const fct_split *split, const cut_list *cuts, fct_surface *out) {
    for (size_t f = 0; f < split->face_count; ++f) {
        const size_t parent = split->parents[f];
        const uint32_t *t = old->mesh.triangles + 3 * parent;
        double shares[3] = {0, 0, 0};
        for (size_t c = 0; c < 3; ++c) {
            const size_t place = split->places[3 * f + c];
            if (place >= 3) shares[place - 3] = find_share(cuts, t[place - 3], t[(place - 2) % 3]);
        }
        fct_split_uv(split, f, old->mesh.source_uv + 6 * parent, shares, out->mesh.source_uv + 6 * f);
    }
}

/* Copies the old vertices and the faces of the split, and appends the new vertices. */
static void copy_surface(const fct_surface *old, const fct_split *split, const cut_list *cuts,
                         fct_surface *out) {
    size_t count = old->mesh.vertex_count;
    out->shading = old->shading;
    memcpy(out->mesh.positions, old->mesh.positions, 3 * count * sizeof(float));
    memcpy(out->mesh.colors, old->mesh.colors, 3 * count * sizeof(float));
    memcpy(out->normals, old->normals, 3 * count * sizeof(float));
    memcpy(out->sample_points, old->sample_points, 3 * count * sizeof(float));
    memcpy(out->offsets, old->offsets, count * sizeof(float));
    memcpy(out->places, old->places, count * sizeof *out->places);
    memcpy(out->flat, old->flat, count);
    for (size_t i = 0; i < split->vertex_count; ++i) {
        const uint32_t *ends = split->ends + 2 * i;
        const size_t a = 3 * (size_t)ends[0], b = 3 * (size_t)ends[1], to = 3 * (count + i);
        const double share = find_share(cuts, ends[0], ends[1]);
        v3_store(out->mesh.colors + to,
                 mix(v3_load(old->mesh.colors + a), v3_load(old->mesh.colors + b), share));
        v3_store(out->mesh.positions + to,
                 mix(v3_load(old->mesh.positions + a), v3_load(old->mesh.positions + b), share));
    }
    memcpy(out->mesh.triangles, split->triangles, split->face_count * 3 * sizeof *split->triangles);
    for (size_t f = 0; f < split->face_count; ++f) {
        out->mesh.source_faces[f] = old->mesh.source_faces[split->parents[f]];
        out->face_places[f] = old->face_places[split->parents[f]];
    }
    copy_uv(old, split, cuts, out);
}

/* Adds a third of each face's area to its vertices. */
static void add_areas(fct_surface *s) {
    for (size_t f = 0; f < s->mesh.face_count; ++f) {
        const uint32_t *t = s->mesh.triangles + 3 * f;
        v3 a = v3_load(s->mesh.positions + 3 * (size_t)t[0]);
        v3 e1 = v3_sub(v3_load(s->mesh.positions + 3 * (size_t)t[1]), a);
        v3 e2 = v3_sub(v3_load(s->mesh.positions + 3 * (size_t)t[2]), a);
        double third = v3_norm(v3_cross(e1, e2)) / 6;
        for (int k = 0; k < 3; ++k) s->areas[t[k]] += (float)third;
    }
}

/* The foothold of a new vertex from the corners around it: with the interpolated normal of the file where it
 * has one, else with that of the faces. */
static fct_foothold find_foothold(const fct_corners *mesh, const uint32_t *corners, size_t count, bool rim,
                                  const fct_surface *s) {
    v3 normal = fct_shading_mean(&s->shading, corners, count, s->face_places, s->mesh.source_uv);
    if (!fct_corner_front(mesh, corners, count, normal)) fct_corner_normal(mesh, corners, count, &normal);
    fct_foothold at = fct_corner_foothold(mesh, corners, count, normal, rim);
    at.sample = fct_shading_lift(&s->shading, s->face_places[at.face], at.sample);
    return at;
}

/* Sets the footholds of the new vertices from the corners around them. A new vertex is on the rim if only one
 * face of the old surface has its edge. */
static fct_result place_cuts(const fct_env *env, const fct_split *split, uint32_t old_count, fct_surface *s) {
    size_t corners = 3 * (size_t)s->mesh.face_count;
    fct_corners mesh = {s->mesh.vertex_count, s->mesh.face_count, s->mesh.positions, s->mesh.triangles};
    size_t *begin = fct_allocate_zero(env, (size_t)split->vertex_count + 2, sizeof *begin);
    uint32_t *list = NULL;
    fct_result result = begin ? FCT_OK : fct_fail_memory(env, "a refined surface");
    if (result != FCT_OK) goto done;
    for (size_t c = 0; c < corners; ++c)
        if (mesh.triangles[c] >= old_count) ++begin[mesh.triangles[c] - old_count + 2];
    for (size_t i = 0; i < split->vertex_count; ++i) begin[i + 2] += begin[i + 1];
    list = fct_allocate(env, begin[split->vertex_count + 1], sizeof *list);
    if (!list) {
        result = fct_fail_memory(env, "a refined surface");
        goto done;
    }
    for (size_t c = 0; c < corners; ++c)
        if (mesh.triangles[c] >= old_count) list[begin[mesh.triangles[c] - old_count + 1]++] = (uint32_t)c;
    for (uint32_t i = 0; i < split->vertex_count; ++i) {
        const uint32_t *around = list + begin[i];
        size_t count = begin[i + 1] - begin[i];
        uint32_t parent = split->parents[around[0] / 3];
        bool rim = true;
        for (size_t k = 1; k < count && rim; ++k) rim = split->parents[around[k] / 3] == parent;
        const fct_foothold at = find_foothold(&mesh, around, count, rim, s);
        fct_surface_place(s, old_count + i, &at);
    }
done:
    fct_release(env, begin);
    fct_release(env, list);
    return result;
}

static fct_result refine_surface(const fct_env *env, fct_surface *surface, const cut_list *cuts,
                                 const uint8_t *marks, uint32_t *added) {
    const fct_mesh *mesh = &surface->mesh;
    const uint32_t old_count = mesh->vertex_count;
    fct_split split = {0};
    fct_surface finer = {0};
    fct_result result =
        fct_split_edges(env, old_count, mesh->positions, mesh->face_count, mesh->triangles, marks, &split);
    if (result != FCT_OK || split.vertex_count == 0) goto done;
    if (split.face_count > UINT32_MAX / 3) {
        result = fct_fail(env, FCT_ERROR_MEMORY, "a surface of %u triangles has too many corners",
                          split.face_count);
        goto done;
    }
    result = fct_surface_allocate(env, old_count + split.vertex_count, split.face_count, &finer);
    if (result != FCT_OK) goto done;
    copy_surface(surface, &split, cuts, &finer);
    add_areas(&finer);
    result = place_cuts(env, &split, old_count, &finer);
    if (result != FCT_OK) goto done;
    fct_surface swap = *surface;
    *surface = finer, finer = swap;
    *added = split.vertex_count;
done:
    fct_split_release(env, &split);
    fct_surface_release(env, &finer);
    return result;
}

fct_result fct_surface_refine(const fct_env *env, fct_surface *surface, fct_edge_cut *cut, void *user,
                              uint32_t *added) {
    const fct_mesh *mesh = &surface->mesh;
    cut_list cuts = {.mesh = mesh};
    uint32_t count = 0;
    uint8_t *marks;
    const fct_array arrays[] = {FCT_ARRAY(marks, mesh->face_count),
                                FCT_ARRAY(cuts.first, mesh->vertex_count)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "a refined surface");
    if (result == FCT_OK) {
        result = fct_weld(env, mesh->vertex_count, mesh->positions, cuts.first);
        if (result == FCT_OK) result = collect_cuts(env, cut, user, marks, &cuts);
        if (result == FCT_OK) result = refine_surface(env, surface, &cuts, marks, &count);
        fct_edge_table_release(env, &cuts.edges);
        fct_release(env, cuts.shares);
        fct_release_all(env, arrays, FCT_LENGTH(arrays));
    }
    if (added) *added = count;
    return result;
}
