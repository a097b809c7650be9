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

#include "base/key.h"
#include "base/math/simd.h"

typedef struct traversal {
    const fct_bvh *bvh;
    const fct_prepared_ray *ray;
    fct_raw_hit hit;      /* the closest so far; hit.t is ray->t_max before the first */
    const fct_leaf *leaf; /* of the hit */
    uint32_t number;      /* of the hit triangle in its leaf */
    fct_visits visits;
} traversal;

/* Tests eight axis boxes. Returns a mask of the boxes that the ray meets within [t_min, t_max]; enter[i] is
 * the entry distance of box i. */
static inline uint32_t meet_axis_boxes(const fct_axis_node *node, const fct_prepared_ray *r, float t_max,
                                       float enter[8]) {
    f8 first = f8_set(r->t_min), last = f8_set(t_max);
    for (int k = 0; k < 3; ++k) {
        f8 origin = f8_set(r->origin[k]), inverse = f8_set(r->inverse[k]);
        f8 a = f8_mul(f8_sub(f8_load(node->bounds[k][r->side[k]]), origin), inverse);
        f8 b = f8_mul(f8_sub(f8_load(node->bounds[k][1 - r->side[k]]), origin), inverse);
        first = f8_max(a, first);
        last = f8_min(b, last);
    }
    f8_store(enter, first);
    return f8_le(first, last);
}

/* The same with eight oriented boxes: map i takes box i to [-1, 1]^3. `origin` is relative to the centre. */
static inline uint32_t meet_oriented_boxes(const fct_oriented_node *node, const fct_prepared_ray *r,
                                           const float origin[3], float t_max, float enter[8]) {
    f8 first = f8_set(r->t_min), last = f8_set(t_max);
    f8 ox = f8_set(origin[0]), oy = f8_set(origin[1]), oz = f8_set(origin[2]);
    f8 dx = f8_set(r->direction[0]), dy = f8_set(r->direction[1]), dz = f8_set(r->direction[2]);
    for (int k = 0; k < 3; ++k) {
        f8 mx = f8_load(node->map[k][0]), my = f8_load(node->map[k][1]), mz = f8_load(node->map[k][2]);
        f8 at =
            f8_add(f8_add(f8_mul(mx, ox), f8_mul(my, oy)), f8_add(f8_mul(mz, oz), f8_load(node->map[k][3])));
        f8 go = f8_add(f8_add(f8_mul(mx, dx), f8_mul(my, dy)), f8_mul(mz, dz));
        /* A component below 1e-18 moves the ray by less than the padding of the box. */
        f8 inverse = f8_div(f8_set(1), f8_copysign(f8_max(f8_abs(go), f8_set(1e-18f)), go));
        f8 middle = f8_sub(f8_set(0), f8_mul(at, inverse)), half = f8_abs(inverse);
        first = f8_max(f8_sub(middle, half), first);
        last = f8_min(f8_add(middle, half), last);
    }
    f8_store(enter, first);
    return f8_le(first, last);
}

/* The vertices of a leaf after translation and shear. A leaf of eight vertices fills both halves with them.
 */
typedef struct sheared {
    f8 x[2], y[2], z[2];
} sheared;

