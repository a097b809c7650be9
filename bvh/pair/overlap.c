/* bvh/pair/overlap.c: pairs of faces that meet, and fronts of searches. A kernel file.
 *
 * The search goes down both trees at once. It opens the node with the larger box, and tests the other box
 * against its eight children. Boxes that overlap deepest come first, so that a contact is found early. A pair
 * of leaves compares the boxes of single triangles in the coordinates of one leaf, then each pair that is
 * left exactly.
 *
 * With a hint, the search keeps its front: each node that it opened, with those of its boxes that are apart
 * from the other box, and each pair of leaves. A pair of the front waits until b has moved by the least of
 * these distances. Then its boxes are tested again, and the search goes down where they are not apart any
 * more. A front whose pairs are tested about as often as those of a search from the roots is dropped. If a
 * contact is found, the pairs that were not searched stay in the front, as pairs that do not wait.
 */
#include "bvh/pair/search.h"

#include "base/math/simd.h"
#include "bvh/pair/apart.h"
#include "bvh/pair/boxes.h"
#include "bvh/pair/hint.h"
#include "bvh/pair/leaves.h"
#include "bvh/pair/place.h"
#include "bvh/pair/triangles.h"

/* A pair of boxes. */
typedef struct box_pair {
    uint32_t a, b;
} box_pair;

typedef struct overlap_search {
    const fct_pair_map *map;
    size_t limit, capacity, count;
    fct_face_pair *pairs;
    bool self, prefetches;
    fct_placed_box placed_a, placed_b; /* a box of b in a, and of a in b: the last ones used */
    fct_visits visits;
    fct_pair_hint *hint; /* NULL if no front is kept */
    bool fronted;        /* it is the search of a hint */
    double gap_of_a, gap_of_b; /* gaps in the scaled units, times this, are lower bounds in a's */
    bool near;                 /* looks for faces within `distance`, unscaled, also for those without area */
    double distance;
    float within_a, within_b; /* the distance in the scaled units, or more */
    double way;                /* that of the hint */
    uint32_t effort;           /* nodes and pairs of leaves tested */
    box_pair last;             /* the leaves of the last pair of faces */
} overlap_search;

static bool share_corner(const v3 a[3], const v3 b[3]) {
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            if (a[i].x == b[j].x && a[i].y == b[j].y && a[i].z == b[j].z) return true;
    return false;
}

static void record_pair(overlap_search *s, uint32_t place_a, uint32_t place_b) {
    if (s->count < s->capacity) {
        uint32_t face_a = s->map->a->view.face_ids[place_a], face_b = s->map->b->view.face_ids[place_b];
        bool swap = s->self && face_a > face_b;
        s->pairs[s->count] = swap ? (fct_face_pair){face_b, face_a, place_b, place_a}
                                  : (fct_face_pair){face_a, face_b, place_a, place_b};
    }
    ++s->count;
}

/* --- Leaves of a front --- */

/* Whether the search looks for this pair of faces; records it then. */
static bool test_faces(overlap_search *s, box_pair boxes, uint32_t place_a, uint32_t place_b) {
    v3 p[3], q[3], at_a, at_b;
    fct_pair_triangle_a(s->map, place_a, p);
    fct_pair_triangle_b(s->map, place_b, q);
    ++s->visits.triangles;
    bool wanted = s->near ? fct_triangles_distance(p, q, &at_a, &at_b) <= s->distance * s->distance
                          : fct_triangles_meet(p, q);
    if (wanted) record_pair(s, place_a, place_b), s->last = boxes;
    return wanted;
}

/* Two leaves in the coordinates of a's box. The lists hold pairs of triangles whose boxes are near. */
typedef struct leaf_pair {
    box_pair boxes;
    const fct_leaf *a, *b;
    fct_leaf_maps maps;
    leaf_corners corners_a, corners_b;
    uint32_t listed, list_a[24], list_b[24];
    float gap; /* a lower bound of the distance of the other triangles, scaled */
} leaf_pair;

/* Bounds the distances of the first eight pairs of the lists, removes them, and tests the near ones. Returns
 * whether one is found. */
