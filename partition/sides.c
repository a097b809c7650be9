/* partition/sides.c: the sides of all faces, sorted by vertex pair.
 *
 * One stable radix sort brings the sides of each mesh edge together in order of their ids; neighbours in that
 * order are linked. There is no list per vertex, so vertices of high valence cost no more. O(F log F),
 * parallel; 24 bytes per face in the end and 96 during the sort.
 */
#include "partition/sides.h"

#include "base/parallel.h"
#include "base/sort.h"

enum { GRAIN = 1 << 15 };

typedef struct builder {
    const uint32_t *triangles;
    unsigned bits; /* of a vertex id */
    uint64_t none; /* key of a side from a vertex to itself: the largest */
    size_t count;
    uint64_t *keys;
    uint32_t *order;
    fct_sides *out;
} builder;

static void list_sides(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    builder *b = user;
    for (size_t f = begin; f < end; ++f)
        for (size_t k = 0; k < 3; ++k) {
            uint64_t u = b->triangles[3 * f + k], v = b->triangles[3 * f + (k + 1) % 3];
            b->keys[3 * f + k] = u == v ? b->none : u < v ? u << b->bits | v : v << b->bits | u;
            b->order[3 * f + k] = (uint32_t)(3 * f + k);
        }
}

static void link_sides(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    builder *b = user;
    for (size_t i = begin; i < end; ++i) {
        bool lone = b->keys[i] == b->none;
        bool first = lone || i == 0 || b->keys[i - 1] != b->keys[i];
        bool last = lone || i + 1 == b->count || b->keys[i + 1] != b->keys[i];
        b->out->before[b->order[i]] = first ? FCT_NONE : b->order[i - 1];
        b->out->after[b->order[i]] = last ? FCT_NONE : b->order[i + 1];
    }
}

static fct_result sort_and_link(const fct_env *env, builder *b) {
    fct_parallel_for(env, b->count / 3, GRAIN, list_sides, b);
    fct_result result = fct_sort_pairs(env, b->keys, b->order, b->count);
    if (result == FCT_OK) result = fct_progress(env, "sides", 0.8);
    if (result != FCT_OK) return result;
    fct_parallel_for(env, b->count, GRAIN, link_sides, b);
    return fct_progress(env, "sides", 1);
}

fct_result fct_sides_build(const fct_env *env, const uint32_t *triangles, uint32_t face_count,
                           uint32_t vertex_count, fct_sides *out) {
    *out = (fct_sides){0};
    if (face_count > UINT32_MAX / 3) return fct_fail_memory(env, "the sides of so many faces");
    builder b = {.triangles = triangles, .bits = 1, .count = 3 * (size_t)face_count, .out = out};
    while (vertex_count >> b.bits) ++b.bits;
    b.none = ((uint64_t)1 << 2 * b.bits) - 1; /* no vertex has id 2^bits - 1 on both ends */
    const fct_array arrays[] = {FCT_ARRAY(b.keys, b.count), FCT_ARRAY(b.order, b.count),
                                FCT_ARRAY(out->before, b.count), FCT_ARRAY(out->after, b.count)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "the sides of faces");
    if (result == FCT_OK) result = sort_and_link(env, &b);
    fct_release(env, b.keys);
    fct_release(env, b.order);
    if (result != FCT_OK) fct_sides_release(env, out);
    return result;
}

void fct_sides_release(const fct_env *env, fct_sides *sides) {
    fct_release(env, sides->before);
    fct_release(env, sides->after);
    *sides = (fct_sides){0};
}
