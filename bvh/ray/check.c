/* bvh/ray/check.c: compares two backends on the same rays, and decides their differences in double.
 *
 * A difference is explained unless our answer is wrong. Our answer is wrong in three cases:
 *   1. The point that we report is not on its face.
 *   2. Embree reports a nearer face, and the ray meets it farther from its rim than float rounding.
 *   3. Embree reports a nearer face, the ray meets it within rounding of its rim, and the faces there leave
 * no gap around the ray (surface_covers). One face alone may be missed there, a closed surface may not. It is
 * also correct to miss Embree's face within rounding of t_min or t_max.
 */
#include <string.h>

#include "base/math/elementary.h"
#include "bvh/near/triangle.h"
#include "bvh/ray/embree.h"
#include "bvh/ray/traverse.h"
#include "cluster/tree/node.h"

/* In scaled units, more than the float test can move a triangle (model.h). */
#define ROUNDING ((double)FCT_AXIS_PAD)
enum { SLICE = 65536 /* rays per step */, AROUND = 16 /* rays of the ring in surface_covers */ };

/* The ray in scaled units, with a unit direction. `origin` is the point of the ray's line nearest to the
 * centre of the model; distances start there. */
typedef struct exact_ray {
    v3 origin, direction;
    v3 across[2]; /* completes direction to a frame */
    double t_min, t_max;
    double start;  /* distance of `origin` from the ray's own origin */
    double length; /* scaled distance per unit of the caller's t */
} exact_ray;

static exact_ray make_exact_ray(const fct_bvh *bvh, const fct_ray *ray) {
    const float *o = ray->origin, *d = ray->direction;
    long double length = 0, middle = 0, unit[3], far[3];
    for (int k = 0; k < 3; ++k) length += (long double)d[k] * (long double)d[k];
    length = sqrtl(length);
    for (int k = 0; k < 3; ++k) {
        unit[k] = (long double)d[k] / length;
        far[k] = (long double)bvh->scale * (long double)o[k];
        middle += unit[k] * ((long double)bvh->center[k] - far[k]);
    }
    for (int k = 0; k < 3; ++k) far[k] += middle * unit[k];
    exact_ray e = {.origin = v3_make((double)far[0], (double)far[1], (double)far[2]),
                   .direction = v3_make((double)unit[0], (double)unit[1], (double)unit[2]),
                   .start = (double)middle,
                   .length = bvh->scale * (double)length};
    e.t_min = (double)ray->t_min * e.length - e.start;
    e.t_max = (double)ray->t_max * e.length - e.start;
    v3_frame(e.direction, &e.across[0], &e.across[1]);
    return e;
}

static void face_corners(const fct_bvh *bvh, uint32_t place, v3 p[3]) {
    for (size_t c = 0; c < 3; ++c) {
        const float *q = bvh->view.positions + 3 * (size_t)bvh->view.triangles[3 * (size_t)place + c];
        p[c] = v3_scale(v3_load(q), bvh->scale);
    }
}

/* Moves the ray by (x, y) across its direction and returns its distance from the face's rim, as seen along
 * the ray: positive inside, negative outside. *at receives the distance along the ray to the face's plane. */
static double measure_rim_distance(const exact_ray *e, const v3 p[3], double x, double y, double *at) {
    double qx[3], qy[3], nearest2 = INFINITY, area = 0;
    bool positive = true, negative = true;
    for (int i = 0; i < 3; ++i) {
        v3 r = v3_sub(p[i], e->origin);
        qx[i] = v3_dot(r, e->across[0]) - x, qy[i] = v3_dot(r, e->across[1]) - y;
    }
    for (int i = 0; i < 3; ++i) {
        int j = (i + 1) % 3;
        double ex = qx[j] - qx[i], ey = qy[j] - qy[i], length2 = ex * ex + ey * ey;
        double side = qx[i] * qy[j] - qy[i] * qx[j];
        double t = length2 > 0 ? fmin(fmax(-(qx[i] * ex + qy[i] * ey) / length2, 0), 1) : 0;
        double rx = qx[i] + t * ex, ry = qy[i] + t * ey;
        nearest2 = fmin(nearest2, rx * rx + ry * ry);
        positive = positive && side >= 0, negative = negative && side <= 0;
        area += side;
    }
    v3 n = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
    v3 moved = v3_mad(v3_mad(e->origin, x, e->across[0]), y, e->across[1]);
    *at = v3_dot(n, v3_sub(p[0], moved)) / v3_dot(n, e->direction);
    return (positive || negative) && area != 0 ? sqrt(nearest2) : -sqrt(nearest2);
}

