/* facetree/simplify.h: simplifies a mesh by edge contractions, and keeps its shape and attributes.
 *
 * Quadrics measure the error of position and attributes together: vertex colours, texture coordinates and
 * vertex normals. Source: Garland, "Quadric-Based Polygonal Surface Simplification", CMU 1999, chapters 3
 * and 5.
 */
#ifndef FACETREE_SIMPLIFY_H
#define FACETREE_SIMPLIFY_H

#include "facetree/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The position of the point that replaces an edge (Garland 1999, section 3.5). */
typedef enum fct_placement {
    FCT_PLACE_OPTIMAL, /* the minimum of the quadric; if it is more than two edge lengths away, as SEGMENT */
    FCT_PLACE_SEGMENT, /* the minimum on the edge */
    FCT_PLACE_ENDS,    /* the best of both ends and the midpoint */
    FCT_PLACE_SUBSET   /* the better of both ends, with its attributes */
} fct_placement;

/* What one step of the simplifier contracts to a point. */
typedef enum fct_primitive {
    FCT_PRIMITIVE_EDGE, /* the ends of an edge */
    /* The corners of a face (Garland 1999, section 3.8): the cheapest edge of the face that can be
     * contracted, and then the edge to the third corner, at the best position for all three. If the second
     * edge cannot be contracted, or costs more than twice what the face seemed to cost, the first
     * contraction stays. When no face is left that can be contracted, edges are. It takes half as many
     * steps, and the errors are larger. It is here for comparison. Not together with pair_distance. */
    FCT_PRIMITIVE_FACE
} fct_primitive;

/* How much a face weighs in the quadric of a corner (Garland 1999, section 3.4.1). ANGLE and UNIFORM are
 * scaled so that all weights add up to the area. They depend on the tessellation, AREA does not. */
typedef enum fct_weighting {
    FCT_WEIGHT_AREA,   /* a third of its area */
    FCT_WEIGHT_ANGLE,  /* the angle at the corner */
    FCT_WEIGHT_UNIFORM /* the same for all faces */
} fct_weighting;

typedef enum fct_stop {
    FCT_STOP_FACES,    /* the face count is at most target_faces */
    FCT_STOP_ERROR,    /* every possible contraction has a larger error than max_error */
    FCT_STOP_EXHAUSTED /* no contraction is allowed */
} fct_stop;

/* Only for color_weight: 2 / sqrt(faces of the result), at most .1. Without target_faces the result is taken
 * to have as many faces as the longest side of the bounds has lengths of max_error. So colours weigh less in
 * larger scenes and finer results. */
#define FCT_WEIGHT_AUTO (-1.)

/* Attributes. The simplifier knows three attributes, each with a weight: vertex colours, texture coordinates
 * and vertex normals. Positions are scaled so that the longest side of the bounds is 1. An attribute is
 * scaled so that its range is about 1, and then multiplied by its weight. For colours this is the range from
 * the 2nd to the 98th percentile, but at least 1/20 of the full range. A weight above 0 makes the attribute a
 * part of the error. With weight 0 it does not count in the error and is interpolated, but its seams are
 * still held in place. So it is with the arrays irradiance, direct, indirect and error, which have no weight.
 * A weight has no effect if the mesh does not have the attribute. */
