/* simplify/topology/remain.h: whether a move of a point leaves good faces: not folded, with an area, each
 * once, and at most two at an edge. A face that is bad before the move may be bad after it.
 */
#ifndef FCT_SIMPLIFY_REMAIN_H
#define FCT_SIMPLIFY_REMAIN_H

#include "simplify/state.h"

/* Point a moves to `at`. In a contraction b moves there too, and the faces between a and b vanish; else b is
 * FCT_NONE and count_b is 0. ring_a and ring_b hold the corners of a and b. If a is a hub, it does not move
 * and count_a is 0. */
typedef struct fct_move {
    uint32_t a, b, count_a, count_b;
    v3 at;
} fct_move;

/* Empties `remaining`. */
void fct_simplify_begin_move(fct_simplifier *s);
/* Adds the faces of a ring, whose point moves from `from` to `at`, to `remaining`. Faces that touch `other`
 * vanish and do not count; with FCT_NONE all faces count. Returns whether a face folds over or loses its
 * area:
 * - its normal turns by more than 84 degrees (Garland 1999, section 3.7, the test by normals);
 * - its height falls below least_height, or its area becomes 0 when its corners become floats.
 * Faces without area never fold. */
bool fct_simplify_folds_over(fct_simplifier *s, const uint32_t *ring, uint32_t count, uint32_t other, v3 from,
                             v3 at);
/* Lists the remaining faces. Returns whether the move makes no such face, no face with the corners of
 * another, no edge of more than two faces, and no two faces that lie on each other, with less than 26 degrees
 * between them at their common edge. Without check_foldover every move is good. */
bool fct_simplify_remains_good(fct_simplifier *s, const fct_move *move);
/* The same for the contraction of a pair, whose ends have no common face. The faces of each end are judged by
 * themselves: both may have faces at one edge. `remaining` lists those of a before those of b. */
bool fct_simplify_joins_well(fct_simplifier *s, const fct_move *move);
/* Whether the faces after the move that fct_simplify_remains_good accepted form one closed fan that is nearly
 * flat. Then they cover what was covered before. */
bool fct_simplify_is_level(const fct_simplifier *s);
/* Whether the edge a-b belongs to a body of four faces and nothing else. ring_a and ring_b hold the corners.
 */
bool fct_simplify_is_tetrahedron(const fct_simplifier *s, const fct_move *move);

#endif
