/* radiosity/output/blend.c: see blend.h.
 *
 * Irradiance caching after Ward, Rubinstein and Clear 1988, with a local regression in place of their mean:
 *   x_i = |p - p_i| / reach_i + .7 |n - n_i|            (.7 |n - n_i| is about sqrt(1 - n . n_i))
 *   w_i = (1 - .98 x_i / max x)^2 / (x_i^2 + .2^2)
 *   E_i(n) = E_i + gradient_i . (n - n_i)
 * E is the value at p of the polynomial f over the tangent plane at p that minimizes
 *   sum w_i (E_i(n) - f(p_i))^2 / sum w_i + .02 |linear terms|^2 + .1 |quadratic terms|^2,
 * with the weighted RMS distance of the anchors as the unit of length. So E = sum v_i E_i(n), with sum v = 1.
 * The weight of the farthest anchor is nearly zero, so E hardly changes where one anchor replaces another
 * among the nearest ones.
 *
 * The anchors differ from f because of the noise of their rays, and because light changes more quickly than f
 * can. If those differences are independent, the variance of E is their mean square times sum v^2.
 */
#include "radiosity/output/blend.h"

#include <string.h>

/* Weight of |n - n'| against distance / reach. Smaller: bent surfaces show their anchors' light. */
#define TURN_WEIGHT .7
/* Least x: max x is not zero. */
#define LEAST_APART 1e-4
/* Share of max x at which a weight would vanish. With 1, all weights vanish where all anchors are equally
 * far.
 */
#define FADE .98
/* Anchors with x below this have equal weights, so that their noise averages out. With 0, a vertex on an
 * anchor shows all of its noise. */
#define NOISE_APART .2
/* Penalties on the coefficients of the polynomial. Without them, anchors in a row or on one side give wild
 * slopes. With a large one the polynomial becomes flatter: light is concave in the middle of walls, and a
 * mean of anchors there is .2 to .3 % of all light too dark. */
#define LINEAR_PENALTY    .02
#define QUADRATIC_PENALTY .1
/* Terms of the polynomial: 1, x, y, x^2, sqrt(2) x y, y^2. */
enum { LINEAR_TERMS = 3, TERMS = 6 };
/* Range of the corrected irradiance over the anchor's own. The gradient knows nothing below the anchor's
 * horizon, so larger corrections overshoot. */
#define LEAST_CHANGE .5
#define MOST_CHANGE  1.6
/* An anchor needs a visibility ray if it has at least this share of the weight and differs from the mean by
 * at least this share of it. */
#define RAY_WEIGHT     .01
#define RAY_DIFFERENCE .15
/* Origins of these rays lie this many offsets above the surface, because they graze flat ground. */
#define RAY_LIFT 4

static bool point_sees_anchor(const fct_elements *set, const float p[3], const float n[3], float offset,
                              const fct_anchor *a) {
    fct_ray ray = {.t_min = 0, .t_max = 1};
    for (int k = 0; k < 3; ++k) {
        double from = (double)p[k] + RAY_LIFT * (double)offset * n[k];
        ray.origin[k] = (float)from;
        ray.direction[k] =
            (float)((double)a->position[k] + RAY_LIFT * (double)a->offset * a->normal[k] - from);
    }
    return !fct_scene_any_hit(set->scene, &ray, NULL);
}

/* The anchors of one blend. */
typedef struct blend {
    fct_nearest near;
    double values[FCT_NEAREST_ANCHORS][3]; /* irradiance for the point's normal */
    double weights[FCT_NEAREST_ANCHORS];
} blend;

static double sum_channels(const double value[3]) {
    return value[0] + value[1] + value[2];
}

/* Corrects the anchors' irradiance to the normal n, and weighs them. */
static void weigh_anchors(const fct_anchors *t, v3 p, v3 n, blend *b) {
    double x[FCT_NEAREST_ANCHORS], farthest = 0;
    for (int i = 0; i < b->near.count; ++i) {
        const fct_anchor *a = &t->items[b->near.ids[i]];
        v3 turn = v3_sub(n, v3_load(a->normal));
        x[i] =
            v3_norm(v3_sub(p, v3_load(a->position))) / a->reach + v3_norm(turn) * TURN_WEIGHT + LEAST_APART;
        farthest = fct_max(farthest, x[i]);
        for (int c = 0; c < 3; ++c) {
            double e = a->irradiance[c], changed = e + v3_dot(v3_load(a->gradient[c]), turn);
            b->values[i][c] = fct_min(fct_max(changed, LEAST_CHANGE * e), MOST_CHANGE * e);
        }
    }
    for (int i = 0; i < b->near.count; ++i) {
        double w = 1 - FADE * x[i] / farthest;
        b->weights[i] = w * w / (x[i] * x[i] + NOISE_APART * NOISE_APART);
    }
}

