/* facetree/simplifier.h: a simplification that stops, goes on, goes back, and can be steered in between.
 *
 *     fct_simplifier_create(&env, &mesh, &def, &s);
 *     fct_simplifier_run(s, 10000, INFINITY, NULL);
 *     fct_simplifier_save(s, "bunny.fst");       stop here, and resume later; or
 *     fct_simplifier_paint(s, ...);              ask for more faces somewhere
 *     fct_simplifier_undo(s, 50000);             and go back
 *     fct_simplifier_run(s, 5000, INFINITY, NULL);
 *     fct_simplifier_mesh(s, true, &small, NULL);
 *
 * The quadrics of the current points hold all that the simplifier knows about the input, so a run goes on
 * exactly where the run before stopped. Source: Garland, "Quadric-Based Polygonal Surface Simplification",
 * CMU 1999, sections 7.1.3 (interruptible) and 7.4.2 (interactive simplification).
 */
#ifndef FACETREE_SIMPLIFIER_H
#define FACETREE_SIMPLIFIER_H

#include "facetree/simplify.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A mesh on its way from the input to fewer faces. One thread at a time may use it. */
typedef struct fct_simplifier fct_simplifier;

/* Copies the mesh and the options, so both may be released. env must outlive *out. def->target_faces and
 * def->max_error are used only for the automatic weight of colours (FCT_WEIGHT_AUTO). Errors: those of
 * fct_simplify, and DATA if def->pair_distance is above 0: a state holds no pairs. *out is then NULL. */
FCT_API fct_result fct_simplifier_create(const fct_env *env, const fct_mesh *mesh,
                                         const fct_simplify_def *def, fct_simplifier **out);
/* NULL is allowed. */
FCT_API void fct_simplifier_destroy(fct_simplifier *s);

/* The current number of faces. At first: those of the input with three distinct points. */
FCT_API uint32_t fct_simplifier_faces(const fct_simplifier *s);
/* The faces of the mesh that was given to fct_simplifier_create. */
FCT_API uint32_t fct_simplifier_input_faces(const fct_simplifier *s);

/* Contracts until at most target_faces are left, or until every contraction has an error above max_error
 * (INFINITY: no limit). Does nothing if there are no more faces than that.
 *
 * What the sequence of targets changes: a run sorts the edges or faces into a queue and cuts the mesh into
 * blocks anew. With contractions of faces it may stop between the two contractions of a face. So each stop
 * can change the order of contractions of about equal cost, and the runs A, B and the run B alone give other
 * meshes, with about the same error. But equal calls give equal bytes: run(A), run(B) with or without a stop
 * in a file between them; fct_simplify_levels with the targets A, B and a def with target_faces = A; and
 * run(A) alone as fct_simplify. The number of threads changes nothing.
 *
 * stats may be NULL; the errors of the result (distance_rms to normal_rms) and seconds_refit are left to
 * fct_simplifier_mesh. After an error the simplifier is as before the call; after fct_simplifier_forget it
 * keeps the contractions made so far. Errors: DATA (max_error), MEMORY, CANCELLED. */
FCT_API fct_result fct_simplifier_run(fct_simplifier *s, uint32_t target_faces, double max_error,
                                      fct_simplify_stats *stats);

/* The current mesh, as fct_simplify writes it. refit: fits the vertices of the copy to the input; the
 * simplifier itself stays as it is. stats: NULL, or receives faces_before, faces_after, the errors of the
 * result and seconds_refit. Errors: MEMORY, CANCELLED. */
FCT_API fct_result fct_simplifier_mesh(fct_simplifier *s, bool refit, fct_mesh *out,
                                       fct_simplify_stats *stats);

