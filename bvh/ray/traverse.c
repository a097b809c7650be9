/* bvh/ray/traverse.c: closest hit and any hit through nodes of eight children. A kernel file.
 *
 * The traversal enters the nearest child first and keeps the others on a stack, sorted by entry distance.
 *
 * Triangles: Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection", JCGT 2013. The test subtracts the
 * ray's origin from the vertices and shears them, so that the ray becomes the z axis. The signs of three edge
 * functions decide. Two faces compute the function of their shared edge from the same numbers, so no ray
 * passes between them. This needs products that are rounded separately: a fused multiply-add would break it.
 * An edge function that is zero in float is computed again in double, where it is exact.
 */
#include "bvh/ray/traverse.h"

#include "base/math/simd.h"
#include "bvh/entry.h"

/* Rays of a batch that go on in turns. While one waits for memory, the others compute. */
enum { LANES = 8 };

/* Receives all hits. */
typedef struct hit_visitor {
    const fct_ray *ray; /* the caller's */
    fct_visit_hit *visit;
    void *user;
} hit_visitor;

typedef struct traversal {
    const fct_bvh *bvh;
    const fct_prepared_ray *ray;
    const hit_visitor *all; /* NULL unless all hits are wanted; then hit.t stays t_max */
    fct_raw_hit hit;        /* the closest so far; hit.t is ray->t_max before the first */
    const fct_leaf *leaf;   /* of the hit */
    uint32_t number;        /* of the hit triangle in its leaf */
    double weight[3];       /* of the hit: those of corners 1 and 2, and the sum of all three */
    fct_visits visits;
} traversal;

/* The ray's coordinates, each in eight lanes. */
typedef struct wide_ray {
    f8 origin[3], inverse[3];
    f8 centered[3], direction[3]; /* the origin relative to the model's centre */
    uint32_t entry[3];            /* per axis, where the bounds begin at which the ray enters a slab */
} wide_ray;

static inline wide_ray widen_ray(const fct_bvh *bvh, const fct_prepared_ray *r) {
    wide_ray w;
    for (uint32_t k = 0; k < 3; ++k) {
        w.origin[k] = f8_set(r->origin[k]), w.inverse[k] = f8_set(r->inverse[k]);
        w.centered[k] = f8_set(r->origin[k] - bvh->center[k]), w.direction[k] = f8_set(r->direction[k]);
        w.entry[k] = 16 * k + 8 * r->side[k];
    }
    return w;
}

/* Tests eight axis boxes. Returns a mask of the boxes that the ray meets within [t_min, t_max]; enter[i] is
 * the entry distance of box i. */
static inline uint32_t meet_axis_boxes(const fct_axis_node *node, const wide_ray *r, float t_min, float t_max,
                                       float enter[8]) {
    f8 first = f8_set(t_min), last = f8_set(t_max);
    const float *bounds = node->bounds[0][0];
    for (int k = 0; k < 3; ++k) {
        f8 a = f8_mul(f8_sub(f8_load(bounds + r->entry[k]), r->origin[k]), r->inverse[k]);
        f8 b = f8_mul(f8_sub(f8_load(bounds + (r->entry[k] ^ 8)), r->origin[k]), r->inverse[k]);
        first = f8_max(a, first);
        last = f8_min(b, last);
    }
    f8_store(enter, first);
    return f8_le(first, last) & node->present;
}

/* The same with eight oriented boxes: map i takes box i to [-1, 1]^3. */
static inline uint32_t meet_oriented_boxes(const fct_oriented_node *node, const wide_ray *r, float t_min,
                                           float t_max, float enter[8]) {
    f8 first = f8_set(t_min), last = f8_set(t_max);
    for (int k = 0; k < 3; ++k) {
        f8 mx = f8_load(node->map[k][0]), my = f8_load(node->map[k][1]), mz = f8_load(node->map[k][2]);
        f8 at = f8_add(f8_add(f8_mul(mx, r->centered[0]), f8_mul(my, r->centered[1])),
                       f8_add(f8_mul(mz, r->centered[2]), f8_load(node->map[k][3])));
        f8 go = f8_add(f8_add(f8_mul(mx, r->direction[0]), f8_mul(my, r->direction[1])),
                       f8_mul(mz, r->direction[2]));
        /* A component below 1e-18 moves the ray by less than the padding of the box. */
        f8 inverse = f8_div(f8_set(1), f8_copysign(f8_max(f8_abs(go), f8_set(1e-18f)), go));
        f8 middle = f8_sub(f8_set(0), f8_mul(at, inverse)), half = f8_abs(inverse);
        first = f8_max(f8_sub(middle, half), first);
        last = f8_min(f8_add(middle, half), last);
    }
    f8_store(enter, first);
    return f8_le(first, last) & node->present;
}

