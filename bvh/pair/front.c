/* bvh/pair/front.c: the search for a contact, or for faces within a distance, that keeps its front. A kernel
 * file.
 *
 * The front is each node that the search opened, with those of its boxes that are apart from the other box,
 * and each pair of leaves. A pair of the front waits until b has moved by the least of these distances. Then
 * its boxes are tested again, and the search goes down where they are not apart any more. So a pair of bodies
 * that moves slowly, or rests, tests few boxes or none. A search from the roots makes a new front if many
 * pairs have moved that far, and none while b moves fast. After a contact, the pair of leaves comes first.
 *
 * Bounds of the float kernel apart.h spare most pairs of triangles the exact test, and tell how far they are
 * apart.
 */
#include "bvh/pair/search.h"

#include "base/math/simd.h"
#include "bvh/pair/apart.h"
#include "bvh/pair/boxes.h"
#include "bvh/pair/hint.h"
#include "bvh/pair/leaves.h"
#include "bvh/pair/open.h"
#include "bvh/pair/place.h"
#include "bvh/pair/triangles.h"

typedef struct front_search {
    const fct_pair_map *map;
    fct_pair_hint *hint;
    bool keeps;                /* the front: not of a fast motion, nor once it is full */
    double gap_of_a, gap_of_b; /* gaps in the scaled units, times this, are lower bounds in a's */
    bool near;                 /* looks for faces within `distance`, unscaled, also for those without area */
    double distance;
    float within_a, within_b; /* the distance in the scaled units, or more */
    uint32_t effort;          /* nodes and pairs of leaves tested */
    bool prefetches;
    fct_placed_box placed_a, placed_b; /* a box of b in a, and of a in b: the last ones used */
    fct_visits visits;
} front_search;

/* How far b has come when a gap is closed. */
static float find_reach(const front_search *s, double gap) {
    return (float)((s->hint->way + gap) * (1 - 0x1p-22));
}

/* --- Leaves --- */

/* Two leaves in the coordinates of a's box. The lists hold pairs of triangles whose boxes are near. */
typedef struct leaf_pair {
    const fct_leaf *a, *b;
    fct_leaf_maps maps;
    leaf_corners corners_a, corners_b;
    uint32_t listed, list_a[24], list_b[24];
    float gap; /* a lower bound of the distance of the other triangles, scaled */
} leaf_pair;

/* Whether the search looks for this pair of triangles of the leaves. */
static bool test_faces(front_search *s, const leaf_pair *l, uint32_t number_a, uint32_t number_b) {
    const uint32_t place_a = fct_leaf_place(s->map->a, l->a, number_a),
                   place_b = fct_leaf_place(s->map->b, l->b, number_b);
    v3 p[3], q[3], at_a, at_b;
    fct_pair_triangle_a(s->map, place_a, p);
    fct_pair_triangle_b(s->map, place_b, q);
    ++s->visits.triangles;
    if (s->near ? !(fct_triangles_distance(p, q, &at_a, &at_b) <= s->distance * s->distance)
                : !fct_triangles_meet(p, q))
        return false;
    const uint32_t *ids_a = s->map->a->view.face_ids, *ids_b = s->map->b->view.face_ids;
    s->hint->pair = (fct_face_pair){ids_a[place_a], ids_b[place_b], place_a, place_b};
    return true;
}

/* Bounds the distances of the first eight pairs of the lists, removes them, and tests the near ones. Returns
 * whether one is found. */
static bool test_listed(front_search *s, leaf_pair *l) {
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
        if (!(gap > s->within_a) && test_faces(s, l, lanes_a[i], lanes_b[i])) return true;
        if (!(gap > l->gap)) l->gap = gap > 0 ? gap : 0;
    }
    return false;
}

/* A mask of the triangles whose boxes may be near the box low..high. *least2 becomes at most the squared
 * distances of the others. */
static inline uint32_t find_near(const front_search *s, const triangle_boxes *boxes, uint32_t count,
                                 const float low[3], const float high[3], float slack, f8 *least2) {
    f8 within2 = f8_set(s->within_a * s->within_a * (1 + 0x1p-20f)), none = f8_set(INFINITY);
    uint32_t near = 0;
    for (uint32_t first = 0; first < count; first += 8) {
        f8 bound = bound_triangles(boxes, first, low, high, 2 * slack);
        near |= f8_le(bound, within2) << first;
        *least2 = f8_min(*least2, f8_if_lt(within2, bound, bound, none));
    }
    return near & ((1u << count) - 1);
}