static inline void shear_vertices(const fct_leaf *leaf, const fct_prepared_ray *r, sheared *s) {
    const float *rows = fct_leaf_vertices(leaf);
    uint32_t stride = 8u * leaf->vertex_octets;
    f8 ox = f8_set(r->origin[r->axis[0]]), oy = f8_set(r->origin[r->axis[1]]),
       oz = f8_set(r->origin[r->axis[2]]);
    f8 sx = f8_set(r->shear[0]), sy = f8_set(r->shear[1]), sz = f8_set(r->shear[2]);
    for (uint32_t i = 0; i < 2; ++i) {
        const float *at = rows + (i && leaf->vertex_octets == 2 ? 8 : 0);
        f8 z = f8_sub(f8_load(at + r->axis[2] * stride), oz);
        s->x[i] = f8_sub(f8_sub(f8_load(at + r->axis[0] * stride), ox), f8_mul(sx, z));
        s->y[i] = f8_sub(f8_sub(f8_load(at + r->axis[1] * stride), oy), f8_mul(sy, z));
        s->z[i] = f8_mul(sz, z);
    }
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

static inline float measure_spread(const float x[3]) {
    float low = x[0] < x[1] ? x[0] : x[1], high = x[0] < x[1] ? x[1] : x[0];
    low = x[2] < low ? x[2] : low, high = x[2] > high ? x[2] : high;
    return high - low;
}

/* Whether the ray sees the triangle almost edge-on, so that a rounding error across the ray moves the hit
 * much farther along the ray. `det` is twice the area that the ray sees. */
static inline bool is_seen_edge_on(const float x[3], const float y[3], const float z[3], double det) {
    float dx = measure_spread(x), dy = measure_spread(y), dz = measure_spread(z);
    double wide = (double)(dx > dy ? dx : dy), deep = (double)dz;
    return 4 * fabs(det) < wide * (deep > wide ? deep : wide);
}

/* Tests one triangle that the eight-wide test has not rejected, and records a hit that is nearer, or as near
 * with a lower face id. x, y, z: its sheared corners. */
static inline bool test_triangle(traversal *t, const fct_leaf *leaf, uint32_t number, const float x[3],
                                 const float y[3], const float z[3]) {
    float u = x[2] * y[1] - y[2] * x[1], v = x[0] * y[2] - y[0] * x[2], w = x[1] * y[0] - y[1] * x[0];
    weights s = {{(double)u, (double)v, (double)w}, {(double)z[0], (double)z[1], (double)z[2]}};
    if (u == 0 || v == 0 || w == 0) {
        s.w[0] = (double)x[2] * (double)y[1] - (double)y[2] * (double)x[1];
        s.w[1] = (double)x[0] * (double)y[2] - (double)y[0] * (double)x[2];
        s.w[2] = (double)x[1] * (double)y[0] - (double)y[1] * (double)x[0];
    }
    if ((s.w[0] < 0 || s.w[1] < 0 || s.w[2] < 0) && (s.w[0] > 0 || s.w[1] > 0 || s.w[2] > 0)) return false;
    double det = s.w[0] + s.w[1] + s.w[2];
    if (det == 0) return false;
    if (is_seen_edge_on(x, y, z, det)) {
        refine_weights(leaf, number, t->ray, &s);
        det = s.w[0] + s.w[1] + s.w[2];
    }
    float at = (float)((s.w[0] * s.z[0] + s.w[1] * s.z[1] + s.w[2] * s.z[2]) / det);
    if (!(at >= t->ray->t_min && at <= t->hit.t)) return false;
    uint32_t place = leaf->first + number;
    const uint32_t *ids = t->bvh->view.face_ids;
    if (at == t->hit.t && t->hit.place != FCT_NONE && ids[place] > ids[t->hit.place]) return false;
    t->hit = (fct_raw_hit){.t = at, .u = (float)(s.w[1] / det), .v = (float)(s.w[2] / det), .place = place};
    t->leaf = leaf, t->number = number;
    return true;
}

/* Tests the triangles of a leaf; returns whether t->hit has changed. With `any`, stops at the first hit. */
static inline bool test_leaf(traversal *t, const fct_leaf *leaf, bool any) {
    sheared s;
    bool found = false;
    shear_vertices(leaf, t->ray, &s);
    const uint8_t *corners = fct_leaf_corners(leaf);
    t->visits.triangles += leaf->count;
    for (uint32_t first = 0; first < leaf->count; first += 8, corners += 24) {
        i8 a = i8_load_bytes(corners), b = i8_load_bytes(corners + 8), c = i8_load_bytes(corners + 16);
        f8 ax = f8_lookup16(s.x[0], s.x[1], a), ay = f8_lookup16(s.y[0], s.y[1], a);
        f8 bx = f8_lookup16(s.x[0], s.x[1], b), by = f8_lookup16(s.y[0], s.y[1], b);
        f8 cx = f8_lookup16(s.x[0], s.x[1], c), cy = f8_lookup16(s.y[0], s.y[1], c);
        f8 u = f8_sub(f8_mul(cx, by), f8_mul(cy, bx));
        f8 v = f8_sub(f8_mul(ax, cy), f8_mul(ay, cx));
        f8 w = f8_sub(f8_mul(bx, ay), f8_mul(by, ax));
        f8 zero = f8_set(0);
        uint32_t mixed = f8_lt(f8_min(u, f8_min(v, w)), zero) & f8_lt(zero, f8_max(u, f8_max(v, w)));
        uint32_t open = ((uint32_t)leaf->mask >> first) & 0xffu & ~mixed;
        if (!open) continue;
        float x[3][8], y[3][8], z[3][8];
        f8_store(x[0], ax), f8_store(x[1], bx), f8_store(x[2], cx);
        f8_store(y[0], ay), f8_store(y[1], by), f8_store(y[2], cy);
        f8_store(z[0], f8_lookup16(s.z[0], s.z[1], a));
        f8_store(z[1], f8_lookup16(s.z[0], s.z[1], b));
        f8_store(z[2], f8_lookup16(s.z[0], s.z[1], c));
        for (; open; open &= open - 1) {
            uint32_t i = (uint32_t)__builtin_ctz(open);
            float tx[3] = {x[0][i], x[1][i], x[2][i]}, ty[3] = {y[0][i], y[1][i], y[2][i]},
                  tz[3] = {z[0][i], z[1][i], z[2][i]};
            if (!test_triangle(t, leaf, first + i, tx, ty, tz)) continue;
            found = true;
            if (any) return true;
        }
    }
    return found;
}

/* A pending child: the bits of the entry distance, then the reference. The distance is not negative, so the
 * entries sort by distance. */
static inline uint64_t make_entry(float enter, uint32_t ref) {
    return (uint64_t)fct_float_bits(enter) << 32 | ref;
}

static inline float entry_distance(uint64_t entry) {
    return fct_float_of_bits((uint32_t)(entry >> 32));
}

/* Prefetches 256 bytes: an axis node, or the largest leaf. */
static inline void prefetch_child(const fct_bvh *bvh, uint32_t ref) {
    const char *at = ref & FCT_REF_LEAF ? (const char *)fct_bvh_leaf(bvh, ref) : fct_bvh_node(bvh, ref);
    __builtin_prefetch(at);
    __builtin_prefetch(at + 64);
    __builtin_prefetch(at + 128);
    __builtin_prefetch(at + 192);
}

/* Pushes the children in the mask, the nearest on top, and returns the new height of the stack. */
static inline uint32_t push_children(const fct_bvh *bvh, uint64_t *stack, uint32_t height, uint32_t met,
                                     const float enter[8], const uint32_t child[8]) {
    uint32_t base = height;
    for (; met; met &= met - 1) {
        uint32_t i = (uint32_t)__builtin_ctz(met);
        uint64_t entry = make_entry(enter[i], child[i]);
        prefetch_child(bvh, child[i]);
        uint32_t at = height++;
        while (at > base && stack[at - 1] < entry) stack[at] = stack[at - 1], --at;
        stack[at] = entry;
    }
    return height;
}

static inline bool traverse_nodes(traversal *t, bool any) {
    const fct_prepared_ray *r = t->ray;
    const fct_bvh *bvh = t->bvh;
    float centered[3];
    for (int k = 0; k < 3; ++k) centered[k] = r->origin[k] - bvh->center[k];
    uint64_t stack[FCT_STACK_SIZE];
    uint32_t height = 1;
    stack[0] = make_entry(r->t_min, bvh->root);
    bool found = false;
    while (height) {
        uint64_t entry = stack[--height];
        if (entry_distance(entry) > t->hit.t) continue;
        uint32_t ref = (uint32_t)entry;
        if (ref & FCT_REF_LEAF) {
            if (test_leaf(t, fct_bvh_leaf(bvh, ref), any)) {
                found = true;
                if (any) return true;
            }
            continue;
        }
        float enter[8];
        const uint32_t *child;
        uint32_t met;
        ++t->visits.nodes;
        t->visits.boxes += 8;
        if (ref & FCT_REF_ORIENTED) {
            const fct_oriented_node *node = fct_bvh_node(bvh, ref);
            met = meet_oriented_boxes(node, r, centered, t->hit.t, enter) & node->present;
            child = node->child;
        } else {
            const fct_axis_node *node = fct_bvh_node(bvh, ref);
            met = meet_axis_boxes(node, r, t->hit.t, enter) & node->present;
            child = node->child;
        }
        height = push_children(bvh, stack, height, met, enter, child);
    }
    return found;
}

static traversal begin_traversal(const fct_bvh *bvh, const fct_prepared_ray *ray) {
    return (traversal){
        .bvh = bvh, .ray = ray, .hit = {.t = ray->t_max, .place = FCT_NONE}, .visits = {0, 0, 0}};
}

static v3 cross_sides(const traversal *t) {
    v3 p[3];
    fct_leaf_triangle(t->leaf, t->number, p);
    return v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
}

bool fct_traverse_closest(const fct_bvh *bvh, const fct_prepared_ray *ray, fct_raw_hit *hit,
                          fct_visits *visits) {
    traversal t = begin_traversal(bvh, ray);
    bool found = traverse_nodes(&t, false);
    if (found) t.hit.normal = cross_sides(&t);
    *hit = t.hit;
    fct_visits_add(visits, &t.visits);
    return found;
}

bool fct_traverse_any(const fct_bvh *bvh, const fct_prepared_ray *ray, fct_visits *visits) {
    traversal t = begin_traversal(bvh, ray);
    bool found = traverse_nodes(&t, true);
    fct_visits_add(visits, &t.visits);
    return found;
}
