/* simplify/collapse.h: one edge contraction, applied to rings, wedges, edges and quadrics. */
#ifndef FCT_SIMPLIFY_COLLAPSE_H
#define FCT_SIMPLIFY_COLLAPSE_H

#include "simplify/cost/placement.h"

/* Contracts the edge between the points `ends`: ends[keep] receives the corners, the quadric and the wedges
 * of the other end and moves to the candidate. ring_b holds the count_b corners of the other end. */
void fct_simplify_collapse(fct_simplifier *s, const uint32_t ends[2], const fct_candidate *candidate,
                           uint32_t keep, uint32_t count_b);
/* Removes the faces at the point that was contracted last. */
void fct_simplify_remove_faces(fct_simplifier *s, uint32_t point);
/* Removes one face. */
void fct_simplify_remove_face(fct_simplifier *s, uint32_t f);
/* Takes an edge out of the queue for good. */
void fct_simplify_drop_edge(fct_simplifier *s, uint32_t e);

#endif