typedef struct checker {
    const fct_bvh *obb;
    uint32_t *stack; /* depth + root_count + 2 */
    double near;     /* smaller differences of distance do not count */
} checker;

/* A lower bound of the distance of a scaled point from a cluster's box. */
static double bound_box_distance(const fct_bvh *bvh, uint32_t node, v3 point) {
    fct_cluster room;
    fct_box box;
    fct_cluster_box(fct_node_cluster(bvh->tree, node, &room), &box);
    v3 r = v3_sub(point, v3_scale(v3_load(box.center), bvh->scale));
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
        double beyond = fabs(v3_dot(r, v3_load(box.axes[k]))) - bvh->scale * (double)box.half[k];
        if (beyond > 0) sum += beyond * beyond;
    }
    return sqrt(sum) * (1 - 1e-5) - 1e-6;
}

/* A hash of the segment a b: the same for b a, and for other vertices at the same positions. */
static uint64_t hash_segment(v3 a, v3 b) {
    double ends[2][3] = {{a.x, a.y, a.z}, {b.x, b.y, b.z}};
    uint64_t sum = 0;
    for (int i = 0; i < 2; ++i) {
        uint64_t h = 0;
        for (int k = 0; k < 3; ++k) {
            double x = ends[i][k] + 0.0; /* -0 is 0 */
            uint64_t bits;
            memcpy(&bits, &x, sizeof bits);
            h = (h ^ bits) * 0x9e3779b97f4a7c15u;
            h ^= h >> 29;
        }
        sum += h * h; /* not linear, so that different pairs of ends have different sums */
    }
    return sum * 0xbf58476d1ce4e5b9u;
}

/* XOR of the hashes of the sides of a face that pass near the point. A side that two faces share cancels. */
static uint64_t hash_sides_near(v3 point, const v3 p[3]) {
    uint64_t fold = 0;
    for (int i = 0; i < 3; ++i) {
        v3 a = p[i], b = p[(i + 1) % 3];
        double u, v;
        if (v3_norm(v3_sub(fct_triangle_closest(point, a, b, b, &u, &v), point)) <= 4 * ROUNDING)
            fold ^= hash_segment(a, b);
    }
    return fold;
}

/* Whether the faces near `point` leave no gap around the ray:
 *   1. the ray meets one of them;
 *   2. so does each ray of a ring around it;
 *   3. each side that passes near the point belongs to an even number of faces. Faces that only touch (a
 * corner on another's side, or a face without area between them) may leave a slit after rounding. Only hits
 * before `farthest` count, because at a silhouette the rays of the ring also meet the surface behind. */
static bool surface_covers(const checker *c, const exact_ray *e, v3 point, double farthest) {
    const fct_bvh *bvh = c->obb;
    const fct_tree_view *view = &bvh->view;
    uint32_t height = 0, covered = 0;
    uint64_t unpaired = 0;
    bool met = false;
    for (uint32_t r = 0; r < view->root_count; ++r) c->stack[height++] = view->roots[r];
    while (height) {
        uint32_t node = c->stack[--height];
        if (node < view->node_count) {
            if (bound_box_distance(bvh, node, point) > 4 * ROUNDING) continue;
            c->stack[height++] = fct_node_child(bvh->tree, node, 0);
            c->stack[height++] = fct_node_child(bvh->tree, node, 1);
            continue;
        }
        v3 p[3];
        double u, v, at;
        face_corners(bvh, node - view->node_count, p);
        if (fct_bvh_degenerate(bvh, node - view->node_count)) continue;
        if (v3_norm(v3_sub(fct_triangle_closest(point, p[0], p[1], p[2], &u, &v), point)) > 4 * ROUNDING)
            continue;
        unpaired ^= hash_sides_near(point, p);
        met = met || (measure_rim_distance(e, p, 0, 0, &at) >= 0 && at < farthest);
        for (int i = 0; i < AROUND; ++i) {
            double angle = 6.283185307179586 * i / AROUND, radius = 1.5 * ROUNDING;
            double rim = measure_rim_distance(e, p, radius * fct_cos(angle), radius * fct_sin(angle), &at);
            if (rim >= 0 && at < farthest) covered |= 1u << i;
        }
    }
    return met && !unpaired && covered == (1u << AROUND) - 1;
}

/* Whether our answer is wrong, given Embree's: see the top of this file. A place is FCT_NONE on a miss;
 * distances start at e->origin. */
