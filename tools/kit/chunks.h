/* tools/kit/chunks.h: a loop over chunks on --threads threads, with progress.
 *
 * The bounds of chunks depend only on the count and the grain. So a command writes the same bytes for every
 * number of threads if the answers to a chunk depend on that chunk alone.
 */
#ifndef FCT_TOOLS_CHUNKS_H
#define FCT_TOOLS_CHUNKS_H

#include "tools/kit/env.h"

/* Works on the items [begin, end) of chunk number `chunk`. It must not call functions of the tool. */
typedef void tool_chunk_body(void *user, size_t begin, size_t end, size_t chunk);

typedef struct tool_loop {
    size_t count, grain; /* items, and items per chunk */
    tool_chunk_body *body;
    void *user;
    const char *phase; /* for the progress bar */
    double from, to;   /* the shares of the phase at the beginning and at the end of the loop */
} tool_loop;

/* Returns TOOL_CANCELLED if the progress hook cancels the loop, which then leaves chunks undone. */
int tool_run_loop(tool *t, const tool_loop *loop);

#endif
