/* base/parallel.c: the calling thread and helpers (threads that the process keeps) share the chunks of a job.
 *
 * The caller offers the job to free helpers and works on chunks itself. When no chunk is left, it withdraws
 * the offer from helpers that have not begun, so it never waits for a thread that does not run.
 *
 *     FREE, ASLEEP --offer--> job --withdraw--> FREE             the state of a helper, one word
 *                              |
 *                              +--begin--> job | AT_WORK --end--> FREE
 *                                              +--caller sleeps--> job | AT_WORK | AWAITED --end--> FREE
 *
 * All callers share the helpers and start missing ones. A child of fork() has none.
 */
#include "base/parallel.h"

#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>

/* A waiter polls SPINS times (about 0.5 ms), then sleeps. After KEEP polls (20 to 50 us) it also yields
 * between polls. Waking a sleeper takes 50 to 100 us on a virtual machine. */
enum { MOST_HELPERS = 255, KEEP = 1000, SPINS = 10000 };

/* States, beside the address of a job, which is a multiple of 64. */
enum { FREE = 0, AT_WORK = 1, AWAITED = 2, ASLEEP = 4, LEAVING = 8 };

typedef struct job {
    size_t count, grain, chunk_count;
    fct_chunk_body *body;
    void *user;
    _Alignas(64) atomic_size_t next; /* the first chunk that no thread has taken */
    _Atomic uint32_t threads;        /* threads that have begun */
} job;

typedef struct helper {
    _Alignas(64) _Atomic uintptr_t state;
    pthread_t thread;
    pthread_mutex_t mutex; /* with `changed`: to sleep until the state changes */
    pthread_cond_t changed;
} helper;

static helper helpers[MOST_HELPERS];
static _Atomic uint32_t helper_count;
static pthread_mutex_t starting = PTHREAD_MUTEX_INITIALIZER; /* held while helpers are added */
static bool closed = true;                                   /* no helper may start */

/* Works on the next chunk. Returns false if there is none. */
static bool do_chunk(job *j, uint32_t thread) {
    size_t chunk = atomic_fetch_add_explicit(&j->next, 1, memory_order_relaxed);
    if (chunk >= j->chunk_count) return false;
    size_t begin = chunk * j->grain;
    size_t end = j->count - begin > j->grain ? begin + j->grain : j->count;
    j->body(j->user, begin, end, chunk, thread);
    return true;
}

static void wake_helper(helper *h) {
    pthread_mutex_lock(&h->mutex);
    pthread_mutex_unlock(&h->mutex);
    pthread_cond_broadcast(&h->changed);
}

static void sleep_while(helper *h, uintptr_t state) {
    pthread_mutex_lock(&h->mutex);
    while (atomic_load_explicit(&h->state, memory_order_acquire) == state)
        pthread_cond_wait(&h->changed, &h->mutex);
    pthread_mutex_unlock(&h->mutex);
}

/* Returns the first other state, or `state` if it stays. */
static uintptr_t spin_while(const helper *h, uintptr_t state) {
    for (int i = 0; i < SPINS; ++i) {
#if defined(__x86_64__)
        __builtin_ia32_pause();
#endif
        uintptr_t seen = atomic_load_explicit(&h->state, memory_order_acquire);
        if (seen != state) return seen;
        if (i >= KEEP && i % 32 == 0) sched_yield();
    }
    return state;
}

static void *run_helper(void *argument) {
    helper *h = argument;
    for (;;) {
        uintptr_t state = spin_while(h, FREE);
        if (state == LEAVING) return NULL;
        if (state == FREE) {
            if (atomic_compare_exchange_strong(&h->state, &state, ASLEEP)) sleep_while(h, ASLEEP);
            continue;
        }
        if (!atomic_compare_exchange_strong(&h->state, &state, state | AT_WORK)) continue; /* withdrawn */
        job *j = (job *)state;
        uint32_t thread = atomic_fetch_add_explicit(&j->threads, 1, memory_order_relaxed);
        while (do_chunk(j, thread)) {
        }
        if (atomic_exchange(&h->state, FREE) & AWAITED) wake_helper(h);
    }
}

/* Gives a helper a job, or LEAVING. Returns false if the helper is not free. */
static bool offer_job(helper *h, uintptr_t what) {
    uintptr_t state = atomic_load_explicit(&h->state, memory_order_relaxed);
    while (state == FREE || state == ASLEEP)
        if (atomic_compare_exchange_weak(&h->state, &state, what)) {
            if (state == ASLEEP) wake_helper(h);
            return true;
        }
    return false;
}

/* Helpers block all signals except those that their own instructions raise and a profiler's, because signals
 * belong to the threads of the program. */
static bool start_thread(helper *h) {
    sigset_t blocked, before;
    sigfillset(&blocked);
    const int open[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGABRT, SIGPROF};
    for (size_t i = 0; i < sizeof open / sizeof *open; ++i) sigdelset(&blocked, open[i]);
    if (pthread_sigmask(SIG_SETMASK, &blocked, &before)) return false;
    bool started = pthread_create(&h->thread, NULL, run_helper, h) == 0;
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return started;
}

