/* Disjoint sets against labels that a plain loop renames at each join. */
#include "support.h"

#include "base/union_find.h"

enum { IDS = 300 };

static void sets_are_those_of_renamed_labels(void **state) {
    (void)state;
    uint32_t parents[IDS], labels[IDS], seed = 3, sets = IDS;
    fct_sets_create(parents, IDS);
    for (uint32_t i = 0; i < IDS; ++i) labels[i] = i;
    for (int step = 0; step < 600; ++step) {
        seed = seed * 1664525u + 1013904223u;
        uint32_t a = (seed >> 8) % IDS, b = (seed >> 19) % IDS, low = labels[a], high = labels[b];
        if (low > high) low = labels[b], high = labels[a];
        assert_int_equal(fct_sets_join(parents, a, b), low != high);
        sets -= low != high;
        for (uint32_t i = 0; i < IDS; ++i)
            if (labels[i] == high) labels[i] = low;
        uint32_t roots = 0;
        for (uint32_t i = 0; i < IDS; ++i) {
            assert_int_equal(fct_sets_find(parents, i), labels[i]); /* the smallest id of the set */
            roots += parents[i] == i;
        }
        assert_int_equal(roots, sets);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(sets_are_those_of_renamed_labels)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