static bool test_listed(overlap_search *s, leaf_pair *l) {
    uint32_t used = l->listed < 8 ? l->listed : 8, lanes_a[8] = {0}, lanes_b[8] = {0};
    l->listed -= used;
    for (uint32_t i = 0; i < used; ++i)
        lanes_a[i] = l->list_a[l->listed + i], lanes_b[i] = l->list_b[l->listed + i];
    lane_triangles a = gather_triangles(&l->corners_a, lanes_a), b = gather_triangles(&l->corners_b, lanes_b);
    f8 lower_lanes, upper_lanes;
    float lower[8], error = fct_round_up(APART_ERROR * (double)l->maps.size + 2 * (double)l->maps.slack);
    bound_distances(&a, &b, &lower_lanes, &upper_lanes);
    f8_store(lower, lower_lanes);
    for (uint32_t i = 0; i < used; ++i) {
        float gap = lower[i] - error;
        if (!(gap > s->within_a) &&
            test_faces(s, l->boxes, l->a->first + lanes_a[i], l->b->first + lanes_b[i]))
            return true;
        if (!(gap > l->gap)) l->gap = gap > 0 ? gap : 0;
    }
    return false;
}

/* The least bound of the distances of the triangles of the mask. */
static float find_least_gap(const triangle_boxes *boxes, uint32_t count, uint32_t mask, const float low[3],
                            const float high[3], float slack) {
    float gap2[16], least = INFINITY;
    for (uint32_t first = 0; first < count; first += 8)
        f8_store(gap2 + first, bound_triangles(boxes, first, low, high, slack));
    for (mask &= (1u << count) - 1; mask; mask &= mask - 1) {
        uint32_t i = (uint32_t)__builtin_ctz(mask);
        if (gap2[i] < least) least = gap2[i];
    }
    return sqrtf(least) * (1 - 0x1p-20f);
}

/* search_leaves for a front: looks for one pair of faces, and sets *gap to a lower bound of the distance of
 * the leaves, scaled. */
static bool search_front_leaves(overlap_search *s, box_pair boxes, float *gap) {
    const fct_pair_map *map = s->map;
    leaf_pair l = {.boxes = boxes, .listed = 0};
    triangle_boxes boxes_a, boxes_b;
    float low[3], high[3];
    l.a = fct_bvh_leaf(map->a, fct_box_child(map->a, boxes.a));
    l.b = fct_bvh_leaf(map->b, fct_box_child(map->b, boxes.b));
    uint32_t mask_a = s->near ? 0xffff : l.a->mask, mask_b = s->near ? 0xffff : l.b->mask;
    fct_leaf_maps_set(map, boxes.a, boxes.b, &l.maps);
    ++s->effort;
    placed_leaf placed = place_leaf(l.b, &l.maps.of_b);
    find_triangle_boxes(l.b, &placed, &boxes_b);
    for (int k = 0; k < 3; ++k) low[k] = -l.maps.half_a[k], high[k] = l.maps.half_a[k];
    float slack = l.maps.slack, reach = slack + s->within_a;
    uint32_t open_b = meet_triangles(&boxes_b, l.b->count, low, high, reach) & mask_b;
    l.gap = find_least_gap(&boxes_b, l.b->count, mask_b & ~open_b, low, high, 2 * slack);
    if (open_b) {
        store_corners(l.b, &placed, &l.corners_b);
        placed = place_leaf(l.a, &l.maps.of_a);
        find_triangle_boxes(l.a, &placed, &boxes_a);
        store_corners(l.a, &placed, &l.corners_a);
    }
    for (; open_b; open_b &= open_b - 1) {
        uint32_t i = (uint32_t)__builtin_ctz(open_b);
        for (int k = 0; k < 3; ++k) low[k] = boxes_b.low[k][i], high[k] = boxes_b.high[k][i];
        uint32_t open_a = meet_triangles(&boxes_a, l.a->count, low, high, reach) & mask_a;
        float row = find_least_gap(&boxes_a, l.a->count, mask_a & ~open_a, low, high, 2 * slack);
        if (row < l.gap) l.gap = row;
        for (; open_a; open_a &= open_a - 1, ++l.listed)
            l.list_a[l.listed] = (uint32_t)__builtin_ctz(open_a), l.list_b[l.listed] = i;
        while (l.listed >= 8)
            if (test_listed(s, &l)) return true;
    }
    if (l.listed && test_listed(s, &l)) return true;
    *gap = l.gap;
    return false;
}

