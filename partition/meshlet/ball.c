/* partition/meshlet/ball.c: smallest enclosing ball by pivoting.
 *
 * At most four support points define the ball. The farthest point outside enters; the smallest ball around it
 * and the support passes through it and a subset of the support, so at most 15 small systems are solved. The
 * radius grows with every step, so no support returns and the loop ends, in practice after fewer than ten
 * passes over the points. It stops where rounding stops the growth.
 */
#include "partition/meshlet/ball.h"

#include <stdbool.h>

enum { MOST_PASSES = 64 };

/* The centre of the smallest ball with all points on its sphere; false if they are dependent. */
static bool fit_ball(const v3 *p, int count, v3 *center) {
    v3 d[3];
    double g[3][4];
    *center = p[0];
    for (int i = 0; i + 1 < count; ++i) d[i] = v3_sub(p[i + 1], p[0]);
    for (int i = 0; i + 1 < count; ++i) {
        for (int k = 0; k + 1 < count; ++k) g[i][k] = v3_dot(d[i], d[k]);
        g[i][3] = 0.5 * v3_norm2(d[i]);
    }
    for (int i = 0; i + 1 < count;
         ++i) { /* elimination without pivoting: the Gram matrix is positive definite */
        if (!(g[i][i] > 1e-12 * v3_norm2(d[i]))) return false;
        for (int k = 0; k + 1 < count; ++k) {
            double factor = g[k][i] / g[i][i];
            for (int j = i; j < 4 && k != i; ++j) g[k][j] -= factor * g[i][j];
        }
    }
    for (int i = 0; i + 1 < count; ++i) *center = v3_mad(*center, g[i][3] / g[i][i], d[i]);
    return true;
}

/* Replaces the support by that of the smallest ball around it and `entering`. */
static bool pivot_support(v3 *support, int *count, v3 entering, v3 *center, double *squared) {
    double best = INFINITY;
    int best_set = -1;
    v3 best_center = *center;
    for (int set = 0; set < 1 << *count; ++set) {
        v3 chosen[5], middle;
        int size = 0;
        chosen[size++] = entering;
        for (int i = 0; i < *count; ++i)
            if (set >> i & 1) chosen[size++] = support[i];
        if (size > 4 || !fit_ball(chosen, size, &middle)) continue;
        double reach = v3_norm2(v3_sub(entering, middle));
        bool holds = reach < best;
        for (int i = 0; i < *count && holds; ++i)
            holds = v3_norm2(v3_sub(support[i], middle)) <= reach * (1 + 1e-10);
        if (holds) best = reach, best_set = set, best_center = middle;
    }
    if (best_set < 0 || !(best > *squared)) return false;
    int kept = 0;
    for (int i = 0; i < *count; ++i)
        if (best_set >> i & 1) support[kept++] = support[i];
    support[kept++] = entering;
    *count = kept, *center = best_center, *squared = best;
    return true;
}

static uint32_t find_farthest(const v3 *points, uint32_t count, v3 center, double *squared) {
    uint32_t far = 0;
    *squared = -1;
    for (uint32_t i = 0; i < count; ++i) {
        double d = v3_norm2(v3_sub(points[i], center));
        if (d > *squared) *squared = d, far = i;
    }
    return far;
}

void fct_smallest_ball(const v3 *points, uint32_t count, v3 *center, double *radius) {
    v3 support[5], middle = points[0];
    int held = 1;
    double squared = 0, reach;
    support[0] = points[0];
    *center = middle;
    find_farthest(points, count, middle, &reach);
    *radius = sqrt(reach);
    for (int pass = 0; pass < MOST_PASSES; ++pass) {
        uint32_t far = find_farthest(points, count, middle, &reach);
        if (reach < *radius * *radius) *center = middle, *radius = sqrt(reach);
        if (reach <= squared * (1 + 1e-12) || !pivot_support(support, &held, points[far], &middle, &squared))
            break;
    }
}
