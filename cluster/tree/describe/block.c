/* cluster/tree/describe/block.c: the records of one block of at most FCT_BLOCK faces.
 *
 * 1. List the subtree's nodes and the block's distinct points.
 * 2. Sum from the leaves upwards (sums.c).
 * 3. Sort the nodes by size and describe eight of about the same size together (octet.c): planes by (8.5) to
 *    (8.11), cones, and oriented boxes (section 8.3.1) over the distinct points of each.
 *
 * Nodes side by side have different points. Short lists repeat their points up to the length of the longest
 * list, because a repeated point does not change a box.
 */
#include "cluster/tree/describe/block.h"

#include <assert.h>
#include <string.h>

#include "base/math/simd.h"

/* Size classes: one per number of faces below EXACT, then one per 32 faces. */
enum { EXACT = 64, SIZES = EXACT - 1 + FCT_BLOCK / 32 };

/* Lists the inner nodes of the subtree level by level, with the sums of their children. Prefetches the links
 * of a level while it walks the level above. Returns the number of nodes. */
static uint32_t list_subtree(const fct_tree *tree, uint32_t root, uint32_t first, fct_block_scratch *s) {
    uint32_t nodes = tree->view.node_count, count = 0;
    if (root < nodes) s->order[count++] = root;
    for (uint32_t i = 0; i < count; ++i) {
        const fct_node_link *link = &tree->links[s->order[i]];
        s->links[i] = *link;
        for (int k = 0; k < 2; ++k) {
            uint32_t child = link->child[k];
            s->parts[i][k] = child < nodes ? &s->nodes[count] : &s->leaves[child - nodes - first];
            if (child >= nodes) continue;
            __builtin_prefetch(&tree->links[child].child);
            __builtin_prefetch(&tree->links[child].cost); /* may be in the next cache line */
            s->order[count++] = child;
        }
    }
    return count;
}

/* The number of an older vertex. New ones are numbered from *count on. */
static uint32_t number_old(uint32_t vertex, uint32_t *count, fct_block_scratch *s) {
    static_assert(FCT_BLOCK_SLOTS > FCT_BLOCK_CORNERS, "the table never fills");
    uint32_t slot = vertex % FCT_BLOCK_SLOTS;
    for (; s->slots[slot] != UINT16_MAX; slot = (slot + 1) % FCT_BLOCK_SLOTS)
        if (s->old[s->slots[slot]] == vertex) return s->slots[slot];
    s->old[*count] = vertex;
    s->slots[slot] = (uint16_t)*count;
    return (*count)++;
}

static void load_point(const fct_tree_view *view, uint32_t vertex, float point[4]) {
    const float *p = view->positions + 3 * (size_t)vertex;
    point[0] = p[0], point[1] = p[1], point[2] = p[2], point[3] = 0;
}

/* Numbers the vertices of the block, loads their points, and links the corners at each vertex. */
static void load_points(const fct_tree *tree, const fct_outline *outline, size_t first, size_t faces,
                        fct_block_scratch *s) {
    const fct_tree_view *view = &tree->view;
    const uint32_t *corners = view->triangles + 3 * first;
    uint32_t introduced = fct_vertices_before(tree, outline, first);
    uint32_t fresh = fct_vertices_before(tree, outline, first + faces) - introduced, count = fresh;
    memset(s->slots, 0xFF, sizeof s->slots);
    memset(s->last, 0, 3 * faces * sizeof *s->last);
    for (uint32_t v = 0; v < fresh; ++v) load_point(view, introduced + v, s->points + 4 * v);
    for (uint32_t c = 0; c < 3 * faces; ++c) {
        uint32_t vertex = corners[c] - introduced; /* an older vertex wraps around */
        if (vertex >= fresh) vertex = number_old(corners[c], &count, s);
        s->at[c] = 4 * vertex;
        s->before[c] = s->last[vertex];
        s->last[vertex] = c + 1;
    }
    for (uint32_t v = fresh; v < count; ++v) load_point(view, s->old[v], s->points + 4 * v);
}

/* Sums and normals of the faces, four at a time; the last four may repeat a face. */
static void load_faces(size_t faces, fct_block_scratch *s) {
    for (size_t i = 0; i < faces; i += 4) {
        const float *corners[3][4];
        for (size_t l = 0; l < 4; ++l)
            for (size_t k = 0; k < 3; ++k)
                corners[k][l] = s->points + s->at[3 * (i + l < faces ? i + l : i) + k];
        fct_sums_four((const float *const(*)[4])corners, s->leaves + i, s->normals + i);
    }
}

/* The class of a number of faces; 0 is the largest. */
static inline uint32_t find_size_class(uint32_t faces) {
    return SIZES - 1 - (faces < EXACT ? faces : EXACT - 2 + faces / 32);
}

/* Counting sort of the nodes by size class, so that eight in a row have about the same size. */
static void sort_nodes(uint32_t count, fct_block_scratch *s) {
    uint32_t starts[SIZES + 1] = {0};
    for (uint32_t i = 0; i < count; ++i) ++starts[find_size_class(s->links[i].count) + 1];
    for (uint32_t i = 1; i < SIZES; ++i) starts[i] += starts[i - 1];
    for (uint32_t i = 0; i < count; ++i)
        s->by_size[starts[find_size_class(s->links[i].count)]++] = (uint16_t)i;
}

