/* base/io/spool.h: temporary files for data that does not fit into memory, and a cache of blocks.
 *
 * A spool has no name, so it vanishes however the program ends. The caller passes buffers, and nothing is
 * mapped, so limits on resident memory hold. One thread at a time.
 */
#ifndef FCT_BASE_SPOOL_H
#define FCT_BASE_SPOOL_H

#include "base/env.h"

typedef struct fct_spool {
    const fct_env *env; /* NULL: not open */
    int descriptor;
    uint64_t size;
    char folder[256]; /* for messages */
} fct_spool;

/* Creates an empty file in `folder`, or in the folder of the file `beside` if folder is NULL. Also removes
 * temporary files of ended processes there. Errors: OUTPUT. */
fct_result fct_spool_open(const fct_env *env, const char *folder, const char *beside, fct_spool *out);
/* A zeroed struct is allowed. */
void fct_spool_close(fct_spool *spool);
/* Appends bytes. Errors: OUTPUT. */
fct_result fct_spool_append(fct_spool *spool, const void *data, size_t size);
/* Reads bytes that were written before. Errors: OUTPUT (the disk failed). */
fct_result fct_spool_read(const fct_spool *spool, uint64_t offset, void *data, size_t size);
/* Frees the disk space of a range, if the file system can. Do not read the range afterwards. */
void fct_spool_discard(const fct_spool *spool, uint64_t offset, uint64_t size);

/* Reads a range of an open file. *got receives the number of bytes, which is less than size only at the end
 * of the file. Returns false on an error, with errno. */
bool fct_read_at(int descriptor, uint64_t offset, void *data, size_t size, size_t *got);

/* Fills `data` with block number `block`. */
typedef fct_result fct_fill(void *user, uint64_t block, void *data);

/* A cache of blocks. A block has one place, and stays there until another block needs the place. */
typedef struct fct_cache {
    const fct_env *env; /* NULL: not created */
    unsigned char *data;
    uint64_t *blocks; /* per place; UINT64_MAX: empty */
    size_t block_size, places;
    fct_fill *fill;
    void *user;
    fct_result result; /* of the last fill that failed */
} fct_cache;

/* Allocates places * block_size bytes, or less if block_count blocks need less. Errors: MEMORY. */
fct_result fct_cache_create(const fct_env *env, size_t block_size, uint64_t block_count, size_t places,
                            fct_fill *fill, void *user, fct_cache *out);
void fct_cache_release(fct_cache *cache);
/* Fills the place of the block. Returns NULL on failure and sets cache->result. */
const void *fct_cache_fill(fct_cache *cache, uint64_t block);

/* The block, valid until the next call. Returns NULL on failure and sets cache->result. */
static inline const void *fct_cache_get(fct_cache *cache, uint64_t block) {
    size_t place = block % cache->places;
    if (cache->blocks[place] == block) return cache->data + place * cache->block_size;
    return fct_cache_fill(cache, block);
}

#endif
