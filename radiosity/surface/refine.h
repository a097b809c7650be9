/* radiosity/surface/refine.h: splits edges of a finished surface. */
#ifndef FCT_RADIOSITY_SURFACE_REFINE_H
#define FCT_RADIOSITY_SURFACE_REFINE_H

#include "radiosity/surface/surface.h"

/* True if the edge between two vertices, a < b, must be split. May be called several times per edge. */
typedef bool fct_edge_test(void *user, uint32_t a, uint32_t b);
/* One round of splits at midpoints. An edge is split if the test is true for it or for an edge that coincides
 * with it on a crease; all triangles at the edge follow. Old vertices keep their numbers and data. New
 * vertices follow them, with the mean colour of the two ends. After a failure the surface is unchanged.
 * *added (may be NULL) receives the number of new vertices. Errors: MEMORY. */
fct_result fct_surface_refine(const fct_env *env, fct_surface *surface, fct_edge_test *test, void *user,
                              uint32_t *added);

#endif