/* Starts one more helper with a job. If the system refuses, fewer threads work. */
static bool add_helper(uintptr_t what, uint8_t *number) {
    pthread_mutex_lock(&starting);
    uint32_t i = atomic_load_explicit(&helper_count, memory_order_relaxed);
    bool added = !closed && i < MOST_HELPERS;
    if (added) {
        helper *h = helpers + i;
        atomic_store_explicit(&h->state, what, memory_order_relaxed);
        pthread_mutex_init(&h->mutex, NULL);
        pthread_cond_init(&h->changed, NULL);
        added = start_thread(h);
    }
    if (added) {
        *number = (uint8_t)i;
        atomic_store_explicit(&helper_count, i + 1, memory_order_release);
    }
    pthread_mutex_unlock(&starting);
    return added;
}

/* Offers the job to at most one helper per chunk. Returns the number of helpers that took it. */
static uint32_t call_helpers(const fct_env *env, job *j, uint8_t *called) {
    uint32_t wanted = fct_env_threads(env) - 1, count = 0;
    if (j->chunk_count <= wanted) wanted = (uint32_t)j->chunk_count - 1;
    uint32_t all = atomic_load_explicit(&helper_count, memory_order_acquire);
    for (uint32_t i = 0; i < all && count < wanted; ++i)
        if (offer_job(helpers + i, (uintptr_t)j)) called[count++] = (uint8_t)i;
    while (count < wanted && add_helper((uintptr_t)j, called + count)) ++count;
    return count;
}

/* Withdraws the job, or waits until the helper has left it. */
static void dismiss_helper(helper *h, const job *j) {
    uintptr_t state = (uintptr_t)j, busy = state | AT_WORK;
    if (atomic_compare_exchange_strong(&h->state, &state, FREE) || state != busy) return;
    if (spin_while(h, busy) != busy) return;
    if (atomic_compare_exchange_strong(&h->state, &busy, busy | AWAITED)) sleep_while(h, busy | AWAITED);
}

static void dismiss_all(const uint8_t *called, uint32_t count, const job *j) {
    for (uint32_t i = 0; i < count; ++i) dismiss_helper(helpers + called[i], j);
}

static void lock_pool(void) {
    pthread_mutex_lock(&starting);
}

static void unlock_pool(void) {
    pthread_mutex_unlock(&starting);
}

static void unlock_child(void) {
    atomic_store_explicit(&helper_count, 0, memory_order_relaxed);
    pthread_mutex_unlock(&starting);
}

__attribute__((constructor)) static void open_pool(void) {
    closed = pthread_atfork(lock_pool, unlock_pool, unlock_child) != 0;
}

/* Runs when the process ends or the library is unloaded. A helper that works for another thread stays. */
__attribute__((destructor)) static void close_pool(void) {
    pthread_mutex_lock(&starting);
    closed = true;
    pthread_mutex_unlock(&starting);
    uint32_t all = atomic_load_explicit(&helper_count, memory_order_acquire);
    bool leaving[MOST_HELPERS];
    for (uint32_t i = 0; i < all; ++i) leaving[i] = offer_job(helpers + i, LEAVING);
    for (uint32_t i = 0; i < all; ++i)
        if (leaving[i]) pthread_join(helpers[i].thread, NULL);
}

static job make_job(size_t count, size_t grain, fct_chunk_body *body, void *user) {
    return (job){.count = count,
                 .grain = grain,
                 .chunk_count = fct_chunk_count(count, grain),
                 .body = body,
                 .user = user,
                 .threads = 1};
}

void fct_parallel_for(const fct_env *env, size_t count, size_t grain, fct_chunk_body *body, void *user) {
    if (count == 0) return;
    job j = make_job(count, grain, body, user);
    uint8_t called[MOST_HELPERS];
    uint32_t called_count = call_helpers(env, &j, called);
    while (do_chunk(&j, 0)) {
    }
    dismiss_all(called, called_count, &j);
}

/* Reports every hundredth of the chunks. After a long chunk of the caller, several reports follow at once. */
fct_result fct_parallel_for_progress(const fct_env *env, const char *phase, size_t count, size_t grain,
                                     fct_chunk_body *body, void *user) {
    if (count == 0) return fct_progress(env, phase, 1);
    fct_result result = fct_progress(env, phase, 0);
    if (result != FCT_OK) return result;
    job j = make_job(count, grain, body, user);
    uint8_t called[MOST_HELPERS];
    uint32_t called_count = call_helpers(env, &j, called);
    size_t slice = j.chunk_count / 100 + 1, told = slice;
    for (bool more = true; more && result == FCT_OK;) {
        more = do_chunk(&j, 0);
        size_t taken = atomic_load_explicit(&j.next, memory_order_relaxed);
        for (; result == FCT_OK && told < j.chunk_count && told <= taken; told += slice)
            result = fct_progress(env, phase, (double)told / (double)j.chunk_count);
    }
    if (result != FCT_OK) atomic_store_explicit(&j.next, j.chunk_count, memory_order_relaxed);
    dismiss_all(called, called_count, &j);
    return result == FCT_OK ? fct_progress(env, phase, 1) : result;
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