/* Of eight corners, appends the points of those whose vertex has no earlier corner from `limit` on. Returns
 * their number. */
static inline uint32_t list_eight(const fct_block_scratch *s, uint32_t corner, i8 limit, uint32_t mask,
                                  uint32_t *list) {
    mask &= i8_lt(i8_load(s->before + corner), limit);
    i8_store_some(list, i8_load(s->at + corner), mask);
    return (uint32_t)__builtin_popcount(mask);
}

/* Lists the distinct points of faces [first, end) of the block. Returns their number. */
static uint32_t list_points(const fct_block_scratch *s, uint32_t first, uint32_t end, uint32_t *list) {
    uint32_t count = 0, corner = 3 * first, last = 3 * end;
    i8 limit = i8_set(corner + 1);
    for (; corner + 8 <= last; corner += 8) count += list_eight(s, corner, limit, 255, list + count);
    if (corner < last) count += list_eight(s, corner, limit, (1u << (last - corner)) - 1, list + count);
    return count;
}

/* Extends a list to the wanted length by repeating it. */
static inline void repeat_list(uint32_t *list, uint32_t count, uint32_t wanted) {
    if (count < 8)
        for (uint32_t j = count; j < wanted; ++j) list[j] = list[j - count];
    else
        for (uint32_t j = count; j < wanted; j += 8) i8_store(list + j, i8_load(list + j - count));
}

/* Transposes the points of eight lists into rows, a lane each. Returns the number of rows. */
static uint32_t load_rows(fct_block_scratch *s, const uint32_t counts[8]) {
    uint32_t longest = 0;
    for (uint32_t i = 0; i < 8; ++i) longest = counts[i] > longest ? counts[i] : longest;
    for (uint32_t i = 0; i < 8; ++i) repeat_list(s->lists[i], counts[i], longest);
    for (uint32_t j = 0; j < longest; ++j) {
        const float *points[8];
        f8 p[3];
        for (uint32_t i = 0; i < 8; ++i) points[i] = s->points + s->lists[i][j];
        f8_load_columns(points, p);
        f8_store(s->rows[j].x, p[0]), f8_store(s->rows[j].y, p[1]), f8_store(s->rows[j].z, p[2]);
    }
    return longest;
}

/* Prefetches the records of two nodes. More at a time would fill the core's miss buffers and stall it. */
static inline void prefetch_two(const fct_tree *tree, const fct_block_scratch *s, uint32_t i,
                                uint32_t count) {
    for (uint32_t end = i + 2 < count ? i + 2 : count; i < end; ++i) {
        const fct_cluster *c = &tree->clusters[s->order[s->by_size[i]]];
        for (size_t at = 0; at < sizeof *c; at += 64) __builtin_prefetch((const char *)c + at, 1);
    }
}

/* Describes nodes [begin, begin + 8) in the order of sizes. Repeats the first one beyond `count`. first: the
 * first place of the block. */
static void describe_eight(const fct_tree *tree, uint32_t first, uint32_t begin, uint32_t count,
                           fct_block_scratch *s) {
    fct_octet o;
    fct_octet_normals n;
    const fct_sums *sums[8];
    fct_cluster *out[8];
    uint32_t nodes[8], counts[8];
    n.normals = s->normals[0];
    for (uint32_t i = 0; i < 8; ++i) {
        nodes[i] = s->by_size[begin + i < count ? begin + i : begin];
        const fct_node_link *link = &s->links[nodes[i]];
        sums[i] = &s->nodes[nodes[i]];
        out[i] = &tree->clusters[s->order[nodes[i]]];
        n.firsts[i] = link->first - first, n.counts[i] = link->count;
        counts[i] = list_points(s, n.firsts[i], n.firsts[i] + n.counts[i], s->lists[i]);
    }
    prefetch_two(tree, s, begin + 8, count);
    uint32_t rows = load_rows(s, counts);
    prefetch_two(tree, s, begin + 10, count);
    fct_octet_sum(&o, sums);
    fct_octet_cone(&o, &n);
    prefetch_two(tree, s, begin + 12, count);
    fct_octet_turn(&o, s->rows, rows);
    prefetch_two(tree, s, begin + 14, count);
    fct_octet_fit(&o, s->rows, rows);
    fct_octet_store_all(&o, out);
    for (uint32_t i = 0; i < 8; ++i) fct_node_link_store(&s->links[nodes[i]], out[i]);
}

void fct_block_describe(const fct_tree *tree, fct_outline *outline, size_t block, fct_block_scratch *s) {
    uint32_t nodes = tree->view.node_count, root = outline->blocks[block];
    uint32_t first = root < nodes ? tree->links[root].first : root - nodes;
    uint32_t faces = root < nodes ? tree->links[root].count : 1;
    uint32_t count = list_subtree(tree, root, first, s);
    load_points(tree, outline, first, faces, s);
    load_faces(faces, s);
    for (uint32_t i = count; i-- > 0;) fct_sums_join(s->parts[i][0], s->parts[i][1], &s->nodes[i]);
    sort_nodes(count, s);
    for (uint32_t i = 0; i < count; i += 8) describe_eight(tree, first, i, count, s);
    const fct_sums *all = count ? &s->nodes[0] : &s->leaves[0];
    outline->sums[block] = *all;
    fct_cap *cap = &outline->caps[block];
    v3_store(cap->axis, v3_unit(all->vector));
    cap->angle = count ? tree->clusters[root].cone_angle : 0;
}
