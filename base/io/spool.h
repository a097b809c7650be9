/* base/io/spool.h: temporary files for what does not fit into memory, and blocks of files kept in memory.
 *
 * A spool has no name from the moment it is made, so that nothing is left of it however the program ends.
 * What is read and written goes through buffers of the caller; nothing is mapped, so that a limit on resident
 * memory holds. Not for several threads at once.
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

/* An empty file in the folder `folder`, or beside the file `beside` if folder is NULL. Errors: OUTPUT. */
fct_result fct_spool_open(const fct_env *env, const char *folder, const char *beside, fct_spool *out);
/* A spool of zeros, not open, is allowed. */
void fct_spool_close(fct_spool *spool);
/* Adds bytes at the end. Errors: OUTPUT. */
fct_result fct_spool_append(fct_spool *spool, const void *data, size_t size);
/* Bytes that were written before. Errors: OUTPUT (the disk failed). */
fct_result fct_spool_read(const fct_spool *spool, uint64_t offset, void *data, size_t size);
/* Gives a range back to the disk, where the file system can; it must not be read any more. */
void fct_spool_discard(const fct_spool *spool, uint64_t offset, uint64_t size);

/* Reads a range of any open file; *got tells how many bytes there were before its end. False: an error, of
 * which errno tells. */
bool fct_read_at(int descriptor, uint64_t offset, void *data, size_t size, size_t *got);

/* Fills `data` with block number `block`. */
typedef fct_result fct_fill(void *user, uint64_t block, void *data);

/* Blocks of something long; each has one place where it may lie, and stays there until another needs it. */
typedef struct fct_cache {
    const fct_env *env; /* NULL: not made */
    unsigned char *data;
    uint64_t *blocks; /* per place; UINT64_MAX: empty */
    size_t block_size, places;
    fct_fill *fill;
    void *user;
    fct_result result; /* of the last fill that failed */
} fct_cache;

/* Takes places * block_size bytes, or as much as block_count blocks need. Errors: MEMORY. */
fct_result fct_cache_create(const fct_env *env, size_t block_size, uint64_t block_count, size_t places,
                            fct_fill *fill, void *user, fct_cache *out);
void fct_cache_release(fct_cache *cache);
/* Fills the block's place. NULL on failure, with cache->result. */
const void *fct_cache_fill(fct_cache *cache, uint64_t block);

/* Valid until the next call. NULL on failure, with cache->result. */
static inline const void *fct_cache_get(fct_cache *cache, uint64_t block) {
    size_t place = block % cache->places;
    if (cache->blocks[place] == block) return cache->data + place * cache->block_size;
    return fct_cache_fill(cache, block);
}

#endif
