/* partition/adjacency.c: pairs of labels that share mesh edges.
 *
 * 1. Walk the chain of sides of every mesh edge once, from its first side.
 * 2. List a link for each pair of successive faces with different labels. A chain of k >= 3 faces gives each
 *    link half the length, as in the dual graph.
 * 3. Sort the links by pair and sum them.
 * O(F + B log B) for B links, parallel, the same result for every thread count.
 */
#include "partition/adjacency.h"

#include "base/key.h"
#include "base/math/vec.h"
#include "base/parallel.h"
#include "base/sort.h"
#include "partition/labels.h"

enum { GRAIN = 1 << 15 };

/* A border between two labels on one mesh edge. */
typedef struct link {
    double length;
    uint32_t head; /* first side of the mesh edge, which identifies it */
} link;

typedef struct lister {
    const fct_mesh *mesh;
    const fct_sides *sides;
    const uint32_t *labels;
    uint32_t *places; /* per chunk: number of links, then index of the first */
    uint64_t *keys;
    uint32_t *order;
    link *links;
} lister;

/* The last of the successive sides of one face that begin at `side`, and their number. A face that uses a
 * vertex twice can have several sides on one edge. */
static uint32_t find_run_end(const fct_sides *sides, uint32_t side, uint32_t *length) {
    *length = 1;
    while (sides->after[side] != FCT_NONE && sides->after[side] / 3 == side / 3) {
        side = sides->after[side];
        ++*length;
    }
    return side;
}

static double measure_side(const fct_mesh *mesh, uint32_t side) {
    uint32_t face = side / 3, corner = side % 3;
    const uint32_t *t = mesh->triangles + 3 * (size_t)face;
    v3 p = v3_load(mesh->positions + 3 * (size_t)t[corner]),
       q = v3_load(mesh->positions + 3 * (size_t)t[(corner + 1) % 3]);
    return v3_norm(v3_sub(q, p));
}

/* Lists the links of the mesh edge with this head from index `place` on; only counts them while keys is NULL.
 */
static uint32_t list_edge(const lister *l, uint32_t head, uint32_t place) {
    uint32_t runs, last = find_run_end(l->sides, head, &runs), count = 0;
    bool first = true;
    while (l->sides->after[last] != FCT_NONE) {
        uint32_t side = l->sides->after[last], next_runs,
                 next_last = find_run_end(l->sides, side, &next_runs);
        uint32_t a = l->labels[last / 3], b = l->labels[side / 3];
        if (a != b) {
            if (l->keys) {
                double share = fmin(runs / (first ? 1.0 : 2.0),
                                    next_runs / (l->sides->after[next_last] == FCT_NONE ? 1.0 : 2.0));
                l->keys[place + count] = fct_pair_key(a, b);
                l->order[place + count] = place + count;
                l->links[place + count] = (link){share * measure_side(l->mesh, head), head};
            }
            ++count;
        }
        last = next_last, runs = next_runs, first = false;
    }
    return count;
}

static void count_links(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    lister *l = user;
    uint32_t count = 0;
    for (size_t i = begin; i < end; ++i)
        if (l->sides->before[i] == FCT_NONE) count += list_edge(l, (uint32_t)i, 0);
    l->places[chunk] = count;
}

static void list_links(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    lister *l = user;
    uint32_t place = l->places[chunk];
    for (size_t i = begin; i < end; ++i)
        if (l->sides->before[i] == FCT_NONE) place += list_edge(l, (uint32_t)i, place);
}

/* Sums the links of each pair. A mesh edge with several links of one pair counts once in `edges`. */
static fct_result sum_links(const fct_env *env, const lister *l, uint32_t link_count, fct_adjacency *out) {
    uint32_t pairs = 0;
    for (uint32_t i = 0; i < link_count; ++i) pairs += i == 0 || l->keys[i] != l->keys[i - 1];
    const fct_array arrays[] = {FCT_ARRAY(out->pairs, 2 * (size_t)pairs), FCT_ARRAY(out->lengths, pairs),
                                FCT_ARRAY(out->edges, pairs)};
    if (fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "neighbours") != FCT_OK) return FCT_ERROR_MEMORY;
    for (uint32_t i = 0; i < link_count; ++i) {
        const link *item = &l->links[l->order[i]];
        if (i == 0 || l->keys[i] != l->keys[i - 1]) {
            uint32_t p = out->pair_count++;
            out->pairs[2 * (size_t)p] = (uint32_t)(l->keys[i] >> 32);
            out->pairs[2 * (size_t)p + 1] = (uint32_t)l->keys[i];
            out->lengths[p] = item->length;
            out->edges[p] = 1;
        } else {
            out->lengths[out->pair_count - 1] += item->length;
            out->edges[out->pair_count - 1] += item->head != l->links[l->order[i - 1]].head;
        }
    }
    return FCT_OK;
}

