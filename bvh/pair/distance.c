/* bvh/pair/distance.c: the nearest faces of two models. A kernel file.
 *
 * The search goes down both trees depth first, pairs of near boxes first, and leaves out pairs whose lower
 * bound exceeds the best distance so far. Bounds are squared, in the scaled unit of a. A pair of leaves
 * compares the boxes of single triangles in the coordinates of one leaf, then measures each pair that is left
 * in double.
 *
 * Models that are far apart beside their size need more digits than a float has. There, the bound is the
 * separation along the line between the centres, in double.
 */
#include "bvh/pair/search.h"

#include <float.h>

#include "base/math/simd.h"
#include "bvh/pair/apart.h"
#include "bvh/pair/boxes.h"
#include "bvh/pair/far.h"
#include "bvh/pair/leaves.h"
#include "bvh/pair/triangles.h"

/* Beyond this distance of the centres (sum of coordinates, scaled), double arithmetic bounds the distance. */
#define FAR_CENTER 16.0

/* A pair of faces that is at least `distance` apart, scaled. */
typedef struct candidate {
    float distance;
    uint32_t place_a, place_b;
} candidate;

enum { CANDIDATES = 64 };

typedef struct distance_search {
    const fct_pair_map *map;
    double relative, absolute, enough;
    fct_near_pair best;
    double maximum;    /* farther pairs do not count, scaled */
    double upper;      /* the least distance is not more, scaled; infinity until a pair is known */
    double reach;      /* a pair must have a lower bound of at most this, scaled */
    float limit2;      /* its square, rounded up */
    bool done;         /* the rest cannot matter */
    double to_limit_b; /* squared distances in b's unit, times this, are lower bounds in a's unit */
    fct_placed_box placed_a, placed_b; /* a box of b in a, and of a in b: the last ones used */
    uint32_t waiting;
    candidate candidates[CANDIDATES];
    fct_visits visits;
} distance_search;

static bool is_enough(const distance_search *s) {
    return s->best.place_a != FCT_NONE && sqrt(s->best.distance2) <= s->enough;
}

/* The tolerances count once a pair is known that is near enough. */
static void set_limit(distance_search *s) {
    double scale = s->map->a->scale, reach = s->maximum;
    bool known = s->upper <= s->maximum;
    if (known) reach = fct_max((s->upper - s->absolute * scale) / (1 + s->relative), 0);
    s->done = is_enough(s) || (known && reach == 0);
    s->reach = reach * (1 + 0x1p-40) + 1e-18;
    double limit2 = s->reach * s->reach * (1 + 0x1p-20);
    s->limit2 = limit2 < 1e36 ? (float)limit2 : 1e36f;
}

static void measure_pair(distance_search *s, uint32_t place_a, uint32_t place_b) {
    v3 p[3], q[3], at_a, at_b;
    fct_pair_triangle_a(s->map, place_a, p);
    fct_pair_triangle_b(s->map, place_b, q);
    ++s->visits.triangles;
    double d2 = fct_triangles_distance(p, q, &at_a, &at_b);
    if (!(d2 < s->best.distance2 || (d2 == s->best.distance2 && s->best.place_a == FCT_NONE))) return;
    s->best = (fct_near_pair){d2, at_a, at_b, place_a, place_b};
    s->upper = fct_min(s->upper, sqrt(d2) * s->map->a->scale);
    set_limit(s);
}

/* Measures the candidates that may be the nearest pair. */
static void settle_candidates(distance_search *s) {
    for (uint32_t i = 0; i < s->waiting && !is_enough(s); ++i) {
        uint32_t nearest = i;
        for (uint32_t j = i + 1; j < s->waiting; ++j)
            if (s->candidates[j].distance < s->candidates[nearest].distance) nearest = j;
        candidate c = s->candidates[nearest];
        s->candidates[nearest] = s->candidates[i];
        if ((double)c.distance > fct_min(s->upper, s->maximum)) break;
        measure_pair(s, c.place_a, c.place_b);
    }
    s->waiting = 0;
}

/* A pair at `distance`, which may err by `error`. */
static void add_candidate(distance_search *s, float distance, float error, uint32_t place_a,
                          uint32_t place_b) {
    if ((double)distance - (double)error > s->reach) return;
    s->candidates[s->waiting++] = (candidate){distance - error, place_a, place_b};
    double upper = (double)distance + (double)error;
    s->upper = fct_min(upper, s->upper);
    set_limit(s);
    if (s->waiting == CANDIDATES || (double)(distance - error) <= s->enough * s->map->a->scale)
        settle_candidates(s);
}

/* A leaf of a in the coordinates of its box. */
typedef struct measured_leaf {
    const fct_leaf *leaf;
    placed_leaf placed;
    triangle_boxes boxes;
} measured_leaf;

/* A face of b there. */
typedef struct measured_face {
    lane_triangles lanes;
    float low[3], high[3]; /* its box */
    uint32_t place;
} measured_face;

