/* partition/labels.h: partitions given as a cluster number for each face. */
#ifndef FCT_CLUSTER_LABELS_H
#define FCT_CLUSTER_LABELS_H

#include "base/env.h"
#include "facetree/mesh.h"

/* Whether the mesh is valid and each of its faces has a label below count. Errors: DATA. */
fct_result fct_labels_check(const fct_env *env, const fct_mesh *mesh, const uint32_t *labels, uint32_t count);

#endif