static fct_result list_and_sum(const fct_env *env, lister *l, fct_adjacency *out) {
    size_t sides = 3 * (size_t)l->mesh->face_count, chunks = fct_chunk_count(sides, GRAIN);
    uint32_t total = 0;
    fct_parallel_for(env, sides, GRAIN, count_links, l);
    for (size_t i = 0; i < chunks; ++i) {
        uint32_t count = l->places[i];
        l->places[i] = total;
        total += count;
    }
    const fct_array arrays[] = {FCT_ARRAY(l->keys, total), FCT_ARRAY(l->order, total),
                                FCT_ARRAY(l->links, total)};
    if (fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "neighbours") != FCT_OK) return FCT_ERROR_MEMORY;
    fct_parallel_for(env, sides, GRAIN, list_links, l);
    fct_result result = fct_sort_pairs(env, l->keys, l->order, total);
    return result == FCT_OK ? sum_links(env, l, total, out) : result;
}

fct_result fct_adjacency_pairs(const fct_env *env, const fct_mesh *mesh, const fct_sides *sides,
                               const uint32_t *labels, fct_adjacency *out) {
    lister l = {.mesh = mesh, .sides = sides, .labels = labels};
    l.places = fct_allocate(env, fct_chunk_count(3 * (size_t)mesh->face_count, GRAIN), sizeof *l.places);
    fct_result result = l.places ? list_and_sum(env, &l, out) : fct_fail_memory(env, "neighbours");
    fct_release(env, l.places);
    fct_release(env, l.keys);
    fct_release(env, l.order);
    fct_release(env, l.links);
    return result;
}

/* Fills the rows of neighbours. They come out ascending, because the pairs are sorted. */
static fct_result list_neighbours(const fct_env *env, uint32_t label_count, fct_adjacency *out) {
    size_t ends = 2 * (size_t)out->pair_count;
    out->label_count = label_count;
    const fct_array arrays[] = {FCT_ARRAY_ZERO(out->first, (size_t)label_count + 1),
                                FCT_ARRAY(out->others, ends), FCT_ARRAY(out->other_pairs, ends)};
    if (fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "neighbours") != FCT_OK) return FCT_ERROR_MEMORY;
    for (size_t i = 0; i < ends; ++i) ++out->first[out->pairs[i]];
    uint32_t total = 0;
    for (uint32_t a = 0; a <= label_count; ++a) {
        uint32_t count = out->first[a];
        out->first[a] = total;
        total += count;
    }
    for (size_t i = 0; i < ends; ++i) {
        uint32_t place = out->first[out->pairs[i]]++;
        out->others[place] = out->pairs[i ^ 1];
        out->other_pairs[place] = (uint32_t)(i / 2);
    }
    for (uint32_t a = label_count; a > 0; --a) out->first[a] = out->first[a - 1];
    out->first[0] = 0;
    return FCT_OK;
}

fct_result fct_labels_adjacency(const fct_env *env, const fct_mesh *mesh, const uint32_t *labels,
                                uint32_t label_count, fct_adjacency *out) {
    *out = (fct_adjacency){0};
    fct_sides sides;
    fct_result result = fct_labels_check(env, mesh, labels, label_count);
    if (result != FCT_OK) return result;
    result = fct_sides_build(env, mesh->triangles, mesh->face_count, mesh->vertex_count, &sides);
    if (result == FCT_OK) result = fct_adjacency_pairs(env, mesh, &sides, labels, out);
    if (result == FCT_OK) result = list_neighbours(env, label_count, out);
    fct_sides_release(env, &sides);
    if (result != FCT_OK) fct_adjacency_release(env, out);
    return result;
}

void fct_adjacency_release(const fct_env *env, fct_adjacency *adjacency) {
    fct_release(env, adjacency->pairs);
    fct_release(env, adjacency->lengths);
    fct_release(env, adjacency->edges);
    fct_release(env, adjacency->first);
    fct_release(env, adjacency->others);
    fct_release(env, adjacency->other_pairs);
    *adjacency = (fct_adjacency){0};
}
