/* simplify/view/walk.h: walks over the levels of a progressive mesh with the corners at each handle listed.
 */
#ifndef FCT_SIMPLIFY_VIEW_WALK_H
#define FCT_SIMPLIFY_VIEW_WALK_H

#include "simplify/progressive/progressive.h"

enum { WALK_HUB = 512 /* a point with more corners of a handle is a hub */ };

/* A ring of a step: the corners at the nodes that the step replaces. Each face around the point that splits
 * has one of them. They are the same before and after the split. Of a hub that does not change, only the
 * faces beside those of the step count, so that a fan is not read once per face. */
typedef struct fct_walk {
    const fct_progressive *m;
    uint32_t step;               /* the steps below are done */
    uint32_t *triangles, *nodes; /* as those of m, at this level */
    uint32_t *next, *previous;   /* per corner: in the list of its handle */
    uint32_t *first;             /* per handle: a corner */
    uint32_t *marks;             /* per face: the last ring that had it */
    uint32_t ring_number;
    uint32_t *ring, ring_count; /* corners */
    size_t ring_room;
} fct_walk;

/* A walk that begins at the base mesh. Errors: MEMORY. */
fct_result fct_walk_begin(const fct_progressive *m, fct_walk *out);
/* Releases all arrays but triangles and nodes. */
void fct_walk_end(fct_walk *w);

/* Splits and contracts. */
void fct_walk_forward(fct_walk *w);
void fct_walk_backward(fct_walk *w);
/* Writes the ring of step w->step, which is not done. Errors: MEMORY. */
fct_result fct_walk_find_ring(fct_walk *w);

#endif
