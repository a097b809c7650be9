/* cluster/metric.c: fit, direction and shape error of a union, from the records of its parts.
 *
 * INCREMENT, C = a1 D(w E_fit) + a2 2 (|Sa| + |Sb| - |Sa + Sb|) + a3 w E_shape: the growth of the total
 * error. MEAN, E = a1 E_fit + a2 E_dir + a3 E_shape (8.18). E_shape is (8.17), with its factor 2.
 *
 * Degenerate answers. No area: direction and shape errors weigh nothing in INCREMENT; E_dir is 0 and
 * E_shape 1/2 in MEAN. Points on a line: fit 0. A mean normal that cancels: the plane across the direction in
 * which the points spread least, by the adjugate's largest column. Irregularity is held between 0 and 1e30, a
 * bonus for a border that closes at 1000.
 */
#include "cluster/metric.h"

#include <float.h>

#include "base/eigen.h"

#define PI_F 3.14159265f
#define TINY 1e-30f

/* fmaxf and fminf are calls here, for they must look out for NaN. */
static inline float greater(float a, float b) {
    return a > b ? a : b;
}
static inline float lesser(float a, float b) {
    return a < b ? a : b;
}

/* Sums of a union about its own centroid. */
typedef struct joint {
    float covariance[6], centroid[3], weight, vector[3], area, perimeter;
} joint;

fct_metric fct_metric_make(const fct_tree_def *def, const fct_bounds *bounds) {
    bool mean = def->cost == FCT_COST_MEAN;
    v3 lower = v3_load(bounds->lower), upper = v3_load(bounds->upper);
    double diagonal = v3_norm(v3_sub(upper, lower));
    fct_metric metric = {.cost = def->cost, .measure = def->fit_measure};
    metric.fit_weight = (float)(def->fit_weight >= 0 ? def->fit_weight : mean ? 1e6 : 1e4);
    metric.direction_weight = (float)(def->direction_weight >= 0 ? def->direction_weight : 1);
    metric.shape_weight = (float)(def->shape_weight >= 0 ? def->shape_weight : mean ? 1 : 0.006);
    metric.origin = v3_scale(v3_add(lower, upper), 0.5);
    metric.scale = diagonal > 0 ? 1 / diagonal : 1;
    return metric;
}

void fct_metric_face(const fct_metric *metric, const float *positions, const uint32_t triangle[3],
                     float perimeter, fct_record *record, fct_direction *direction) {
    v3 p[3];
    for (int k = 0; k < 3; ++k)
        p[k] = v3_scale(v3_sub(v3_load(positions + 3 * (size_t)triangle[k]), metric->origin), metric->scale);
    v3 center = v3_scale(v3_add(v3_add(p[0], p[1]), p[2]), 1.0 / 3);
    v3 vector = v3_scale(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])), 0.5);
    double area = v3_norm(vector), covariance[6] = {0};
    bool points = metric->measure == FCT_FIT_POINTS;
    for (int k = 0; k < 3; ++k) sym3_add_outer(covariance, points ? 1 : area / 12, v3_sub(p[k], center));
    for (int i = 0; i < 6; ++i) record->covariance[i] = (float)covariance[i];
    v3_store(record->centroid, center);
    v3_store(record->vector, vector);
    record->weight = points ? 3 : (float)area;
    record->area = (float)area;
    record->perimeter = (float)(perimeter * metric->scale);
    record->fit = 0;
    if (!direction) return;
    *direction = (fct_direction){.vector = {vector.x, vector.y, vector.z}, .area = area};
    if (area > 0) sym3_add_outer(direction->moment, 1 / area, vector);
}

static inline float irregularity(float perimeter, float area) {
    float g = perimeter * perimeter / (4 * PI_F * greater(area, TINY));
    return lesser(g, 1e30f);
}

/* (8.17) */
static inline float shape_error(float worst, float joined) {
    float error = 1 - worst / (2 * greater(joined, TINY));
    return worst > 0 ? greater(error, -1000) : 0.5f;
}

static inline void join(const fct_record *a, const fct_record *b, float shared, joint *u) {
    float weight = a->weight + b->weight, share = weight > 0 ? b->weight / weight : 0.5f;
    float k = a->weight * share, d[3];
    for (int i = 0; i < 3; ++i) {
        d[i] = b->centroid[i] - a->centroid[i];
        u->centroid[i] = a->centroid[i] + share * d[i];
        u->vector[i] = a->vector[i] + b->vector[i];
    }
    u->covariance[0] = a->covariance[0] + b->covariance[0] + k * d[0] * d[0];
    u->covariance[1] = a->covariance[1] + b->covariance[1] + k * d[0] * d[1];
    u->covariance[2] = a->covariance[2] + b->covariance[2] + k * d[0] * d[2];
    u->covariance[3] = a->covariance[3] + b->covariance[3] + k * d[1] * d[1];
    u->covariance[4] = a->covariance[4] + b->covariance[4] + k * d[1] * d[2];
    u->covariance[5] = a->covariance[5] + b->covariance[5] + k * d[2] * d[2];
    u->weight = weight;
    u->area = a->area + b->area;
    u->perimeter = greater(a->perimeter + b->perimeter - 2 * shared, 0);
}

static inline float form(const float c[6], const float n[3]) {
    return n[0] * (c[0] * n[0] + 2 * (c[1] * n[1] + c[2] * n[2])) + n[1] * (c[3] * n[1] + 2 * c[4] * n[2]) +
           c[5] * n[2] * n[2];
}

/* Least spread of the covariance, as a total over the measure: one step of inverse iteration from the mean
 * normal, which is as good as an eigen solve here and a tenth of its time. */
