/* bvh/near/nearest.c: the nearest point of the surface. A kernel file.
 *
 * The search opens the nearest box first. It prunes boxes and triangles in float, with a margin, and measures
 * the remaining triangles in double, so the answer is exact up to double rounding. Equal distances: the lower
 * face id.
 */
#include "bvh/near/nearest.h"

#include "base/key.h"
#include "base/math/round.h"
#include "base/math/simd.h"
#include "bvh/near/triangle.h"

typedef struct search {
    const fct_bvh *bvh;
    v3 point;        /* scaled */
    float at[3];     /* the point in float, clamped to 10^9 around the centre */
    double rounding; /* at least the distance between `at` and the clamped point */
    double best2;    /* squared distance of the best face, or of the maximum distance */
    float limit2;    /* a box farther than this from `at`, squared, has no better face */
    double u, v;
    uint32_t place;
    fct_visits visits;
    /* If `normal` is set, best2 stays the maximum distance, and faces compete by their cosine to it. */
    const v3 *normal;
    double agreement, facing2; /* cosine and squared distance of the best face */
} search;

static void set_best_distance(search *s, double best2) {
    s->best2 = best2;
    double limit = sqrt(best2) + s->rounding;
    s->limit2 = (float)fmin(limit * limit * 1.0001 + 1e-30, 3e38);
    if (best2 == INFINITY) s->limit2 = INFINITY;
}

static uint32_t measure_axis_boxes(const fct_axis_node *node, const float at[3], float limit2,
                                   float distance2[8]) {
    f8 zero = f8_set(0), sum = zero;
    for (int k = 0; k < 3; ++k) {
        f8 p = f8_set(at[k]);
        f8 below = f8_sub(f8_load(node->bounds[k][0]), p), above = f8_sub(p, f8_load(node->bounds[k][1]));
        f8 d = f8_max(f8_max(below, above), zero);
        sum = f8_add(sum, f8_mul(d, d));
    }
    f8_store(distance2, sum);
    return f8_le(sum, f8_set(limit2));
}

/* A row of a map is an axis of the box over its half extent h, so a distance d in mapped units is d h = d /
 * |row|. */
static uint32_t measure_oriented_boxes(const fct_oriented_node *node, const float centered[3], float limit2,
                                       float distance2[8]) {
    f8 zero = f8_set(0), one = f8_set(1), sum = zero;
    f8 x = f8_set(centered[0]), y = f8_set(centered[1]), z = f8_set(centered[2]);
    for (int k = 0; k < 3; ++k) {
        f8 mx = f8_load(node->map[k][0]), my = f8_load(node->map[k][1]), mz = f8_load(node->map[k][2]);
        f8 q = f8_add(f8_add(f8_mul(mx, x), f8_mul(my, y)), f8_add(f8_mul(mz, z), f8_load(node->map[k][3])));
        f8 d = f8_max(f8_sub(f8_abs(q), one), zero);
        f8 row2 = f8_add(f8_add(f8_mul(mx, mx), f8_mul(my, my)), f8_mul(mz, mz));
        sum = f8_add(sum, f8_div(f8_mul(d, d), f8_max(row2, f8_set(1e-30f))));
    }
    f8_store(distance2, sum);
    return f8_le(sum, f8_set(limit2));
}

