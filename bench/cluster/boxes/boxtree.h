/* bench/cluster/boxes/boxes/boxtree.h: binary trees of boxes with one triangle per leaf, from several
 * builders, and plain queries that walk all of them with the same code.
 *
 * Box i < face_count - 1 is inner node i. Box face_count - 1 + f is the leaf of face f. A child is the number
 * of a box. All boxes have the same form, so only the trees and their frames differ.
 */
#ifndef FCT_BENCH_CLUSTER_BOXTREE_H
#define FCT_BENCH_CLUSTER_BOXTREE_H

#include "base/math/vec.h"
#include "facetree/cluster.h"

typedef struct box_tree {
    const fct_mesh *mesh;
    uint32_t inner_count, root;
    fct_box *boxes;       /* inner_count + face_count */
    uint32_t (*child)[2]; /* inner_count */
    double seconds;       /* of the build; 0: unknown */
} box_tree;

/* The boxes of our tree. The box of a leaf is the smallest rectangle around its triangle. */
void box_tree_take(const fct_mesh *mesh, const fct_tree *tree, box_tree *out);
/* An OBB tree from the top (Gottschalk, Lin, Manocha 1996). The axes are those of the surface's covariance.
 * The cut is at the mean, across the longest axis that has faces on both sides. Without such an axis, the
 * faces are halved. */
void box_tree_oriented(const fct_mesh *mesh, box_tree *out);
/* Axis-aligned boxes by the surface area heuristic with 16 bins. */
void box_tree_aligned(const fct_mesh *mesh, box_tree *out);
/* Our clusters of the cut into `count`, below a new top by the surface area heuristic over their boxes. */
void box_tree_regroup(const fct_mesh *mesh, const fct_tree *tree, uint32_t count, box_tree *out);
void box_tree_release(box_tree *tree);

/* The box of the listed faces along the given axes. */
fct_box box_fit(const fct_mesh *mesh, const uint32_t *faces, uint32_t count, const v3 axes[3]);
/* Axes of the surface's covariance, least spread first. Returns the centroid. */
v3 box_axes(const fct_mesh *mesh, const uint32_t *faces, uint32_t count, v3 axes[3]);
/* A quarter of the surface area of the box. */
static inline double box_surface(const fct_box *box) {
    double a = (double)box->half[0], b = (double)box->half[1], c = (double)box->half[2];
    return 2 * (a * b + b * c + c * a);
}

/* The sum of the surface areas of all inner boxes, over the squared diagonal. */
double box_tree_area(const box_tree *tree, double diagonal);
uint32_t box_tree_depth(const box_tree *tree);
/* The number of vertices outside of a box above their triangle by more than 1e-5 of the diagonal. */
uint64_t box_tree_escaped(const box_tree *tree, double diagonal);

typedef struct box_visits {
    uint64_t boxes, triangles;
} box_visits;

/* The nearest t >= 0 of origin + t direction; INFINITY on a miss. Tests both children and enters the nearer
 * one first. */
double box_tree_ray(const box_tree *tree, v3 origin, v3 direction, box_visits *visits);

/* x -> rotation x + shift */
typedef struct box_pose {
    v3 axes[3]; /* rows of the rotation */
    v3 shift;
} box_pose;
/* Whether the surface touches its copy in the given pose. Tests pairs of boxes and opens the larger box of a
 * pair that overlaps, until two triangles touch. */
bool box_tree_touches(const box_tree *tree, const box_pose *pose, box_visits *visits);

#endif
