/* simplify/view/hierarchy.h: the vertex hierarchy of a progressive mesh, and a cut through it.
 *
 * A cut is a set of steps that are done, together with all steps that they need. It can be done in the order
 * of the file, or in any other order that does needed steps first. A step needs
 * - the steps that made the nodes that it replaces, and the nodes that its new faces use. Then the mesh is
 * the finest one with all vertices at their ancestors in the cut, so a closed mesh stays closed and seams do
 * not crack;
 * - strictly, also the last steps before it that changed a face that it changes. If all strict needs of a
 * step are done, and theirs, its faces are faces of some level. A cut does this where a face would fold over,
 * but not for all faces at a hub (walk.h).
 * (Garland 1999, section 7.3; Xia and Varshney, "Dynamic View-Dependent Simplification for Polygonal Models",
 * Visualization 1996, have strict needs everywhere, which refines far more.)
 */
#ifndef FCT_SIMPLIFY_HIERARCHY_H
#define FCT_SIMPLIFY_HIERARCHY_H

#include "simplify/progressive/progressive.h"

/* What a mesh lacks around the point of a step that is not done, and of all steps below it in the tree. */
typedef struct fct_bound {
    float center[3], radius; /* a sphere around the surface that the steps change */
    float low[3], high[3];   /* a box of its unit normals; -1 and 1: there is an open boundary as well */
    float error;             /* the largest distance of a vertex of the finest level from the faces */
    float color;             /* the largest difference of a component of its colour from that of the faces */
} fct_bound;

/* How far a face turns in the levels. */
typedef struct fct_face_turn {
    float normal[3]; /* at the finest level: unit, or 0 */
    float cosine;    /* of the angle to that at any level: the smallest */
} fct_face_turn;

typedef struct fct_hierarchy {
    uint32_t step_count;
    /* Step t needs needs[first_needs[t]] to needs[first_strict[t]], and strictly those to
     * needs[first_needs[t + 1]] as well; step 0, which is always done, is left out. */
    uint32_t *first_needs, *first_strict, *needs;
    /* A tree of the steps with root 0: the parent is the last step that made a node that this step replaces,
     * or 0. What the bounds of children hold is inside that of their parent. */
    uint32_t *parents, *first_children, *siblings;
    fct_bound *bounds;
    fct_face_turn *turns; /* per face */
    /* The cut. */
    uint64_t *done;                     /* a bit per step */
    uint64_t *wanted, *forced, *strict; /* scratch, likewise */
    uint32_t *triangles, *nodes;        /* as those of the progressive mesh */
    uint32_t *stack, *tested;           /* scratch, step_count each */
} fct_hierarchy;

/* NULL is allowed. */
void fct_hierarchy_destroy(const fct_env *env, fct_hierarchy *h);

#endif