static inline float least_spread(const joint *u) {
    float trace = u->covariance[0] + u->covariance[3] + u->covariance[5];
    float invert = 1 / greater(trace, TINY), c[6];
    for (int i = 0; i < 6; ++i) c[i] = u->covariance[i] * invert;
    float adjugate[6] = {c[3] * c[5] - c[4] * c[4], c[2] * c[4] - c[1] * c[5], c[1] * c[4] - c[2] * c[3],
                         c[0] * c[5] - c[2] * c[2], c[1] * c[2] - c[0] * c[4], c[0] * c[3] - c[1] * c[1]};
    float largest = greater(greater(fabsf(u->vector[0]), fabsf(u->vector[1])), fabsf(u->vector[2]));
    bool cancelled = largest <= 1e-4f * u->area;
    bool x = adjugate[0] >= adjugate[3] && adjugate[0] >= adjugate[5], y = !x && adjugate[3] >= adjugate[5];
    float normalize = 1 / greater(largest, TINY);
    float s[3] = {cancelled ? (x ? 1.f : 0.f) : u->vector[0] * normalize,
                  cancelled ? (y ? 1.f : 0.f) : u->vector[1] * normalize,
                  cancelled ? (x || y ? 0.f : 1.f) : u->vector[2] * normalize};
    float n[3] = {adjugate[0] * s[0] + adjugate[1] * s[1] + adjugate[2] * s[2],
                  adjugate[1] * s[0] + adjugate[3] * s[1] + adjugate[4] * s[2],
                  adjugate[2] * s[0] + adjugate[4] * s[1] + adjugate[5] * s[2]};
    float nn = n[0] * n[0] + n[1] * n[1] + n[2] * n[2], ss = s[0] * s[0] + s[1] * s[1] + s[2] * s[2];
    float start = form(c, s) / greater(ss, TINY), stepped = nn > TINY ? form(c, n) / nn : start;
    return trace * greater(lesser(start, stepped), 0);
}

static inline float total_fit(const fct_metric *metric, const joint *u) {
    float spread = least_spread(u);
    return metric->measure == FCT_FIT_AREA ? spread : spread * u->area / u->weight;
}

static inline float length3(const float v[3]) {
    return sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/* 2 (|a| + |b| - |a + b|). Near-parallel vectors go by their cross product, for the difference has no digits
 * left on fine meshes. */
static inline float direction_growth(const float a[3], const float b[3]) {
    float scale = greater(length3(a), length3(b)), invert = 1 / greater(scale, TINY);
    float p[3] = {a[0] * invert, a[1] * invert, a[2] * invert};
    float q[3] = {b[0] * invert, b[1] * invert, b[2] * invert};
    float s[3] = {p[0] + q[0], p[1] + q[1], p[2] + q[2]};
    float cross[3] = {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]};
    float lp = length3(p), lq = length3(q), ls = length3(s), dot = p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    float cc = cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2];
    float near = cc / greater(lp * lq + dot, TINY), far = lp * lq - dot;
    return scale * 4 * (dot > 0 ? near : far) / greater(lp + lq + ls, TINY);
}

static inline float union_shape(const fct_record *a, const fct_record *b, const joint *u) {
    float worst = greater(irregularity(a->perimeter, a->area), irregularity(b->perimeter, b->area));
    return shape_error(worst, irregularity(u->perimeter, u->area));
}

static float mean_cost(const fct_metric *metric, const joint *u, float shape, const fct_direction *da,
                       const fct_direction *db) {
    double covariance[6], moment[6], values[3];
    v3 axes[3];
    for (int i = 0; i < 6; ++i)
        covariance[i] = (double)u->covariance[i], moment[i] = da->moment[i] + db->moment[i];
    fct_eigen3(covariance, values, axes);
    v3 s = {da->vector[0] + db->vector[0], da->vector[1] + db->vector[1], da->vector[2] + db->vector[2]};
    v3 n = v3_dot(axes[0], s) < 0 ? v3_scale(axes[0], -1) : axes[0];
    double area = da->area + db->area;
    double fit = u->weight > 0 ? fmax(values[0], 0) / (double)u->weight : 0;
    double direction = area > 0 ? fmax((sym3_form(moment, n, n) - 2 * v3_dot(n, s)) / area + 1, 0) : 0;
    return (float)((double)metric->fit_weight * fit + (double)metric->direction_weight * direction +
                   (double)(metric->shape_weight * shape));
}

float fct_metric_cost(const fct_metric *metric, const fct_record *a, const fct_record *b, float shared,
                      const fct_direction *da, const fct_direction *db) {
    joint u;
    join(a, b, shared, &u);
    float shape = union_shape(a, b, &u);
    if (metric->cost == FCT_COST_MEAN) return mean_cost(metric, &u, shape, da, db);
    float fit = greater(total_fit(metric, &u) - a->fit - b->fit, 0);
    return metric->fit_weight * fit + metric->direction_weight * direction_growth(a->vector, b->vector) +
           metric->shape_weight * u.area * shape;
}

void fct_metric_merge(const fct_metric *metric, fct_record *a, const fct_record *b, float shared,
                      fct_direction *da, const fct_direction *db) {
    joint u;
    join(a, b, shared, &u);
    for (int i = 0; i < 6; ++i) a->covariance[i] = u.covariance[i];
    for (int i = 0; i < 3; ++i) a->centroid[i] = u.centroid[i], a->vector[i] = u.vector[i];
    a->weight = u.weight;
    a->area = u.area;
    a->perimeter = u.perimeter;
    a->fit = total_fit(metric, &u);
    if (!da) return;
    for (int i = 0; i < 6; ++i) da->moment[i] += db->moment[i];
    for (int i = 0; i < 3; ++i) da->vector[i] += db->vector[i];
    da->area += db->area;
}
