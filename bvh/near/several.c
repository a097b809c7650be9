/* bvh/near/several.c: the k nearest faces. A kernel file.
 *
 * The search is that of nearest.c, but each triangle whose lower bound is within reach is measured in double
 * at once. The best k faces are a heap in the caller's array, the farthest on top, and its distance bounds
 * the search when the heap is full. While the search runs, an item holds its squared distance as a double in
 * the memory of `point`, the reference of its leaf as `place`, and its number in the leaf as `u`. At the end
 * the heap is sorted, and the k faces are measured again to fill the items in.
 */
#include "bvh/near/several.h"

#include <string.h>

#include "base/math/simd.h"
#include "base/sift.h"
#include "bvh/near/descend.h"
#include "bvh/near/triangle.h"

typedef struct several {
    const fct_bvh *bvh;
    v3 point; /* scaled */
    fct_at at;
    uint32_t k, count;
    fct_closest *heap;
    double bound2; /* squared distance of the farthest face of a full heap, or of the maximum distance */
    float reach2, limit2;
    fct_visits visits;
} several;

static double load_distance2(const fct_closest *item) {
    double d2;
    memcpy(&d2, item->point, sizeof d2);
    return d2;
}

static fct_closest make_item(double d2, uint32_t face, uint32_t leaf_ref, uint32_t number) {
    fct_closest item = {.face = face, .place = leaf_ref, .u = (float)number};
    memcpy(item.point, &d2, sizeof d2);
    return item;
}

static bool is_nearer(const void *items, size_t i, size_t j) {
    const fct_closest *item = items;
    double a = load_distance2(&item[i]), b = load_distance2(&item[j]);
    return a < b || (a == b && item[i].face < item[j].face);
}

static void swap_items(void *items, size_t i, size_t j) {
    fct_closest *item = items, kept = item[i];
    item[i] = item[j];
    item[j] = kept;
}

static void set_reach(several *s, double bound2) {
    double bound = sqrt(bound2);
    s->bound2 = bound2;
    s->limit2 = fct_box_limit2(&s->at, bound);
    s->reach2 = fct_triangle_limit2(&s->at, bound);
}

static double measure_face(const several *s, const fct_leaf *leaf, uint32_t number, v3 *nearest, double *u,
                           double *v) {
    v3 p[3];
    fct_leaf_triangle(leaf, number, p);
    *nearest = fct_triangle_closest(s->point, p[0], p[1], p[2], u, v);
    return v3_norm2(v3_sub(*nearest, s->point));
}

static void offer_face(several *s, const fct_leaf *leaf, uint32_t leaf_ref, uint32_t number) {
    v3 nearest;
    double u, v, d2 = measure_face(s, leaf, number, &nearest, &u, &v);
    uint32_t face = s->bvh->view.face_ids[fct_leaf_place(s->bvh, leaf, number)];
    ++s->visits.triangles;
    if (!(d2 <= s->bound2)) return;
    if (s->count < s->k) {
        s->heap[s->count] = make_item(d2, face, leaf_ref, number);
        fct_sift_up(s->heap, s->count++, is_nearer, swap_items);
    } else {
        if (d2 == s->bound2 && face > s->heap[0].face) return;
        s->heap[0] = make_item(d2, face, leaf_ref, number);
        fct_sift_down(s->heap, 0, s->count, is_nearer, swap_items);
    }
    if (s->count == s->k) set_reach(s, load_distance2(&s->heap[0]));
}

static void search_leaf(void *user, uint32_t ref) {
    several *s = user;
    const fct_leaf *leaf = fct_bvh_leaf(s->bvh, ref);
    fct_near_vertices vertices;
    fct_near_vertices_load(leaf, &s->at, &vertices);
    if (!fct_leaf_within(&vertices, leaf->vertex_octets, s->reach2)) return;
    const uint8_t *corners = fct_leaf_corners(leaf);
    for (uint32_t first = 0; first < leaf->count; first += 8, corners += 24) {
        fct_eight_near near = fct_measure_triangles(&vertices, leaf->vertex_octets, corners);
        uint32_t left = leaf->count - first, lanes = left < 8 ? (1u << left) - 1 : 0xffu;
        for (lanes &= fct_triangles_within(&near, s->reach2); lanes; lanes &= lanes - 1)
            offer_face(s, leaf, ref, first + (uint32_t)__builtin_ctz(lanes));
    }
}

/* Turns an item of the heap into an answer, as fct_bvh_closest_point gives it. */
static void fill_item(const several *s, fct_closest *item) {
    const fct_leaf *leaf = fct_bvh_leaf(s->bvh, item->place);
    uint32_t number = (uint32_t)item->u;
    v3 p[3], nearest;
    double u, v, scale = s->bvh->scale, d2 = measure_face(s, leaf, number, &nearest, &u, &v);
    fct_leaf_triangle(leaf, number, p);
    v3 scaled = v3_add(v3_scale(p[0], 1 - u - v), v3_add(v3_scale(p[1], u), v3_scale(p[2], v)));
    v3_store(item->point, fct_bvh_from_scaled(s->bvh, scaled));
    item->distance = (float)sqrt(d2 / scale / scale);
    item->u = (float)u, item->v = (float)v;
    item->place = fct_leaf_place(s->bvh, leaf, number);
}

uint32_t fct_several_search(const fct_bvh *bvh, v3 point, uint32_t k, double max_distance, fct_closest *out,
                            fct_visits *visits) {
    several s = {.bvh = bvh, .point = fct_bvh_to_scaled(bvh, point), .k = k, .heap = out};
    s.at = fct_at_make(bvh, s.point);
    double reach = max_distance * bvh->scale;
    set_reach(&s, reach * reach);
    fct_descend(bvh, fct_measure_children, &s.at, &s.limit2, search_leaf, &s, &s.visits);
    fct_sift_sort(out, s.count, is_nearer, swap_items);
    for (uint32_t i = 0; i < s.count; ++i) fill_item(&s, &out[i]);
    fct_visits_add(visits, &s.visits);
    return s.count;
}
