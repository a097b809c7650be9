/* bvh/near/region/region.c: the faces that touch a ball or a convex region of half-spaces. A kernel file.
 *
 * The search carries a mask of the parts of the region's boundary that may cut a box: bit i for half-space i,
 * bit 0 for a ball. A box outside of one half-space is dropped. A box inside of one clears its bit; once the
 * mask is 0, the whole subtree belongs to the region and is not tested again. Boxes are tested in float with
 * a margin. Faces that float cannot decide are decided in double: by their distance from the centre of the
 * ball, or by clipping them against the half-spaces of the mask.
 */
#include "bvh/near/region/region.h"

#include "base/math/simd.h"
#include "bvh/near/measure.h"
#include "bvh/near/triangle.h"

/* More than float arithmetic errs on heights of boxes over a plane, in scaled units. */
#define HEIGHT_MARGIN 0x1p-15f

typedef struct region {
    const fct_bvh *bvh;
    fct_face_list *list;
    fct_visits visits;
    /* A ball. */
    v3 point; /* scaled */
    fct_at at;
    double radius2;
    float reach2, limit2; /* as in nearest.c */
    float inside2;        /* a box or triangle whose upper bound, squared, is less lies in the ball */
    /* Half-spaces, scaled. */
    uint32_t plane_count;
    fct_half_space half_spaces[FCT_BVH_PLANES];
    float planes[FCT_BVH_PLANES][4]; /* of unit normal; relative to the centre of the model */
} region;

/* The box of each child as centre and three half axes, in the form that both tests need. */
typedef struct eight_boxes {
    f8 center[3];  /* relative to the centre of the model */
    f8 axes[3][3]; /* half axes; axis, coordinate */
    uint32_t present;
    const uint32_t *child;
} eight_boxes;

static inline void load_axis_boxes(const fct_bvh *bvh, uint32_t ref, eight_boxes *out) {
    const fct_axis_node *node = fct_bvh_node(bvh, ref);
    f8 half = f8_set(.5f), zero = f8_set(0);
    for (int k = 0; k < 3; ++k) {
        f8 lower = f8_load(node->bounds[k][0]), upper = f8_load(node->bounds[k][1]);
        out->center[k] = f8_sub(f8_mul(half, f8_add(lower, upper)), f8_set(bvh->center[k]));
        for (int j = 0; j < 3; ++j) out->axes[k][j] = j == k ? f8_mul(half, f8_sub(upper, lower)) : zero;
    }
    out->present = node->present, out->child = node->child;
}

/* Row k of a map is axis k over its half extent: the half axis is row / |row|^2. */
static inline void load_oriented_boxes(const fct_bvh *bvh, uint32_t ref, eight_boxes *out) {
    const fct_oriented_node *node = fct_bvh_node(bvh, ref);
    f8 one = f8_set(1), zero = f8_set(0);
    for (int j = 0; j < 3; ++j) out->center[j] = zero;
    for (int k = 0; k < 3; ++k) {
        f8 m[3] = {f8_load(node->map[k][0]), f8_load(node->map[k][1]), f8_load(node->map[k][2])};
        f8 row2 = f8_add(f8_add(f8_mul(m[0], m[0]), f8_mul(m[1], m[1])), f8_mul(m[2], m[2]));
        f8 inverse = f8_div(one, f8_max(row2, f8_set(1e-30f))), offset = f8_load(node->map[k][3]);
        for (int j = 0; j < 3; ++j) {
            out->axes[k][j] = f8_mul(m[j], inverse);
            out->center[j] = f8_sub(out->center[j], f8_mul(offset, out->axes[k][j]));
        }
    }
    out->present = node->present, out->child = node->child;
}

static inline f8 dot_plane(const float plane[4], const f8 v[3]) {
    return f8_add(f8_add(f8_mul(f8_set(plane[0]), v[0]), f8_mul(f8_set(plane[1]), v[1])),
                  f8_mul(f8_set(plane[2]), v[2]));
}

