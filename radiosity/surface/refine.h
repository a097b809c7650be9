/* radiosity/surface/refine.h: splits edges of a finished surface. */
#ifndef FCT_RADIOSITY_SURFACE_REFINE_H
#define FCT_RADIOSITY_SURFACE_REFINE_H

#include "radiosity/surface/surface.h"

/* Where to split the edge between two vertices, a < b: the share of the way from a to b, in (0, 1); or 0: not
 * at all. May be called several times per edge. */
typedef double fct_edge_cut(void *user, uint32_t a, uint32_t b);
/* One round of splits. An edge is split if the cut is not 0 for it or for an edge that coincides with it on a
 * crease, where the first of them decides the place; all triangles at the edge follow. Old vertices keep
 * their numbers and data. New vertices follow them, with a colour between those of the two ends. After a
 * failure the surface is unchanged. *added (may be NULL) receives the number of new vertices. Errors: MEMORY.
 */
fct_result fct_surface_refine(const fct_env *env, fct_surface *surface, fct_edge_cut *cut, void *user,
                              uint32_t *added);

#endif