/* Removes the weight of anchors that differ from the mean and are hidden. */
static void drop_hidden_anchors(const fct_anchors *t, const fct_elements *set, const float point[3],
                                const float normal[3], float offset, blend *b, uint64_t *rays) {
    double total = 0, mean = 0;
    for (int i = 0; i < b->near.count; ++i) {
        total += b->weights[i];
        mean += b->weights[i] * sum_channels(b->values[i]);
    }
    mean /= total;
    for (int i = 0; i < b->near.count; ++i) {
        double difference = fabs(sum_channels(b->values[i]) - mean);
        if (b->weights[i] < RAY_WEIGHT * total || difference < RAY_DIFFERENCE * mean) continue;
        ++*rays;
        if (!point_sees_anchor(set, point, normal, offset, &t->items[b->near.ids[i]])) b->weights[i] = 0;
    }
}

/* The terms of the polynomial at each anchor, over the tangent plane at p. Returns false if no anchor with a
 * weight is beside p. */
static bool list_terms(const fct_anchors *t, v3 p, v3 n, const blend *b,
                       double terms[FCT_NEAREST_ANCHORS][TERMS]) {
    double total = 0, spread = 0;
    v3 axes[2];
    v3_frame(n, &axes[0], &axes[1]);
    for (int i = 0; i < b->near.count; ++i) {
        v3 d = v3_sub(v3_load(t->items[b->near.ids[i]].position), p);
        double x = v3_dot(d, axes[0]), y = v3_dot(d, axes[1]);
        terms[i][1] = x, terms[i][2] = y;
        total += b->weights[i], spread += b->weights[i] * (x * x + y * y);
    }
    if (!(spread > 0)) return false;
    const double scale = sqrt(total / spread);
    for (int i = 0; i < b->near.count; ++i) {
        double x = scale * terms[i][1], y = scale * terms[i][2];
        /* sqrt(2) x y makes the penalty the same in each frame. */
        const double values[TERMS] = {1, x, y, x * x, sqrt(2) * x * y, y * y};
        memcpy(terms[i], values, sizeof values);
    }
    return true;
}

/* Solves A z = b, with b in z at first. A is symmetric and positive definite, so elimination needs no pivots.
 * A changes. */
static void solve_terms(double a[TERMS][TERMS], double z[TERMS]) {
    for (int j = 0; j < TERMS; ++j)
        for (int k = j + 1; k < TERMS; ++k) {
            const double factor = a[k][j] / a[j][j];
            for (int l = j; l < TERMS; ++l) a[k][l] -= factor * a[j][l];
            z[k] -= factor * z[j];
        }
    for (int j = TERMS - 1; j >= 0; --j) {
        for (int k = j + 1; k < TERMS; ++k) z[j] -= a[j][k] * z[k];
        z[j] /= a[j][j];
    }
}

/* F^T W F + penalties, where row i of F has the terms at anchor i. */
static void sum_matrix(const blend *b, const double terms[FCT_NEAREST_ANCHORS][TERMS],
                       double a[TERMS][TERMS]) {
    double total = 0;
    memset(a, 0, TERMS * sizeof *a);
    for (int i = 0; i < b->near.count; ++i) {
        total += b->weights[i];
        for (int j = 0; j < TERMS; ++j)
            for (int k = 0; k < TERMS; ++k) a[j][k] += b->weights[i] * terms[i][j] * terms[i][k];
    }
    for (int j = 1; j < TERMS; ++j)
        a[j][j] += total * (j < LINEAR_TERMS ? LINEAR_PENALTY : QUADRATIC_PENALTY);
}

/* Replaces the weights w by the v of the sum above: v_i = w_i f_i . z with (F^T W F + penalties) z = (1, 0,
 * ...), where f_i are the terms at anchor i. */
static void fit_weights(const fct_anchors *t, v3 p, v3 n, blend *b) {
    double terms[FCT_NEAREST_ANCHORS][TERMS], a[TERMS][TERMS], z[TERMS] = {1};
    if (!list_terms(t, p, n, b, terms)) return;
    sum_matrix(b, terms, a);
    solve_terms(a, z);
    for (int i = 0; i < b->near.count; ++i) {
        double sum = 0;
        for (int j = 0; j < TERMS; ++j) sum += terms[i][j] * z[j];
        b->weights[i] *= sum;
    }
}