/* Clears the bits of half-spaces that hold a child, and the bits of children that lie outside of one in
 * *open. masks[i]: the mask of child i. */
static inline void classify_by_planes(const region *r, const eight_boxes *boxes, uint32_t mask,
                                      uint32_t masks[8], uint32_t *open) {
    for (int i = 0; i < 8; ++i) masks[i] = mask;
    for (; mask; mask &= mask - 1) {
        uint32_t bit = (uint32_t)__builtin_ctz(mask);
        const float *plane = r->planes[bit];
        f8 height = f8_add(dot_plane(plane, boxes->center), f8_set(plane[3])), reach = f8_set(HEIGHT_MARGIN);
        for (int k = 0; k < 3; ++k) reach = f8_add(reach, f8_abs(dot_plane(plane, boxes->axes[k])));
        *open &= f8_le(f8_sub(f8_set(0), reach), height);
        for (uint32_t inside = f8_lt(reach, height) & 0xffu; inside; inside &= inside - 1)
            masks[__builtin_ctz(inside)] &= ~(1u << bit);
    }
}

/* The farthest corner of a box is at most |centre - point| + |a half diagonal| away. */
static inline void classify_by_ball(const region *r, const eight_boxes *boxes, uint32_t ref,
                                    uint32_t masks[8], uint32_t *open) {
    float nearest2[8], far2[8];
    const uint32_t *child;
    f8 beyond[3], far = f8_set(0);
    *open &= fct_measure_children(r->bvh, ref, &r->at, r->limit2, nearest2, &child);
    for (int j = 0; j < 3; ++j) {
        beyond[j] = f8_abs(f8_sub(boxes->center[j], f8_set(r->at.centered[j])));
        for (int k = 0; k < 3; ++k) beyond[j] = f8_add(beyond[j], f8_abs(boxes->axes[k][j]));
        far = f8_add(far, f8_mul(beyond[j], beyond[j]));
    }
    f8_store(far2, far);
    for (int i = 0; i < 8; ++i) masks[i] = far2[i] < r->inside2 ? 0 : 1;
}

static void add_face(region *r, const fct_leaf *leaf, uint32_t number) {
    fct_face_list_add(r->list, r->bvh->view.face_ids[fct_leaf_place(r->bvh, leaf, number)]);
}

static void add_leaf(region *r, const fct_leaf *leaf) {
    for (uint32_t i = 0; i < leaf->count; ++i) add_face(r, leaf, i);
}

static void add_leaf_in_planes(region *r, const fct_leaf *leaf, uint32_t mask) {
    for (uint32_t i = 0; i < leaf->count; ++i) {
        v3 p[3];
        fct_leaf_triangle(leaf, i, p);
        ++r->visits.triangles;
        if (fct_clip_touches(p, r->half_spaces, mask)) add_face(r, leaf, i);
    }
}

static bool is_in_ball(region *r, const fct_leaf *leaf, uint32_t number) {
    v3 p[3];
    double u, v;
    fct_leaf_triangle(leaf, number, p);
    ++r->visits.triangles;
    return v3_norm2(v3_sub(fct_triangle_closest(r->point, p[0], p[1], p[2], &u, &v), r->point)) <= r->radius2;
}

static void add_leaf_in_ball(region *r, const fct_leaf *leaf) {
    fct_near_vertices vertices;
    fct_near_vertices_load(leaf, &r->at, &vertices);
    const uint8_t *corners = fct_leaf_corners(leaf);
    for (uint32_t first = 0; first < leaf->count; first += 8, corners += 24) {
        fct_eight_near near = fct_measure_triangles(&vertices, leaf->vertex_octets, corners);
        uint32_t left = leaf->count - first, lanes = left < 8 ? (1u << left) - 1 : 0xffu;
        uint32_t inside = f8_lt(near.upper2, f8_set(r->inside2));
        for (lanes &= inside | fct_triangles_within(&near, r->reach2); lanes; lanes &= lanes - 1) {
            uint32_t i = (uint32_t)__builtin_ctz(lanes);
            if (inside >> i & 1 || is_in_ball(r, leaf, first + i)) add_face(r, leaf, first + i);
        }
    }
}

