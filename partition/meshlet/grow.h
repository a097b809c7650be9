/* partition/meshlet/grow.h: growing pieces. */
#ifndef FCT_PARTITION_GROW_H
#define FCT_PARTITION_GROW_H

#include "partition/meshlet/packer.h"

/* Puts every face into a piece: sets owner and count. `bounds` holds bound_count ascending places, from 0 to
 * face_count; no piece crosses one of them. Errors: MEMORY, CANCELLED. */
fct_result fct_meshlets_grow(const fct_env *env, fct_packer *packer, const uint32_t *bounds,
                             uint32_t bound_count);

#endif
