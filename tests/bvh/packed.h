/* tests/bvh/packed.h: the packed structure read as plain boxes, in double. */
#ifndef FCT_TESTS_BVH_PACKED_H
#define FCT_TESTS_BVH_PACKED_H

#include "models.h"

#include "bvh/model.h"

static inline bool is_leaf(uint32_t ref) {
    return ref & FCT_REF_LEAF;
}
static inline bool is_oriented(uint32_t ref) {
    return !is_leaf(ref) && (ref & FCT_REF_ORIENTED);
}

static inline uint32_t child_count(const fct_bvh *bvh, uint32_t ref) {
    const void *node = fct_bvh_node(bvh, ref);
    uint32_t present = is_oriented(ref) ? ((const fct_oriented_node *)node)->present
                                        : ((const fct_axis_node *)node)->present;
    uint32_t count = 0;
    while (present >> count & 1) ++count;
    assert_int_equal(present >> count, 0);
    return count;
}

static inline uint32_t child_of(const fct_bvh *bvh, uint32_t ref, uint32_t i) {
    const void *node = fct_bvh_node(bvh, ref);
    return is_oriented(ref) ? ((const fct_oriented_node *)node)->child[i]
                            : ((const fct_axis_node *)node)->child[i];
}

/* Box i of a node as three slabs -1 <= row . p + offset <= 1; rows of an axis node are parallel to the axes.
 */
typedef struct plain_box {
    v3 row[3];
    double offset[3];
} plain_box;

static inline plain_box box_of(const fct_bvh *bvh, uint32_t ref, uint32_t i) {
    plain_box box;
    v3 center = v3_load(bvh->center);
    for (int k = 0; k < 3; ++k) {
        if (is_oriented(ref)) {
            const fct_oriented_node *node = fct_bvh_node(bvh, ref);
            box.row[k] = v3_make(node->map[k][0][i], node->map[k][1][i], node->map[k][2][i]);
            box.offset[k] = node->map[k][3][i] - v3_dot(box.row[k], center);
        } else {
            const fct_axis_node *node = fct_bvh_node(bvh, ref);
            double lower = node->bounds[k][0][i], upper = node->bounds[k][1][i], half = (upper - lower) / 2;
            box.row[k] = v3_scale(v3_make(k == 0, k == 1, k == 2), 1 / half);
            box.offset[k] = -(upper + lower) / 2 / half;
        }
    }
    return box;
}

/* Entry distance of the ray o + t d into the box, or INFINITY if it misses the box within [t_min, t_max]. */
static inline double box_entry(const plain_box *box, v3 o, v3 d, double t_min, double t_max) {
    for (int k = 0; k < 3; ++k) {
        double at = v3_dot(box->row[k], o) + box->offset[k], go = v3_dot(box->row[k], d);
        if (go == 0) {
            if (fabs(at) > 1) return INFINITY;
            continue;
        }
        double a = (-1 - at) / go, b = (1 - at) / go;
        t_min = fmax(t_min, fmin(a, b)), t_max = fmin(t_max, fmax(a, b));
    }
    return t_min <= t_max ? t_min : INFINITY;
}

static inline double plain_box_distance(const plain_box *box, v3 p) {
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
        double beyond = fabs(v3_dot(box->row[k], p) + box->offset[k]) - 1;
        if (beyond > 0) sum += beyond * beyond / v3_norm2(box->row[k]);
    }
    return sqrt(sum);
}

/* Nodes and triangles that no traversal can avoid: those in boxes that the ray enters before t_max. */
static inline void count_entered(const fct_bvh *bvh, uint32_t ref, v3 o, v3 d, double t_min, double t_max,
                                 fct_visits *out) {
    if (is_leaf(ref)) {
        out->triangles += fct_bvh_leaf(bvh, ref)->count;
        return;
    }
    ++out->nodes;
    for (uint32_t i = 0; i < child_count(bvh, ref); ++i) {
        plain_box box = box_of(bvh, ref, i);
        if (box_entry(&box, o, d, t_min, t_max) < INFINITY)
            count_entered(bvh, child_of(bvh, ref, i), o, d, t_min, t_max, out);
    }
}

/* The same for the faces within `distance` of a scaled point. */
static inline void count_within(const fct_bvh *bvh, uint32_t ref, v3 p, double distance, fct_visits *out) {
    if (is_leaf(ref)) return;
    ++out->nodes;
    for (uint32_t i = 0; i < child_count(bvh, ref); ++i) {
        plain_box box = box_of(bvh, ref, i);
        if (plain_box_distance(&box, p) <= distance)
            count_within(bvh, child_of(bvh, ref, i), p, distance, out);
    }
}

/* Thin square bars along a diagonal, far apart: oriented boxes are much smaller than axis boxes there. */
static inline fct_mesh make_bars(const fct_env *env, uint32_t count, uint64_t seed) {
    enum { STEPS = 40 };
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(env, count * 4 * (STEPS + 1), count * 8 * STEPS, 0, &mesh), FCT_OK);
    uint32_t vertex = 0, *t = mesh.triangles;
    for (uint32_t b = 0; b < count; ++b) {
        v3 at = {random_unit(&seed), random_unit(&seed), random_unit(&seed)}, x, y;
        v3 along = v3_unit(v3_make(1, 1 + .2 * random_unit(&seed), 1));
        v3_frame(along, &x, &y);
        uint32_t base = vertex;
        for (uint32_t s = 0; s <= STEPS; ++s)
            for (uint32_t c = 0; c < 4; ++c) {
                v3 p = v3_mad(at, 2.0 * s / STEPS, along);
                p = v3_mad(v3_mad(p, c & 1 ? .01 : -.01, x), c & 2 ? .01 : -.01, y);
                v3_store(mesh.positions + 3 * (size_t)vertex++, p);
            }
        for (uint32_t s = 0; s < STEPS; ++s)
            for (uint32_t side = 0; side < 4; ++side) {
                static const uint32_t ring[5] = {0, 1, 3, 2, 0};
                uint32_t a = base + 4 * s + ring[side], d = base + 4 * s + ring[side + 1];
                uint32_t two[6] = {a, d, d + 4, a, d + 4, a + 4};
                memcpy(t, two, sizeof two);
                t += 6;
            }
    }
    return mesh;
}

#endif
