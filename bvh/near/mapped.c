/* bvh/near/mapped.c: the nearest point of a model under an affine map. A kernel file.
 *
 * The search is that of nearest.c, in a space where the point is the origin and a position y of the model,
 * relative to the point, is at `rows` y (mapped.h). Its axes are the principal axes of the map.
 *
 *   1. A box around a box there bounds the distance. It is exact for axis boxes if the map scales along the
 *      axes of the model, and tight in the direction of the largest stretch under any map.
 *   2. Triangles are measured by measure.h after their vertices have moved there.
 *   3. Triangles within reach are mapped and measured in double at once.
 */
#include "bvh/near/mapped.h"

#include "base/math/simd.h"
#include "bvh/near/descend.h"
#include "bvh/near/triangle.h"

/* A farther point moves towards the centre of the model, to half of this distance: so it comes nearer to the
 * whole model, whose radius there is below 4. */
static const double FARTHEST = 1e9;
/* Times the rows and the farthest position: the error of step 2. Beyond measure.h's 32 u, 5 u for the
 * products with the rows, and the rounding of the rows. */
#define MAPPED_MARGIN (1.5 * FCT_MEASURE_MARGIN)
/* Times the same lengths: the error of step 1 for oriented boxes, whose maps round more (model.h). */
#define ORIENTED_MARGIN 0x1p-17

typedef struct mapped_at {
    float at[3], centered[3]; /* the scaled point, and relative to the centre */
    float row[3][3];
    float oriented_slack[3]; /* per row */
    double margin;           /* error of all bounds but those of oriented boxes */
} mapped_at;

static mapped_at place_point(const fct_bvh *bvh, const fct_mapped_frame *frame, v3 scaled) {
    mapped_at a;
    v3 center = v3_load(bvh->center), from = v3_sub(scaled, center), there, far;
    const float *rows = frame->rows;
    there = v3_make(v3_dot(v3_load(rows), from), v3_dot(v3_load(rows + 3), from),
                    v3_dot(v3_load(rows + 6), from));
    double distance = v3_norm(there);
    if (distance > FARTHEST) scaled = v3_mad(center, .5 * FARTHEST / distance, from);
    v3_store(a.at, scaled);
    v3 at = v3_load(a.at), rounding = v3_sub(at, scaled);
    v3_store(a.centered, v3_sub(at, center));
    far = v3_make(fct_max(fabs(bvh->lower[0] - at.x), fabs(bvh->upper[0] - at.x)),
                  fct_max(fabs(bvh->lower[1] - at.y), fabs(bvh->upper[1] - at.y)),
                  fct_max(fabs(bvh->lower[2] - at.z), fabs(bvh->upper[2] - at.z)));
    far = v3_add(v3_scale(far, MAPPED_MARGIN), v3_make(fabs(rounding.x), fabs(rounding.y), fabs(rounding.z)));
    double error2 = 0;
    for (int i = 0; i < 3; ++i) {
        v3 row = v3_load(rows + 3 * i), size = v3_make(fabs(row.x), fabs(row.y), fabs(row.z));
        double error = v3_dot(size, far);
        error2 += error * error;
        a.oriented_slack[i] = (float)(ORIENTED_MARGIN / MAPPED_MARGIN * v3_norm(row) * v3_norm(far));
        v3_store(a.row[i], row);
    }
    a.margin = sqrt(error2);
    return a;
}

/* Squared lower bounds of the distances of eight axis boxes. */
static inline f8 bound_axis_boxes(const fct_axis_node *node, const mapped_at *a) {
    f8 zero = f8_set(0), sum = zero, half = f8_set(.5f), middle[3], reach[3];
    for (int k = 0; k < 3; ++k) {
        f8 p = f8_set(a->at[k]);
        f8 low = f8_sub(f8_load(node->bounds[k][0]), p), high = f8_sub(f8_load(node->bounds[k][1]), p);
        middle[k] = f8_mul(f8_add(low, high), half), reach[k] = f8_mul(f8_sub(high, low), half);
    }
    for (int i = 0; i < 3; ++i) {
        f8 x = f8_set(a->row[i][0]), y = f8_set(a->row[i][1]), z = f8_set(a->row[i][2]);
        f8 from = f8_add(f8_add(f8_mul(x, middle[0]), f8_mul(y, middle[1])), f8_mul(z, middle[2]));
        f8 size = f8_add(f8_add(f8_mul(f8_abs(x), reach[0]), f8_mul(f8_abs(y), reach[1])),
                         f8_mul(f8_abs(z), reach[2]));
        f8 out = f8_max(f8_sub(f8_abs(from), size), zero);
        sum = f8_add(sum, f8_mul(out, out));
    }
    return sum;
}

