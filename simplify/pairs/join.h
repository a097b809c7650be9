/* simplify/pairs/join.h: what the contraction of a pair does beside that of an edge.
 *
 * No face lies between the two ends, so none vanishes. But two bodies that stand on each other may get equal
 * faces, one of each: an inner wall. Both faces of a wall vanish, and of two equal faces that look the same
 * way one does.
 */
#ifndef FCT_SIMPLIFY_JOIN_H
#define FCT_SIMPLIFY_JOIN_H

#include "simplify/topology/remain.h"

/* Equal faces of both ends, as their corners there. */
typedef struct fct_walls {
    uint32_t count;
    uint32_t first[SIMPLIFY_HUB], second[SIMPLIFY_HUB]; /* FCT_NONE: this face stays */
} fct_walls;

/* Lists the faces that the move makes equal. `remaining` holds the faces after it, with count_a of the first
 * end. False if some of them can neither stay (check_foldover) nor vanish: faces of opposite sides vanish
 * only if both belonged to closed bodies with the volume on the same side of their faces, and faces at a
 * locked point stay. */
bool fct_simplify_find_walls(fct_simplifier *s, const fct_move *move, fct_walls *out);
/* The number of faces of the walls. */
uint32_t fct_simplify_count_walls(const fct_walls *walls);
/* Without colours and normals the wedges of the point that replaced a pair become one output vertex. */
void fct_simplify_join_classes(fct_simplifier *s, uint32_t point);
/* Removes them, after the contraction. */
void fct_simplify_remove_walls(fct_simplifier *s, const fct_walls *walls);

#endif
