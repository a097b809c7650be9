/* base/union_find.h: disjoint sets of the ids 0 to count - 1.
 *
 * The caller owns the array. parents[i] is i for a root, and an id of the same set otherwise. The root of a
 * set is its smallest id, so the sets and their roots do not depend on the order of the joins. Joins take
 * constant time in practice, because find_root halves the paths it walks.
 */
#ifndef FCT_BASE_UNION_FIND_H
#define FCT_BASE_UNION_FIND_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Makes every id a set of its own. */
static inline void fct_sets_create(uint32_t *parents, size_t count) {
    for (size_t i = 0; i < count; ++i) parents[i] = (uint32_t)i;
}

static inline uint32_t fct_sets_find(uint32_t *parents, uint32_t i) {
    while (parents[i] != i) i = parents[i] = parents[parents[i]];
    return i;
}

/* Joins the sets of a and b. Returns false if a and b were in one set already. */
static inline bool fct_sets_join(uint32_t *parents, uint32_t a, uint32_t b) {
    a = fct_sets_find(parents, a), b = fct_sets_find(parents, b);
    if (a == b) return false;
    parents[a < b ? b : a] = a < b ? a : b;
    return true;
}

#endif