/* The vertices of a leaf after translation and shear: x, y, z of the first eight, then of the others. */
typedef struct sheared {
    f8 x[2], y[2], z[2];
} sheared;

static inline void shear_vertices(const fct_leaf *leaf, const fct_prepared_ray *r, uint32_t octets,
                                  sheared *s) {
    const float *rows = fct_leaf_vertices(leaf);
    uint32_t stride = 8 * octets;
    f8 ox = f8_set(r->origin[r->axis[0]]), oy = f8_set(r->origin[r->axis[1]]),
       oz = f8_set(r->origin[r->axis[2]]);
    f8 sx = f8_set(r->shear[0]), sy = f8_set(r->shear[1]), sz = f8_set(r->shear[2]);
    for (uint32_t i = 0; i < octets; ++i) {
        const float *at = rows + 8 * i;
        f8 z = f8_sub(f8_load(at + r->axis[2] * stride), oz);
        s->x[i] = f8_sub(f8_sub(f8_load(at + r->axis[0] * stride), ox), f8_mul(sx, z));
        s->y[i] = f8_sub(f8_sub(f8_load(at + r->axis[1] * stride), oy), f8_mul(sy, z));
        s->z[i] = f8_mul(sz, z);
    }
}

/* One coordinate of the corners with these indices. */
static inline f8 pick_corners(const f8 vertices[2], i8 index, uint32_t octets) {
    return octets == 2 ? f8_lookup16(vertices[0], vertices[1], index) : f8_lookup8(vertices[0], index);
}

/* Barycentric weights, not normalised, and sheared z of a triangle's corners. */
typedef struct weights {
    double w[3], z[3];
} weights;

/* Weights of the point of the triangle's three sides that is nearest to the ray, at x = y = 0. */
static void rim_weights(const double x[3], const double y[3], double w[3]) {
    double nearest2 = INFINITY;
    for (int i = 0; i < 3; ++i) {
        int j = (i + 1) % 3;
        double ex = x[j] - x[i], ey = y[j] - y[i], length2 = ex * ex + ey * ey;
        double s = length2 > 0 ? -(x[i] * ex + y[i] * ey) / length2 : 0;
        s = s < 0 ? 0 : s > 1 ? 1 : s;
        double qx = x[i] + s * ex, qy = y[i] + s * ey, distance2 = qx * qx + qy * qy;
        if (distance2 >= nearest2) continue;
        nearest2 = distance2;
        w[i] = 1 - s, w[j] = s, w[(i + 2) % 3] = 0;
    }
}

/* Computes the weights again in double. The float test has decided that the ray hits, but on a triangle seen
 * almost edge-on its weights are inaccurate. If the signs differ in double, the ray misses the triangle by
 * less than float rounding, and the hit is the nearest point of its sides. */
static void refine_weights(const fct_leaf *leaf, uint32_t number, const fct_prepared_ray *r, weights *out) {
    const float *rows = fct_leaf_vertices(leaf);
    const uint8_t *corners = fct_leaf_corners(leaf) + 24 * (number / 8) + number % 8;
    uint32_t stride = 8u * leaf->vertex_octets;
    double sz = 1 / (double)r->direction[r->axis[2]], sx = (double)r->direction[r->axis[0]] * sz,
           sy = (double)r->direction[r->axis[1]] * sz, x[3], y[3], z[3], w[3];
    for (int c = 0; c < 3; ++c) {
        const float *at = rows + corners[8 * c];
        double along = (double)at[r->axis[2] * stride] - (double)r->origin[r->axis[2]];
        x[c] = (double)at[r->axis[0] * stride] - (double)r->origin[r->axis[0]] - sx * along;
        y[c] = (double)at[r->axis[1] * stride] - (double)r->origin[r->axis[1]] - sy * along;
        z[c] = sz * along;
    }
    for (int c = 0; c < 3; ++c) {
        int i = (c + 1) % 3, j = (c + 2) % 3;
        w[c] = x[j] * y[i] - y[j] * x[i];
    }
    bool negative = w[0] < 0 || w[1] < 0 || w[2]<0, positive = w[0]> 0 || w[1] > 0 || w[2] > 0;
    if (negative == positive) rim_weights(x, y, w);
    for (int c = 0; c < 3; ++c) out->w[c] = w[c], out->z[c] = z[c];
}

