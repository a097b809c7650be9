/* bench/cluster/boxtree.h: binary trees of boxes down to one triangle a leaf, however they were made, and the
 * plain queries that walk them all alike.
 *
 * Box i < face_count - 1 is inner node i, box face_count - 1 + f is that of face f alone. A child is a box's
 * number. All boxes are in one form, so that only the tree and its frames differ.
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
    double seconds;       /* to build it, 0 where unknown */
} box_tree;

/* The boxes of our own tree. A leaf has its triangle's tightest rectangle. */
void box_tree_take(const fct_mesh *mesh, const fct_tree *tree, box_tree *out);
/* Top down (Gottschalk, Lin, Manocha 1996): axes of the surface's covariance, cut at the mean across the
 * longest side, across the next where all lies on one side of it; halves where no axis parts. */
void box_tree_oriented(const fct_mesh *mesh, box_tree *out);
/* Boxes along the axes of the world, by the surface area heuristic with 16 bins. */
void box_tree_aligned(const fct_mesh *mesh, box_tree *out);
/* Our clusters of a cut into `count`, under a top built anew by the surface area heuristic over their boxes.
 */
void box_tree_regroup(const fct_mesh *mesh, const fct_tree *tree, uint32_t count, box_tree *out);
void box_tree_release(box_tree *tree);

/* The box of the listed faces along the given axes. */
fct_box box_fit(const fct_mesh *mesh, const uint32_t *faces, uint32_t count, const v3 axes[3]);
/* Axes of the surface's covariance, shortest first; returns its mean. */
v3 box_axes(const fct_mesh *mesh, const uint32_t *faces, uint32_t count, v3 axes[3]);
/* Of the box's surface, a quarter. */
static inline double box_surface(const fct_box *box) {
    double a = (double)box->half[0], b = (double)box->half[1], c = (double)box->half[2];
    return 2 * (a * b + b * c + c * a);
}

/* Of the inner boxes' surfaces, over the squared diagonal. */
double box_tree_area(const box_tree *tree, double diagonal);
uint32_t box_tree_depth(const box_tree *tree);
/* Vertices that lie outside a box of their triangle's ancestors by more than 1e-5 of the diagonal. */
uint64_t box_tree_escaped(const box_tree *tree, double diagonal);

typedef struct box_visits {
    uint64_t boxes, triangles;
} box_visits;

/* The nearest t >= 0 of origin + t direction, INFINITY on a miss: both children are tested, the nearer is
 * entered first. */
double box_tree_ray(const box_tree *tree, v3 origin, v3 direction, box_visits *visits);

/* x -> rotation x + shift */
typedef struct box_pose {
    v3 axes[3]; /* rows of the rotation */
    v3 shift;
} box_pose;
/* Whether the tree's surface touches that of its copy in the given pose: pairs of boxes are tested, of a pair
 * that overlaps the larger box is opened, until two triangles touch. */
bool box_tree_touches(const box_tree *tree, const box_pose *pose, box_visits *visits);

#endif
