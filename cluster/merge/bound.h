/* cluster/merge/bound.h: bounds of faces. */
#ifndef FCT_CLUSTER_BOUND_H
#define FCT_CLUSTER_BOUND_H

#include "base/variant.h"
#include "facetree/mesh.h"

/* Bounds of the corners of faces [begin, end), at least one. */
#define fct_bound_faces FCT_KERNEL(fct_bound_faces)
FCT_DECLARE_KERNEL(void, fct_bound_faces, (const fct_mesh *mesh, size_t begin, size_t end, fct_bounds *out));

#endif
