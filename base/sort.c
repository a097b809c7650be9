/* base/sort.c: see sort.h. A radix sort from the least significant byte on. One pass per byte:
 *   1. Count the values of the byte per chunk.
 *   2. Turn the counts into places, in (value, chunk) order.
 *   3. Move each pair to its place.
 * The chunks do not depend on the threads, so neither does the result. A byte that is equal in all keys needs
 * no pass.
 */
#include "base/sort.h"

#include <string.h>

#include "base/parallel.h"
#include "base/sift.h"

enum { DIGITS = 256, GRAIN = 1 << 16 };
enum { SMALL = 48 }; /* at most so many pairs are sorted by insertion */

typedef struct pass {
    const uint64_t *keys;
    const uint32_t *values;
    uint64_t *keys_out;
    uint32_t *values_out;
    uint32_t (*places)[DIGITS]; /* per chunk: counts, then places */
    uint64_t *differing;        /* per chunk: the bits in which a key differs from the first key */
    unsigned shift;
} pass;

static void find_differing(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    pass *p = user;
    uint64_t first = p->keys[0], differing = 0;
    for (size_t i = begin; i < end; ++i) differing |= p->keys[i] ^ first;
    p->differing[chunk] = differing;
}

static void count_digits(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    pass *p = user;
    uint32_t *counts = p->places[chunk];
    memset(counts, 0, sizeof p->places[chunk]);
    for (size_t i = begin; i < end; ++i) ++counts[p->keys[i] >> p->shift & (DIGITS - 1)];
}

static void move_pairs(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    pass *p = user;
    uint32_t *places = p->places[chunk];
    for (size_t i = begin; i < end; ++i) {
        uint32_t place = places[p->keys[i] >> p->shift & (DIGITS - 1)]++;
        p->keys_out[place] = p->keys[i];
        if (p->values) p->values_out[place] = p->values[i];
    }
}

static void sort_small(uint64_t *keys, uint32_t *values, unsigned low, size_t count) {
    for (size_t i = 1; i < count; ++i) {
        uint64_t key = keys[i];
        uint32_t value = values ? values[i] : 0;
        size_t j = i;
        for (; j > 0 && keys[j - 1] >> low > key >> low; --j) {
            keys[j] = keys[j - 1];
            if (values) values[j] = values[j - 1];
        }
        keys[j] = key;
        if (values) values[j] = value;
    }
}

static void counts_to_places(pass *p, size_t chunks) {
    uint32_t place = 0;
    for (size_t digit = 0; digit < DIGITS; ++digit)
        for (size_t chunk = 0; chunk < chunks; ++chunk) {
            uint32_t count = p->places[chunk][digit];
            p->places[chunk][digit] = place;
            place += count;
        }
}

/* Sorts by the bits from `low` on. values may be NULL. */
static fct_result sort_by_bits(const fct_env *env, uint64_t *keys, uint32_t *values, unsigned low,
                               size_t count) {
    if (count <= SMALL) {
        sort_small(keys, values, low, count);
        return FCT_OK;
    }
    size_t chunks = fct_chunk_count(count, GRAIN);
    uint64_t *other_keys = fct_allocate(env, count, sizeof *other_keys);
    uint32_t *other_values = values ? fct_allocate(env, count, sizeof *other_values) : NULL;
    pass p = {.keys = keys, .values = values, .keys_out = other_keys, .values_out = other_values};
    p.places = fct_allocate(env, chunks, sizeof *p.places);
    p.differing = fct_allocate(env, chunks, sizeof *p.differing);
    fct_result result = FCT_OK;
    if (count > UINT32_MAX || !other_keys || (values && !other_values) || !p.places || !p.differing) {
        result = fct_fail_memory(env, "sorting");
        goto done;
    }
    fct_parallel_for(env, count, GRAIN, find_differing, &p);
    uint64_t differing = 0;
    for (size_t chunk = 0; chunk < chunks; ++chunk) differing |= p.differing[chunk];
    for (p.shift = low; p.shift < 64; p.shift += 8) {
        if (!(differing >> p.shift & (DIGITS - 1))) continue;
        fct_parallel_for(env, count, GRAIN, count_digits, &p);
        counts_to_places(&p, chunks);
        fct_parallel_for(env, count, GRAIN, move_pairs, &p);
        uint64_t *swap_keys = (uint64_t *)p.keys;
        uint32_t *swap_values = (uint32_t *)p.values;
        p.keys = p.keys_out, p.values = p.values_out;
        p.keys_out = swap_keys, p.values_out = swap_values;
    }
    if (p.keys != keys) {
        memcpy(keys, p.keys, count * sizeof *keys);
        if (values) memcpy(values, p.values, count * sizeof *values);
    }
done:
    fct_release(env, other_keys);
    fct_release(env, other_values);
    fct_release(env, p.places);
    fct_release(env, p.differing);
    return result;
}

typedef struct pairs {
    uint64_t *keys;
    uint32_t *values;
} pairs;

static bool less_pairs(const void *items, size_t i, size_t j) {
    const pairs *p = items;
    return p->keys[i] != p->keys[j] ? p->keys[i] < p->keys[j] : p->values[i] < p->values[j];
}

static void swap_pairs(void *items, size_t i, size_t j) {
    const pairs *p = items;
    uint64_t key = p->keys[i];
    uint32_t value = p->values[i];
    p->keys[i] = p->keys[j], p->values[i] = p->values[j];
    p->keys[j] = key, p->values[j] = value;
}

void fct_sort_in_place(uint64_t *keys, uint32_t *values, size_t count) {
    pairs p = {keys, values};
    if (count > SMALL) {
        fct_sift_sort(&p, count, less_pairs, swap_pairs);
        return;
    }
    for (size_t i = 1; i < count; ++i) {
        uint64_t key = keys[i];
        uint32_t value = values[i];
        size_t j = i;
        for (; j > 0 && (keys[j - 1] > key || (keys[j - 1] == key && values[j - 1] > value)); --j)
            keys[j] = keys[j - 1], values[j] = values[j - 1];
        keys[j] = key, values[j] = value;
    }
}

fct_result fct_sort_pairs(const fct_env *env, uint64_t *keys, uint32_t *values, size_t count) {
    return sort_by_bits(env, keys, values, 0, count);
}

fct_result fct_sort_items(const fct_env *env, uint64_t *items, size_t count) {
    return sort_by_bits(env, items, NULL, 32, count);
}
