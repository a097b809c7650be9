/* The progress of a run: its share and its remaining time, for runs that keep to the table of stages and
 * others. */
#include "support.h"

#include "tools/kit/progress.h"

static const tool_stage stages[] = {
    {"read", 10}, {"models|graph|clusters", 30}, {"extra", 20}, {"write", 40}, {0}};

static tool_progress begin(void) {
    tool_progress p;
    tool_progress_start(&p, stages, true, 100);
    return p;
}

/* Each unit of share takes .1 s. */
static void a_run_by_the_table_is_foreseen(void **state) {
    (void)state;
    tool_progress p = begin();
    double before = 0, passed = 0;
    for (int s = 0; s < 4; ++s)
        for (int i = 0; i <= 20; ++i) {
            static const char *const names[] = {"read", "models", "extra", "write"};
            double now = 100 + .1 * (passed += i ? stages[s].share / 20 : 0);
            tool_progress_show(&p, names[s], i / 20.0, now);
            double whole = tool_progress_whole(&p);
            assert_true(fabs(whole - passed / 100) < 1e-9 && whole >= before);
            if (passed > 0) assert_true(fabs(tool_progress_left(&p, now) - .1 * (100 - passed)) < 1e-6);
            before = whole;
        }
    assert_true(before > 1 - 1e-9);
}

static void a_skipped_stage_does_not_count(void **state) {
    (void)state;
    tool_progress p = begin();
    tool_progress_show(&p, "read", 1, 101);
    tool_progress_show(&p, "models", 1, 104);
    tool_progress_show(&p, "write", 0, 104);
    tool_progress_show(&p, "write", .5, 106);
    assert_true(fabs(tool_progress_whole(&p) - 60.0 / 80) < 1e-9);
    assert_true(fabs(tool_progress_left(&p, 106) - 2) < 1e-9);
}

static void phases_inside_a_stage_do_not_move_it(void **state) {
    (void)state;
    tool_progress p = begin();
    tool_progress_show(&p, "read", 1, 101);
    tool_progress_show(&p, "models", .25, 102);
    double whole = tool_progress_whole(&p);
    static const char *const inner[] = {"graph", "clusters", "read", "unknown", "model"};
    for (int i = 0; i < 10; ++i) {
        tool_progress_show(&p, inner[i % 5], i / 10.0, 102);
        assert_true(tool_progress_whole(&p) == whole && p.stage == 1);
    }
}

/* The present stage is ten times slower than the table says. */
static void a_slow_stage_is_measured(void **state) {
    (void)state;
    tool_progress p = begin();
    tool_progress_show(&p, "read", 1, 101);
    tool_progress_show(&p, "models", 0, 101);
    tool_progress_show(&p, "models", .1, 104);
    assert_true(tool_progress_left(&p, 104) >= 27);
}

static void without_stages_nothing_is_foreseen(void **state) {
    (void)state;
    tool_progress p;
    tool_progress_start(&p, NULL, true, 0);
    tool_progress_show(&p, "read", .5, 3);
    assert_true(isinf(tool_progress_left(&p, 3)));
    p = begin();
    assert_true(isinf(tool_progress_left(&p, 101)) && tool_progress_whole(&p) == 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_run_by_the_table_is_foreseen),
        cmocka_unit_test(a_skipped_stage_does_not_count),
        cmocka_unit_test(phases_inside_a_stage_do_not_move_it),
        cmocka_unit_test(a_slow_stage_is_measured),
        cmocka_unit_test(without_stages_nothing_is_foreseen),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