static bool ours_is_wrong(const checker *c, const exact_ray *e, uint32_t ours, double our_distance,
                          uint32_t theirs, double their_distance) {
    v3 p[3];
    double u, v, at;
    if (ours != FCT_NONE) {
        face_corners(c->obb, ours, p);
        v3 point = v3_mad(e->origin, our_distance, e->direction);
        v3 nearest = fct_triangle_closest(point, p[0], p[1], p[2], &u, &v);
        if (v3_norm(v3_sub(nearest, point)) > 2 * ROUNDING) return true;
    }
    if (theirs == FCT_NONE || (ours != FCT_NONE && their_distance >= our_distance)) return false;
    face_corners(c->obb, theirs, p);
    double rim = measure_rim_distance(e, p, 0, 0, &at);
    if (rim < -ROUNDING) return false;
    if (rim > ROUNDING) {
        bool within = at > e->t_min + ROUNDING && at < e->t_max - ROUNDING;
        return within && (ours == FCT_NONE || at < our_distance - c->near);
    }
    if (their_distance < e->t_min + c->near || their_distance > e->t_max - c->near) return false;
    double farthest = ours == FCT_NONE ? INFINITY : (our_distance + their_distance) / 2;
    return surface_covers(c, e, v3_mad(e->origin, their_distance, e->direction), farthest);
}

/* Asks both backends for their unrounded answers and counts the difference. */
static void settle_difference(const checker *c, const fct_bvh *embree, const fct_ray *ray,
                              fct_ray_check *out) {
    fct_prepared_ray prepared;
    fct_raw_hit ours, theirs;
    if (!fct_ray_prepare(c->obb, ray, &prepared)) return;
    if (!fct_traverse_closest(c->obb, &prepared, &ours, NULL)) ours.place = FCT_NONE;
    if (!fct_embree_closest(embree, &prepared, &theirs)) theirs.place = FCT_NONE;
    exact_ray e = make_exact_ray(c->obb, ray);
    double ours_at = 0, theirs_at = 0;
    if (ours.place != FCT_NONE)
        ours_at = (prepared.shift + (double)ours.t) * prepared.factor * e.length - e.start;
    if (theirs.place != FCT_NONE)
        theirs_at = (prepared.shift + (double)theirs.t) * prepared.factor * e.length - e.start;
    if (ours.place != FCT_NONE && theirs.place != FCT_NONE && fabs(ours_at - theirs_at) <= c->near) return;
    ++out->differences;
    if (ours_is_wrong(c, &e, ours.place, ours_at, theirs.place, theirs_at))
        ++out->unexplained;
    else
        ++out->explained;
}

/* Seconds of one thread. */
static double time_slice(const fct_bvh *bvh, size_t count, const fct_ray *rays, fct_hit *hits) {
    double start = fct_seconds();
    for (size_t i = 0; i < count; ++i) fct_bvh_closest_hit(bvh, &rays[i], &hits[i], NULL);
    return fct_seconds() - start;
}

static void compare_slice(const checker *c, const fct_bvh *embree, size_t count, const fct_ray *rays,
                          const fct_hit *ours, const fct_hit *theirs, fct_ray_check *out) {
    for (size_t i = 0; i < count; ++i) {
        bool hit = ours[i].face != FCT_NONE;
        out->hits += hit;
        out->occlusion_differences += fct_bvh_any_hit(c->obb, &rays[i], NULL) != hit;
        if (ours[i].face != theirs[i].face) settle_difference(c, embree, &rays[i], out);
    }
}

fct_result fct_bvh_check(const fct_env *env, const fct_bvh *obb, const fct_bvh *embree, size_t count,
                         const fct_ray *rays, fct_ray_check *out) {
    fct_ray_check total = {.rays = count};
    fct_bounds b = obb->bounds;
    v3 extent = v3_scale(v3_sub(v3_load(b.upper), v3_load(b.lower)), obb->scale);
    checker c = {.obb = obb, .near = 1e-5 * v3_norm(extent)};
    fct_result result = FCT_OK;
    fct_hit *ours = fct_allocate(env, SLICE, sizeof *ours),
            *theirs = fct_allocate(env, SLICE, sizeof *theirs);
    c.stack = fct_allocate(env, (size_t)obb->view.depth + obb->view.root_count + 2, sizeof *c.stack);
    if (!ours || !theirs || !c.stack) result = fct_fail_memory(env, "a check of rays");
    for (size_t first = 0; first < count && result == FCT_OK; first += SLICE) {
        size_t some = count - first < SLICE ? count - first : SLICE;
        total.seconds_obb += time_slice(obb, some, rays + first, ours);
        total.seconds_embree += time_slice(embree, some, rays + first, theirs);
        compare_slice(&c, embree, some, rays + first, ours, theirs, &total);
        result = fct_progress(env, "checking rays", (double)(first + some) / (double)count);
    }
    fct_release(env, ours);
    fct_release(env, theirs);
    fct_release(env, c.stack);
    if (result == FCT_OK) *out = total;
    return result;
}