/* Takes the face if it is in reach and its normal is closer to the wanted one than that of the best face. */
static void consider_facing(search *s, const v3 p[3], double d2, double u, double v, uint32_t place) {
    if (!(d2 <= s->best2)) return;
    v3 n = v3_unit(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
    double agreement = v3_norm2(n) > 0 ? v3_dot(n, *s->normal) : -2;
    const uint32_t *ids = s->bvh->view.face_ids;
    if (s->place != FCT_NONE) {
        if (agreement < s->agreement) return;
        bool tie = agreement == s->agreement;
        if (tie && (d2 > s->facing2 || (d2 == s->facing2 && ids[place] > ids[s->place]))) return;
    }
    s->agreement = agreement, s->facing2 = d2;
    s->u = u, s->v = v, s->place = place;
}

static void measure_triangle(search *s, const fct_leaf *leaf, uint32_t number) {
    v3 p[3];
    double u, v;
    fct_leaf_triangle(leaf, number, p);
    v3 q = fct_triangle_closest(s->point, p[0], p[1], p[2], &u, &v);
    double d2 = v3_norm2(v3_sub(q, s->point));
    uint32_t place = leaf->first + number;
    if (s->normal) {
        consider_facing(s, p, d2, u, v, place);
        return;
    }
    const uint32_t *ids = s->bvh->view.face_ids;
    if (!(d2 < s->best2 || (d2 == s->best2 && (s->place == FCT_NONE || ids[place] < ids[s->place])))) return;
    s->u = u, s->v = v, s->place = place;
    set_best_distance(s, d2);
}

/* Measures the triangles whose axis boxes are near enough. */
static void search_leaf(search *s, const fct_leaf *leaf) {
    const float *rows = fct_leaf_vertices(leaf);
    const uint8_t *corners = fct_leaf_corners(leaf);
    uint32_t stride = 8u * leaf->vertex_octets, second = leaf->vertex_octets == 2 ? 8 : 0;
    f8 zero = f8_set(0);
    for (uint32_t first = 0; first < leaf->count; first += 8, corners += 24) {
        i8 a = i8_load_bytes(corners), b = i8_load_bytes(corners + 8), c = i8_load_bytes(corners + 16);
        f8 sum = zero;
        for (uint32_t k = 0; k < 3; ++k) {
            f8 p = f8_set(s->at[k]);
            f8 low = f8_sub(f8_load(rows + k * stride), p),
               high = f8_sub(f8_load(rows + k * stride + second), p);
            f8 x = f8_lookup16(low, high, a), y = f8_lookup16(low, high, b), z = f8_lookup16(low, high, c);
            f8 below = f8_min(x, f8_min(y, z)), above = f8_sub(zero, f8_max(x, f8_max(y, z)));
            f8 d = f8_max(f8_max(below, above), zero);
            sum = f8_add(sum, f8_mul(d, d));
        }
        float distance2[8];
        f8_store(distance2, sum);
        uint32_t left = leaf->count - first, open = f8_le(sum, f8_set(s->limit2));
        if (left < 8) open &= (1u << left) - 1;
        for (; open; open &= open - 1) {
            uint32_t i = (uint32_t)__builtin_ctz(open);
            if (distance2[i] > s->limit2) continue;
            measure_triangle(s, leaf, first + i);
            ++s->visits.triangles;
        }
    }
}

static uint64_t make_entry(float distance2, uint32_t ref) {
    return (uint64_t)fct_float_bits(distance2) << 32 | ref;
}

static float entry_distance2(uint64_t entry) {
    return fct_float_of_bits((uint32_t)(entry >> 32));
}

static void search_nodes(search *s) {
    const fct_bvh *bvh = s->bvh;
    float centered[3];
    for (int k = 0; k < 3; ++k) centered[k] = s->at[k] - bvh->center[k];
    uint64_t stack[FCT_STACK_SIZE];
    uint32_t height = 1;
    stack[0] = make_entry(0, bvh->root);
    while (height) {
        uint64_t entry = stack[--height];
        if (entry_distance2(entry) > s->limit2) continue;
        uint32_t ref = (uint32_t)entry;
        if (ref & FCT_REF_LEAF) {
            search_leaf(s, fct_bvh_leaf(bvh, ref));
            continue;
        }
        float distance2[8];
        const uint32_t *child;
        uint32_t met, base = height;
        ++s->visits.nodes;
        s->visits.boxes += 8;
        if (ref & FCT_REF_ORIENTED) {
            const fct_oriented_node *node = fct_bvh_node(bvh, ref);
            met = measure_oriented_boxes(node, centered, s->limit2, distance2) & node->present;
            child = node->child;
        } else {
            const fct_axis_node *node = fct_bvh_node(bvh, ref);
            met = measure_axis_boxes(node, s->at, s->limit2, distance2) & node->present;
            child = node->child;
        }
        for (; met; met &= met - 1) {
            uint32_t i = (uint32_t)__builtin_ctz(met);
            uint64_t waiting = make_entry(distance2[i], child[i]);
            uint32_t at = height++;
            while (at > base && stack[at - 1] < waiting) stack[at] = stack[at - 1], --at;
            stack[at] = waiting;
        }
    }
}

/* Sets `at` and `rounding`. Clamping the point to a large cube around the model moves it nearer to everything
 * in the model, so box distances from the clamped point are lower bounds of those from the point. */
static void round_point(search *s) {
    double p[3] = {s->point.x, s->point.y, s->point.z};
    s->rounding = 0;
    for (int k = 0; k < 3; ++k) {
        double c = (double)s->bvh->center[k], clamped = fmin(fmax(p[k], c - 1e9), c + 1e9);
        double rounded = fct_round(clamped);
        s->at[k] = (float)rounded;
        s->rounding += fabs(rounded - clamped);
    }
}

static void report_face(const search *s, double distance2, fct_near *out) {
    const fct_tree_view *view = &s->bvh->view;
    const uint32_t *t = view->triangles + 3 * (size_t)s->place;
    v3 a = v3_load(view->positions + 3 * (size_t)t[0]), b = v3_load(view->positions + 3 * (size_t)t[1]),
       c = v3_load(view->positions + 3 * (size_t)t[2]);
    double scale = s->bvh->scale;
    *out = (fct_near){.distance2 = distance2 / scale / scale, .u = s->u, .v = s->v, .place = s->place};
    out->point = v3_add(v3_scale(a, 1 - s->u - s->v), v3_add(v3_scale(b, s->u), v3_scale(c, s->v)));
}

bool fct_nearest_search(const fct_bvh *bvh, v3 point, const v3 *normal, double max_distance, fct_near *out,
                        fct_visits *visits) {
    search s = {.bvh = bvh, .point = fct_bvh_to_scaled(bvh, point), .place = FCT_NONE, .normal = normal};
    double size = fabs(point.x) + fabs(point.y) + fabs(point.z);
    if (bvh->embree || !(size < INFINITY) || !(max_distance >= 0)) return false;
    round_point(&s);
    double reach = max_distance * bvh->scale;
    set_best_distance(&s, reach * reach);
    search_nodes(&s);
    fct_visits_add(visits, &s.visits);
    if (s.place == FCT_NONE) return false;
    report_face(&s, normal ? s.facing2 : s.best2, out);
    return true;
}