/* Returns whether the search has all it wants. */
static bool search_leaves(overlap_search *s, uint32_t box_a, uint32_t box_b) {
    const fct_pair_map *map = s->map;
    const fct_leaf *a = fct_bvh_leaf(map->a, fct_box_child(map->a, box_a)),
                   *b = fct_bvh_leaf(map->b, fct_box_child(map->b, box_b));
    fct_leaf_maps maps;
    triangle_boxes boxes_a, boxes_b;
    float low[3], high[3];
    fct_leaf_maps_set(map, box_a, box_b, &maps);
    placed_leaf placed = place_leaf(b, &maps.of_b);
    find_triangle_boxes(b, &placed, &boxes_b);
    for (int k = 0; k < 3; ++k) low[k] = -maps.half_a[k], high[k] = maps.half_a[k];
    uint32_t open_b = meet_triangles(&boxes_b, b->count, low, high, maps.slack) & b->mask;
    if (!open_b) return false;
    placed = place_leaf(a, &maps.of_a);
    find_triangle_boxes(a, &placed, &boxes_a);
    for (; open_b; open_b &= open_b - 1) {
        uint32_t i = (uint32_t)__builtin_ctz(open_b);
        for (int k = 0; k < 3; ++k) low[k] = boxes_b.low[k][i], high[k] = boxes_b.high[k][i];
        uint32_t open_a = meet_triangles(&boxes_a, a->count, low, high, maps.slack) & a->mask;
        if (s->self && box_a == box_b) open_a &= (1u << i) - 1;
        if (!open_a) continue;
        v3 p[3], q[3];
        fct_pair_triangle_b(map, b->first + i, q);
        for (; open_a; open_a &= open_a - 1) {
            uint32_t j = (uint32_t)__builtin_ctz(open_a);
            fct_pair_triangle_a(map, a->first + j, p);
            ++s->visits.triangles;
            if ((s->self && share_corner(p, q)) || !fct_triangles_meet(p, q)) continue;
            record_pair(s, a->first + j, b->first + i);
            if (s->count < s->limit) continue;
            s->last = (box_pair){box_a, box_b};
            return true;
        }
    }
    return false;
}

/* Larger models are prefetched. Two statues of a million triangles touch in 4.4 us instead of 5.2. Two scans
 * of 70,000 triangles take 1.06 times as long without prefetching if other work uses the caches in between.
 * If the caches keep what the poses need, they take 1.2 times as long with prefetching. */
#define PREFETCH_BYTES ((size_t)2 << 20)

static size_t count_bytes(const fct_bvh *bvh) {
    return bvh->leaf_bytes + bvh->pair_count * sizeof(fct_pair_node);
}

/* Prefetches a node, or the largest leaf. */
static inline void prefetch_child(const fct_bvh *bvh, uint32_t ref) {
    const char *at =
        ref & FCT_REF_LEAF ? (const char *)fct_bvh_leaf(bvh, ref) : (const char *)&bvh->pairs[ref];
    uint32_t bytes = ref & FCT_REF_LEAF ? 256 : (uint32_t)sizeof(fct_pair_node);
    for (uint32_t i = 0; i < bytes; i += 64) __builtin_prefetch(at + i);
}

/* --- The front --- */

/* How far b has come when a gap is closed. */
static float find_reach(const overlap_search *s, double gap) {
    return (float)((s->way + gap) * (1 - 0x1p-22));
}

static void add_to_front(overlap_search *s, fct_front_pair pair) {
    if (s->hint->front_count < FCT_FRONT_PAIRS) {
        s->hint->front[s->hint->front_count++] = pair;
    } else {
        s->hint->front_count = 0;
        s->hint = NULL;
    }
}

/* Keeps the boxes of the pair that are apart, by the gaps. */
static void keep_apart(const overlap_search *s, bool opens_a, f8 gaps, uint32_t met, fct_front_pair *pair) {
    float gap[8], least = INFINITY;
    pair->lanes &= ~met;
    f8_store(gap, gaps);
    for (uint32_t lanes = pair->lanes & FCT_FRONT_ALL; lanes; lanes &= lanes - 1) {
        uint32_t i = (uint32_t)__builtin_ctz(lanes);
        if (gap[i] < least) least = gap[i];
    }
    pair->reach = find_reach(s, fct_max((double)least, 0) * (opens_a ? s->gap_of_a : s->gap_of_b));
}

/* Pushes the other box with those boxes of the opened node that it may meet, those that overlap deepest on top.
 * `lanes` and bit 8 of pair.lanes tell the node and its boxes. If the search keeps a front, *pair keeps the
 * boxes that are apart. Returns the new height of the stack. */
