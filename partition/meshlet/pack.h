/* partition/meshlet/pack.h: moving faces between pieces. */
#ifndef FCT_PARTITION_PACK_H
#define FCT_PARTITION_PACK_H

#include "partition/meshlet/packer.h"

/* Adds a face to a piece that has room for it. */
void fct_packer_add(fct_packer *packer, uint32_t piece, uint32_t face);

/* Merges pieces and moves faces until fewer and fuller pieces remain. Errors: MEMORY, CANCELLED. */
fct_result fct_meshlets_pack(const fct_env *env, fct_packer *packer);

#endif
