/* bvh/pair/far.c: see far.h. */
#include "bvh/pair/far.h"

void fct_bound_far_boxes(const fct_placed_box *b, const fct_pair_node *n, const fct_space_map *map,
                         double bound2[8]) {
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
        double gap = length - radius - slack;
        bound2[i] = gap > 0 ? gap * gap : 0;
    }
}

static v3 find_middle(const v3 p[][3], uint32_t count) {
    v3 lower = p[0][0], upper = p[0][0];
    for (uint32_t i = 0; i < 3 * count; ++i) {
        v3 q = p[i / 3][i % 3];
        lower = v3_make(fct_min(lower.x, q.x), fct_min(lower.y, q.y), fct_min(lower.z, q.z));
        upper = v3_make(fct_max(upper.x, q.x), fct_max(upper.y, q.y), fct_max(upper.z, q.z));
    }
    return v3_scale(v3_add(lower, upper), .5);
}

void fct_bound_far_leaves(const fct_pair_map *map, const fct_leaf *a, const fct_leaf *b,
                          fct_far_leaves *out) {
    v3 p[FCT_LEAF_FACES][3], q[FCT_LEAF_FACES][3];
    for (uint32_t i = 0; i < a->count; ++i) fct_pair_triangle_a(map, a->first + i, p[i]);
    for (uint32_t i = 0; i < b->count; ++i) fct_pair_triangle_b(map, b->first + i, q[i]);
    v3 from = find_middle(p, a->count), to = find_middle(q, b->count);
    v3 line = v3_sub(to, from), along = v3_unit(line);
    double error = 0x1p-48 * (v3_norm(line) + v3_norm(from) + v3_norm(to));
    for (uint32_t i = 0; i < a->count; ++i) {
        double top = -INFINITY;
        for (int c = 0; c < 3; ++c) top = fct_max(top, v3_dot(along, v3_sub(p[i][c], from)));
        out->top_a[i] = top + error;
    }
    for (uint32_t i = 0; i < b->count; ++i) {
        double bottom = INFINITY;
        for (int c = 0; c < 3; ++c) bottom = fct_min(bottom, v3_dot(along, v3_sub(q[i][c], from)));
        out->bottom_b[i] = bottom - error;
    }
}
