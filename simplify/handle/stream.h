/* simplify/handle/stream.h: bytes that a state writes, to a file or to memory, and reads. */
#ifndef FCT_SIMPLIFY_STREAM_H
#define FCT_SIMPLIFY_STREAM_H

#include <stdio.h>
#include <string.h>
#define XXH_STATIC_LINKING_ONLY /* for the size of XXH3_state_t */
#include <xxhash.h>

#include "base/env.h"

typedef struct fct_sink {
    const fct_env *env;
    FILE *file;          /* NULL: memory */
    XXH3_state_t *hash;  /* of the bytes; NULL: none */
    unsigned char *data; /* the memory */
    size_t count, capacity;
    fct_result result; /* OK until an allocation fails */
} fct_sink;

/* Appends bytes. Errors: MEMORY, in sink->result. */
static inline void fct_sink_put(fct_sink *sink, const void *data, size_t size) {
    if (sink->result != FCT_OK || size == 0) return;
    if (sink->hash) XXH3_64bits_update(sink->hash, data, size);
    if (sink->file) {
        fwrite(data, 1, size, sink->file);
        return;
    }
    sink->result = fct_grow(sink->env, (void **)&sink->data, &sink->capacity, sink->count + size, 1);
    if (sink->result != FCT_OK) return;
    memcpy(sink->data + sink->count, data, size);
    sink->count += size;
}

typedef struct fct_source {
    const unsigned char *at, *end;
} fct_source;

/* Copies `count` elements. False, without a change, if there are fewer. */
static inline bool fct_source_take(fct_source *source, void *to, size_t count, size_t size) {
    if (count > (size_t)(source->end - source->at) / size) return false;
    if (count) memcpy(to, source->at, count * size);
    source->at += count * size;
    return true;
}

#endif