/* The same for oriented boxes. A row m of a map is an axis of the box over its half extent, so the axis times
 * the half extent is m / |m|^2, and the centre of the box is q times that away from a point mapped to q. */
static inline f8 bound_oriented_boxes(const fct_oriented_node *node, const mapped_at *a) {
    f8 zero = f8_set(0), sum = zero, from[3] = {zero, zero, zero}, size[3] = {zero, zero, zero};
    f8 x = f8_set(a->centered[0]), y = f8_set(a->centered[1]), z = f8_set(a->centered[2]);
    for (int k = 0; k < 3; ++k) {
        f8 mx = f8_load(node->map[k][0]), my = f8_load(node->map[k][1]), mz = f8_load(node->map[k][2]);
        f8 q = f8_add(f8_add(f8_mul(mx, x), f8_mul(my, y)), f8_add(f8_mul(mz, z), f8_load(node->map[k][3])));
        f8 row2 = f8_add(f8_add(f8_mul(mx, mx), f8_mul(my, my)), f8_mul(mz, mz));
        f8 length2 = f8_div(f8_set(1), f8_max(row2, f8_set(1e-30f)));
        for (int i = 0; i < 3; ++i) {
            f8 along =
                f8_mul(f8_add(f8_add(f8_mul(mx, f8_set(a->row[i][0])), f8_mul(my, f8_set(a->row[i][1]))),
                              f8_mul(mz, f8_set(a->row[i][2]))),
                       length2);
            from[i] = f8_add(from[i], f8_mul(along, q));
            size[i] = f8_add(size[i], f8_abs(along));
        }
    }
    for (int i = 0; i < 3; ++i) {
        f8 slack = f8_set(a->oriented_slack[i]);
        f8 out = f8_max(f8_sub(f8_sub(f8_abs(from[i]), size[i]), slack), zero);
        sum = f8_add(sum, f8_mul(out, out));
    }
    return sum;
}

static inline uint32_t bound_children(const fct_bvh *bvh, uint32_t ref, const void *user, float limit2,
                                      float distance2[8], const uint32_t **child) {
    uint32_t present;
    const void *node = fct_bvh_node(bvh, ref);
    *child = fct_bvh_children(bvh, ref, &present);
    f8 bound = ref & FCT_REF_ORIENTED ? bound_oriented_boxes(node, user) : bound_axis_boxes(node, user);
    f8_store(distance2, bound);
    return f8_le(bound, f8_set(limit2)) & present;
}

typedef struct search {
    const fct_bvh *bvh;
    const fct_map *map;
    v3 point;
    mapped_at at;
    double unit;  /* of the search, per unit of distance */
    double bound; /* the distance of the answer is at most this, or there is no answer */
    float limit2; /* boxes and triangles beyond this squared bound hold no better point */
    fct_mapped_near best;
    fct_visits visits;
} search;

static void set_bound(search *s, double bound) {
    double limit = bound * s->unit * (1 + 1e-6) + s->at.margin;
    s->bound = bound;
    s->limit2 = bound < INFINITY ? (float)fct_min(limit * limit * 1.0001, 3e38) : INFINITY;
}

/* A position of the model in scaled space, mapped. */
static v3 map_position(const search *s, v3 scaled) {
    v3 p = fct_bvh_from_scaled(s->bvh, scaled);
    double x[3];
    for (int i = 0; i < 3; ++i) {
        const float *m = s->map->forward + 4 * i;
        x[i] = m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3];
    }
    return v3_make(x[0], x[1], x[2]);
}

