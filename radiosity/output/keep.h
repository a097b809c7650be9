/* radiosity/output/keep.h: light on the mesh as it was added, without new faces. */
#ifndef FCT_RADIOSITY_KEEP_H
#define FCT_RADIOSITY_KEEP_H

#include "facetree/radiosity.h"
#include "radiosity/surface/surface.h"

/* Appends a vertex at the centre of each face: number vertex_count + f, without faces. The areas become the
 * weights of a rule that integrates quadratics exactly: 3/4 of the face at its centre and 1/12 at each
 * corner. Errors: MEMORY. */
fct_result fct_keep_centres(const fct_env *env, fct_surface *surface);

/* Makes one mesh in the order of the added one from the lit surfaces of its parts, the instances
 * [first, first + count) of an object. The surfaces have the faces of their models, and for FCT_KEEP_FACE the
 * vertices of fct_keep_centres. Errors: DATA, MEMORY. */
fct_result fct_keep_merge(const fct_env *env, const fct_scene_view *view, uint32_t first, uint32_t count,
                          fct_keep keep, const fct_mesh *lit, fct_mesh *out);

#endif