static uint32_t open_node(overlap_search *s, fct_front_pair *pair, box_pair *stack, uint32_t height) {
    const fct_pair_map *map = s->map;
    bool opens_a = pair->lanes & FCT_FRONT_OPENS_A;
    uint32_t fixed = opens_a ? pair->box_b : pair->box_a;
    const fct_bvh *other = opens_a ? map->b : map->a, *own = opens_a ? map->a : map->b;
    uint32_t number = fct_box_child(own, opens_a ? pair->box_a : pair->box_b);
    const fct_pair_node *node = &own->pairs[number];
    fct_placed_box *box = opens_a ? &s->placed_a : &s->placed_b;
    float depth[8], waiting[8];
    f8 gap;
    place_box(opens_a ? &map->to_a : &map->to_b, other, fixed, box);
    uint32_t met = meet_boxes(box, node, opens_a ? s->within_a : s->within_b, depth, &gap) & pair->lanes,
             base = height;
    ++s->visits.nodes, s->visits.boxes += 8, ++s->effort;
    if (s->hint) keep_apart(s, opens_a, f8_sub(gap, f8_set(box->slack)), met, pair);
    for (; met; met &= met - 1) {
        uint32_t i = (uint32_t)__builtin_ctz(met), child = number << 3 | i;
        if (node->child[i] == FCT_NONE) continue;
        if (s->prefetches) prefetch_child(own, node->child[i]);
        uint32_t at = height++;
        for (; at > base && waiting[at - 1 - base] < depth[i]; --at)
            stack[at] = stack[at - 1], waiting[at - base] = waiting[at - 1 - base];
        stack[at] = opens_a ? (box_pair){child, fixed} : (box_pair){fixed, child};
        waiting[at - base] = depth[i];
    }
    return height;
}

/* Returns whether the search has all it wants. */
static bool search_stack(overlap_search *s, box_pair *stack, uint32_t height) {
    const fct_bvh *a = s->map->a, *b = s->map->b;
    while (height) {
        box_pair boxes = stack[--height];
        bool leaves = fct_box_is_leaf(a, boxes.a) && fct_box_is_leaf(b, boxes.b), done = false;
        fct_front_pair pair = fct_front_begin(s->map, boxes.a, boxes.b);
        if (leaves && s->fronted) {
            float gap;
            done = search_front_leaves(s, boxes, &gap);
            if (!done) pair.reach = find_reach(s, (double)gap);
        } else if (leaves) {
            done = search_leaves(s, boxes.a, boxes.b);
        } else {
            height = open_node(s, &pair, stack, height);
        }
        if (s->hint && (pair.lanes & FCT_FRONT_ALL)) add_to_front(s, pair);
        if (done) return true;
    }
    return false;
}

static void search_below(overlap_search *s, box_pair from) {
    box_pair stack[FCT_PAIR_STACK];
    stack[0] = from;
    search_stack(s, stack, 1);
}

static overlap_search begin_search(const fct_pair_map *map, size_t limit, size_t capacity,
                                   fct_face_pair *pairs) {
    overlap_search s = {.map = map, .limit = limit, .capacity = capacity, .pairs = pairs};
    s.prefetches = count_bytes(map->a) + count_bytes(map->b) > PREFETCH_BYTES;
    s.placed_a.box = s.placed_b.box = FCT_NONE;
    return s;
}

size_t fct_overlap_search(const fct_pair_map *map, size_t limit, size_t capacity, fct_face_pair *pairs,
                          fct_visits *visits) {
    overlap_search s = begin_search(map, limit, capacity, pairs);
    if (limit) search_below(&s, (box_pair){0, 0});
    fct_visits_add(visits, &s.visits);
    return s.count;
}

/* Tests a pair of the front again, and what is below it. Returns whether faces meet. */
static bool test_pair_again(overlap_search *s, fct_front_pair *pair) {
    const fct_pair_map *map = s->map;
    box_pair stack[FCT_PAIR_STACK];
    if (!fct_box_is_leaf(map->a, pair->box_a) || !fct_box_is_leaf(map->b, pair->box_b))
        return search_stack(s, stack, open_node(s, pair, stack, 0));
    float gap;
    bool done = search_front_leaves(s, (box_pair){pair->box_a, pair->box_b}, &gap);
    if (!done) pair->reach = find_reach(s, (double)gap);
    return done;
}

/* Whether a pair of the front may be within the distance. */
static bool is_expired(const overlap_search *s, const fct_front_pair *pair) {
    return (double)pair->reach <= s->way + (double)s->within_a;
}

