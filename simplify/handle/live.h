/* simplify/handle/live.h: the part of a state that contractions change, as a sequence of bytes.
 *
 * Contracted points, removed faces and dead edges are left out, so the size follows the current mesh, apart
 * from 4 bytes per point and wedge of the input. Paths of parents are written as their roots. So the bytes
 * depend only on what later calls can see. docs/state-file.md describes them.
 */
#ifndef FCT_SIMPLIFY_LIVE_H
#define FCT_SIMPLIFY_LIVE_H

#include "simplify/handle/stream.h"
#include "simplify/state.h"

/* Errors: MEMORY. */
fct_result fct_live_write(fct_simplifier *s, fct_sink *sink);
/* The arrays that a read state needs, so that a way back cannot fail. */
typedef struct fct_live_room {
    uint32_t *parents, *wedge_parents; /* as read */
    uint32_t *owners;                  /* per wedge: the point in whose list it is */
    fct_constraint *constraints;
    uint32_t *constraint_of;
    fct_line *lines;
    float *paint, *weights;
    double (*pins)[POSITION_QUADRIC];
    fct_mark *marks;
} fct_live_room;

/* Room for the current state of s. Errors: MEMORY. */
fct_result fct_live_reserve(const fct_simplifier *s, fct_live_room *room);
void fct_live_release(const fct_env *env, fct_live_room *room);

/* Replaces the state of a filled simplifier of the same input and options. room: of the state that is read,
 * or NULL. *fault says what is wrong with the bytes; it is NULL if they are right. A faulty state may only be
 * destroyed. Errors: MEMORY, without a change, never with a room; DATA with a fault. */
fct_result fct_live_read(fct_simplifier *s, fct_source *source, fct_live_room *room, const char **fault);

#endif
