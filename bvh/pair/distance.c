/* bvh/pair/distance.c: the nearest faces of two models. A kernel file.
 *
 * The search goes on with the pair of boxes with the least lower bound, and ends when this bound exceeds the
 * best distance so far. From each pair it dives to a pair of leaves, so that a near pair of faces is known
 * early. Bounds are squared, in the scaled unit of a. A pair of leaves compares the boxes of single triangles
 * in the coordinates of one leaf, and bounds the distances of the near ones in float. Most are excluded by
 * the direction between the nearest triangles so far, which separates others too. Only pairs whose bounds
 * leave a doubt are measured in double.
 *
 * The queue holds QUEUE pairs. If it is full, a pair is searched depth first.
 *
 * Models that are far apart beside their size need more digits than a float has. There, boxes are also
 * bounded by their separation along the line between the centres, in double. Far leaves are separated along
 * this line and along the way between the nearest faces so far: beside a large triangle, only the latter
 * separates.
 */
#include "bvh/pair/search.h"

#include <float.h>

#include "base/math/simd.h"
#include "base/sift.h"
#include "bvh/pair/apart.h"
#include "bvh/pair/boxes.h"
#include "bvh/pair/far.h"
#include "bvh/pair/leaves.h"
#include "bvh/pair/place.h"
#include "bvh/pair/triangles.h"

/* Beyond this distance of the centres (sum of coordinates, scaled), double arithmetic bounds the distance. */
#define FAR_CENTER 16.0
/* Then a box is large if its centre is at most this many half extents (sums of coordinates) away. The line
 * between the centres hardly separates boxes beside it, as beside a triangle of a floor, but float bounds do:
 * their slack grows with the distance. */
#define FAR_RATIO 16.0
/* The squares of much longer lengths overflow a float. */
#define FLOAT_CENTER 1e9

/* A pair of faces that is at least `lower` apart, scaled. */
typedef struct candidate {
    double lower;
    uint32_t place_a, place_b;
} candidate;

/* A pair of boxes, and a lower bound of their squared distance in the scaled unit of a. */
typedef struct near_boxes {
    uint32_t a, b;
    double bound2;
} near_boxes;

enum { CANDIDATES = 64, QUEUE = 512 };

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
    float way[3];                      /* from a to b between the nearest triangles so far, see set_way */
    uint32_t waiting;
    candidate candidates[CANDIDATES];
    uint32_t queued;
    near_boxes queue[QUEUE]; /* a heap, the least bound on top */
    fct_visits visits;
} distance_search;

static bool is_enough(const distance_search *s) {
    return s->best.place_a != FCT_NONE && sqrt(s->best.distance2) <= s->enough;
}

/* The tolerances count once a pair is known that is near enough. */
static void set_limit(distance_search *s) {
    double scale = s->map->a->scale, reach = s->maximum;
    bool known = s->upper < INFINITY && s->upper <= s->maximum;
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
            if (s->candidates[j].lower < s->candidates[nearest].lower) nearest = j;
        candidate c = s->candidates[nearest];
        s->candidates[nearest] = s->candidates[i];
        if (c.lower > fct_min(s->upper, s->maximum)) break;
        measure_pair(s, c.place_a, c.place_b);
    }
    s->waiting = 0;
}

/* A pair whose distance lies between the bounds, scaled. */
static void add_candidate(distance_search *s, double lower, double upper, uint32_t place_a,
                          uint32_t place_b) {
    if (lower > s->reach) return;
    s->candidates[s->waiting++] = (candidate){lower, place_a, place_b};
    if (upper < s->upper) {
        s->upper = upper;
        set_limit(s);
    }
    if (s->waiting == CANDIDATES || lower <= s->enough * s->map->a->scale) settle_candidates(s);
}

/* Two leaves in the coordinates of a's box. The lists hold pairs of triangles that may be near enough; eight
 * of them fill the lanes. */
typedef struct leaf_pair {
    const fct_leaf *a, *b;
    fct_leaf_maps maps;
    leaf_corners corners_a, corners_b;
    uint32_t listed, list_a[16], list_b[16];
} leaf_pair;

/* Sets the way from a to b: the opposite of the vector in this lane of d, in the coordinates of model a, with
 * a length of at most 1. */
