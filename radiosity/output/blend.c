/* radiosity/output/blend.c: see blend.h.
 *
 * Irradiance caching after Ward, Rubinstein and Clear 1988, with weights that reach zero:
 *   x_i = |p - p_i| / reach_i + .7 |n - n_i|            (.7 |n - n_i| is about sqrt(1 - n . n_i))
 *   w_i = (1 / x_i - .98 / max x)^2
 *   E   = sum w_i E_i(n) / sum w_i,   E_i(n) = E_i + gradient_i . (n - n_i)
 * The weight of the farthest anchor is nearly zero, so the sum hardly changes where one anchor replaces
 * another among the ten nearest.
 */
#include "radiosity/output/blend.h"

/* Weight of |n - n'| against distance / reach. Smaller: bent surfaces show their anchors' light. */
#define TURN_WEIGHT .7
/* Least x, so that a point on an anchor has a finite weight. */
#define LEAST_APART 1e-4
/* Share of 1 / max x that is subtracted. With 1, all weights vanish where all anchors are equally far. */
#define FADE .98
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
        double w = b->near.count == 1 ? 1 : 1 / x[i] - FADE / farthest;
        b->weights[i] = w * w;
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

void fct_anchors_irradiance(const fct_anchors *t, const fct_elements *set, const float point[3],
                            const float normal[3], float offset, bool near_wall, double irradiance[3],
                            uint64_t *rays) {
    blend b;
    irradiance[0] = irradiance[1] = irradiance[2] = 0;
    fct_anchors_nearest(t, point, normal, &b.near);
    if (b.near.count == 0) return;
    weigh_anchors(t, v3_load(point), v3_load(normal), &b);
    if (near_wall && b.near.count > 1) drop_hidden_anchors(t, set, point, normal, offset, &b, rays);
    double total = 0;
    for (int i = 0; i < b.near.count; ++i) total += b.weights[i];
    if (total <= 0) b.weights[0] = total = 1; /* all are hidden: the nearest one decides */
    for (int i = 0; i < b.near.count; ++i)
        for (int c = 0; c < 3; ++c) irradiance[c] += b.weights[i] / total * b.values[i][c];
}
