/* partition/labels.h: partitions given as a label per face. */
#ifndef FCT_PARTITION_LABELS_H
#define FCT_PARTITION_LABELS_H

#include "base/env.h"
#include "facetree/mesh.h"

/* Checks that the mesh is valid and each label is below count. Errors: DATA. */
fct_result fct_labels_check(const fct_env *env, const fct_mesh *mesh, const uint32_t *labels, uint32_t count);

#endif
