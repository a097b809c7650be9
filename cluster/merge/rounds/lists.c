/* cluster/merge/rounds/lists.c: the lists of neighbours of the next round.
 *
 * The list of a union holds the entries of both parts, renumbered, without the edge between the parts.
 * Entries that now lead to the same neighbour become one, with the sum of their borders. Three ways, by the
 * longer list of the two parts:
 * 1. At most 8 entries, as most lists: in registers, each lane compared with every other.
 * 2. At most SHORT_LIST: in scratch memory. A byte per live cluster holds its last place in the scratch. The
 *    entry at that place tells whether it belongs to this list.
 * 3. More: sorted in place.
 * In 1 and 2 no branch depends on the entries, because such branches are unpredictable.
 */
#include "cluster/merge/rounds/lists.h"

#include <string.h>

#include "base/math/simd.h"
#include "base/sift.h"

enum { SHORT_LIST = 100 }; /* two such lists and the union itself fit the 256 places of the scratch */

/* A list in its place in the arrays of the next round. */
typedef struct list {
    uint32_t *others, *keys;
    float *shared;
} list;

static bool less_entries(const void *items, size_t i, size_t j) {
    const list *l = items;
    return l->others[i] != l->others[j] ? l->others[i] < l->others[j] : l->shared[i] < l->shared[j];
}

static void swap_entries(void *items, size_t i, size_t j) {
    const list *l = items;
    uint32_t other = l->others[i], key = l->keys[i];
    float shared = l->shared[i];
    l->others[i] = l->others[j], l->keys[i] = l->keys[j], l->shared[i] = l->shared[j];
    l->others[j] = other, l->keys[j] = key, l->shared[j] = shared;
}

/* Unites adjacent entries with the same end and adds their lengths. Two entries have the same end only if
 * this cluster or that end is a union of this round, so their keys are FCT_KEY_OPEN already. */
static uint32_t unite_sorted(const list *l, uint32_t count) {
    uint32_t to = 0;
    for (uint32_t i = 0; i < count; ++i) {
        if (to > 0 && l->others[to - 1] == l->others[i])
            l->shared[to - 1] += l->shared[i];
        else
            l->others[to] = l->others[i], l->keys[to] = l->keys[i], l->shared[to++] = l->shared[i];
    }
    return to;
}

/* Appends the list of live cluster i, in the numbers of the next round, without entries to `self`. */
static uint32_t append_renumbered(const fct_rounds *r, uint32_t i, uint32_t self, const list *l,
                                  uint32_t count) {
    uint32_t own = r->renumbered[i], from = r->now.starts[i], end = from + r->now.lengths[i];
    for (; from < end; ++from) {
        uint32_t number = r->renumbered[r->now.others[from]];
        if ((number & ~FCT_MERGED) == self) continue;
        l->others[count] = number & ~FCT_MERGED;
        l->shared[count] = r->now.shared[from];
        l->keys[count++] = (number | own) & FCT_MERGED ? FCT_KEY_OPEN : r->now.keys[from];
    }
    return count;
}

static uint32_t join_long_lists(const fct_rounds *r, uint32_t i, uint32_t mate, uint32_t next,
                                uint32_t place) {
    list l = {r->next.others + place, r->next.keys + place, r->next.shared + place};
    uint32_t count = append_renumbered(r, i, next, &l, 0);
    if (mate != FCT_NONE) count = append_renumbered(r, mate, next, &l, count);
    fct_sift_sort(&l, count, less_entries, swap_entries);
    return unite_sorted(&l, count);
}

/* Adds the list of live cluster i to the scratch; returns the number of places in use. */
static inline uint32_t add_to_scratch(const fct_rounds *r, uint32_t i, bool merged, fct_list_scratch *s,
                                      uint32_t count) {
    uint8_t *places = s->places;
    uint32_t from = r->now.starts[i], end = from + r->now.lengths[i];
    for (; from < end; ++from) {
        uint32_t number = r->renumbered[r->now.others[from]], other = number & ~FCT_MERGED;
        uint32_t seen = places[other];
        bool known = (seen < count) & (s->others[seen] == other);
        uint32_t at = known ? seen : count;
        float sum = s->shared[at];
        s->others[at] = other;
        s->shared[at] = (known ? sum : 0) + r->now.shared[from];
        places[other] = (uint8_t)at;
        s->keys[at] = merged || number & FCT_MERGED ? FCT_KEY_OPEN : r->now.keys[from];
        count += !known;
    }
    return count;
}

static uint32_t join_short_lists(const fct_rounds *r, uint32_t i, uint32_t mate, uint32_t next,
                                 uint32_t place, fct_list_scratch *s) {
    s->others[0] = next, s->places[next] = 0;
    uint32_t count = add_to_scratch(r, i, mate != FCT_NONE, s, 1);
    if (mate != FCT_NONE) count = add_to_scratch(r, mate, true, s, count);
    --count;
    memcpy(r->next.others + place, s->others + 1, count * sizeof *s->others);
    memcpy(r->next.keys + place, s->keys + 1, count * sizeof *s->keys);
    memcpy(r->next.shared + place, s->shared + 1, count * sizeof *s->shared);
    return count;
}

/* --- Lists of at most eight, in registers --- */

/* A list of at most eight. Empty lanes have others = FCT_NONE. */
typedef struct lanes {
    i8 others, keys;
    f8 shared;
} lanes;

/* first, first + 1, ... modulo 8 */
static inline i8 numbers(uint32_t first) {
    static const uint32_t all[16] = {0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3, 4, 5, 6, 7};
    return i8_load(all + first);
}

