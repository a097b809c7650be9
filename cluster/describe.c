/* cluster/describe.c: area, moments, cone, plane and box of a cluster, from its triangles.
 *
 * The frame of the box is the PCA of the surface; extents are taken in double along the very axes that
 * fct_cluster_box expands from the stored quaternion, and rounded outwards, so that every vertex is inside.
 *
 * Degenerate answers. No area: moments and area are 0, the centroid is the mean of the corners, and the frame
 * is the PCA of the corners. Cancelled normals: cone pi, the plane's sign is the eigenvector's. Areas beyond
 * a float's range end at its largest value with the area vector scaled alike, below it at 0; boxes, planes
 * and centroids do not depend on either.
 */
#include <float.h>

#include "base/eigen.h"
#include "base/parallel.h"
#include "cluster/tree.h"

/* Sums about a corner of the cluster. */
typedef struct sums {
    v3 origin, center, vector;
    double area, moment[6], covariance[6];
} sums;

static v3 corner(const fct_tree_view *view, size_t place, size_t k) {
    return v3_load(view->positions + 3 * (size_t)view->triangles[3 * place + k]);
}

static void expand(const float q[4], float axes[3][3]) {
    double x = q[0], y = q[1], z = q[2], w = q[3], s = 2 / (x * x + y * y + z * z + w * w);
    v3_store(axes[0], (v3){1 - s * (y * y + z * z), s * (x * y + w * z), s * (x * z - w * y)});
    v3_store(axes[1], (v3){s * (x * y - w * z), 1 - s * (x * x + z * z), s * (y * z + w * x)});
    v3_store(axes[2], (v3){s * (x * z + w * y), s * (y * z - w * x), 1 - s * (x * x + y * y)});
}

void fct_cluster_box(const fct_cluster *cluster, fct_box *out) {
    for (int k = 0; k < 3; ++k) out->center[k] = cluster->box_center[k], out->half[k] = cluster->box_half[k];
    expand(cluster->box_rotation, out->axes);
}

/* Unit quaternion of the rotation whose columns are the right-handed frame a. */
static void quaternion(const v3 a[3], float q[4]) {
    double t[4] = {1 + a[0].x - a[1].y - a[2].z, 1 - a[0].x + a[1].y - a[2].z, 1 - a[0].x - a[1].y + a[2].z,
                   1 + a[0].x + a[1].y + a[2].z};
    double xy = a[0].y + a[1].x, xz = a[0].z + a[2].x, yz = a[1].z + a[2].y;
    double wx = a[1].z - a[2].y, wy = a[2].x - a[0].z, wz = a[0].y - a[1].x;
    int most = 0;
    for (int i = 1; i < 4; ++i)
        if (t[i] > t[most]) most = i;
    double rows[4][4] = {{t[0], xy, xz, wx}, {xy, t[1], yz, wy}, {xz, yz, t[2], wz}, {wx, wy, wz, t[3]}};
    double length = 0;
    for (int i = 0; i < 4; ++i) length += rows[most][i] * rows[most][i];
    for (int i = 0; i < 4; ++i) q[i] = (float)(rows[most][i] / sqrt(length));
}

static void add_triangle(const fct_tree_view *view, size_t place, sums *s) {
    v3 p[3];
    for (size_t k = 0; k < 3; ++k) p[k] = v3_sub(corner(view, place, k), s->origin);
    v3 vector = v3_scale(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])), 0.5);
    v3 middle = v3_scale(v3_add(v3_add(p[0], p[1]), p[2]), 1.0 / 3);
    double area = v3_norm(vector);
    if (!(area > 0)) return;
    s->area += area;
    s->vector = v3_add(s->vector, vector);
    s->center = v3_mad(s->center, area, middle);
    sym3_add_outer(s->moment, 1 / area, vector);
}

