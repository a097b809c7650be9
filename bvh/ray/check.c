/* bvh/ray/check.c: compares two backends on the same rays, and decides their differences in double.
 *
 * Each backend prepares the caller's ray in its own way. A difference is explained unless our answer is
 * wrong. Our answer is wrong in three cases:
 *   1. t, u, v and the normal do not describe one point of the ray and of the face (describes_hit). This is
 * checked for every hit, whatever Embree reports.
 *   2. Embree reports a nearer face, and the ray meets it farther from its rim than float rounding.
 *   3. Embree reports a nearer face, the ray meets it within rounding of its rim, and the faces there leave
 * no gap around the ray (surface_covers). One face alone may be missed there, a closed surface may not. It is
 * also correct to miss Embree's face within rounding of t_min or t_max.
 */
#include <float.h>
#include <string.h>

#include "base/math/elementary.h"
#include "bvh/near/triangle.h"
#include "bvh/ray/exact.h"
#include "bvh/ray/ray.h"
#include "cluster/tree/node.h"

/* In scaled units, more than the float test can move a triangle (model.h). */
#define ROUNDING ((double)FCT_AXIS_PAD)
enum { SLICE = 65536 }; /* rays per step */
/* Rays of the ring in surface_covers. Few rays settle most differences. A surface that folds back at a corner
 * can leave a narrow gap, so many must agree: they are closer to each other than 2^-24. */
enum { FEW = 16, MANY = 1024 };

/* The ray in scaled units, with a unit direction. `origin` is the point of the ray's line nearest to the
 * centre of the model; distances start there. */
typedef struct exact_ray {
    v3 origin, direction;
    v3 across[2]; /* completes direction to a frame */
    double t_min, t_max;
    double start;  /* distance of `origin` from the ray's own origin */
    double length; /* scaled distance per unit of the caller's t */
    const fct_ray *given;
} exact_ray;

static exact_ray make_exact_ray(const fct_bvh *bvh, const fct_ray *ray) {
    const float *o = ray->origin, *d = ray->direction;
    long double length = 0, middle = 0, unit[3], far[3];
    for (int k = 0; k < 3; ++k) length += (long double)d[k] * (long double)d[k];
    length = sqrtl(length);
    for (int k = 0; k < 3; ++k) {
        unit[k] = (long double)d[k] / length;
        far[k] = (long double)bvh->scale * (long double)o[k] - (long double)bvh->offset[k];
        middle += unit[k] * ((long double)bvh->center[k] - far[k]);
    }
    for (int k = 0; k < 3; ++k) far[k] += middle * unit[k];
    exact_ray e = {.origin = v3_make((double)far[0], (double)far[1], (double)far[2]),
                   .direction = v3_make((double)unit[0], (double)unit[1], (double)unit[2]),
                   .start = (double)middle,
                   .length = bvh->scale * (double)length,
                   .given = ray};
    e.t_min = (double)ray->t_min * e.length - e.start;
    e.t_max = (double)ray->t_max * e.length - e.start;
    v3_frame(e.direction, &e.across[0], &e.across[1]);
    return e;
}

/* Loads the corners of a face, not scaled. */
static void load_corners(const fct_bvh *bvh, uint32_t place, v3 p[3]) {
    for (size_t c = 0; c < 3; ++c)
        p[c] = v3_load(bvh->view.positions + 3 * (size_t)bvh->view.triangles[3 * (size_t)place + c]);
}

static void face_corners(const fct_bvh *bvh, uint32_t place, v3 p[3]) {
    load_corners(bvh, place, p);
    for (int c = 0; c < 3; ++c) p[c] = fct_bvh_to_scaled(bvh, p[c]);
}

/* Whether the ray's line crosses a face, by exact arithmetic. */
static bool crosses_exactly(const fct_bvh *bvh, const exact_ray *e, uint32_t place) {
    v3 p[3];
    load_corners(bvh, place, p);
    for (int c = 0; c < 3; ++c) p[c] = v3_scale(p[c], bvh->scale);
    return fct_line_crosses(v3_scale(v3_load(e->given->origin), bvh->scale), v3_load(e->given->direction), p);
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

/* The point of a face with the barycentrics u and v, scaled. */
static v3 interpolate_face(const fct_bvh *bvh, uint32_t place, double u, double v) {
    v3 p[3];
    face_corners(bvh, place, p);
    return v3_mad(v3_mad(v3_scale(p[0], 1 - u - v), u, p[1]), v, p[2]);
}

/* How far the rounding of t to a float moves the point at t. */
static double bound_rounding(const exact_ray *e, double t) {
    return (0x1p-24 * fabs(t) + (double)FLT_TRUE_MIN) * e->length;
}

/* Whether t, u, v and the normal of our hit describe one point, up to rounding: the point at t of the exact
 * ray is the point (u, v) of the face, inside of it and within the limits of t; and the normal is the face's.
 */
static bool describes_hit(const checker *c, const exact_ray *e, const fct_hit *hit) {
    static const double slack = 1e-6; /* of barycentrics and of unit normals */
    double u = (double)hit->u, v = (double)hit->v, t = (double)hit->t;
    if (!(u >= -slack && v >= -slack && u + v <= 1 + slack)) return false;
    if (!(hit->t >= e->given->t_min && hit->t <= e->given->t_max)) return false;
    v3 on_face = interpolate_face(c->obb, hit->place, u, v);
    v3 on_ray = v3_mad(e->origin, t * e->length - e->start, e->direction);
    double rounding = 2 * ROUNDING + bound_rounding(e, t);
    if (!(v3_norm(v3_sub(on_face, on_ray)) <= rounding)) return false;
    v3 p[3];
    face_corners(c->obb, hit->place, p);
    v3 exact = v3_unit(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]))), normal = v3_load(hit->normal);
    double largest = fmax(fabs(normal.x), fmax(fabs(normal.y), fabs(normal.z)));
    return largest > 0 && v3_norm(v3_sub(v3_unit(v3_scale(normal, 1 / largest)), exact)) <= slack;
}

