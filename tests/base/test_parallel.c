/* Work shared among threads: every item once, chunks that depend on count and grain alone, distinct thread
 * numbers below their bound, all threads at work at once, callers beside one another, a child of fork(),
 * progress that cancels, and a sum that is the same for every number of threads. */
#define _GNU_SOURCE
#include "support.h"

#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "base/parallel.h"

enum { MOST = 5000 };

typedef struct tally {
    size_t count, grain;
    uint32_t threads;
    uint32_t visits[MOST], chunks[MOST]; /* by item; by chunk */
    uint32_t wrong[MOST + 1];            /* by chunk, so that threads share no word */
} tally;

static void count_items(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    tally *t = user;
    bool last = end == t->count;
    t->wrong[chunk] += begin != chunk * t->grain || end <= begin || end > t->count ||
                       (!last && end - begin != t->grain) || end - begin > t->grain || thread >= t->threads;
    ++t->chunks[chunk];
    for (size_t i = begin; i < end; ++i) ++t->visits[i];
}

static void check_tally(const tally *t) {
    size_t chunks = fct_chunk_count(t->count, t->grain);
    size_t wrong = 0;
    for (size_t i = 0; i < MOST; ++i)
        wrong += t->visits[i] != (i < t->count) || t->chunks[i] != (i < chunks) || t->wrong[i];
    assert_int_equal(wrong, 0);
}

static void every_item_once(void **state) {
    (void)state;
    static tally t;
    const size_t counts[] = {0, 1, 2, 63, 64, 65, 1000, MOST}, grains[] = {1, 2, 64, 999, 1000, 100000};
    fct_env env = fct_env_default();
    for (uint32_t threads = 1; threads <= 32; threads *= 2)
        for (size_t c = 0; c < sizeof counts / sizeof *counts; ++c)
            for (size_t g = 0; g < sizeof grains / sizeof *grains; ++g) {
                env.thread_count = threads;
                t = (tally){.count = counts[c], .grain = grains[g], .threads = threads};
                fct_parallel_for(&env, t.count, t.grain, count_items, &t);
                check_tally(&t);
                t = (tally){.count = counts[c], .grain = grains[g], .threads = threads};
                assert_int_equal(fct_parallel_for_progress(&env, "test", t.count, t.grain, count_items, &t),
                                 FCT_OK);
                check_tally(&t);
            }
}

/* Sleeps, so that others may run, until *value is at least `least`; false after half a minute. */
static bool wait_for(atomic_int *value, int least) {
    for (int i = 0; i < 300000; ++i) {
        if (atomic_load(value) >= least) return true;
        nanosleep(&(struct timespec){.tv_nsec = 100000}, NULL);
    }
    return false;
}

/* Each chunk waits until all threads are in a chunk, and then reads the numbers of the other threads. */
typedef struct meeting {
    int threads, late; /* late: after how many chunks it is held */
    atomic_int begun, ended, wrong;
    atomic_int at_work[256]; /* by thread number */
} meeting;

static void meet(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)begin, (void)end, (void)chunk;
    meeting *m = user;
    if (thread >= (uint32_t)m->threads || atomic_fetch_add(&m->at_work[thread], 1)) ++m->wrong;
    int begun = atomic_fetch_add(&m->begun, 1) + 1;
    if (begun > m->late && !wait_for(&m->begun, m->late + m->threads)) ++m->wrong;
    if (begun - atomic_load(&m->ended) > m->threads) ++m->wrong;
    atomic_fetch_add(&m->ended, 1);
    if (thread < (uint32_t)m->threads) atomic_fetch_sub(&m->at_work[thread], 1);
}

/* `threads` must be at work at once and no more; returns what went wrong. */
static int hold_meeting(int threads, int late) {
    meeting m = {.threads = threads, .late = late};
    fct_env env = fct_env_default();
    env.thread_count = (uint32_t)threads;
    fct_parallel_for(&env, (size_t)(threads + late), 1, meet, &m);
    return m.wrong + (m.begun != threads + late) + (m.ended != threads + late);
}

