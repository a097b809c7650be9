/* Work shared among threads: every item once, chunks that depend on count and grain alone, thread numbers
 * below their bound, progress that cancels, and a sum that is the same for every number of threads. */
#include "support.h"

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
    for (uint32_t threads = 1; threads <= 4; threads *= 2)
        for (size_t c = 0; c < sizeof counts / sizeof *counts; ++c)
            for (size_t g = 0; g < sizeof grains / sizeof *grains; ++g) {
                env.thread_count = threads;
                t = (tally){.count = counts[c], .grain = grains[g], .threads = threads};
                fct_parallel_for(&env, t.count, t.grain, count_items, &t);
                check_tally(&t);
                if (c < 6 || g % 2) continue; /* a team of threads for each hundredth: slow */
                t = (tally){.count = counts[c], .grain = grains[g], .threads = threads};
                assert_int_equal(fct_parallel_for_progress(&env, "test", t.count, t.grain, count_items, &t),
                                 FCT_OK);
                check_tally(&t);
            }
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
    watcher w = {0};
    fct_env env = fct_env_default();
    env.progress = watch;
    env.progress_user = &w;
    env.thread_count = 2;
    t = (tally){.count = MOST, .grain = 1, .threads = 2};
    assert_int_equal(fct_parallel_for_progress(&env, "test", t.count, t.grain, count_items, &t), FCT_OK);
    assert_true(w.last == 1 && !w.falling && w.calls > 50);
    check_tally(&t);
    for (int stop = 1; stop <= w.calls; stop += 23) {
        watcher stopped = {.stop = stop};
        env.progress_user = &stopped;
        t = (tally){.count = MOST, .grain = 1, .threads = 2};
        assert_int_equal(fct_parallel_for_progress(&env, "test", t.count, t.grain, count_items, &t),
                         FCT_ERROR_CANCELLED);
        assert_int_equal(stopped.calls, stop); /* and nobody is asked again */
        size_t done = 0;
        for (size_t i = 0; i < MOST; ++i) done += t.visits[i];
        assert_true(stop == 1 ? done == 0 : done > 0);
        assert_true(done <= (size_t)stop * MOST / 50);
    }
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
                                       cmocka_unit_test(progress_rises_and_cancels),
                                       cmocka_unit_test(sums_are_the_same_and_right)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