static void set_way(distance_search *s, const fct_leaf_maps *maps, w3 d, uint32_t lane) {
    float rows[3][8], length2 = 0;
    f8_store(rows[0], d.x), f8_store(rows[1], d.y), f8_store(rows[2], d.z);
    for (int k = 0; k < 3; ++k) {
        s->way[k] = 0;
        for (int r = 0; r < 3; ++r) s->way[k] -= maps->of_a.turn[r][k] * rows[r][lane];
        length2 += s->way[k] * s->way[k];
    }
    float scale = length2 > 1e-30f ? (1 - 0x1p-20f) / sqrtf(length2) : 0;
    for (int k = 0; k < 3; ++k) s->way[k] *= scale;
}

/* Bounds the distances of the first eight pairs of the lists, and removes them. */
static void measure_listed(distance_search *s, leaf_pair *l) {
    uint32_t used = l->listed < 8 ? l->listed : 8, nearest = 0;
    for (uint32_t i = used; i < 8; ++i) l->list_a[i] = l->list_b[i] = 0;
    lane_triangles a = gather_triangles(&l->corners_a, l->list_a),
                   b = gather_triangles(&l->corners_b, l->list_b);
    f8 lower_lanes, upper_lanes;
    float lower[8], upper[8];
    w3 d = bound_distances(&a, &b, &lower_lanes, &upper_lanes);
    f8_store(lower, lower_lanes), f8_store(upper, upper_lanes);
    double error = APART_ERROR * (double)l->maps.size + 2 * (double)l->maps.slack;
    for (uint32_t i = 1; i < used; ++i)
        if (upper[i] < upper[nearest]) nearest = i;
    if ((double)upper[nearest] + error < s->upper) set_way(s, &l->maps, d, nearest);
    for (uint32_t i = 0; i < used && !s->done; ++i)
        add_candidate(s, fct_max((double)lower[i] - error, 0), (double)upper[i] + error,
                      fct_leaf_place(s->map->a, l->a, l->list_a[i]),
                      fct_leaf_place(s->map->b, l->b, l->list_b[i]));
    l->listed -= used;
    for (uint32_t i = 0; i < l->listed; ++i) l->list_a[i] = l->list_a[i + 8], l->list_b[i] = l->list_b[i + 8];
}

/* How far the triangles reach along the way: those of a up to top, those of b down to bottom. Rounding
 * included. */
static void extend_along_way(const distance_search *s, const leaf_pair *l, float top[16], float bottom[16]) {
    const float *way = s->way;
    f8 along[3], slack = f8_set(2 * l->maps.slack);
    w3 p[3];
    for (int r = 0; r < 3; ++r) {
        const float *turn = l->maps.of_a.turn[r];
        along[r] = f8_set(turn[0] * way[0] + turn[1] * way[1] + turn[2] * way[2]);
    }
    for (uint32_t first = 0; first < l->a->count; first += 8) {
        load_corners(&l->corners_a, first, p);
        f8_store(top + first, f8_add(most_along(p, w3_load(along)), slack));
    }
    for (uint32_t first = 0; first < l->b->count; first += 8) {
        load_corners(&l->corners_b, first, p);
        f8_store(bottom + first, f8_sub(least_along(p, w3_load(along)), slack));
    }
}

/* Measures face i of leaf a and face j of leaf b. */
static void measure_faces(distance_search *s, const fct_leaf *a, uint32_t i, const fct_leaf *b, uint32_t j) {
    measure_pair(s, fct_leaf_place(s->map->a, a, i), fct_leaf_place(s->map->b, b, j));
}

