/* bvh/pair/overlap.c: pairs of faces that meet. A kernel file.
 *
 * The search goes down both trees at once. It opens the node with the larger box, and tests the other box
 * against its eight children. Boxes that overlap deepest come first, so that a contact is found early. A pair
 * of leaves compares the boxes of single triangles in the coordinates of one leaf, then each pair that is
 * left exactly.
 */
#include "bvh/pair/search.h"

#include "base/math/simd.h"
#include "bvh/pair/boxes.h"
#include "bvh/pair/leaves.h"
#include "bvh/pair/open.h"
#include "bvh/pair/place.h"
#include "bvh/pair/triangles.h"

typedef struct overlap_search {
    const fct_pair_map *map;
    size_t limit, capacity, count;
    fct_face_pair *pairs;
    bool self, prefetches;
    fct_placed_box placed_a, placed_b; /* a box of b in a, and of a in b: the last ones used */
    fct_visits visits;
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
        const uint32_t place_b = fct_leaf_place(map->b, b, i);
        fct_pair_triangle_b(map, place_b, q);
        for (; open_a; open_a &= open_a - 1) {
            uint32_t j = (uint32_t)__builtin_ctz(open_a);
            const uint32_t place_a = fct_leaf_place(map->a, a, j);
            fct_pair_triangle_a(map, place_a, p);
            ++s->visits.triangles;
            if ((s->self && share_corner(p, q)) || !fct_triangles_meet(p, q)) continue;
            record_pair(s, place_a, place_b);
            if (s->count == s->limit) return true;
        }
    }
    return false;
}

/* Pushes box `fixed` with the children of the node of `opened` that it may meet. Returns the new height of
 * the stack. */
static uint32_t open_node(overlap_search *s, bool opens_a, uint32_t fixed, uint32_t opened, box_pair *stack,
                          uint32_t height) {
    const fct_pair_map *map = s->map;
    const fct_bvh *other = opens_a ? map->b : map->a, *own = opens_a ? map->a : map->b;
    uint32_t number = fct_box_child(own, opened);
    fct_placed_box *box = opens_a ? &s->placed_a : &s->placed_b;
    float depth[8];
    f8 gap;
    place_box(opens_a ? &map->to_a : &map->to_b, other, fixed, box);
    uint32_t met = meet_boxes(box, &own->pairs[number], 0, depth, &gap);
    ++s->visits.nodes, s->visits.boxes += 8;
    opened_node node = {own, number, fixed, opens_a, s->prefetches};
    return push_boxes(&node, met, depth, stack, height);
}

static size_t search_below(overlap_search *s, box_pair from) {
    const fct_bvh *a = s->map->a, *b = s->map->b;
    box_pair stack[FCT_PAIR_STACK];
    uint32_t height = 1;
    stack[0] = from;
    while (height) {
        box_pair pair = stack[--height];
        if (fct_box_is_leaf(a, pair.a) && fct_box_is_leaf(b, pair.b)) {
            if (search_leaves(s, pair.a, pair.b)) break;
            continue;
        }
        height = fct_opens_a(s->map, pair.a, pair.b) ? open_node(s, true, pair.b, pair.a, stack, height)
                                                     : open_node(s, false, pair.a, pair.b, stack, height);
    }
    return s->count;
}

static overlap_search begin_search(const fct_pair_map *map, size_t limit, size_t capacity,
                                   fct_face_pair *pairs) {
    overlap_search s = {.map = map, .limit = limit, .capacity = capacity, .pairs = pairs};
    s.prefetches = is_prefetched(map);
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