/* The pairs of a face of b and triangles [first, first + 8) of a that may be near enough. */
static void measure_octet(distance_search *s, const measured_leaf *a, uint32_t first, const measured_face *b,
                          const fct_leaf_maps *maps) {
    uint32_t left = a->leaf->count - first, used = left < 8 ? (1u << left) - 1 : 0xffu;
    f8 bound = bound_triangles(&a->boxes, first, b->low, b->high, maps->slack);
    uint32_t open = f8_le(bound, f8_set(s->limit2)) & used;
    if (!open) return;
    eight_triangles eight = pick_triangles(a->leaf, &a->placed, first / 8);
    float distance[8];
    f8_store(distance, f8_sqrt(f8_max(find_distances2(&eight, &b->lanes), bound)));
    /* Triangles that meet may be far apart along their edges, but their boxes meet too. */
    uint32_t touching = f8_le(bound, f8_set(0));
    for (; open && !s->done; open &= open - 1) {
        uint32_t i = (uint32_t)__builtin_ctz(open), place_a = a->leaf->first + first + i;
        if (touching >> i & 1)
            measure_pair(s, place_a, b->place);
        else
            add_candidate(s, distance[i], DISTANCE_ERROR * maps->size + maps->slack, place_a, b->place);
    }
}

/* Leaves that are far apart. The pair with the least bound comes first. */
static void search_far_leaves(distance_search *s, const fct_leaf *a, const fct_leaf *b) {
    fct_far_leaves far;
    uint32_t top = 0, bottom = 0;
    fct_bound_far_leaves(s->map, a, b, &far);
    for (uint32_t i = 1; i < a->count; ++i)
        if (far.top_a[i] > far.top_a[top]) top = i;
    for (uint32_t i = 1; i < b->count; ++i)
        if (far.bottom_b[i] < far.bottom_b[bottom]) bottom = i;
    double reach = s->reach / s->map->a->scale;
    if (far.bottom_b[bottom] - far.top_a[top] > reach) return;
    measure_pair(s, a->first + top, b->first + bottom);
    for (uint32_t i = 0; i < a->count; ++i)
        for (uint32_t j = 0; j < b->count && !s->done; ++j)
            if ((i != top || j != bottom) && far.bottom_b[j] - far.top_a[i] <= s->reach / s->map->a->scale)
                measure_pair(s, a->first + i, b->first + j);
}

/* Faces of leaf b whose boxes are near enough to the box of leaf a. */
static uint32_t find_near_faces(const distance_search *s, const fct_leaf *b, const triangle_boxes *boxes,
                                const fct_leaf_maps *maps) {
    uint32_t open = 0;
    float low[3];
    for (int k = 0; k < 3; ++k) low[k] = -maps->half_a[k];
    for (uint32_t first = 0; first < b->count; first += 8)
        open |= f8_le(bound_triangles(boxes, first, low, maps->half_a, maps->slack), f8_set(s->limit2))
                << first;
    return open & ((1u << b->count) - 1);
}

static void search_leaves(distance_search *s, uint32_t box_a, uint32_t box_b) {
    const fct_pair_map *map = s->map;
    const fct_leaf *b = fct_bvh_leaf(map->b, fct_box_child(map->b, box_b));
    measured_leaf a;
    fct_leaf_maps maps;
    triangle_boxes boxes_b;
    float corners[3][3][16];
    a.leaf = fct_bvh_leaf(map->a, fct_box_child(map->a, box_a));
    fct_leaf_maps_set(map, box_a, box_b, &maps);
    if ((double)maps.size > FAR_CENTER) {
        search_far_leaves(s, a.leaf, b);
        return;
    }
    placed_leaf placed_b = place_leaf(b, &maps.of_b);
    find_triangle_boxes(b, &placed_b, &boxes_b);
    uint32_t open = find_near_faces(s, b, &boxes_b, &maps);
    if (!open) return;
    for (uint32_t octet = 0; octet < fct_leaf_octets(b); ++octet) {
        eight_triangles t = pick_triangles(b, &placed_b, octet);
        for (int c = 0; c < 3; ++c)
            for (int k = 0; k < 3; ++k) f8_store(corners[c][k] + 8 * octet, t.p[c][k]);
    }
    a.placed = place_leaf(a.leaf, &maps.of_a);
    find_triangle_boxes(a.leaf, &a.placed, &a.boxes);
    for (; open && !s->done; open &= open - 1) {
        uint32_t i = (uint32_t)__builtin_ctz(open);
        measured_face face;
        float p[3][3];
        face.place = b->first + i;
        for (int k = 0; k < 3; ++k) {
            face.low[k] = boxes_b.low[k][i], face.high[k] = boxes_b.high[k][i];
            for (int c = 0; c < 3; ++c) p[c][k] = corners[c][k][i];
        }
        face.lanes = spread_triangle((const float(*)[3])p);
        for (uint32_t first = 0; first < a.leaf->count && !s->done; first += 8)
            measure_octet(s, &a, first, &face, &maps);
    }
}