/* The weighted sum of the anchors' values, within the range of those that count: the polynomial must not
 * overshoot. */
static void sum_values(const blend *b, double irradiance[3]) {
    double total = 0;
    for (int i = 0; i < b->near.count; ++i) total += b->weights[i];
    for (int c = 0; c < 3; ++c) {
        double sum = 0, lowest = HUGE_VAL, highest = 0;
        for (int i = 0; i < b->near.count; ++i) {
            if (b->weights[i] == 0) continue;
            sum += b->weights[i] / total * b->values[i][c];
            lowest = fct_min(lowest, b->values[i][c]), highest = fct_max(highest, b->values[i][c]);
        }
        irradiance[c] = fct_min(fct_max(sum, lowest), highest);
    }
}

/* Finds the anchors, their values and their weights w. Returns false without any anchor. */
static bool find_blend(const fct_anchors *t, const fct_elements *set, const float point[3],
                       const float normal[3], float offset, bool flat, blend *b, uint64_t *rays) {
    fct_anchors_nearest(t, point, normal, &b->near);
    if (b->near.count == 0) return false;
    weigh_anchors(t, v3_load(point), v3_load(normal), b);
    if (flat && b->near.count > 1) drop_hidden_anchors(t, set, point, normal, offset, b, rays);
    double total = 0;
    for (int i = 0; i < b->near.count; ++i) total += b->weights[i];
    if (total <= 0) b->weights[0] = 1; /* all are hidden: the nearest one decides */
    return true;
}

void fct_anchors_irradiance(const fct_anchors *t, const fct_elements *set, const float point[3],
                            const float normal[3], float offset, bool flat, double irradiance[3],
                            uint64_t *rays) {
    blend b;
    irradiance[0] = irradiance[1] = irradiance[2] = 0;
    if (!find_blend(t, set, point, normal, offset, flat, &b, rays)) return;
    fit_weights(t, v3_load(point), v3_load(normal), &b);
    sum_values(&b, irradiance);
}

/* The coefficients of the polynomial of a channel: (F^T W F + penalties) z = F^T W E. */
static void fit_polynomial(const blend *b, const double terms[FCT_NEAREST_ANCHORS][TERMS], int channel,
                           double z[TERMS]) {
    double a[TERMS][TERMS];
    sum_matrix(b, terms, a);
    for (int j = 0; j < TERMS; ++j) z[j] = 0;
    for (int i = 0; i < b->near.count; ++i)
        for (int j = 0; j < TERMS; ++j) z[j] += b->weights[i] * terms[i][j] * b->values[i][channel];
    solve_terms(a, z);
}

/* The weighted mean square, per channel, of the anchors' differences from the polynomial; 0 if no anchor is
 * beside p. */
static void measure_residuals(const fct_anchors *t, v3 p, v3 n, const blend *b, double squares[3]) {
    double terms[FCT_NEAREST_ANCHORS][TERMS], z[TERMS], total = 0;
    squares[0] = squares[1] = squares[2] = 0;
    if (!list_terms(t, p, n, b, terms)) return;
    for (int i = 0; i < b->near.count; ++i) total += b->weights[i];
    for (int c = 0; c < 3; ++c) {
        fit_polynomial(b, terms, c, z);
        for (int i = 0; i < b->near.count; ++i) {
            double apart = b->values[i][c];
            for (int j = 0; j < TERMS; ++j) apart -= z[j] * terms[i][j];
            squares[c] += b->weights[i] / total * apart * apart;
        }
    }
}

void fct_anchors_variance(const fct_anchors *t, const fct_elements *set, const float point[3],
                          const float normal[3], float offset, bool flat, double variance[3],
                          uint64_t *rays) {
    blend b;
    double squares = 0;
    variance[0] = variance[1] = variance[2] = 0;
    if (!find_blend(t, set, point, normal, offset, flat, &b, rays)) return;
    measure_residuals(t, v3_load(point), v3_load(normal), &b, variance);
    fit_weights(t, v3_load(point), v3_load(normal), &b);
    for (int i = 0; i < b.near.count; ++i) squares += b.weights[i] * b.weights[i];
    for (int c = 0; c < 3; ++c) variance[c] *= squares; /* the sum of the weights is 1 */
}