static inline float measure_spread(float a, float b, float c) {
    float low = a < b ? a : b, high = a < b ? b : a;
    low = c < low ? c : low, high = c > high ? c : high;
    return high - low;
}

/* Eight triangles: the sheared corners a, b, c and the edge functions opposite to them. */
typedef struct octet {
    float x[3][8], y[3][8], z[3][8], w[3][8];
} octet;

/* Whether the ray sees triangle i almost edge-on, so that a rounding error across the ray moves the hit much
 * farther along the ray. `det` is twice the area that the ray sees. */
static inline bool is_seen_edge_on(const octet *o, uint32_t i, double det) {
    float dx = measure_spread(o->x[0][i], o->x[1][i], o->x[2][i]);
    float dy = measure_spread(o->y[0][i], o->y[1][i], o->y[2][i]);
    float dz = measure_spread(o->z[0][i], o->z[1][i], o->z[2][i]);
    double wide = (double)(dx > dy ? dx : dy), deep = (double)dz;
    return 4 * fabs(det) < wide * (deep > wide ? deep : wide);
}

/* The edge functions again, in double, where they are exact. */
static void compute_exact_weights(const octet *o, uint32_t i, double w[3]) {
    for (int c = 0; c < 3; ++c) {
        int j = (c + 1) % 3, k = (c + 2) % 3;
        w[c] = (double)o->x[k][i] * (double)o->y[j][i] - (double)o->y[k][i] * (double)o->x[j][i];
    }
}

/* Tests triangle i of an octet, which is triangle `number` of the leaf and which the eight-wide test has not
 * rejected. Records a hit that is nearer, or as near with a lower face id. */
static inline bool test_triangle(traversal *t, const fct_leaf *leaf, uint32_t number, const octet *o,
                                 uint32_t i) {
    weights s;
    for (int c = 0; c < 3; ++c) s.w[c] = (double)o->w[c][i], s.z[c] = (double)o->z[c][i];
    if (s.w[0] == 0 || s.w[1] == 0 || s.w[2] == 0) {
        compute_exact_weights(o, i, s.w);
        if ((s.w[0] < 0 || s.w[1] < 0 || s.w[2] < 0) && (s.w[0] > 0 || s.w[1] > 0 || s.w[2] > 0))
            return false;
    }
    double det = s.w[0] + s.w[1] + s.w[2];
    if (det == 0) return false;
    if (is_seen_edge_on(o, i, det)) {
        refine_weights(leaf, number, t->ray, &s);
        det = s.w[0] + s.w[1] + s.w[2];
    }
    float at = (float)((s.w[0] * s.z[0] + s.w[1] * s.z[1] + s.w[2] * s.z[2]) / det);
    if (!(at >= t->ray->t_min && at <= t->hit.t)) return false;
    uint32_t place = fct_leaf_place(t->bvh, leaf, number);
    const uint32_t *ids = t->bvh->view.face_ids;
    if (t->ray->except != FCT_NONE && ids[place] == t->ray->except) return false;
    if (t->all) {
        fct_hit hit = {.t = fct_ray_clamp_t(t->all->ray, fct_ray_unscale_t(t->ray, at)),
                       .u = (float)(s.w[1] / det),
                       .v = (float)(s.w[2] / det),
                       .face = ids[place],
                       .place = place};
        t->all->visit(t->all->user, &hit);
        return false;
    }
    if (at == t->hit.t && t->hit.place != FCT_NONE && ids[place] > ids[t->hit.place]) return false;
    __builtin_prefetch(ids + place); /* query.c reads it when the traversal ends */
    t->hit.t = at, t->hit.place = place;
    t->leaf = leaf, t->number = number;
    t->weight[0] = s.w[1], t->weight[1] = s.w[2], t->weight[2] = det;
    return true;
}

/* Tests the triangles of a leaf of 8 or 16 vertices; returns whether t->hit has changed. With `any`, stops at
 * the first hit. */