/* Leaves that are far apart, or of which one is large. A pair of faces with the least bound comes first. */
static void search_far_leaves(distance_search *s, const fct_leaf *a, const fct_leaf *b) {
    fct_far_leaves far;
    double scale = s->map->a->scale;
    v3 way = v3_unit(v3_sub(s->best.point_b, s->best.point_a));
    if (!fct_bound_far_leaves(s->map, a, b, way, s->reach / scale, &far)) return;
    measure_faces(s, a, far.first_a, b, far.first_b);
    for (uint32_t i = 0; i < a->count; ++i)
        for (uint32_t j = 0; j < b->count && !s->done; ++j)
            if ((i != far.first_a || j != far.first_b) && fct_far_gap(&far, i, j) <= s->reach / scale)
                measure_faces(s, a, i, b, j);
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
    triangle_boxes boxes_a, boxes_b;
    leaf_pair l;
    float top[16], bottom[16];
    l.a = fct_bvh_leaf(map->a, fct_box_child(map->a, box_a));
    l.b = fct_bvh_leaf(map->b, fct_box_child(map->b, box_b));
    l.listed = 0;
    fct_leaf_maps_set(map, box_a, box_b, &l.maps);
    if ((double)l.maps.size > FAR_CENTER) {
        search_far_leaves(s, l.a, l.b);
        return;
    }
    placed_leaf placed = place_leaf(l.b, &l.maps.of_b);
    find_triangle_boxes(l.b, &placed, &boxes_b);
    uint32_t open_b = find_near_faces(s, l.b, &boxes_b, &l.maps);
    if (!open_b) return;
    store_corners(l.b, &placed, &l.corners_b);
    placed = place_leaf(l.a, &l.maps.of_a);
    find_triangle_boxes(l.a, &placed, &boxes_a);
    store_corners(l.a, &placed, &l.corners_a);
    extend_along_way(s, &l, top, bottom);
    for (; open_b && !s->done; open_b &= open_b - 1) {
        uint32_t i = (uint32_t)__builtin_ctz(open_b);
        float low[3], high[3], least_top = bottom[i] - (float)fct_min(s->reach * (1 + 0x1p-20), 1e30);
        for (int k = 0; k < 3; ++k) low[k] = boxes_b.low[k][i], high[k] = boxes_b.high[k][i];
        for (uint32_t first = 0; first < l.a->count; first += 8) {
            uint32_t left = l.a->count - first, open_a = left < 8 ? (1u << left) - 1 : 0xffu;
            open_a &= f8_le(bound_triangles(&boxes_a, first, low, high, l.maps.slack), f8_set(s->limit2));
            open_a &= f8_le(f8_set(least_top), f8_load(top + first));
            for (; open_a; open_a &= open_a - 1, ++l.listed)
                l.list_a[l.listed] = first + (uint32_t)__builtin_ctz(open_a), l.list_b[l.listed] = i;
            if (l.listed >= 8) measure_listed(s, &l);
        }
    }
    if (l.listed && !s->done) measure_listed(s, &l);
}

/* Bounds boxes in double, and those beside a large box by the float bounds near2 too. */
static void bound_far_children(const fct_placed_box *b, const fct_pair_node *n, const fct_space_map *space,
                               bool large, const float near2[8], double bound2[8], float guess[8]) {
    double bound[8];
    fct_bound_far_boxes(b, n, space, bound);
    for (int i = 0; i < 8; ++i) {
        if (large && near2[i] > 0) bound[i] = fct_max(bound[i], sqrt((double)near2[i]));
        bound2[i] = bound[i] > 0 ? bound[i] * bound[i] : 0;
        guess[i] = (float)(bound[i] - bound[0]); /* a float of the bound itself would lose the difference */
    }
}

static bool is_large(const fct_placed_box *b, double away) {
    return away <= FAR_RATIO * (double)(b->half[0] + b->half[1] + b->half[2]) && away <= FLOAT_CENTER;
}

/* Opens the node of the larger box. Writes its near boxes with the other box; the last one seems to be the
 * nearest. Returns their number. */
