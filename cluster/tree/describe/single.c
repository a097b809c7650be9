/* cluster/tree/describe/single.c: see single.h. Uses one of the eight lanes of the code that describes
 * blocks, so that a cluster gets the same bits from both. */
#include "cluster/tree/describe/single.h"

#include <float.h>
#include <string.h>

void fct_points_describe(const fct_octet_row *points, uint32_t point_count, const float *normals,
                         uint32_t normal_count, const fct_sums *sums, fct_cluster *out) {
    fct_octet o;
    fct_octet_normals n = {.normals = normals};
    const fct_sums *all[8];
    for (int i = 0; i < 8; ++i) all[i] = sums, n.counts[i] = normal_count;
    fct_octet_sum(&o, all);
    fct_octet_cone(&o, &n);
    fct_octet_turn(&o, points, point_count);
    fct_octet_fit(&o, points, point_count);
    fct_octet_store(&o, 0, out);
}

void fct_leaf_describe(const fct_tree_view *view, uint32_t place, fct_cluster *out) {
    const uint32_t *triangle = view->triangles + 3 * (size_t)place;
    const float *corners[3][4];
    float points[3][4] = {{0}}, normals[4][4];
    fct_octet_row rows[3];
    fct_sums sums[4];
    for (int k = 0; k < 3; ++k) {
        memcpy(points[k], view->positions + 3 * (size_t)triangle[k], 3 * sizeof(float));
        fct_octet_row_fill(&rows[k], points[k]);
        for (int i = 0; i < 4; ++i) corners[k][i] = points[k];
    }
    fct_sums_four((const float *const(*)[4])corners, sums, normals);
    memset(out, 0, sizeof *out);
    fct_points_describe(rows, 3, normals[0], 1, sums, out);
    out->child[0] = out->child[1] = FCT_NONE;
    out->first = place, out->count = 1;
}

float fct_leaf_area(const fct_tree_view *view, uint32_t place) {
    fct_sums sums;
    fct_sums_face(view->positions, view->triangles + 3 * (size_t)place, &sums);
    return (float)(sums.area < (double)FLT_MAX ? sums.area : (double)FLT_MAX);
}
