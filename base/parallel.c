/* base/parallel.c: OpenMP behind one function, so that thread sanitizers need to be told of one fork and one
 * join. */
#include "base/parallel.h"

#include <stdatomic.h>

#if defined(__SANITIZE_THREAD__)
#define FCT_TSAN 1
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define FCT_TSAN 1
#endif
#endif
#ifdef FCT_TSAN
/* The OpenMP runtime is not instrumented: its fork and join look like no synchronisation at all. */
void __tsan_acquire(void *address);
void __tsan_release(void *address);
#define ACQUIRE(address) __tsan_acquire(address)
#define RELEASE(address) __tsan_release(address)
/* What a parallel region is passed goes through memory before the region can acquire anything. */
#define UNTRACED __attribute__((no_sanitize("thread")))
#else
#define ACQUIRE(address) ((void)(address))
#define RELEASE(address) ((void)(address))
#define UNTRACED
#endif

typedef struct work {
    size_t count, grain, chunk_end;
    fct_chunk_body *body;
    void *user;
    atomic_size_t next;
    char fork, join;
} work;

static void run(work *w, uint32_t thread) {
    ACQUIRE(&w->fork);
    for (;;) {
        size_t chunk = atomic_fetch_add_explicit(&w->next, 1, memory_order_relaxed);
        if (chunk >= w->chunk_end) break;
        size_t begin = chunk * w->grain;
        size_t end = begin + w->grain < w->count ? begin + w->grain : w->count;
        w->body(w->user, begin, end, chunk, thread);
    }
    RELEASE(&w->join);
}

UNTRACED static void run_chunks(const fct_env *env, work *w, size_t first, size_t last) {
    atomic_store_explicit(&w->next, first, memory_order_relaxed);
    w->chunk_end = last;
    uint32_t threads = fct_env_threads(env);
    if (last - first < threads) threads = (uint32_t)(last - first);
    if (threads <= 1) {
        run(w, 0);
        return;
    }
    _Atomic uint32_t number = 0;
    RELEASE(&w->fork);
#pragma omp parallel num_threads(threads) default(none) shared(w, number)
    { run(w, atomic_fetch_add_explicit(&number, 1, memory_order_relaxed)); }
    ACQUIRE(&w->join);
}

void fct_parallel_for(const fct_env *env, size_t count, size_t grain, fct_chunk_body *body, void *user) {
    if (count == 0) return;
    work w = {.count = count, .grain = grain, .body = body, .user = user};
    run_chunks(env, &w, 0, fct_chunk_count(count, grain));
}

fct_result fct_parallel_for_progress(const fct_env *env, const char *phase, size_t count, size_t grain,
                                     fct_chunk_body *body, void *user) {
    work w = {.count = count, .grain = grain, .body = body, .user = user};
    size_t chunks = fct_chunk_count(count, grain);
    size_t slice = chunks / 100 + 1;
    if (slice < 4 * (size_t)fct_env_threads(env)) slice = 4 * (size_t)fct_env_threads(env);
    for (size_t first = 0; first < chunks; first += slice) {
        fct_result result = fct_progress(env, phase, (double)first / (double)chunks);
        if (result != FCT_OK) return result;
        run_chunks(env, &w, first, first + slice < chunks ? first + slice : chunks);
    }
    return fct_progress(env, phase, 1);
}

double fct_sum(const double *values, size_t count) {
    double total = 0;
    for (size_t begin = 0; begin < count; begin += 1024) {
        size_t end = begin + 1024 < count ? begin + 1024 : count;
        double part = 0;
        for (size_t i = begin; i < end; ++i) part += values[i];
        total += part;
    }
    return total;
}