static void all_are_at_work_under_numbers_of_their_own(void **state) {
    (void)state;
    const int threads[] = {1, 2, 3, 2, 7, 64, 256, 4};
    for (size_t i = 0; i < sizeof threads / sizeof *threads; ++i) {
        assert_int_equal(hold_meeting(threads[i], 0), 0);
        assert_int_equal(hold_meeting(threads[i], 50), 0);
    }
}

static void record_thread(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)begin, (void)end;
    ((uint32_t *)user)[chunk] = thread + 1;
}

static void many_small_regions(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    size_t wrong = 0;
    for (int region = 0; region < 50000; ++region) {
        uint32_t seen[6] = {0};
        size_t count = 1 + (size_t)region % 5;
        env.thread_count = 2 + (uint32_t)region % 31; /* often more than there are chunks */
        fct_parallel_for(&env, count, 1, record_thread, seen);
        for (size_t i = 0; i < 6; ++i)
            wrong += i < count ? seen[i] == 0 || seen[i] > env.thread_count : seen[i] != 0;
    }
    assert_int_equal(wrong, 0);
}

static void add_items(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    uint32_t *items = user;
    for (size_t i = begin; i < end; ++i) ++items[i];
}

static void *call_often(void *user) {
    atomic_int *wrong = user;
    fct_env env = fct_env_default();
    for (uint32_t region = 0; region < 2000; ++region) {
        uint32_t items[200] = {0};
        env.thread_count = 1 + region % 4;
        fct_parallel_for(&env, 150, 1 + region % 7, add_items, items);
        for (int i = 0; i < 200; ++i)
            if (items[i] != (i < 150)) ++*wrong;
    }
    return NULL;
}

static void callers_beside_one_another(void **state) {
    (void)state;
    atomic_int wrong = 0;
    pthread_t callers[5];
    for (int i = 0; i < 5; ++i) assert_int_equal(pthread_create(&callers[i], NULL, call_often, &wrong), 0);
    for (int i = 0; i < 5; ++i) pthread_join(callers[i], NULL);
    assert_int_equal(wrong, 0);
}

/* A caller whose chunks go on until `release`. */
typedef struct holder {
    uint32_t threads;
    atomic_int held, release, wrong;
} holder;

static void hold(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)begin, (void)end, (void)chunk, (void)thread;
    holder *h = user;
    atomic_fetch_add(&h->held, 1);
    if (!wait_for(&h->release, 1)) ++h->wrong;
}

static void *hold_threads(void *user) {
    holder *h = user;
    fct_env env = fct_env_default();
    env.thread_count = h->threads;
    fct_parallel_for(&env, h->threads, 1, hold, h);
    return NULL;
}

static void who_finds_all_helpers_taken_works_alone(void **state) {
    (void)state;
    holder h = {.threads = 256};
    pthread_t caller;
    assert_int_equal(pthread_create(&caller, NULL, hold_threads, &h), 0);
    assert_true(wait_for(&h.held, 256));
    uint32_t seen[40] = {0};
    fct_env env = fct_env_default();
    env.thread_count = 8;
    fct_parallel_for(&env, 40, 1, record_thread, seen);
    for (int i = 0; i < 40; ++i) assert_int_equal(seen[i], 1);
    h.release = 1;
    pthread_join(caller, NULL);
    assert_int_equal(h.wrong, 0);
    assert_int_equal(hold_meeting(8, 0), 0);
}

/* The first chunk ends when all others have. */
static void wait_in_first(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)begin, (void)end, (void)thread;
    holder *h = user;
    if (chunk > 0) atomic_fetch_add(&h->held, 1);
    if (chunk == 0 && !wait_for(&h->held, 999)) ++h->wrong;
}

static void a_chunk_that_takes_long_holds_nobody_up(void **state) {
    (void)state;
    for (uint32_t threads = 2; threads < 5; ++threads) {
        holder h = {0};
        fct_env env = fct_env_default();
        env.thread_count = threads;
        fct_parallel_for(&env, 1000, 1, wait_in_first, &h);
        assert_int_equal(h.held, 999);
        assert_int_equal(h.wrong, 0);
    }
}