/* Tests the pairs of the front that may not be apart any more. Pairs without boxes leave the front. */
static bool test_front(overlap_search *s, fct_pair_hint *hint) {
    uint32_t count = hint->front_count, kept = 0;
    for (uint32_t i = 0; i < count; ++i)
        if (is_expired(s, &hint->front[i]) && test_pair_again(s, &hint->front[i])) return true;
    for (uint32_t i = 0; s->hint && i < hint->front_count; ++i)
        if (hint->front[i].lanes & FCT_FRONT_ALL) hint->front[kept++] = hint->front[i];
    if (s->hint) hint->front_count = kept;
    return false;
}

/* A search from the roots, which makes a new front if s->hint is set. */
static bool search_roots(overlap_search *s, fct_pair_hint *hint) {
    hint->front_count = 0, hint->way = s->way = 0;
    search_below(s, (box_pair){0, 0});
    hint->effort = s->effort;
    return s->count > 0;
}

/* A search from the roots is better if more than this part of its tests must be repeated. */
#define MOST_EXPIRED .5
/* Then the next searches do not make a front, because b moves too fast. */
#define PAUSE 6

bool fct_front_search(const fct_pair_map *map, fct_pair_hint *hint, double distance, fct_visits *visits) {
    overlap_search s = begin_search(map, 1, 1, &hint->pair);
    double narrow = (1 - 0x1p-20) / (1 + map->to_a.skew), shrink2 = 1 - map->to_a.skew;
    s.gap_of_a = narrow;
    s.gap_of_b = shrink2 > 0 ? map->to_a.factor * sqrt(shrink2) * narrow : 0;
    s.way = hint->way, s.fronted = true;
    s.near = distance >= 0;
    if (s.near) {
        s.distance = distance;
        s.within_a = fct_round_up(distance * map->a->scale);
        s.within_b = s.gap_of_b > 0 ? fct_round_up((double)s.within_a / s.gap_of_b) : INFINITY;
    }
    bool met = false, tested = false;
    if (hint->touching) {
        float gap;
        met = tested =
            search_front_leaves(&s, (box_pair){hint->front[0].box_a, hint->front[0].box_b}, &gap);
    } else if (hint->front_count) {
        uint32_t expired = 0;
        for (uint32_t i = 0; i < hint->front_count; ++i) expired += is_expired(&s, &hint->front[i]);
        tested = expired <= MOST_EXPIRED * hint->effort;
        if (tested) {
            s.hint = hint;
            met = test_front(&s, hint);
        } else {
            hint->pause = PAUSE;
        }
    }
    if (!tested) {
        s.hint = hint->pause ? NULL : hint;
        hint->pause -= hint->pause > 0;
        met = search_roots(&s, hint);
    }
    hint->touching = met;
    if (met) {
        hint->front[0] = fct_front_begin(map, s.last.a, s.last.b);
        hint->front_count = 0;
    }
    fct_visits_add(visits, &s.visits);
    return met;
}

/* A node with itself: each of its boxes with itself, and all pairs of them. */
size_t fct_self_search(const fct_pair_map *map, size_t limit, size_t capacity, fct_face_pair *pairs,
                       fct_visits *visits) {
    const fct_bvh *bvh = map->a;
    overlap_search s = begin_search(map, limit, capacity, pairs);
    s.self = true;
    uint32_t stack[7 * (FCT_TOP_DEPTH + 1) + 1], height = 0;
    if (limit) stack[height++] = 0;
    while (height) {
        uint32_t box = stack[--height], number = fct_box_child(bvh, box);
        if (number & FCT_REF_LEAF) {
            if (search_leaves(&s, box, box)) break;
            continue;
        }
        const fct_pair_node *node = &bvh->pairs[number];
        for (uint32_t i = 0; i < 8 && node->child[i] != FCT_NONE && s.count < limit; ++i) {
            float depth[8];
            place_box(&map->to_a, bvh, number << 3 | i, &s.placed_a);
            f8 gap;
            uint32_t met = meet_boxes(&s.placed_a, node, 0, depth, &gap) & ((1u << i) - 1);
            ++s.visits.nodes, s.visits.boxes += i;
            for (; met && s.count < limit; met &= met - 1)
                search_below(&s, (box_pair){number << 3 | (uint32_t)__builtin_ctz(met), number << 3 | i});
            stack[height++] = number << 3 | i;
        }
        if (s.count == limit) break;
    }
    fct_visits_add(visits, &s.visits);
    return s.count;
}
