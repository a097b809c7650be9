/* base/io/spool.c: see spool.h. */
#define _GNU_SOURCE
#include "base/io/spool.h"
#include "base/io/temporary.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* The most bytes of one read or write. The limit of the kernel is just below 2 GB. */
enum { MOST = 1 << 30 };

static fct_result fail_spool(const fct_spool *spool, const char *what, int error) {
    return fct_fail(spool->env, FCT_ERROR_OUTPUT, "%s: a temporary file cannot be %s: %s", spool->folder,
                    what, strerror(error));
}

static int open_nameless(const char *folder) {
    char name[PATH_MAX];
    int descriptor = fct_temporary_open(folder, name, sizeof name);
    if (descriptor >= 0 && *name) unlink(name);
    return descriptor;
}

fct_result fct_spool_open(const fct_env *env, const char *folder, const char *beside, fct_spool *out) {
    char path[PATH_MAX];
    *out = (fct_spool){.env = env};
    if (folder)
        snprintf(path, sizeof path, "%s", folder);
    else
        fct_folder_of(beside, path, sizeof path);
    snprintf(out->folder, sizeof out->folder, "%.*s", (int)sizeof out->folder - 1, path);
    fct_temporary_sweep(path); /* a process that was killed before its unlink */
    out->descriptor = open_nameless(path);
    if (out->descriptor >= 0) return FCT_OK;
    fct_result result = fail_spool(out, "made", errno);
    *out = (fct_spool){0};
    return result;
}

void fct_spool_close(fct_spool *spool) {
    if (spool->env) close(spool->descriptor);
    *spool = (fct_spool){0};
}

fct_result fct_spool_append(fct_spool *spool, const void *data, size_t size) {
    const unsigned char *from = data;
    while (size > 0) {
        ssize_t put = pwrite(spool->descriptor, from, size < MOST ? size : MOST, (off_t)spool->size);
        if (put < 0 && errno == EINTR) continue;
        if (put <= 0) return fail_spool(spool, "written", put < 0 ? errno : EIO);
        from += put, size -= (size_t)put;
        spool->size += (uint64_t)put;
    }
    return FCT_OK;
}

bool fct_read_at(int descriptor, uint64_t offset, void *data, size_t size, size_t *got) {
    unsigned char *to = data;
    *got = 0;
    while (*got < size) {
        size_t left = size - *got;
        ssize_t part = pread(descriptor, to + *got, left < MOST ? left : MOST, (off_t)(offset + *got));
        if (part < 0 && errno == EINTR) continue;
        if (part < 0) return false;
        if (part == 0) break;
        *got += (size_t)part;
    }
    return true;
}

fct_result fct_spool_read(const fct_spool *spool, uint64_t offset, void *data, size_t size) {
    size_t got;
    if (!fct_read_at(spool->descriptor, offset, data, size, &got)) return fail_spool(spool, "read", errno);
    return got == size ? FCT_OK : fail_spool(spool, "read", EIO);
}

void fct_spool_discard(const fct_spool *spool, uint64_t offset, uint64_t size) {
    uint64_t begin = (offset + 4095) & ~(uint64_t)4095, end = (offset + size) & ~(uint64_t)4095;
    if (begin < end)
        (void)!fallocate(spool->descriptor, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, (off_t)begin,
                         (off_t)(end - begin));
}

fct_result fct_cache_create(const fct_env *env, size_t block_size, uint64_t block_count, size_t places,
                            fct_fill *fill, void *user, fct_cache *out) {
    if (places > block_count) places = (size_t)block_count;
    if (places == 0) places = 1;
    *out = (fct_cache){.env = env, .block_size = block_size, .places = places, .fill = fill, .user = user};
    out->data = fct_allocate(env, places, block_size);
    out->blocks = fct_allocate(env, places, sizeof *out->blocks);
    if (!out->data || !out->blocks) {
        fct_cache_release(out);
        return fct_fail_memory(env, "blocks of a file");
    }
    memset(out->blocks, 0xFF, places * sizeof *out->blocks);
    return FCT_OK;
}

void fct_cache_release(fct_cache *cache) {
    if (!cache->env) return;
    fct_release(cache->env, cache->data);
    fct_release(cache->env, cache->blocks);
    *cache = (fct_cache){0};
}

const void *fct_cache_fill(fct_cache *cache, uint64_t block) {
    size_t place = block % cache->places;
    void *data = cache->data + place * cache->block_size;
    cache->blocks[place] = UINT64_MAX;
    fct_result result = cache->fill(cache->user, block, data);
    if (result != FCT_OK) {
        cache->result = result;
        return NULL;
    }
    cache->blocks[place] = block;
    return data;
}