/* Returns the result of `run` in a child process; 99 if it dies or takes longer than a minute. */
static int in_child(int (*run)(void)) {
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        alarm(60);
        _exit(run());
    }
    int status = 0;
    return child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status) ? WEXITSTATUS(status) : 99;
}

static int meet_in_child(void) {
    return hold_meeting(4, 20) != 0;
}

static void a_child_gets_helpers_of_its_own(void **state) {
    (void)state;
#ifdef __SANITIZE_THREAD__
    skip(); /* which allows a child no threads */
#endif
    assert_int_equal(hold_meeting(4, 0), 0);
    assert_int_equal(in_child(meet_in_child), 0);
    holder h = {.threads = 3}; /* some helpers at work in the parent */
    pthread_t caller;
    assert_int_equal(pthread_create(&caller, NULL, hold_threads, &h), 0);
    assert_true(wait_for(&h.held, 3));
    assert_int_equal(in_child(meet_in_child), 0);
    h.release = 1;
    pthread_join(caller, NULL);
    assert_int_equal(h.wrong, 0);
    assert_int_equal(hold_meeting(4, 20), 0);
}

/* Two chunks, one each: the helper leaves the processor to whoever else wants it. */
static void step_back(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    meet(user, begin, end, chunk, thread);
    if (thread > 0) sched_setscheduler(0, SCHED_IDLE, &(struct sched_param){0});
}

static void *stay_busy(void *user) {
    while (!atomic_load((atomic_int *)user)) {
    }
    return NULL;
}

/* One processor, which a busy thread, the caller and a helper of the lowest rank share: the helper hardly
 * ever runs. Two thousand calls are over before it would have run a hundred times. */
static int call_with_helper_starved(void) {
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set)) return 0;
    int first = 0;
    while (!CPU_ISSET(first, &set)) ++first;
    CPU_ZERO(&set);
    CPU_SET(first, &set);
    if (sched_setaffinity(0, sizeof set, &set)) return 0;
    meeting m = {.threads = 2};
    fct_env env = fct_env_default();
    env.thread_count = 2;
    fct_parallel_for(&env, 2, 1, step_back, &m);
    atomic_int enough = 0;
    pthread_t busy;
    if (m.wrong || pthread_create(&busy, NULL, stay_busy, &enough)) return 1;
    double begin = fct_seconds();
    for (int i = 0; i < 2000; ++i) fct_parallel_for(&env, 4, 1, record_thread, (uint32_t[4]){0});
    double seconds = fct_seconds() - begin;
    atomic_store(&enough, 1);
    pthread_join(busy, NULL);
    return seconds < 10 ? 0 : 2;
}

static void nobody_waits_for_who_is_not_let_run(void **state) {
    (void)state;
#ifdef __SANITIZE_THREAD__
    skip(); /* as above */
#endif
    assert_int_equal(in_child(call_with_helper_starved), 0);
}

typedef struct watcher {
    int calls, stop; /* stop: the call that cancels, 0 for none */
    double last;
    bool falling; /* it went backwards or left [0, 1] */
} watcher;

static bool watch(void *user, const char *phase, double done) {
    watcher *w = user;
    assert_string_equal(phase, "test");
    w->falling = w->falling || !(done >= w->last && done <= 1);
    w->last = done;
    return ++w->calls != w->stop;
}