static inline bool test_triangles(traversal *t, const fct_leaf *leaf, uint32_t octets, bool any) {
    sheared s;
    bool found = false;
    shear_vertices(leaf, t->ray, octets, &s);
    const uint8_t *corners = fct_leaf_corners(leaf);
    for (uint32_t first = 0; first < leaf->count; first += 8, corners += 24) {
        i8 a = i8_load_bytes(corners), b = i8_load_bytes(corners + 8), c = i8_load_bytes(corners + 16);
        f8 ax = pick_corners(s.x, a, octets), ay = pick_corners(s.y, a, octets);
        f8 bx = pick_corners(s.x, b, octets), by = pick_corners(s.y, b, octets);
        f8 cx = pick_corners(s.x, c, octets), cy = pick_corners(s.y, c, octets);
        f8 u = f8_sub(f8_mul(cx, by), f8_mul(cy, bx));
        f8 v = f8_sub(f8_mul(ax, cy), f8_mul(ay, cx));
        f8 w = f8_sub(f8_mul(bx, ay), f8_mul(by, ax));
        f8 zero = f8_set(0);
        uint32_t mixed = f8_lt(f8_min(u, f8_min(v, w)), zero) & f8_lt(zero, f8_max(u, f8_max(v, w)));
        uint32_t open = ((uint32_t)leaf->mask >> first) & 0xffu & ~mixed;
        if (!open) continue;
        octet o;
        f8_store(o.x[0], ax), f8_store(o.x[1], bx), f8_store(o.x[2], cx);
        f8_store(o.y[0], ay), f8_store(o.y[1], by), f8_store(o.y[2], cy);
        f8_store(o.z[0], pick_corners(s.z, a, octets));
        f8_store(o.z[1], pick_corners(s.z, b, octets));
        f8_store(o.z[2], pick_corners(s.z, c, octets));
        f8_store(o.w[0], u), f8_store(o.w[1], v), f8_store(o.w[2], w);
        for (; open; open &= open - 1) {
            uint32_t i = (uint32_t)__builtin_ctz(open);
            if (!test_triangle(t, leaf, first + i, &o, i)) continue;
            found = true;
            if (any) return true;
        }
    }
    return found;
}

static inline bool test_leaf(traversal *t, const fct_leaf *leaf, bool any) {
    t->visits.triangles += leaf->count;
    return leaf->vertex_octets == 2 ? test_triangles(t, leaf, 2, any) : test_triangles(t, leaf, 1, any);
}

/* Pushes all children in the mask but the nearest, sorted, and returns the nearest. The mask is not empty.
 * Most nodes have one or two such children. */
static inline uint64_t push_children(const fct_bvh *bvh, uint64_t *stack, uint32_t *height, uint32_t met,
                                     const float enter[8], const uint32_t child[8], bool in_turns) {
    uint32_t i = (uint32_t)__builtin_ctz(met);
    uint64_t nearest = fct_entry_make(enter[i], child[i]);
    if (!in_turns) fct_prefetch_child(bvh, child[i]);
    uint32_t base = *height;
    for (met &= met - 1; met; met &= met - 1) {
        i = (uint32_t)__builtin_ctz(met);
        uint64_t entry = fct_entry_make(enter[i], child[i]);
        if (!in_turns) fct_prefetch_child(bvh, child[i]);
        uint64_t waiting = entry < nearest ? nearest : entry;
        nearest = entry < nearest ? entry : nearest;
        uint32_t at = (*height)++;
        while (at > base && stack[at - 1] < waiting) stack[at] = stack[at - 1], --at;
        stack[at] = waiting;
    }
    return nearest;
}

/* Where a traversal stands: at an entry, with others waiting. */
typedef struct position {
    uint64_t entry;
    uint32_t height;
    uint64_t stack[FCT_STACK_SIZE];
} position;

static inline void enter_root(const traversal *t, position *at) {
    at->entry = fct_entry_make(t->ray->t_min, t->bvh->root), at->height = 0;
}

/* Visits the node or leaf of the current entry, and goes on to the next. Returns false at the end. */
static inline bool visit_next(traversal *t, const wide_ray *wide, position *at, bool any, bool in_turns) {
    const fct_bvh *bvh = t->bvh;
    const uint32_t ref = (uint32_t)at->entry;
    if (ref & FCT_REF_LEAF) {
        if (test_leaf(t, fct_bvh_leaf(bvh, ref), any) && any) return false;
    } else {
        float enter[8];
        const uint32_t *child;
        uint32_t met;
        ++t->visits.nodes;
        if (ref & FCT_REF_ORIENTED) {
            const fct_oriented_node *node = fct_bvh_node(bvh, ref);
            met = meet_oriented_boxes(node, wide, t->ray->t_min, t->hit.t, enter);
            child = node->child;
        } else {
            const fct_axis_node *node = fct_bvh_node(bvh, ref);
            met = meet_axis_boxes(node, wide, t->ray->t_min, t->hit.t, enter);
            child = node->child;
        }
        if (met) {
            at->entry = push_children(bvh, at->stack, &at->height, met, enter, child, in_turns);
            if (in_turns) fct_prefetch_all(bvh, (uint32_t)at->entry);
            return true;
        }
    }
    do {
        if (at->height == 0) return false;
        at->entry = at->stack[--at->height];
    } while (fct_entry_distance(at->entry) > t->hit.t);
    if (in_turns) fct_prefetch_all(bvh, (uint32_t)at->entry);
    return true;
}

