/* facetree/simplify.h: quadric simplification with attributes.
 *
 * Source: Garland, "Quadric-Based Polygonal Surface Simplification", CMU 1999, chapters 3 and 5: iterative
 * edge contraction by n-dimensional quadrics over position and vertex colours.
 */
#ifndef FACETREE_SIMPLIFY_H
#define FACETREE_SIMPLIFY_H

#include "facetree/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum fct_placement {
    FCT_PLACE_OPTIMAL, /* the minimiser, else the best on the segment, else the better of ends and middle
                          (3.5) */
    FCT_PLACE_SEGMENT,
    FCT_PLACE_ENDS,  /* better of both ends and the middle */
    FCT_PLACE_SUBSET /* better of both ends */
} fct_placement;

typedef enum fct_stop {
    FCT_STOP_FACES,    /* the face count was reached */
    FCT_STOP_ERROR,    /* the next contraction would cost more than max_error */
    FCT_STOP_EXHAUSTED /* no contraction is allowed any more */
} fct_stop;

typedef struct fct_simplify_def {
    uint32_t size;
    uint32_t target_faces; /* stop at or below; default 0 */
    double
        max_error; /* bound on the square root of a contraction's quadric error over its area, in the mesh's
                      unit (a root mean squared distance when no attributes are used); default infinity */
    fct_placement placement;
    double color_weight; /* of vertex colours against positions in the unit cube; 0: colours are interpolated
                            but do not steer; default .1 where the mesh has colours */
    double texcoord_weight; /* texture coordinates likewise; seams are kept; default .1 where the mesh has
                               them */
    double normal_weight;   /* vertex normals likewise, renormalised in the output; default .01 where the mesh
                               has them */
    double
        boundary_weight; /* of the planes that hold boundary edges and colour borders (3.6); default 1000 */
    double feature_threshold; /* face colours that differ by more in |dr| + |dg| + |db| make a border; default
                                 .1; infinity: none */
    double regularization;    /* gamma of the squared distance to the edge's midpoint, relative to the trace;
                                 default 1e-9 */
    uint32_t refit_passes;    /* passes of the vertex refit after the contractions; default 2; 0: the plain
                                 quadric result; none with FCT_PLACE_SUBSET, whose vertices are the input's */
    bool keep_topology;       /* refuse contractions that fail the link condition; default false */
    bool check_foldover;      /* refuse contractions that turn a face over; default true */
} fct_simplify_def;
FCT_API fct_simplify_def fct_simplify_def_default(void);

typedef struct fct_simplify_stats {
    uint32_t faces_before, faces_after;
    fct_stop stopped_because;
    double max_cost; /* the largest cost of a contraction made, as max_error is measured */
    double seconds_init, seconds_contract, seconds_refit;
} fct_simplify_stats;

/* Simplifies; the result's arrays are those of the input, its faces in the input's order. Vertices with equal
 * coordinates move together whatever their attributes where open sides of their faces coincide, so doubled
 * creases and seams do not crack; doubles with equal attributes become one vertex. Bodies that only touch are
 * simplified on their own. Vertices that no face uses, and faces with two corners at one place, are dropped.
 * Colours stay within the range of the input's. A point of more than 512 faces keeps its place. Same bits on
 * every run and for every thread count. stats may be NULL. Any valid mesh, with no faces too. Errors: DATA
 * (invalid mesh; a negative or NaN option), MEMORY, CANCELLED. */
FCT_API fct_result fct_simplify(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def,
                                fct_mesh *out, fct_simplify_stats *stats);

#ifdef __cplusplus
}
#endif
#endif