/* Goes back to more faces: the mesh becomes the one that the last run through this number of faces would have
 * left with the target `faces`. So it has at most `faces` faces; if the input has fewer, it is the input.
 * Does nothing if the mesh has at least `faces` faces. The state is restored bit by bit: a run that is
 * repeated gives the same bytes, and the state after undo(N) is that after run(N). Weights and constraints
 * stay: the result is as if the caller had painted and then constrained there. Cost: the runs since the last
 * snapshot, repeated. A snapshot is taken before a run if the mesh has at most half the faces of the snapshot
 * before, or if weights or constraints have changed. So one long run is repeated from its beginning. After an
 * error nothing has changed. Errors: DATA (after fct_simplifier_forget), MEMORY, CANCELLED. */
FCT_API fct_result fct_simplifier_undo(fct_simplifier *s, uint32_t faces);
/* Releases the memory for undo, about twice that of the state, and records no more runs. A run that fails
 * afterwards keeps its contractions. */
FCT_API void fct_simplifier_forget(fct_simplifier *s);

/* The vertices that fct_simplifier_paint takes weights for. */
typedef enum fct_paint_level {
    FCT_PAINT_INPUT,  /* those of the input */
    FCT_PAINT_CURRENT /* those of the mesh that fct_simplifier_mesh writes; a weight also goes to all vertices
                         of the input that were contracted to this one */
} fct_paint_level;

/* Gives each vertex a weight from 1e-6 to 1e6; without paint all are 1. weights: `count` values, one per
 * vertex. The cost of a contraction is multiplied by the largest weight of the vertices of the input that it
 * joins; positions and errors stay as they are. On a smooth surface a region of weight w keeps about w^(1/3)
 * times as many faces per area (docs/simplification.md). Vertices at one place that move together have their
 * largest weight. Replaces earlier weights. Errors: DATA (another count, a weight out of range), MEMORY,
 * without a change. */
FCT_API fct_result fct_simplifier_paint(fct_simplifier *s, fct_paint_level level, const float *weights,
                                        uint32_t count);

/* Contours and points that hold their place (Garland 1999, section 3.6). */
typedef struct fct_constrain_def {
    uint32_t size;
    /* contour_count x 2 vertices of the input: edges of the input that hold like a boundary, contour_weight
     * times as much (default 1; fct_simplify_def.boundary_weight must be above 0). Planes through them,
     * perpendicular to their faces, pull the points of the contour back. With a weight of at least .25,
     * marked before the first run, straight parts also stay on their line and keep their ends. */
    const uint32_t *contour;
    uint32_t contour_count;
    double contour_weight;
    /* point_count vertices of the input, and positions that they are drawn to: point_count x 3, or NULL:
     * where the vertices are in the input. The cost of a place v is point_weight * |v - position|^2 more
     * (3.19), so the weight is an area: the faces of a vertex have the weight of a third of their areas.
     * Default 1. It is no part of max_error. */
    const uint32_t *points;
    const float *positions;
    uint32_t point_count;
    double point_weight;
} fct_constrain_def;
FCT_API fct_constrain_def fct_constrain_def_default(void);

/* Adds contours and point constraints to those that there are. Weights must be above 0 and at most 1e12.
 * Errors: DATA (a pair that is no edge, a vertex without faces, a weight), MEMORY, without a change. */
FCT_API fct_result fct_simplifier_constrain(fct_simplifier *s, const fct_constrain_def *def);

/* Writes the state: the input, and the points, quadrics, faces, wedges and constraints that are left
 * (docs/state-file.md). Replaces the file as a whole; "-" is standard output. The same state gives the same
 * bytes. Steps for undo are not written. Errors: OUTPUT, MEMORY. */
FCT_API fct_result fct_simplifier_save(fct_simplifier *s, const char *path);
/* Reads a state. Each later call gives what it would have given without the stop. "-" is standard input.
 * Errors: INPUT, DATA (no such file, truncated, damaged), MEMORY, with *out = NULL. */
FCT_API fct_result fct_simplifier_load(const fct_env *env, const char *path, fct_simplifier **out);

#ifdef __cplusplus
}
#endif
#endif
