/* tools/kit/chunks.c: see chunks.h. The calling thread works too. It alone calls the progress hook, between
 * its own chunks. */
#define _GNU_SOURCE
#include "tools/kit/chunks.h"

#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <unistd.h>

enum {
    MOST_HELPERS = 255,
    STACK_BYTES = 1 << 20 /* of a helper; the usual 8 MB would count under --max-memory */
};

typedef struct shared_loop {
    const tool_loop *loop;
    size_t chunk_count;
    atomic_size_t next; /* the first chunk that no thread has taken */
} shared_loop;

/* Returns false if no chunk is left. */
static bool do_next_chunk(shared_loop *s) {
    const tool_loop *loop = s->loop;
    size_t chunk = atomic_fetch_add(&s->next, 1);
    if (chunk >= s->chunk_count) return false;
    size_t begin = chunk * loop->grain, rest = loop->count - begin;
    loop->body(loop->user, begin, begin + (rest < loop->grain ? rest : loop->grain), chunk);
    return true;
}

static void *run_helper(void *user) {
    while (do_next_chunk(user)) {
    }
    return NULL;
}

static size_t count_helpers(const tool *t, size_t chunk_count) {
    long cores = sysconf(_SC_NPROCESSORS_ONLN);
    size_t threads = t->threads ? t->threads : cores > 0 ? (size_t)cores : 1;
    if (threads > chunk_count) threads = chunk_count;
    return threads > MOST_HELPERS ? MOST_HELPERS : threads ? threads - 1 : 0;
}

/* Starts helpers that block all signals except those that their own instructions raise, because signals
 * belong to the main thread. If the system refuses, fewer threads work. Returns their number. */
static size_t start_helpers(shared_loop *s, size_t wanted, pthread_t *helpers) {
    sigset_t blocked, before;
    pthread_attr_t attributes;
    size_t count = 0;
    if (!wanted || pthread_attr_init(&attributes)) return 0;
    pthread_attr_setstacksize(&attributes, STACK_BYTES);
    sigfillset(&blocked);
    const int open[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGABRT};
    for (size_t i = 0; i < sizeof open / sizeof *open; ++i) sigdelset(&blocked, open[i]);
    if (pthread_sigmask(SIG_SETMASK, &blocked, &before) == 0) {
        while (count < wanted && pthread_create(helpers + count, &attributes, run_helper, s) == 0) ++count;
        pthread_sigmask(SIG_SETMASK, &before, NULL);
    }
    pthread_attr_destroy(&attributes);
    return count;
}

static bool show_loop(tool *t, const shared_loop *s) {
    size_t next = atomic_load(&s->next), done = next < s->chunk_count ? next : s->chunk_count;
    double share = s->chunk_count ? (double)done / (double)s->chunk_count : 1;
    const tool_loop *loop = s->loop;
    return t->env.progress(t->env.progress_user, loop->phase, loop->from + share * (loop->to - loop->from));
}

int tool_run_loop(tool *t, const tool_loop *loop) {
    pthread_t helpers[MOST_HELPERS];
    shared_loop s = {.loop = loop, .chunk_count = (loop->count + loop->grain - 1) / loop->grain};
    if (!show_loop(t, &s)) return TOOL_CANCELLED;
    size_t count = start_helpers(&s, count_helpers(t, s.chunk_count), helpers);
    bool cancelled = false;
    while (!cancelled && do_next_chunk(&s)) cancelled = !show_loop(t, &s);
    if (cancelled) atomic_store(&s.next, s.chunk_count);
    for (size_t i = 0; i < count; ++i) pthread_join(helpers[i], NULL);
    return cancelled ? TOOL_CANCELLED : TOOL_DONE;
}