/* Boxes with the bound 0 are many. This estimate sorts them: the distance of the centres less half the radius
 * of the child. (Without the radius, and with all of it, the search visits 9 % more; with the bound alone, 70
 * %.) */
static float estimate_distance(const fct_bvh *own, const fct_pair_node *node, uint32_t slot, uint32_t child,
                               const fct_placed_box *box) {
    float x = node->center[0][slot] - box->center[0], y = node->center[1][slot] - box->center[1],
          z = node->center[2][slot] - box->center[2];
    return sqrtf(x * x + y * y + z * z) - .5f * sqrtf(fct_box_size2(own, child));
}

/* A pair of boxes, and a lower bound of their squared distance in the scaled unit of a. */
typedef struct near_boxes {
    uint32_t a, b;
    double bound2;
} near_boxes;

static uint32_t open_node(distance_search *s, bool opens_a, uint32_t fixed, uint32_t opened,
                          near_boxes *stack, uint32_t height) {
    const fct_pair_map *map = s->map;
    const fct_bvh *other = opens_a ? map->b : map->a, *own = opens_a ? map->a : map->b;
    const fct_space_map *space = opens_a ? &map->to_a : &map->to_b;
    uint32_t number = fct_box_child(own, opened), base = height;
    const fct_pair_node *node = &own->pairs[number];
    fct_placed_box *box = opens_a ? &s->placed_a : &s->placed_b;
    double bound2[8], reach2 = s->reach * s->reach, to_a = opens_a ? 1 : s->to_limit_b;
    float near2[8], keys[8];
    uint32_t met = 0xff;
    fct_place_box(space, other, fixed, box);
    double far = fabs(box->exact_center[0]) + fabs(box->exact_center[1]) + fabs(box->exact_center[2]);
    if (far > FAR_CENTER)
        fct_bound_far_boxes(box, node, space, bound2);
    else
        met = bound_boxes(box, node, to_a > 0 ? (float)fct_min(reach2 / to_a * (1 + 0x1p-20), 1e36) : 1e36f,
                          near2);
    ++s->visits.nodes, s->visits.boxes += 8;
    for (; met; met &= met - 1) {
        uint32_t i = (uint32_t)__builtin_ctz(met), child = number << 3 | i;
        double bound = (far > FAR_CENTER ? bound2[i] : (double)near2[i]) * to_a;
        if (node->child[i] == FCT_NONE || bound > reach2) continue;
        float key = estimate_distance(own, node, i, child, box);
        uint32_t at = height++;
        for (; at > base && keys[at - 1 - base] < key; --at)
            stack[at] = stack[at - 1], keys[at - base] = keys[at - 1 - base];
        keys[at - base] = key;
        stack[at] = opens_a ? (near_boxes){child, fixed, bound} : (near_boxes){fixed, child, bound};
    }
    return height;
}

static void search_nodes(distance_search *s) {
    const fct_bvh *a = s->map->a, *b = s->map->b;
    float ratio2 = (float)(s->map->to_a.factor * s->map->to_a.factor);
    near_boxes stack[FCT_PAIR_STACK];
    uint32_t height = 1;
    stack[0] = (near_boxes){0, 0, 0};
    while (height && !s->done) {
        near_boxes pair = stack[--height];
        if (pair.bound2 > s->reach * s->reach) continue;
        bool leaf_a = fct_box_child(a, pair.a) & FCT_REF_LEAF,
             leaf_b = fct_box_child(b, pair.b) & FCT_REF_LEAF;
        if (leaf_a && leaf_b) {
            search_leaves(s, pair.a, pair.b);
            continue;
        }
        bool opens_a = leaf_b || (!leaf_a && fct_box_size2(a, pair.a) >= ratio2 * fct_box_size2(b, pair.b));
        height = opens_a ? open_node(s, true, pair.b, pair.a, stack, height)
                         : open_node(s, false, pair.a, pair.b, stack, height);
    }
}

void fct_distance_search(const fct_pair_map *map, double relative, double absolute, double enough,
                         fct_near_pair *best, fct_visits *visits) {
    distance_search s = {
        .map = map, .relative = relative, .absolute = absolute, .enough = enough, .best = *best};
    double shrink2 = 1 - map->to_a.skew;
    s.to_limit_b = shrink2 > 0 ? map->to_a.factor * map->to_a.factor * shrink2 * (1 - 0x1p-40) : 0;
    s.placed_a.box = s.placed_b.box = FCT_NONE;
    s.maximum = sqrt(best->distance2) * map->a->scale;
    s.upper = best->place_a != FCT_NONE ? s.maximum : INFINITY;
    set_limit(&s);
    search_nodes(&s);
    settle_candidates(&s);
    fct_visits_add(visits, &s.visits);
    *best = s.best;
}
