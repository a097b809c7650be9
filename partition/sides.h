/* partition/sides.h: the sides of triangles that lie on the same mesh edge. Side 3 f + k of face f runs from
 * its corner k to its corner k + 1. */
#ifndef FCT_PARTITION_SIDES_H
#define FCT_PARTITION_SIDES_H

#include "base/env.h"

/* The sides of each mesh edge as a list in order of side ids; FCT_NONE at its ends. A side from a vertex to
 * itself lies on no edge. Two sides of one face may lie on one edge. */
typedef struct fct_sides {
    uint32_t *before, *after; /* face_count x 3 */
} fct_sides;

/* triangles: face_count x 3, each below vertex_count. O(F log F). Errors: MEMORY, CANCELLED. */
fct_result fct_sides_build(const fct_env *env, const uint32_t *triangles, uint32_t face_count,
                           uint32_t vertex_count, fct_sides *out);
void fct_sides_release(const fct_env *env, fct_sides *sides);

#endif