static void progress_rises_and_cancels(void **state) {
    (void)state;
    static tally t;
    for (uint32_t threads = 1; threads <= 3; ++threads) {
        watcher w = {0};
        fct_env env = fct_env_default();
        env.progress = watch;
        env.progress_user = &w;
        env.thread_count = threads;
        t = (tally){.count = MOST, .grain = 1, .threads = threads};
        assert_int_equal(fct_parallel_for_progress(&env, "test", t.count, t.grain, count_items, &t), FCT_OK);
        assert_true(w.last == 1 && !w.falling);
        assert_int_equal(w.calls, 1 + MOST / (MOST / 100 + 1) + 1);
        check_tally(&t);
        for (int stop = 1; stop <= w.calls; stop += 7) {
            watcher stopped = {.stop = stop};
            env.progress_user = &stopped;
            t = (tally){.count = MOST, .grain = 1, .threads = threads};
            assert_int_equal(fct_parallel_for_progress(&env, "test", t.count, t.grain, count_items, &t),
                             FCT_ERROR_CANCELLED);
            assert_int_equal(stopped.calls, stop); /* and the hook is not called again */
            size_t done = 0;
            for (size_t i = 0; i < MOST; ++i) done += t.visits[i];
            assert_true(stop == 1 ? done == 0 : done > 0);
            if (threads == 1) assert_true(done <= (size_t)stop * MOST / 90);
        }
    }
}

/* The caller's chunk lasts until its helper has done half of all. */
static void fall_behind(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)begin, (void)end, (void)chunk;
    holder *h = user;
    if (thread > 0) atomic_fetch_add(&h->held, 1);
    if (thread == 0 && !wait_for(&h->held, 500)) ++h->wrong;
}

static void every_hundredth_is_told_by_a_late_caller_too(void **state) {
    (void)state;
    holder h = {0};
    watcher w = {0};
    fct_env env = fct_env_default();
    env.progress = watch;
    env.progress_user = &w;
    env.thread_count = 2;
    assert_int_equal(fct_parallel_for_progress(&env, "test", 1000, 1, fall_behind, &h), FCT_OK);
    assert_int_equal(h.wrong, 0);
    assert_int_equal(w.calls, 1 + 999 / 11 + 1);
    assert_true(w.last == 1 && !w.falling);
}

/* The second call of the hook cancels while a helper is in a chunk. The call waits for this chunk, and no
 * other chunk begins. */
static void hold_briefly(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)begin, (void)end, (void)chunk;
    holder *h = user;
    atomic_fetch_add(&h->held, 1);
    if (!wait_for(&h->held, 2)) ++h->wrong;
    if (thread > 0) nanosleep(&(struct timespec){.tv_nsec = 30000000}, NULL);
    atomic_fetch_add(&h->release, 1);
}

static void a_cancelled_call_leaves_nobody_at_work(void **state) {
    (void)state;
    holder h = {0};
    watcher w = {.stop = 2};
    fct_env env = fct_env_default();
    env.progress = watch;
    env.progress_user = &w;
    env.thread_count = 2;
    assert_int_equal(fct_parallel_for_progress(&env, "test", 60, 1, hold_briefly, &h), FCT_ERROR_CANCELLED);
    assert_true(h.held == 2 && h.release == 2 && h.wrong == 0);
}

/* The sum of values that a plain order would round otherwise; against long doubles. */
static void sums_are_the_same_and_right(void **state) {
    (void)state;
    static double values[MOST];
    long double exact = 0;
    for (size_t i = 0; i < MOST; ++i) {
        values[i] = sin((double)i * 1.7) * pow(10, (double)(i % 13) - 6);
        exact += (long double)values[i];
        assert_true(fabs((double)((long double)fct_sum(values, i + 1) - exact)) < 1e-6);
    }
    assert_true(fct_sum(values, 0) == 0);
    assert_true(fct_sum(values, 1) == values[0]);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_item_once),
                                       cmocka_unit_test(all_are_at_work_under_numbers_of_their_own),
                                       cmocka_unit_test(many_small_regions),
                                       cmocka_unit_test(callers_beside_one_another),
                                       cmocka_unit_test(who_finds_all_helpers_taken_works_alone),
                                       cmocka_unit_test(a_chunk_that_takes_long_holds_nobody_up),
                                       cmocka_unit_test(a_child_gets_helpers_of_its_own),
                                       cmocka_unit_test(nobody_waits_for_who_is_not_let_run),
                                       cmocka_unit_test(progress_rises_and_cancels),
                                       cmocka_unit_test(every_hundredth_is_told_by_a_late_caller_too),
                                       cmocka_unit_test(a_cancelled_call_leaves_nobody_at_work),
                                       cmocka_unit_test(sums_are_the_same_and_right)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
