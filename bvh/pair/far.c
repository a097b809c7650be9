/* bvh/pair/far.c: see far.h. */
#include "bvh/pair/far.h"

void fct_bound_far_boxes(const fct_placed_box *b, const fct_pair_node *n, const fct_space_map *map,
                         double bound[8]) {
    for (int i = 0; i < 8; ++i) {
        double d[3], length2 = 0, radius = 0, size = 0;
        for (int k = 0; k < 3; ++k)
            d[k] = (double)n->center[k][i] - b->exact_center[k], length2 += d[k] * d[k];
        double length = sqrt(length2);
        for (int k = 0; k < 3; ++k) {
            double along_a = 0, along_b = 0;
            for (int j = 0; j < 3; ++j)
                along_a += (double)n->axes[k][j][i] * d[j], along_b += (double)b->axes[k][j] * d[j];
            radius += ((double)n->half[k][i] * fabs(along_a) + (double)b->half[k] * fabs(along_b)) / length;
            size += fabs((double)n->half[k][i]) + (double)b->half[k];
        }
        /* Axes and half extents are floats; centres are exact to the blur. */
        double slack = 0x1p-20 * size + 0x1p-46 * length + map->blur +
                       4 * map->skew * (length + size + 2 * (1 + map->factor));
        bound[i] = length - radius - slack;
    }
}

/* The middle of the bounds. *reach: no corner is farther from the origin. */
static v3 find_middle(const v3 p[][3], uint32_t count, double *reach) {
    v3 lower = p[0][0], upper = p[0][0];
    for (uint32_t i = 0; i < 3 * count; ++i) {
        v3 q = p[i / 3][i % 3];
        lower = v3_make(fct_min(lower.x, q.x), fct_min(lower.y, q.y), fct_min(lower.z, q.z));
        upper = v3_make(fct_max(upper.x, q.x), fct_max(upper.y, q.y), fct_max(upper.z, q.z));
    }
    *reach = v3_norm(lower) + v3_norm(v3_sub(upper, lower));
    return v3_scale(v3_add(lower, upper), .5);
}

/* The extents of the faces of a leaf along a direction, plus `error`. Returns the face that reaches farthest.
 */
static uint32_t find_tops(const v3 p[][3], uint32_t count, v3 along, v3 from, double error, double *top) {
    uint32_t most = 0;
    for (uint32_t i = 0; i < count; ++i) {
        double reach = -INFINITY;
        for (int c = 0; c < 3; ++c) reach = fct_max(reach, v3_dot(along, v3_sub(p[i][c], from)));
        top[i] = reach + error;
        if (top[i] > top[most]) most = i;
    }
    return most;
}

bool fct_bound_far_leaves(const fct_pair_map *map, const fct_leaf *a, const fct_leaf *b, v3 way, double reach,
                          fct_far_leaves *out) {
    v3 p[FCT_LEAF_FACES][3], q[FCT_LEAF_FACES][3];
    for (uint32_t i = 0; i < a->count; ++i) fct_pair_triangle_a(map, fct_leaf_place(map->a, a, i), p[i]);
    for (uint32_t i = 0; i < b->count; ++i) fct_pair_triangle_b(map, fct_leaf_place(map->b, b, i), q[i]);
    double reach_a, reach_b, largest = -INFINITY;
    v3 from = find_middle(p, a->count, &reach_a), to = find_middle(q, b->count, &reach_b);
    const v3 directions[2] = {v3_unit(v3_sub(to, from)), way};
    double error = 0x1p-48 * (reach_a + reach_b);
    for (int k = 0; k < 2; ++k) {
        v3 along = directions[k], back = v3_scale(along, -1);
        double *bottom = out->bottom_b[k];
        uint32_t i = find_tops(p, a->count, along, from, error, out->top_a[k]),
                 j = find_tops(q, b->count, back, from, error, bottom);
        for (uint32_t face = 0; face < b->count; ++face) bottom[face] = -bottom[face];
        double gap = bottom[j] - out->top_a[k][i];
        if (gap > reach) return false;
        if (gap > largest) largest = gap, out->first_a = i, out->first_b = j;
    }
    return true;
}