/* Whether the search finds faces of two leaves. If not, *pair gets their reach. */
static bool search_leaves(front_search *s, fct_front_pair *pair) {
    const fct_pair_map *map = s->map;
    leaf_pair l;
    triangle_boxes boxes_a, boxes_b;
    float low[3], high[3], gap2[8];
    f8 least2 = f8_set(INFINITY);
    l.a = fct_bvh_leaf(map->a, fct_box_child(map->a, pair->box_a));
    l.b = fct_bvh_leaf(map->b, fct_box_child(map->b, pair->box_b));
    l.listed = 0, l.gap = INFINITY;
    uint32_t mask_a = s->near ? 0xffff : l.a->mask, mask_b = s->near ? 0xffff : l.b->mask;
    fct_leaf_maps_set(map, pair->box_a, pair->box_b, &l.maps);
    float slack = l.maps.slack;
    ++s->effort;
    placed_leaf placed = place_leaf(l.b, &l.maps.of_b);
    find_triangle_boxes(l.b, &placed, &boxes_b);
    for (int k = 0; k < 3; ++k) low[k] = -l.maps.half_a[k], high[k] = l.maps.half_a[k];
    uint32_t near_b = find_near(s, &boxes_b, l.b->count, low, high, slack, &least2) & mask_b;
    if (near_b) {
        store_corners(l.b, &placed, &l.corners_b);
        placed = place_leaf(l.a, &l.maps.of_a);
        find_triangle_boxes(l.a, &placed, &boxes_a);
        store_corners(l.a, &placed, &l.corners_a);
    }
    for (; near_b; near_b &= near_b - 1) {
        uint32_t i = (uint32_t)__builtin_ctz(near_b);
        for (int k = 0; k < 3; ++k) low[k] = boxes_b.low[k][i], high[k] = boxes_b.high[k][i];
        uint32_t near_a = find_near(s, &boxes_a, l.a->count, low, high, slack, &least2) & mask_a;
        for (; near_a; near_a &= near_a - 1, ++l.listed)
            l.list_a[l.listed] = (uint32_t)__builtin_ctz(near_a), l.list_b[l.listed] = i;
        while (l.listed >= 8)
            if (test_listed(s, &l)) return true;
    }
    if (l.listed && test_listed(s, &l)) return true;
    f8_store(gap2, least2);
    for (int i = 0; i < 8; ++i) l.gap = fminf(l.gap, sqrtf(gap2[i]) * (1 - 0x1p-20f));
    pair->reach = find_reach(s, (double)l.gap);
    return false;
}

/* --- The front --- */

/* A front that is full is given up. */
static void add_to_front(front_search *s, fct_front_pair pair) {
    if (s->hint->front_count < FCT_FRONT_PAIRS)
        s->hint->front[s->hint->front_count++] = pair;
    else
        s->hint->front_count = 0, s->keeps = false;
}

/* Keeps the boxes of the pair that are apart, by the gaps. */
static void keep_apart(const front_search *s, bool opens_a, f8 gaps, uint32_t met, fct_front_pair *pair) {
    float gap[8], least = INFINITY;
    pair->lanes &= ~met;
    f8_store(gap, gaps);
    for (uint32_t lanes = pair->lanes & FCT_FRONT_ALL; lanes; lanes &= lanes - 1) {
        uint32_t i = (uint32_t)__builtin_ctz(lanes);
        if (gap[i] < least) least = gap[i];
    }
    pair->reach = find_reach(s, fct_max((double)least, 0) * (opens_a ? s->gap_of_a : s->gap_of_b));
}

/* Tests the boxes of the pair, and pushes those that are not apart. If the search keeps a front, the others
 * stay in the pair. Returns the new height of the stack. */
static uint32_t open_node(front_search *s, fct_front_pair *pair, box_pair *stack, uint32_t height) {
    const fct_pair_map *map = s->map;
    bool opens_a = pair->lanes & FCT_FRONT_OPENS_A;
    uint32_t fixed = opens_a ? pair->box_b : pair->box_a;
    const fct_bvh *other = opens_a ? map->b : map->a, *own = opens_a ? map->a : map->b;
    uint32_t number = fct_box_child(own, opens_a ? pair->box_a : pair->box_b);
    fct_placed_box *box = opens_a ? &s->placed_a : &s->placed_b;
    float depth[8];
    f8 gap;
    place_box(opens_a ? &map->to_a : &map->to_b, other, fixed, box);
    uint32_t met = meet_boxes(box, &own->pairs[number], opens_a ? s->within_a : s->within_b, depth, &gap);
    met &= pair->lanes;
    ++s->visits.nodes, s->visits.boxes += 8, ++s->effort;
    if (s->keeps) keep_apart(s, opens_a, f8_sub(gap, f8_set(box->slack)), met, pair);
    opened_node node = {own, number, fixed, opens_a, s->prefetches};
    return push_boxes(&node, met, depth, stack, height);
}