static traversal begin_traversal(const fct_bvh *bvh, const fct_prepared_ray *ray) {
    return (traversal){
        .bvh = bvh, .ray = ray, .hit = {.t = ray->t_max, .place = FCT_NONE}, .visits = {0, 0, 0}};
}

static inline void traverse_nodes(traversal *t, bool any) {
    const wide_ray wide = widen_ray(t->bvh, t->ray);
    position at;
    enter_root(t, &at);
    while (visit_next(t, &wide, &at, any, false)) {
    }
}

static v3 cross_sides(const traversal *t) {
    v3 p[3];
    fct_leaf_triangle(t->leaf, t->number, p);
    return v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
}

/* The hit of a traversal that has ended. */
static fct_raw_hit describe_hit(const traversal *t) {
    fct_raw_hit hit = t->hit;
    if (hit.place == FCT_NONE) return hit;
    hit.u = (float)(t->weight[0] / t->weight[2]), hit.v = (float)(t->weight[1] / t->weight[2]);
    hit.normal = cross_sides(t);
    return hit;
}

static void add_visits(traversal *t, fct_visits *visits) {
    t->visits.boxes = 8 * t->visits.nodes;
    fct_visits_add(visits, &t->visits);
}

bool fct_traverse_closest(const fct_bvh *bvh, const fct_prepared_ray *ray, fct_raw_hit *hit,
                          fct_visits *visits) {
    traversal t = begin_traversal(bvh, ray);
    traverse_nodes(&t, false);
    *hit = describe_hit(&t);
    add_visits(&t, visits);
    return hit->place != FCT_NONE;
}

bool fct_traverse_any(const fct_bvh *bvh, const fct_prepared_ray *ray, fct_visits *visits) {
    traversal t = begin_traversal(bvh, ray);
    traverse_nodes(&t, true);
    add_visits(&t, visits);
    return t.hit.place != FCT_NONE;
}

/* A ray on its way. */
typedef struct lane {
    traversal t;
    wide_ray wide;
    position at;
} lane;

static inline void start_lane(lane *l, const fct_bvh *bvh, const fct_prepared_ray *ray) {
    l->t = begin_traversal(bvh, ray);
    l->wide = widen_ray(bvh, ray);
    enter_root(&l->t, &l->at);
}

static inline void traverse_many(const fct_bvh *bvh, size_t count, const fct_prepared_ray *rays,
                                 fct_raw_hit *hits, bool any) {
    lane lanes[LANES], *running[LANES];
    size_t next = 0, active = 0;
    for (; active < LANES && next < count; ++active) {
        running[active] = &lanes[active];
        start_lane(running[active], bvh, &rays[next++]);
    }
    while (active) {
        for (size_t i = 0; i < active; ++i) {
            lane *l = running[i];
            if (visit_next(&l->t, &l->wide, &l->at, any, true)) continue;
            hits[l->t.ray - rays] = any ? l->t.hit : describe_hit(&l->t);
            if (next < count)
                start_lane(l, bvh, &rays[next++]);
            else
                running[i] = running[--active];
        }
    }
}

void fct_traverse_many(const fct_bvh *bvh, size_t count, const fct_prepared_ray *rays, bool any,
                       fct_raw_hit *hits) {
    if (any)
        traverse_many(bvh, count, rays, hits, true);
    else
        traverse_many(bvh, count, rays, hits, false);
}

void fct_traverse_all(const fct_bvh *bvh, const fct_ray *caller, const fct_prepared_ray *ray,
                      fct_visit_hit *visit, void *user, fct_visits *visits) {
    const hit_visitor all = {caller, visit, user};
    traversal t = begin_traversal(bvh, ray);
    t.all = &all;
    traverse_nodes(&t, false);
    add_visits(&t, visits);
}