/* Whether two hits are the same point of the same face. Rounding moves the point of a grazing ray farther, by
 * the cosine of its angle with the normal. */
static bool same_point(const checker *c, const exact_ray *e, const fct_hit *ours, const fct_hit *theirs) {
    v3 p[3];
    face_corners(c->obb, ours->place, p);
    double cosine = fabs(v3_dot(v3_unit(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]))), e->direction));
    double t = (double)ours->t, apart = fabs(t - (double)theirs->t) * e->length;
    double moved = c->near / fmax(cosine, 1e-9);
    if (!(apart <= moved + 2 * bound_rounding(e, t))) return false;
    v3 a = interpolate_face(c->obb, ours->place, (double)ours->u, (double)ours->v);
    v3 b = interpolate_face(c->obb, theirs->place, (double)theirs->u, (double)theirs->v);
    return v3_norm(v3_sub(a, b)) <= moved;
}

/* A lower bound of the distance of a scaled point from a cluster's box. */
static double bound_box_distance(const fct_bvh *bvh, uint32_t node, v3 point) {
    fct_cluster room;
    fct_box box;
    fct_cluster_box(fct_node_cluster(bvh->tree, node, &room), &box);
    v3 r = v3_sub(point, fct_bvh_to_scaled(bvh, v3_load(box.center)));
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
 *   1. the ray crosses one of them, by exact arithmetic;
 *   2. each ray of a ring around it meets one of them;
 *   3. each side that passes near the point belongs to an even number of faces. Faces that only touch (a
 * corner on another's side, or a face without area between them) may leave a slit after rounding. Only hits
 * before `farthest` count, because at a silhouette the rays of the ring also meet the surface behind. */
static bool surface_covers(const checker *c, const exact_ray *e, v3 point, double farthest, int around) {
    const fct_bvh *bvh = c->obb;
    const fct_tree_view *view = &bvh->view;
    bool covered[MANY] = {false};
    uint32_t height = 0;
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
        uint32_t place = node - view->node_count;
        face_corners(bvh, place, p);
        if (fct_bvh_degenerate(bvh, place)) continue;
        if (v3_norm(v3_sub(fct_triangle_closest(point, p[0], p[1], p[2], &u, &v), point)) > 4 * ROUNDING)
            continue;
        unpaired ^= hash_sides_near(point, p);
        measure_rim_distance(e, p, 0, 0, &at);
        met = met || (at < farthest && crosses_exactly(bvh, e, place));
        for (int i = 0; i < around; ++i) {
            double angle = 6.283185307179586 * i / around, radius = 1.5 * ROUNDING;
            double rim = measure_rim_distance(e, p, radius * fct_cos(angle), radius * fct_sin(angle), &at);
            covered[i] = covered[i] || (rim >= 0 && at < farthest);
        }
    }
    for (int i = 0; i < around; ++i) met = met && covered[i];
    return met && !unpaired;
}

/* Whether we missed a nearer hit of Embree's: cases 2 and 3 at the top of this file. A place is FCT_NONE on a
 * miss; distances start at e->origin. */
static bool misses_nearer_face(const checker *c, const exact_ray *e, uint32_t ours, double our_distance,
                               uint32_t theirs, double their_distance) {
    v3 p[3];
    double at;
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
    v3 point = v3_mad(e->origin, their_distance, e->direction);
    return surface_covers(c, e, point, farthest, FEW) && surface_covers(c, e, point, farthest, MANY);
}

/* The place of the closest hit, or FCT_NONE. *at receives its distance from e->origin, without the rounding
 * of t. */
static uint32_t find_place(const fct_bvh *bvh, const exact_ray *e, double *at) {
    fct_raw_hit hit;
    double t = 0;
    if (!fct_ray_closest(bvh, e->given, &hit, &t, NULL)) hit.place = FCT_NONE;
    *at = t * e->length - e->start;
    return hit.place;
}

/* Counts the difference of a hit and a miss, or of hits of two faces. */
static void settle_faces(const checker *c, const fct_bvh *embree, const exact_ray *e, bool wrong,
                         fct_ray_check *out) {
    double our_distance, their_distance;
    uint32_t ours = find_place(c->obb, e, &our_distance), theirs = find_place(embree, e, &their_distance);
    bool both = ours != FCT_NONE && theirs != FCT_NONE;
    if (!wrong && both && fabs(our_distance - their_distance) <= c->near) return;
    ++out->differences;
    out->unexplained += wrong || misses_nearer_face(c, e, ours, our_distance, theirs, their_distance);
}

static void compare_answers(const checker *c, const fct_bvh *embree, const fct_ray *ray, const fct_hit *ours,
                            const fct_hit *theirs, fct_ray_check *out) {
    exact_ray e = make_exact_ray(c->obb, ray);
    bool hit = ours->face != FCT_NONE, wrong = hit && !describes_hit(c, &e, ours);
    if (ours->face != theirs->face) {
        settle_faces(c, embree, &e, wrong, out);
    } else if (wrong || (hit && !same_point(c, &e, ours, theirs))) {
        ++out->differences;
        out->unexplained += wrong;
    }
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
        compare_answers(c, embree, &rays[i], &ours[i], &theirs[i], out);
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
    total.explained = total.differences - total.unexplained;
    if (result == FCT_OK) *out = total;
    return result;
}
