/* base/pool.h: an environment whose memory comes out of one block as long as there is room, and from the
 * environment beneath it after that. A computation that comes before a large array can so use the array's
 * memory. */
#ifndef FCT_BASE_POOL_H
#define FCT_BASE_POOL_H

#include "base/env.h"

enum { FCT_POOL_GAPS = 64 };

typedef struct fct_pool {
    fct_env env; /* the environment to use; all but memory is that of `beneath` */
    const fct_env *beneath;
    unsigned char *block;
    size_t size;
    uint32_t gap_count;
    size_t begins[FCT_POOL_GAPS], ends[FCT_POOL_GAPS]; /* free parts of the block, ascending */
} fct_pool;

/* The block, aligned to 64, stays the caller's and must outlive what is taken from it. The pool must not be
 * moved. */
void fct_pool_create(const fct_env *beneath, void *block, size_t size, fct_pool *out);

#endif
