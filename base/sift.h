/* base/sift.h: binary heaps and heap sort for items of any layout, for example several parallel arrays.
 *
 * The caller compares and swaps items by position: `less(items, i, j)` and `swap(items, i, j)`. The heap has
 * its greatest item at position 0. The compiler inlines both functions, so a call costs what a loop written
 * for the items would cost. base/heap.h is the heap whose keys change.
 */
#ifndef FCT_BASE_SIFT_H
#define FCT_BASE_SIFT_H

#include <stdbool.h>
#include <stddef.h>

#define FCT_SIFT_INLINE static inline __attribute__((always_inline))

typedef bool fct_less_items(const void *items, size_t i, size_t j);
typedef void fct_swap_items(void *items, size_t i, size_t j);

/* Restores the heap after the item at position `at` became less. O(log count). */
FCT_SIFT_INLINE void fct_sift_down(void *items, size_t at, size_t count, fct_less_items *less,
                                   fct_swap_items *swap) {
    for (size_t child; (child = 2 * at + 1) < count; at = child) {
        if (child + 1 < count && less(items, child, child + 1)) ++child;
        if (!less(items, at, child)) break;
        swap(items, at, child);
    }
}

/* Restores the heap after the item at position `at` became greater, or was appended there. O(log at). */
FCT_SIFT_INLINE void fct_sift_up(void *items, size_t at, fct_less_items *less, fct_swap_items *swap) {
    for (; at > 0 && less(items, (at - 1) / 2, at); at = (at - 1) / 2) swap(items, (at - 1) / 2, at);
}

/* Makes a heap of items in any order. O(count). */
FCT_SIFT_INLINE void fct_sift_all(void *items, size_t count, fct_less_items *less, fct_swap_items *swap) {
    for (size_t i = count / 2; i-- > 0;) fct_sift_down(items, i, count, less, swap);
}

/* Sorts items ascending, without memory. Not stable. O(count log count). */
FCT_SIFT_INLINE void fct_sift_sort(void *items, size_t count, fct_less_items *less, fct_swap_items *swap) {
    fct_sift_all(items, count, less, swap);
    for (size_t i = count; i-- > 1;) {
        swap(items, 0, i);
        fct_sift_down(items, 0, i, less, swap);
    }
}

#endif
