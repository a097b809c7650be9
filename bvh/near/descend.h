/* bvh/near/descend.h: the search for near faces: opens the nearest box first. For kernel files. */
#ifndef FCT_BVH_DESCEND_H
#define FCT_BVH_DESCEND_H

#include "bvh/entry.h"
#include "bvh/near/measure.h"

/* Pushes the children whose bit is set, the nearest on top, and returns the new height. Prefetches them
 * unless the search takes turns.
 *
 * Each lane counts the lanes that are farther away. The count is its place above `height`. So no branch
 * depends on the order of the distances. The lowest bits of the keys are lane numbers, so no two are equal.
 */
static inline uint32_t fct_push_children(const fct_bvh *bvh, uint64_t *stack, uint32_t height, uint32_t met,
                                         const float distance2[8], const uint32_t child[8], bool in_turns) {
    static const uint32_t numbers[8] = {0, 1, 2, 3, 4, 5, 6, 7}, bits[8] = {1, 2, 4, 8, 16, 32, 64, 128};
    i8 lane = i8_load(numbers), bit = i8_load(bits), farther = i8_set(0);
    i8 key = i8_add(i8_without(i8_bits(f8_load(distance2)), i8_set(7)), i8_set(8));
    key = i8_or(i8_and(key, i8_same(i8_and(i8_set(met), bit), bit)), lane);
    for (uint32_t i = 1; i < 8; ++i)
        farther = i8_add(farther, i8_less(key, i8_lookup8(key, i8_add(lane, i8_set(i)))));
    uint32_t below[8], count = 0;
    i8_store(below, farther); /* minus the count */
    for (; met; met &= met - 1, ++count) {
        uint32_t i = (uint32_t)__builtin_ctz(met);
        stack[height - below[i]] = fct_entry_make(distance2[i], child[i]);
        if (!in_turns) fct_prefetch_child(bvh, child[i]);
    }
    return height + count;
}

/* Stores squared lower bounds of the distances from `at` to the children of a node, and returns the mask of
 * those within limit2. `at` is the point as the function sees it; for fct_measure_children an fct_at. */
typedef uint32_t fct_bound_children(const fct_bvh *bvh, uint32_t ref, const void *at, float limit2,
                                    float distance2[8], const uint32_t **child);

/* Looks at a leaf. It may lower the limit of the search, a squared distance. */
typedef void fct_visit_leaf(void *user, uint32_t ref);

/* Where a search stands: at an entry, with others waiting, the nearest on top. */
typedef struct fct_descent {
    uint64_t entry;
    uint32_t height;
    uint64_t stack[FCT_STACK_SIZE];
} fct_descent;

static inline void fct_descent_begin(const fct_bvh *bvh, fct_descent *d) {
    d->entry = bvh->root;
    d->height = 0;
}

/* Visits the node or leaf of the entry, and goes on to the next within the limit. Returns false if there is
 * none. A search that takes turns requests the next from memory now, and needs it when its turn comes. */
static inline bool fct_descent_step(const fct_bvh *bvh, fct_descent *d, fct_bound_children *bound,
                                    const void *at, const float *limit2, fct_visit_leaf *visit, void *user,
                                    fct_visits *visits, bool in_turns) {
    uint32_t ref = (uint32_t)d->entry;
    if (ref & FCT_REF_LEAF) {
        visit(user, ref);
    } else {
        float distance2[8];
        const uint32_t *child;
        uint32_t met = bound(bvh, ref, at, *limit2, distance2, &child);
        ++visits->nodes;
        visits->boxes += 8;
        d->height = fct_push_children(bvh, d->stack, d->height, met, distance2, child, in_turns);
    }
    do {
        if (d->height == 0) return false;
        d->entry = d->stack[--d->height];
    } while (fct_entry_distance(d->entry) > *limit2);
    if (in_turns) fct_prefetch_all(bvh, (uint32_t)d->entry);
    return true;
}

/* Visits the leaves whose boxes are within the limit, near ones first. */
static inline void fct_descend(const fct_bvh *bvh, fct_bound_children *bound, const void *at,
                               const float *limit2, fct_visit_leaf *visit, void *user, fct_visits *visits) {
    fct_descent d;
    fct_descent_begin(bvh, &d);
    while (fct_descent_step(bvh, &d, bound, at, limit2, visit, user, visits, false)) {
    }
}

#endif