typedef struct fct_simplify_def {
    uint32_t size;
    uint32_t target_faces; /* stop at this count or below; default 0 */
    /* Make no contraction whose error is larger; in the mesh's unit; default infinity. The error is a
     * distance, the root of the mean squared distance from the planes of the faces plus that from the planes
     * of the boundary (without boundary_weight). Attributes have no part in it. */
    double max_error;
    /* Points of different bodies that are at most this far apart may be contracted, too, and join the bodies
     * (Garland 1999, 3.2.1 and 6.4); in the mesh's unit, and up to the rounding of its coordinates; default
     * 0: only edges are contracted. A body is a set of faces that common points join, so points of one body
     * are no pair (closed fans that share a vertex are bodies of their own, if nothing else joins them): a
     * thin sheet does not collapse onto its other side. Each point has a pair with the nearest point of each
     * of the 8 nearest other bodies in reach, so there are at most 8 pairs per point at any distance
     * (infinity is allowed). Locked points and points of more than 512 faces have none. Such a pair costs
     * what both quadrics measure at the best position, and no face of it vanishes. Then equal faces of two
     * closed bodies that stand on each other, an inner wall, vanish, and of two equal faces that look the
     * same way one does. Not together with keep_topology. */
    double pair_distance;
    fct_primitive primitive; /* default EDGE */
    fct_placement placement; /* default OPTIMAL */
    fct_weighting weighting; /* default AREA */
    double color_weight;     /* default FCT_WEIGHT_AUTO */
    double texcoord_weight;  /* default .1 */
    double normal_weight;    /* default .01 */
    /* Squared distances of boundaries, borders and seams from their place (3.6) count this times as much as
     * those of the surface; default 3. With 0 nothing holds them. With any other weight a straight part of
     * such a curve stays on its line, and its ends stay where they are, unless a contraction has to give up
     * one of two such rules. */
    double boundary_weight;
    /* Two faces whose colours differ by more in |dr| + |dg| + |db| make a border; default .1; infinity: no
     * borders. Two faces of different materials always make one. */
    double feature_threshold;
    /* Gamma: the weight of the squared distance to the edge's midpoint, relative to the trace of the quadric;
     * default 1e-9. */
    double regularization;
    uint32_t refit_passes; /* passes that fit the vertices to the input after the contractions, at most 100;
                              default 2. None are made with SUBSET, whose vertices are those of the input */
    /* vertex_count bytes, or NULL. A vertex whose byte is not 0 keeps its position and attributes exactly and
     * is not contracted away. Other vertices at its place that are joined with it are locked too. */
    const uint8_t *locks;
    bool lock_border;   /* lock the vertices of open boundaries; default false */
    bool keep_topology; /* refuse contractions that fail the link condition; default false */
    /* Refuse contractions that make a bad face or edge: a face that folds over, loses its area or gets the
     * corners of another, or an edge of more than two faces; default true. */
    bool check_foldover;
} fct_simplify_def;
FCT_API fct_simplify_def fct_simplify_def_default(void);

typedef struct fct_simplify_stats {
    uint32_t faces_before, faces_after;
    fct_stop stopped_because;
    uint32_t pairs_found, pairs_joined; /* by pair_distance: candidates, and contractions */
    double max_cost; /* the largest error of a contraction that was made, as max_error measures it */
    /* Errors of the result: root mean square, by area, over samples of the input (vertices and centroids of
     * faces: up to 12 per vertex of the result all of them, then one of eight, at most 32, and at least 8,192
     * in all), and the largest. A sample's distance is that to the faces of the result around it, so the
     * nearest one may be nearer. In units of the mesh.
     */
    double distance_rms, distance_max;
    double color_rms;    /* of one component */
    double texcoord_rms; /* length of the difference of (u, v); 0 if the mesh has no such attribute */
    double normal_rms;   /* length of the difference of normals, before they get unit length */
    /* The share of the input's area (0 to 1) that these errors do not cover, because the result has no faces
     * there: bodies that vanished, and corners that lost their last face. Inner walls that pairs removed do
     * not count. */
    double lost_area;
    double seconds_init, seconds_contract, seconds_refit;
} fct_simplify_stats;

/* Simplifies any valid mesh, also one without faces. *out has the arrays of the input, and its faces are in
 * the order of the input.
 *
 * Vertices: if open sides of faces coincide, their vertices move together, also with different attributes. So
 * doubled creases and texture seams do not crack. Doubled vertices with equal attributes become one vertex.
 * Bodies that only touch stay apart. A vertex whose faces form several closed fans becomes one vertex per
 * fan, unless keep_topology is on, so the result can have more vertices than the input. A point of more than
 * 512 faces does not move. Faces: with check_foldover, the result has no duplicate face, no face whose area
 * is 0 in the written floats, no two faces folded onto each other (less than 26 degrees between them, before
 * their corners become floats; several turns of less than 4 degrees each may lead there) and no edge of more
 * than two faces, unless the input has such there; faces lower than 1e-15 of the longest side of the bounds
 * count as faces without area. If no other contraction is left, more than target_faces remain. Attributes
 * stay within the range of each component in the input; normals then get unit length. Dropped: vertices that
 * no face uses, and faces with two corners at one point. Every run and every thread count give the same bits.
 * stats may be NULL. Errors: DATA (invalid mesh; an option out of its range), MEMORY, CANCELLED. */
FCT_API fct_result fct_simplify(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def,
                                fct_mesh *out, fct_simplify_stats *stats);

/* Several levels in one run: out[i] has at most target_faces[i] faces, a descending list. The contractions of
 * a level continue those of the level before, and each level is fitted to the input. def->target_faces is not
 * used; the automatic weight of colours is that of the first level. `stats` has room for `count` entries, or
 * is NULL. On failure no mesh is left. Errors: as fct_simplify; DATA, too, if the list is empty or not
 * descending.
 */
FCT_API fct_result fct_simplify_levels(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def,
                                       const uint32_t *target_faces, uint32_t count, fct_mesh *out,
                                       fct_simplify_stats *stats);

#ifdef __cplusplus
}
#endif
#endif
