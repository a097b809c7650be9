/* base/pool.h: an environment that allocates from one block, and from another environment once the block is
 * full. A computation can so use the memory of a large array that is filled later. */
#ifndef FCT_BASE_POOL_H
#define FCT_BASE_POOL_H

#include "base/env.h"

enum { FCT_POOL_GAPS = 64 };

typedef struct fct_pool {
    fct_env env; /* the environment to use; like `beneath` except for memory */
    const fct_env *beneath;
    unsigned char *block;
    size_t size;
    uint32_t gap_count;
    size_t begins[FCT_POOL_GAPS], ends[FCT_POOL_GAPS]; /* free parts of the block, ascending */
} fct_pool;

/* The block is aligned to 64, belongs to the caller, and must outlive all allocations from it. Do not move
 * the pool, because its environment points to it. */
void fct_pool_create(const fct_env *beneath, void *block, size_t size, fct_pool *out);

#endif