/* `whole` is the mask of the root. An entry of the stack is a mask above a reference. */
static void search_region(region *r, uint32_t whole) {
    bool ball = r->plane_count == 0;
    uint64_t stack[FCT_STACK_SIZE];
    uint32_t height = 1;
    stack[0] = (uint64_t)whole << 32 | r->bvh->root;
    while (height) {
        uint64_t entry = stack[--height];
        uint32_t ref = (uint32_t)entry, mask = (uint32_t)(entry >> 32), masks[8] = {0};
        if (ref & FCT_REF_LEAF) {
            const fct_leaf *leaf = fct_bvh_leaf(r->bvh, ref);
            if (!mask)
                add_leaf(r, leaf);
            else if (ball)
                add_leaf_in_ball(r, leaf);
            else
                add_leaf_in_planes(r, leaf, mask);
            continue;
        }
        eight_boxes boxes;
        ++r->visits.nodes;
        if (ref & FCT_REF_ORIENTED)
            load_oriented_boxes(r->bvh, ref, &boxes);
        else
            load_axis_boxes(r->bvh, ref, &boxes);
        uint32_t open = boxes.present;
        if (mask) r->visits.boxes += 8;
        if (mask && ball) classify_by_ball(r, &boxes, ref, masks, &open);
        if (mask && !ball) classify_by_planes(r, &boxes, mask, masks, &open);
        for (; open; open &= open - 1) {
            uint32_t i = (uint32_t)__builtin_ctz(open);
            stack[height++] = (uint64_t)masks[i] << 32 | boxes.child[i];
        }
    }
}

void fct_region_ball(const fct_bvh *bvh, v3 point, double radius, fct_face_list *list, fct_visits *visits) {
    region r = {.bvh = bvh, .list = list, .point = fct_bvh_to_scaled(bvh, point)};
    r.at = fct_at_make(bvh, r.point);
    double reach = radius * bvh->scale;
    r.radius2 = reach * reach;
    r.limit2 = fct_box_limit2(&r.at, reach);
    r.reach2 = fct_triangle_limit2(&r.at, reach);
    double inner = reach * (1 - 1e-6) - r.at.margin - r.at.rounding;
    /* Clamping makes upper bounds too small: then no box is inside, and double decides on each face. */
    bool clamped = v3_norm(v3_sub(r.point, v3_load(bvh->center))) > FCT_AT_CLAMP;
    r.inside2 = inner > 0 && !clamped ? (float)fct_min(inner * inner, 3e38) : 0;
    search_region(&r, 1);
    fct_visits_add(visits, &r.visits);
}

/* Scales a half-space: n.x + d = (n.(y + offset) + scale d) / scale for y = scale x - offset. The float form
 * is cut where it lies so far away that all of the model is on one side. */
static void scale_plane(region *r, uint32_t i, const fct_half_space *h) {
    const fct_bvh *bvh = r->bvh;
    fct_half_space scaled = {h->n, bvh->scale * h->d + v3_dot(h->n, v3_load(bvh->offset))};
    double length = v3_norm(h->n), height = (scaled.d + v3_dot(h->n, v3_load(bvh->center))) / length;
    r->half_spaces[i] = scaled;
    v3_store(r->planes[i], v3_scale(h->n, 1 / length));
    r->planes[i][3] = (float)fct_min(fct_max(height, -(double)FCT_REACH), (double)FCT_REACH);
}

void fct_region_planes(const fct_bvh *bvh, uint32_t count, const fct_half_space *half_spaces,
                       fct_face_list *list, fct_visits *visits) {
    region r;
    r.bvh = bvh, r.list = list, r.plane_count = count;
    r.visits = (fct_visits){0, 0, 0};
    for (uint32_t i = 0; i < count; ++i) scale_plane(&r, i, &half_spaces[i]);
    search_region(&r, (uint32_t)(((uint64_t)1 << count) - 1));
    fct_visits_add(visits, &r.visits);
}
