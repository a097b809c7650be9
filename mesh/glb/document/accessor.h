/* mesh/glb/document/accessor.h: the elements of accessors. */
#ifndef FCT_MESH_GLB_ACCESSOR_H
#define FCT_MESH_GLB_ACCESSOR_H

#include "mesh/glb/document/glb.h"

/* Finds accessor `index`, which must have `least` to `most` components per element. *out belongs to `glb`.
 * The elements of a sparse accessor, or of one without a buffer view, are assembled once. Errors: DATA (out
 * of bounds, another type), INPUT, MEMORY. */
fct_result fct_glb_array_of(fct_glb *glb, int64_t index, int least, int most, const fct_glb_array **out);

/* Component k of element i. Normalized integers are divided by their largest value. */
double fct_glb_value(const fct_glb_array *array, size_t i, int k);

#endif