static void add_spread(const fct_tree_view *view, size_t place, sums *s) {
    v3 p[3];
    for (size_t k = 0; k < 3; ++k) p[k] = v3_sub(v3_sub(corner(view, place, k), s->origin), s->center);
    double weight = 1;
    if (s->area > 0) weight = 0.5 * v3_norm(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
    /* the surface integral: a twelfth of the corners' and of the sum's */
    for (int k = 0; k < 3; ++k) sym3_add_outer(s->covariance, weight, p[k]);
    if (s->area > 0) sym3_add_outer(s->covariance, weight, v3_add(v3_add(p[0], p[1]), p[2]));
}

static void gather(const fct_tree_view *view, size_t first, size_t count, sums *s) {
    *s = (sums){.origin = corner(view, first, 0)};
    for (size_t place = first; place < first + count; ++place) add_triangle(view, place, s);
    if (s->area > 0) {
        s->center = v3_scale(s->center, 1 / s->area);
    } else {
        for (size_t i = 0; i < 3 * count; ++i)
            s->center = v3_add(s->center, v3_sub(corner(view, first + i / 3, i % 3), s->origin));
        s->center = v3_scale(s->center, 1 / (3 * (double)count));
    }
    for (size_t place = first; place < first + count; ++place) add_spread(view, place, s);
}

/* The angle, rounded up, within which all face normals are to the stored area vector. */
static float cone(const fct_tree_view *view, size_t first, size_t count, const float vector[3]) {
    v3 axis = v3_unit(v3_load(vector));
    if (v3_norm2(axis) == 0) return 3.14159274f;
    double widest = 0;
    for (size_t place = first; place < first + count; ++place) {
        v3 p = corner(view, place, 0), q = corner(view, place, 1), r = corner(view, place, 2);
        v3 normal = v3_unit(v3_cross(v3_sub(q, p), v3_sub(r, p)));
        if (v3_norm2(normal) == 0) continue;
        double angle = atan2(v3_norm(v3_cross(axis, normal)), v3_dot(axis, normal));
        if (angle > widest) widest = angle;
    }
    return nextafterf((float)widest, 4);
}

static void fit_extents(const fct_tree_view *view, size_t first, size_t count, v3 origin, fct_cluster *out) {
    float axes[3][3];
    expand(out->box_rotation, axes);
    v3 a[3] = {v3_load(axes[0]), v3_load(axes[1]), v3_load(axes[2])}, center = origin;
    double low[3], high[3], size = 0;
    for (int k = 0; k < 3; ++k) low[k] = INFINITY, high[k] = -INFINITY;
    for (size_t i = 0; i < 3 * count; ++i) {
        v3 p = v3_sub(corner(view, first + i / 3, i % 3), origin);
        for (int k = 0; k < 3; ++k) {
            double x = v3_dot(p, a[k]);
            low[k] = fmin(low[k], x), high[k] = fmax(high[k], x);
        }
    }
    for (int k = 0; k < 3; ++k) center = v3_mad(center, 0.5 * (low[k] + high[k]), a[k]);
    v3_store(out->box_center, center);
    v3 moved = v3_sub(v3_load(out->box_center), origin);
    for (int k = 0; k < 3; ++k) size = fmax(size, fmax(fabs(low[k]), fabs(high[k])));
    size += fabs(origin.x) + fabs(origin.y) + fabs(origin.z);
    for (int k = 0; k < 3; ++k) {
        double middle = v3_dot(moved, a[k]), half = fmax(high[k] - middle, middle - low[k]);
        half += 8 * DBL_EPSILON * size; /* whatever order of operations checks it */
        out->box_half[k] = nextafterf((float)half, INFINITY);
    }
}

static void store_areas(const sums *s, fct_cluster *out) {
    double factor = s->area > FLT_MAX ? FLT_MAX / s->area : 1;
    out->area = (float)(s->area * factor);
    v3_store(out->area_vector, v3_scale(s->vector, factor));
    for (int i = 0; i < 6; ++i) out->moment[i] = (float)(s->moment[i] * factor);
}

void fct_cluster_describe(const fct_tree_view *view, uint32_t first, uint32_t count, fct_cluster *out) {
    sums s;
    gather(view, first, count, &s);
    store_areas(&s, out);
    v3 center = v3_add(s.origin, s.center);
    v3_store(out->centroid, center);
    out->cone_angle = cone(view, first, count, out->area_vector);
    double values[3];
    v3 axes[3];
    fct_eigen3(s.covariance, values, axes);
    v3 normal = v3_dot(axes[0], s.vector) < 0 ? v3_scale(axes[0], -1) : axes[0];
    v3_store(out->plane, normal);
    out->plane[3] = (float)-v3_dot(normal, center);
    v3 frame[3] = {axes[2], axes[1], v3_cross(axes[2], axes[1])};
    quaternion(frame, out->box_rotation);
    fit_extents(view, first, count, s.origin, out);
}

static void describe_nodes(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    fct_tree *tree = user;
    for (size_t i = begin; i < end; ++i)
        fct_cluster_describe(&tree->view, tree->clusters[i].first, tree->clusters[i].count,
                             &tree->clusters[i]);
}

fct_result fct_tree_describe(fct_tree *tree) {
    return fct_parallel_for_progress(tree->env, "boxes", tree->view.node_count, 64, describe_nodes, tree);
}
