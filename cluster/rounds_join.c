/* cluster/rounds_join.c: the lists of the next round: a union's list is those of its parts, renumbered,
 * doubles added up.
 *
 * Short lists are put together in a scratch area, where a byte for every live number says at which place it
 * was seen last; what stands there tells whether that was in this list. Long ones are sorted.
 */
#include "base/simd.h"
#include "cluster/rounds.h"

/* A long list in its place. */
typedef struct list {
    uint32_t *others, *keys;
    float *shared;
} list;

static inline bool before(const list *l, size_t p, size_t q) {
    return l->others[p] != l->others[q] ? l->others[p] < l->others[q] : l->shared[p] < l->shared[q];
}

static void swap(const list *l, size_t p, size_t q) {
    uint32_t other = l->others[p], key = l->keys[p];
    float shared = l->shared[p];
    l->others[p] = l->others[q], l->keys[p] = l->keys[q], l->shared[p] = l->shared[q];
    l->others[q] = other, l->keys[q] = key, l->shared[q] = shared;
}

static void sift_down(const list *l, size_t at, size_t count) {
    for (size_t child; (child = 2 * at + 1) < count; at = child) {
        if (child + 1 < count && before(l, child, child + 1)) ++child;
        if (!before(l, at, child)) break;
        swap(l, at, child);
    }
}

static void sort_list(const list *l, size_t count) {
    for (size_t i = count / 2; i-- > 0;) sift_down(l, i, count);
    for (size_t i = count; i-- > 1;) {
        swap(l, 0, i);
        sift_down(l, 0, i);
    }
}

/* Adds up neighbouring doubles; a double stands for a merge, so its cost is open. */
static uint32_t join_sorted(const list *l, uint32_t count) {
    uint32_t to = 0;
    for (uint32_t i = 0; i < count; ++i) {
        if (to > 0 && l->others[to - 1] == l->others[i])
            l->shared[to - 1] += l->shared[i];
        else
            l->others[to] = l->others[i], l->keys[to] = l->keys[i], l->shared[to++] = l->shared[i];
    }
    return to;
}

/* Appends the list of live cluster i in the next round's numbers, without what leads to `self`. */
static uint32_t renumber_list(const fct_rounds *r, uint32_t i, uint32_t self, const list *l, uint32_t count) {
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

static uint32_t join_long(const fct_rounds *r, uint32_t i, uint32_t mate, uint32_t next, uint32_t place) {
    list l = {r->next.others + place, r->next.keys + place, r->next.shared + place};
    uint32_t count = renumber_list(r, i, next, &l, 0);
    if (mate != FCT_NONE) count = renumber_list(r, mate, next, &l, count);
    sort_list(&l, count);
    return join_sorted(&l, count);
}

/* Adds the list of live cluster i; returns how many places are taken. Without branches but the loop's, for
 * which way they go could not be foretold. */
static inline uint32_t add_short(const fct_rounds *r, uint32_t i, bool merged, fct_list_scratch *s,
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
        if (!merged) s->keys[at] = number & FCT_MERGED ? FCT_KEY_OPEN : r->now.keys[from];
        count += !known;
    }
    return count;
}

static uint32_t join_short(const fct_rounds *r, uint32_t i, uint32_t mate, uint32_t next, uint32_t place,
                           fct_list_scratch *s) {
    uint32_t count = 1;
    s->others[0] = next, s->places[next] = 0;
    if (mate == FCT_NONE) {
        count = add_short(r, i, false, s, count);
    } else {
        count = add_short(r, i, true, s, count);
        count = add_short(r, mate, true, s, count);
    }
    --count;
    i8 open = i8_set(FCT_KEY_OPEN);
    for (uint32_t k = 0; k < count; k += 8) {
        i8_store(r->next.others + place + k, i8_load(s->others + 1 + k));
        i8_store(r->next.keys + place + k, mate == FCT_NONE ? i8_load(s->keys + 1 + k) : open);
        f8_store(r->next.shared + place + k, f8_load(s->shared + 1 + k));
    }
    return count;
}

void fct_rounds_join_lists(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk;
    fct_rounds *r = user;
    for (uint32_t i = (uint32_t)begin; i < end; ++i) {
        uint32_t mate = r->mates[i], length = r->now.lengths[i];
        if (mate < i) continue;
        uint32_t next = r->renumbered[i] & ~FCT_MERGED, place = r->next.starts[next];
        if (mate != FCT_NONE) length += r->now.lengths[mate];
        r->next.lengths[next] = length <= FCT_SHORT_LIST
                                    ? join_short(r, i, mate, next, place, &r->scratch[thread])
                                    : join_long(r, i, mate, next, place);
    }
}
