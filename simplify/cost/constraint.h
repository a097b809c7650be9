/* simplify/cost/constraint.h: what holds the points of boundaries, of borders and of seams in place.
 *
 * Planes through the held sides pull a point towards its curve (Garland 1999, section 3.6). They are kept
 * apart from the quadric of the faces: their mean counts, times the area of the faces. So the weight of a
 * boundary depends neither on the length of its edges nor on how many of them a contraction has merged.
 *
 *     o---o---o---o      Where a curve is straight, its points slide along one line; the ends of the line
 *     |           |      stay where they are. A contraction that can obey only one of two such rules obeys
 *     o---o---o---o      neither: then only the planes hold the point.
 */
#ifndef FCT_SIMPLIFY_CONSTRAINT_H
#define FCT_SIMPLIFY_CONSTRAINT_H

#include "simplify/state.h"

/* Allocates and fills `constraints`, `constraint_of` and `lines`. Needs the topology, the attributes and the
 * quadrics. Errors: MEMORY. */
fct_result fct_simplify_constraints(fct_simplifier *s);

/* The constraint of a point; NULL if nothing holds it. */
static inline const fct_constraint *constraint_at(const fct_simplifier *s, uint32_t point) {
    uint32_t i = s->constraint_of ? s->constraint_of[point] : FCT_NONE;
    return i == FCT_NONE ? NULL : &s->constraints[i];
}

static inline bool point_is_locked(const fct_simplifier *s, uint32_t point) {
    const fct_constraint *held = constraint_at(s, point);
    return held && held->hold == HOLD_LOCK;
}

/* The constraint of the point that replaces a and b. */
typedef struct fct_joint {
    fct_constraint held;
    bool ends[2]; /* the new point may be at a, at b; neither if both are locked */
} fct_joint;

/* False if nothing holds a or b. */
bool fct_constraint_join(const fct_simplifier *s, uint32_t a, uint32_t b, fct_joint *out);
/* Gives point a the joint constraint of a and b, which are contracted to it. */
void fct_constraint_merge(fct_simplifier *s, uint32_t a, uint32_t b);
/* Whether every vertex of a locked point keeps a face if a and b are contracted. body: all their faces
 * vanish. ring_b holds the count_b corners of b. */
bool fct_constraint_keeps_locked(fct_simplifier *s, uint32_t a, uint32_t b, uint32_t count_b, bool body);
/* The factor of `planes` beside the quadric of faces with this area. */
static inline double constraint_weight(const fct_simplifier *s, const fct_constraint *held, double area) {
    return held->planes[10] > 0 ? s->def->boundary_weight * area / held->planes[10] : 0;
}

#endif