/* Returns whether faces are found; front[0] is then their pair of leaves. */
static bool search_stack(front_search *s, box_pair *stack, uint32_t height) {
    while (height) {
        box_pair boxes = stack[--height];
        fct_front_pair pair = fct_front_begin(s->map, boxes.a, boxes.b);
        if (fct_front_is_leaves(s->map, &pair)) {
            if (search_leaves(s, &pair)) {
                s->hint->front[0] = pair;
                return true;
            }
        } else {
            height = open_node(s, &pair, stack, height);
        }
        if (s->keeps && (pair.lanes & FCT_FRONT_ALL)) add_to_front(s, pair);
    }
    return false;
}

/* Tests a pair of the front again, and what is below it. */
static bool test_pair_again(front_search *s, fct_front_pair *pair) {
    box_pair stack[FCT_PAIR_STACK];
    if (fct_front_is_leaves(s->map, pair)) {
        bool found = search_leaves(s, pair);
        if (found) s->hint->front[0] = *pair;
        return found;
    }
    return search_stack(s, stack, open_node(s, pair, stack, 0));
}

/* Whether a pair of the front may be within the distance. */
static bool is_expired(const front_search *s, const fct_front_pair *pair) {
    return (double)pair->reach <= s->hint->way + (double)s->within_a;
}

/* Tests the pairs of the front that may not be apart any more. Pairs without boxes leave the front. */
static bool test_front(front_search *s) {
    fct_pair_hint *hint = s->hint;
    uint32_t count = hint->front_count, kept = 0;
    for (uint32_t i = 0; i < count; ++i)
        if (is_expired(s, &hint->front[i]) && test_pair_again(s, &hint->front[i])) return true;
    for (uint32_t i = 0; i < hint->front_count; ++i)
        if (hint->front[i].lanes & FCT_FRONT_ALL) hint->front[kept++] = hint->front[i];
    hint->front_count = kept;
    return false;
}

/* A search from the roots, which makes a new front if s->keeps. */
static bool search_roots(front_search *s) {
    box_pair stack[FCT_PAIR_STACK] = {{0, 0}};
    s->hint->front_count = 0, s->hint->way = 0;
    bool found = search_stack(s, stack, 1);
    s->hint->effort = s->effort;
    return found;
}

/* A search from the roots is better if more than this part of its tests must be repeated. */
#define MOST_EXPIRED .5
/* Then, or if the leaves of a contact have none any more, the next queries do without a front. */
#define PAUSE 6

static bool is_worn(const front_search *s) {
    uint32_t expired = 0;
    for (uint32_t i = 0; i < s->hint->front_count; ++i) expired += is_expired(s, &s->hint->front[i]);
    return expired > MOST_EXPIRED * s->hint->effort;
}

static front_search begin_search(const fct_pair_map *map, fct_pair_hint *hint, double distance) {
    front_search s = {
        .map = map, .hint = hint, .near = distance >= 0, .keeps = true, .prefetches = is_prefetched(map)};
    double narrow = (1 - 0x1p-20) / (1 + map->to_a.skew), shrink2 = 1 - map->to_a.skew;
    s.gap_of_a = narrow;
    s.gap_of_b = shrink2 > 0 ? map->to_a.factor * sqrt(shrink2) * narrow : 0;
    s.placed_a.box = s.placed_b.box = FCT_NONE;
    if (!s.near) return s;
    s.distance = distance;
    s.within_a = fct_round_up(distance * map->a->scale);
    s.within_b = s.gap_of_b > 0 ? fct_round_up((double)s.within_a / s.gap_of_b) : INFINITY;
    return s;
}

bool fct_front_search(const fct_pair_map *map, fct_pair_hint *hint, double distance, fct_visits *visits) {
    front_search s = begin_search(map, hint, distance);
    bool found = hint->touching && search_leaves(&s, &hint->front[0]);
    if (!found && !hint->touching && hint->front_count && !is_worn(&s)) {
        found = test_front(&s);
    } else if (!found) {
        s.keeps = !hint->touching && !hint->front_count;
        if (!s.keeps) hint->pause = PAUSE;
        found = search_roots(&s);
    }
    hint->touching = found;
    if (found) hint->front_count = 0;
    fct_visits_add(visits, &s.visits);
    return found;
}
