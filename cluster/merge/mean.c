/* cluster/merge/mean.c: fit, direction and shape error of a union (8.18), in double.
 *
 * Source: Garland, "Quadric-Based Polygonal Surface Simplification", CMU 1999, section 8.2. The quadric P is
 * kept as centroid and centred covariance, because the raw form A - b b^T / c (8.11) loses digits.
 *
 * Degenerate clusters: E_dir is 0 where the area is 0. E_shape is 1/2 where both parts have perimeter 0, and
 * at least -1000, which is what a union without perimeter gets. Where the least eigenvalue is double, the
 * normal is the one that fct_eigen3 chooses. Where the mean normal is across it, its sign is arbitrary too.
 */
#include "cluster/merge/mean.h"

#include "base/math/eigen.h"

/* The least E_shape: a border that closes would have -infinity. */
#define LEAST_SHAPE_ERROR (-1000.0)

void fct_mean_face(const fct_metric *metric, const float *positions, const uint32_t triangle[3],
                   fct_mean_record *out) {
    v3 p[3], sum = {0, 0, 0};
    for (int k = 0; k < 3; ++k) {
        v3 corner = v3_load(positions + 3 * (size_t)triangle[k]);
        p[k] = v3_scale(v3_sub(corner, metric->origin), metric->scale);
        sum = v3_add(sum, p[k]);
    }
    v3 centroid = v3_scale(sum, 1.0 / 3),
       vector = v3_scale(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])), 0.5);
    double area = v3_norm(vector);
    *out = (fct_mean_record){.centroid = centroid, .vector = vector, .area = area};
    /* over a triangle the integral of (x - m)(x - m)^T is area / 12 times the sum over its corners */
    bool points = metric->measure == FCT_FIT_POINTS;
    out->weight = points ? 3 : area;
    for (int k = 0; k < 3; ++k) {
        sym3_add_outer(out->covariance, points ? 1 : area / 12, v3_sub(p[k], centroid)); /* (8.6) */
        out->perimeter += v3_norm(v3_sub(p[(k + 1) % 3], p[k]));
    }
    if (area > 0) sym3_add_outer(out->moment, 1 / area, vector); /* w n n^T (8.14) */
}

double fct_mean_border(const fct_metric *metric, const float *positions, const uint32_t a[3],
                       const uint32_t b[3], float rounded) {
    double lengths[3], best = (double)rounded, error = 1e-4 * (double)rounded;
    int count = 0;
    for (int i = 0; i < 3; ++i) {
        uint32_t from = a[i], to = a[(i + 1) % 3];
        bool shared = false;
        for (int k = 0; k < 3; ++k) {
            uint32_t p = b[k], q = b[(k + 1) % 3];
            shared = shared || (p == from && q == to) || (p == to && q == from);
        }
        v3 side = v3_sub(v3_load(positions + 3 * (size_t)to), v3_load(positions + 3 * (size_t)from));
        if (shared) lengths[count++] = v3_norm(side) * metric->scale;
    }
    /* A side counts whole, half where three or more faces meet in it, and not at all where other faces are
     * between the two in its chain: two bits per side. */
    for (int shares = 0; shares < 1 << 2 * count; ++shares) {
        double length = 0;
        for (int i = 0; i < count; ++i) length += 0.5 * (shares >> 2 * i & 3) * lengths[i];
        if (fabs(length - (double)rounded) >= error) continue;
        best = length, error = fabs(length - (double)rounded);
    }
    return best;
}

/* Z (8.6) of the union. For each part, the steps (8.7), (8.8) and (8.9) to (8.10), taken about another point
 * than its own centroid u, show that Z about v is Z about u plus k (u - v)(u - v)^T. With v the centroid of
 * the union, both added terms together are ka kb / (ka + kb) d d^T, where d goes from one part's centroid to
 * the other's. */
static void join_covariances(const fct_mean_record *a, const fct_mean_record *b, double out[6],
                             v3 *centroid) {
    double weight = a->weight + b->weight, share = weight > 0 ? b->weight / weight : 0.5;
    v3 between = v3_sub(b->centroid, a->centroid);
    for (int i = 0; i < 6; ++i) out[i] = a->covariance[i] + b->covariance[i];
    sym3_add_outer(out, a->weight * share, between);
    *centroid = v3_mad(a->centroid, share, between);
}

static double join_perimeters(const fct_mean_record *a, const fct_mean_record *b, double shared) {
    return fmax(a->perimeter + b->perimeter - 2 * shared, 0);
}

/* (8.17). Both sides of max(g1, g2) / g are multiplied by the areas, so that a part without area counts. */
static double shape_error(const fct_mean_record *a, const fct_mean_record *b, double perimeter) {
    double area = a->area + b->area, share = area > 0 ? b->area / area : 0,
           rest = area > 0 ? a->area / area : 0;
    double worst = fmax(a->perimeter * a->perimeter * share, b->perimeter * b->perimeter * rest);
    double joined = perimeter * perimeter * share * rest;
    if (!(worst > 0)) return 0.5;
    return joined > 0 ? fmax(1 - worst / (2 * joined), LEAST_SHAPE_ERROR) : LEAST_SHAPE_ERROR;
}

double fct_mean_cost(const fct_metric *metric, const fct_mean_record *a, const fct_mean_record *b,
                     double shared) {
    double covariance[6], moment[6], values[3], weight = a->weight + b->weight, area = a->area + b->area;
    v3 centroid, axes[3], s = v3_add(a->vector, b->vector);
    join_covariances(a, b, covariance, &centroid);
    for (int i = 0; i < 6; ++i) moment[i] = a->moment[i] + b->moment[i];
    fct_eigen3(covariance, values, axes);
    v3 n = v3_dot(axes[0], s) < 0 ? v3_scale(axes[0], -1) : axes[0];
    /* The least (8.2): at d = -n^T b / c, P (8.4) is n^T Z n, whose minimum is the least eigenvalue of Z. */
    double fit = weight > 0 ? fmax(values[0], 0) / weight : 0;
    /* (8.13), with R (8.15) for the summed D, e = -s and f = area (8.14) */
    double direction = area > 0 ? fmax((sym3_form(moment, n, n) - 2 * v3_dot(n, s)) / area + 1, 0) : 0;
    double shape = shape_error(a, b, join_perimeters(a, b, shared));
    return metric->fit_weight * fit + metric->direction_weight * direction + metric->shape_weight * shape;
}

void fct_mean_merge(fct_mean_record *a, const fct_mean_record *b, double shared) {
    fct_mean_record u = {.weight = a->weight + b->weight, .area = a->area + b->area};
    join_covariances(a, b, u.covariance, &u.centroid);
    u.vector = v3_add(a->vector, b->vector);
    u.perimeter = join_perimeters(a, b, shared);
    for (int i = 0; i < 6; ++i) u.moment[i] = a->moment[i] + b->moment[i];
    *a = u;
}
