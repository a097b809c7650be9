/* base/parallel.h: the one place where threads are made. They are kept for the next call, by any thread.
 *
 * Work is cut into chunks whose bounds depend on the count and the grain alone, never on the number of
 * threads; a body that writes only what its own range owns, or one partial result per chunk folded in chunk
 * order afterwards, gives the same bits for every thread count. Bodies must not call hooks of the environment
 * (allocate included) and must not nest. A child that a hook forks must not come back from that hook.
 */
#ifndef FCT_BASE_PARALLEL_H
#define FCT_BASE_PARALLEL_H

#include "base/env.h"

/* Work on items [begin, end), which are chunk number `chunk`; `thread` < fct_env_threads(env), no one else's
 * in the same call, is for scratch space only. */
typedef void fct_chunk_body(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread);

static inline size_t fct_chunk_count(size_t count, size_t grain) {
    return (count + grain - 1) / grain;
}

/* Calls body for every chunk of `grain` items of [0, count), chunks handed out in order to idle threads. */
void fct_parallel_for(const fct_env *env, size_t count, size_t grain, fct_chunk_body *body, void *user);

/* The same with progress, told by the calling thread between its own chunks while others work, as often for
 * every number of threads; a cancelled run leaves items undone. */
fct_result fct_parallel_for_progress(const fct_env *env, const char *phase, size_t count, size_t grain,
                                     fct_chunk_body *body, void *user);

/* Sum of count doubles, in an order that depends on count alone. */
double fct_sum(const double *values, size_t count);

#endif