static uint32_t open_node(distance_search *s, near_boxes pair, near_boxes out[8]) {
    const fct_bvh *a = s->map->a, *b = s->map->b;
    bool opens_a = fct_opens_a(s->map, pair.a, pair.b);
    const fct_bvh *own = opens_a ? a : b, *other = opens_a ? b : a;
    const fct_space_map *space = opens_a ? &s->map->to_a : &s->map->to_b;
    uint32_t number = fct_box_child(own, opens_a ? pair.a : pair.b), met = 0xff, count = 0, nearest = 0;
    const fct_pair_node *node = &own->pairs[number];
    fct_placed_box *box = opens_a ? &s->placed_a : &s->placed_b;
    double bound2[8], reach2 = s->reach * s->reach, to_a = opens_a ? 1 : s->to_limit_b;
    float near2[8], guess[8];
    place_box(space, other, opens_a ? pair.b : pair.a, box);
    const double *c = box->exact_center;
    double away = fabs(c[0]) + fabs(c[1]) + fabs(c[2]);
    bool far = away > FAR_CENTER, large = far && is_large(box, away);
    if (!far || large)
        met = bound_boxes(box, node, to_a > 0 ? (float)fct_min(reach2 / to_a * (1 + 0x1p-20), 1e36) : 1e36f,
                          near2, guess);
    if (far) bound_far_children(box, node, space, large, near2, bound2, guess);
    ++s->visits.nodes, s->visits.boxes += 8;
    float least = INFINITY;
    for (; met; met &= met - 1) {
        uint32_t i = (uint32_t)__builtin_ctz(met), child = number << 3 | i;
        double bound = fct_max((far ? bound2[i] : (double)near2[i]) * to_a, pair.bound2);
        if (node->child[i] == FCT_NONE || bound > reach2) continue;
        if (guess[i] < least) least = guess[i], nearest = count;
        out[count++] = opens_a ? (near_boxes){child, pair.b, bound} : (near_boxes){pair.a, child, bound};
    }
    if (count) {
        near_boxes last = out[count - 1];
        out[count - 1] = out[nearest], out[nearest] = last;
    }
    return count;
}

/* Depth first. (Sorting all children saves no visits and costs 3 % of the instructions.) */
static void search_below(distance_search *s, near_boxes from) {
    near_boxes stack[FCT_PAIR_STACK];
    uint32_t height = 1;
    stack[0] = from;
    while (height && !s->done) {
        near_boxes pair = stack[--height];
        if (pair.bound2 > s->reach * s->reach) continue;
        if (fct_box_is_leaf(s->map->a, pair.a) && fct_box_is_leaf(s->map->b, pair.b))
            search_leaves(s, pair.a, pair.b);
        else
            height += open_node(s, pair, stack + height);
    }
}

static bool is_farther(const void *queue, size_t i, size_t j) {
    const near_boxes *q = queue;
    return q[i].bound2 > q[j].bound2;
}

static void swap_boxes(void *queue, size_t i, size_t j) {
    near_boxes *q = queue, boxes = q[i];
    q[i] = q[j], q[j] = boxes;
}

/* Goes from a pair of boxes down to a pair of leaves, each time to the pair that seems the nearest. The
 * others wait in the queue. */
static void dive(distance_search *s, near_boxes pair) {
    near_boxes below[8];
    while (!fct_box_is_leaf(s->map->a, pair.a) || !fct_box_is_leaf(s->map->b, pair.b)) {
        if (s->queued + 7 > QUEUE) {
            search_below(s, pair);
            return;
        }
        uint32_t count = open_node(s, pair, below);
        if (!count) return;
        pair = below[count - 1];
        for (uint32_t i = 0; i + 1 < count; ++i) {
            s->queue[s->queued] = below[i];
            fct_sift_up(s->queue, s->queued++, is_farther, swap_boxes);
        }
    }
    search_leaves(s, pair.a, pair.b);
}

static void search_nodes(distance_search *s) {
    dive(s, (near_boxes){0, 0, 0});
    while (s->queued && !s->done) {
        near_boxes pair = s->queue[0];
        if (pair.bound2 > s->reach * s->reach) break;
        s->queue[0] = s->queue[--s->queued];
        fct_sift_down(s->queue, 0, s->queued, is_farther, swap_boxes);
        dive(s, pair);
    }
}

void fct_distance_search(const fct_pair_map *map, double relative, double absolute, double enough,
                         fct_near_pair *best, fct_visits *visits) {
    distance_search s; /* not cleared, because of its size */
    s.map = map, s.relative = relative, s.absolute = absolute, s.enough = enough, s.best = *best;
    s.waiting = s.queued = 0, s.visits = (fct_visits){0, 0, 0};
    double shrink2 = 1 - map->to_a.skew;
    s.to_limit_b = shrink2 > 0 ? map->to_a.factor * map->to_a.factor * shrink2 * (1 - 0x1p-40) : 0;
    s.way[0] = s.way[1] = s.way[2] = 0;
    s.placed_a.box = s.placed_b.box = FCT_NONE;
    s.maximum = sqrt(best->distance2) * map->a->scale;
    s.upper = best->place_a != FCT_NONE ? s.maximum : INFINITY;
    set_limit(&s);
    search_nodes(&s);
    settle_candidates(&s);
    fct_visits_add(visits, &s.visits);
    *best = s.best;
}