static void measure_triangle(search *s, const fct_leaf *leaf, uint32_t number) {
    v3 p[3];
    double u, v;
    fct_leaf_triangle(leaf, number, p);
    for (int c = 0; c < 3; ++c) p[c] = map_position(s, p[c]);
    v3 q = fct_triangle_closest(s->point, p[0], p[1], p[2], &u, &v);
    double distance = v3_norm(v3_sub(q, s->point));
    uint32_t place = fct_leaf_place(s->bvh, leaf, number);
    const uint32_t *ids = s->bvh->view.face_ids;
    ++s->visits.triangles;
    if (!(distance <= s->best.distance)) return;
    if (distance == s->best.distance && s->best.place != FCT_NONE && ids[place] > ids[s->best.place]) return;
    s->best = (fct_mapped_near){.point = q, .distance = distance, .u = u, .v = v, .place = place};
    if (distance < s->bound) set_bound(s, distance);
}

/* Moves the vertices of a leaf to the space of the search. */
static inline void load_vertices(const fct_leaf *leaf, const mapped_at *a, fct_near_vertices *out) {
    const float *rows = fct_leaf_vertices(leaf);
    uint32_t stride = 8u * leaf->vertex_octets;
    for (uint32_t i = 0; i < leaf->vertex_octets; ++i) {
        f8 x = f8_sub(f8_load(rows + 8 * i), f8_set(a->at[0]));
        f8 y = f8_sub(f8_load(rows + stride + 8 * i), f8_set(a->at[1]));
        f8 z = f8_sub(f8_load(rows + 2 * stride + 8 * i), f8_set(a->at[2]));
        f8 *to[3] = {&out->x[i], &out->y[i], &out->z[i]};
        for (int k = 0; k < 3; ++k)
            *to[k] = f8_add(f8_add(f8_mul(f8_set(a->row[k][0]), x), f8_mul(f8_set(a->row[k][1]), y)),
                            f8_mul(f8_set(a->row[k][2]), z));
    }
}

/* Takes the least upper bound of triangles whose bit is set. */
static void shrink_bound(search *s, f8 upper2, uint32_t lanes) {
    float d2[8], least = s->limit2;
    f8_store(d2, upper2);
    for (; lanes; lanes &= lanes - 1) {
        float lane2 = d2[__builtin_ctz(lanes)];
        if (lane2 < least) least = lane2;
    }
    double bound = (sqrt((double)least) + s->at.margin) / s->unit;
    if (bound < s->bound) set_bound(s, bound);
}

static void search_leaf(void *user, uint32_t ref) {
    search *s = user;
    const fct_leaf *leaf = fct_bvh_leaf(s->bvh, ref);
    fct_near_vertices vertices;
    load_vertices(leaf, &s->at, &vertices);
    if (!fct_leaf_within(&vertices, leaf->vertex_octets, s->limit2)) return;
    const uint8_t *corners = fct_leaf_corners(leaf);
    for (uint32_t first = 0; first < leaf->count; first += 8, corners += 24) {
        fct_eight_near near = fct_measure_triangles(&vertices, leaf->vertex_octets, corners);
        uint32_t left = leaf->count - first, lanes = left < 8 ? (1u << left) - 1 : 0xffu;
        shrink_bound(s, near.upper2, lanes);
        for (lanes &= fct_triangles_within(&near, s->limit2); lanes; lanes &= lanes - 1)
            measure_triangle(s, leaf, first + (uint32_t)__builtin_ctz(lanes));
    }
}

bool fct_mapped_search(const fct_bvh *bvh, const fct_map *map, v3 point, double max_distance,
                       fct_mapped_near *out, fct_visits *visits) {
    if (bvh->embree) return false;
    const double *m = map->backward;
    v3 model = v3_make(m[0] * point.x + m[1] * point.y + m[2] * point.z + m[3],
                       m[4] * point.x + m[5] * point.y + m[6] * point.z + m[7],
                       m[8] * point.x + m[9] * point.y + m[10] * point.z + m[11]);
    search s = {.bvh = bvh, .map = map, .point = point, .unit = map->frame->unit * bvh->scale};
    s.at = place_point(bvh, map->frame, fct_bvh_to_scaled(bvh, model));
    s.best.distance = max_distance, s.best.place = FCT_NONE;
    set_bound(&s, max_distance);
    fct_descend(bvh, bound_children, &s.at, &s.limit2, search_leaf, &s, &s.visits);
    fct_visits_add(visits, &s.visits);
    if (s.best.place != FCT_NONE) *out = s.best;
    return s.best.place != FCT_NONE;
}
