/* base/parallel.h: loops over chunks on several threads. The process keeps the threads for later calls.
 *
 * The bounds of chunks depend only on the count and the grain, never on the number of threads. A result has
 * the same bits for every thread count if the body writes only to its own range, or to one partial result per
 * chunk that the caller adds up in chunk order.
 *
 * A body must not call hooks of the environment (also not allocate) and must not start another loop. If a
 * hook forks, the child must not return from the hook.
 */
#ifndef FCT_BASE_PARALLEL_H
#define FCT_BASE_PARALLEL_H

#include "base/env.h"

/* Works on the items [begin, end) of chunk number `chunk`. thread < fct_env_threads(env) is the number of the
 * thread in this call. Use it only to select scratch space. */
typedef void fct_chunk_body(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread);

static inline size_t fct_chunk_count(size_t count, size_t grain) {
    return (count + grain - 1) / grain;
}

/* Calls body for every chunk of `grain` items of [0, count). Idle threads take the chunks in order. */
void fct_parallel_for(const fct_env *env, size_t count, size_t grain, fct_chunk_body *body, void *user);

/* The same with progress. The calling thread reports it between its own chunks, equally often for every
 * number of threads. A cancelled loop leaves chunks undone. Errors: CANCELLED. */
fct_result fct_parallel_for_progress(const fct_env *env, const char *phase, size_t count, size_t grain,
                                     fct_chunk_body *body, void *user);

/* Sum of count doubles. The order of the additions depends only on count. */
double fct_sum(const double *values, size_t count);

#endif