/* The list of live cluster i, in the numbers of the next round, without entries to `self`. */
static inline lanes load_lanes(const fct_rounds *r, uint32_t i, uint32_t self) {
    const fct_generation *now = &r->now;
    uint32_t start = now->starts[i];
    i8 within = i8_less(numbers(0), i8_set(now->lengths[i])), flag = i8_set(FCT_MERGED);
    i8 number = i8_gather(r->renumbered, i8_and(i8_load(now->others + start), within));
    i8 other = i8_without(number, flag), merged = i8_same(i8_and(number, flag), flag);
    i8 gone = i8_or(i8_same(other, i8_set(self)), i8_same(within, i8_set(0)));
    return (lanes){i8_or(other, gone), i8_or(i8_load(now->keys + start), merged),
                   f8_load(now->shared + start)};
}

/* sum plus the borders of l, rotated by `turn`, where l and `to` have the same number. */
static inline f8 add_equal_lanes(const lanes *to, f8 sum, const lanes *l, i8 turn) {
    i8 equal = i8_same(to->others, i8_lookup8(l->others, turn));
    return f8_add(sum, f8_only(f8_lookup8(l->shared, turn), equal));
}

/* Of lanes with the same number, the first gets the sum of the borders and the others become empty. */
static inline void unite_lanes(lanes *l) {
    f8 sum = l->shared;
    i8 gone = i8_set(0), eight = i8_set(8);
    for (uint32_t turn = 1; turn < 8; ++turn) {
        i8 from = numbers(turn), equal = i8_same(l->others, i8_lookup8(l->others, from));
        i8 later = i8_less(i8_add(numbers(0), i8_set(turn)), eight);
        sum = f8_add(sum, f8_only(f8_lookup8(l->shared, from), i8_and(equal, later)));
        gone = i8_or(gone, i8_without(equal, later));
    }
    l->shared = sum;
    l->others = i8_or(l->others, gone);
}

/* Moves the borders of numbers that a and b have in common from b to a. */
static inline void unite_lists(lanes *a, lanes *b) {
    f8 sum = a->shared;
    i8 gone = i8_set(0);
    for (uint32_t turn = 0; turn < 8; ++turn) {
        sum = add_equal_lanes(a, sum, b, numbers(turn));
        gone = i8_or(gone, i8_same(b->others, i8_lookup8(a->others, numbers(turn))));
    }
    a->shared = sum;
    b->others = i8_or(b->others, gone);
}

/* Moves the lanes that are not empty to the front; returns their number. */
static inline uint32_t pack_lanes(lanes *l) {
    uint32_t held = ~i8_eq(l->others, i8_set(FCT_NONE)) & 0xFF, count = (uint32_t)__builtin_popcount(held);
    i8 order = i8_chosen(held), filled = i8_less(numbers(0), i8_set(count));
    l->others = i8_if(filled, i8_lookup8(l->others, order), i8_set(FCT_NONE));
    l->keys = i8_lookup8(l->keys, order);
    l->shared = f8_lookup8(l->shared, order);
    return count;
}

static inline void store_lanes(const fct_rounds *r, const lanes *l, uint32_t place) {
    i8_store(r->next.others + place, l->others);
    i8_store(r->next.keys + place, l->keys);
    f8_store(r->next.shared + place, l->shared);
}

static inline uint32_t keep_lanes(const fct_rounds *r, uint32_t i, uint32_t next, uint32_t place) {
    lanes l = load_lanes(r, i, next);
    unite_lanes(&l);
    uint32_t count = pack_lanes(&l);
    store_lanes(r, &l, place);
    return count;
}

static inline uint32_t join_lanes(const fct_rounds *r, uint32_t i, uint32_t mate, uint32_t next,
                                  uint32_t place) {
    lanes a = load_lanes(r, i, next), b = load_lanes(r, mate, next);
    a.keys = b.keys = i8_set(FCT_KEY_OPEN);
    uint32_t count = pack_lanes(&a), all = count + pack_lanes(&b);
    if (all <= 8) {
        i8 lane = numbers(0), back = i8_add(lane, i8_set(8 - count)), first = i8_less(lane, i8_set(count));
        a.others = i8_if(first, a.others, i8_lookup8(b.others, back));
        a.shared = f8_if(first, a.shared, f8_lookup8(b.shared, back));
        unite_lanes(&a);
        count = pack_lanes(&a);
        store_lanes(r, &a, place);
        return count;
    }
    unite_lanes(&a), unite_lanes(&b), unite_lists(&a, &b);
    count = pack_lanes(&a);
    store_lanes(r, &a, place);
    uint32_t more = pack_lanes(&b);
    store_lanes(r, &b, place + count);
    return count + more;
}

/* Writes the list of cluster `next` of the next round; returns its length. */
static inline uint32_t join_parts(const fct_rounds *r, uint32_t next, fct_list_scratch *scratch) {
    uint32_t i = (uint32_t)r->parents[next], mate = (uint32_t)(r->parents[next] >> 32),
             place = r->next.starts[next];
    uint32_t length = r->now.lengths[i], other = mate == FCT_NONE ? 0 : r->now.lengths[mate];
    if (length <= 8 && other <= 8)
        return mate == FCT_NONE ? keep_lanes(r, i, next, place) : join_lanes(r, i, mate, next, place);
    if (length <= SHORT_LIST && other <= SHORT_LIST)
        return join_short_lists(r, i, mate, next, place, scratch);
    return join_long_lists(r, i, mate, next, place);
}

void fct_join_lists(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)begin, (void)end;
    fct_rounds *r = user;
    for (uint32_t next = r->kept[chunk]; next < r->kept[chunk + 1]; ++next)
        r->next.lengths[next] = join_parts(r, next, &r->scratch[thread]);
}
