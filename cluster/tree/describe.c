/* cluster/tree/describe.c: area, moments, cone, plane and box of every cluster.
 *
 * Subtrees of at most FCT_BLOCK faces are one task each, whose points, normals and sums stay in the cache.
 * Sums come from the leaves upwards; all else is done for eight clusters of about the same size at a time
 * (octet.c), over the distinct points of each: O(F log FCT_BLOCK). What is above is upper.c's.
 *
 * Degenerate answers. Cancelled normals: cone pi, the plane's sign is the eigenvector's. Areas beyond a
 * float's range end at its largest value with S and M scaled alike, below it at 0 (cone pi then); boxes,
 * planes and centroids depend on neither.
 */
#include "cluster/tree/describe.h"

#include <assert.h>
#include <string.h>

#include "base/math/simd.h"
#include "base/parallel.h"

enum { CORNERS = 3 * FCT_BLOCK, SLOTS = 4096, EXACT = 64, SIZES = EXACT - 1 + FCT_BLOCK / 32 };

/* Room for one block. Vertices have numbers of the block's own: those that it is the first to use are one run
 * of the tree's order, the others follow. Points are rows of four floats. */
typedef struct block_scratch {
    uint32_t order[FCT_BLOCK]; /* ids of inner nodes */
    fct_node_link links[FCT_BLOCK];
    const fct_sums *parts[FCT_BLOCK][2];
    fct_sums leaves[FCT_BLOCK + 4], nodes[FCT_BLOCK];
    float points[4 * CORNERS]; /* x, y, z, 0 */
    float normals[FCT_BLOCK + 4][4];
    uint32_t at[CORNERS + 8];       /* by corner: where its point begins */
    uint32_t before[CORNERS + 8];   /* by corner: 1 + the last corner before it at the same vertex, or 0 */
    uint32_t last[CORNERS];         /* by vertex: 1 + its last corner so far */
    uint32_t old[CORNERS];          /* vertices that other blocks used before */
    uint16_t slots[SLOTS];          /* their numbers by a hash, or UINT16_MAX */
    uint16_t by_size[FCT_BLOCK];    /* nodes, largest first */
    uint32_t lists[8][CORNERS + 8]; /* of the points of eight nodes, and the points */
    fct_octet_row rows[CORNERS];
} block_scratch;

typedef struct describer {
    fct_tree *tree;
    fct_outline outline;
    block_scratch *scratch; /* one a thread */
} describer;

void fct_points_describe(const fct_octet_row *points, uint32_t point_count, const float *normals,
                         uint32_t normal_count, const fct_sums *sums, fct_cluster *out) {
    fct_octet o;
    fct_octet_normals n = {.normals = normals};
    const fct_sums *all[8];
    for (int i = 0; i < 8; ++i) all[i] = sums, n.counts[i] = normal_count;
    fct_octet_sum(&o, all);
    fct_octet_cone(&o, &n);
    fct_octet_turn(&o, points, point_count);
    fct_octet_fit(&o, points, point_count);
    fct_octet_store(&o, 0, out);
}

void fct_cluster_describe_leaf(const fct_tree_view *view, uint32_t place, fct_cluster *out) {
    const uint32_t *triangle = view->triangles + 3 * (size_t)place;
    const float *corners[3][4];
    float points[3][4] = {{0}}, normals[4][4];
    fct_octet_row rows[3];
    fct_sums sums[4];
    for (int k = 0; k < 3; ++k) {
        memcpy(points[k], view->positions + 3 * (size_t)triangle[k], 3 * sizeof(float));
        fct_octet_row_fill(&rows[k], points[k]);
        for (int i = 0; i < 4; ++i) corners[k][i] = points[k];
    }
    fct_sums_four((const float *const(*)[4])corners, sums, normals);
    memset(out, 0, sizeof *out);
    fct_points_describe(rows, 3, normals[0], 1, sums, out);
    out->child[0] = out->child[1] = FCT_NONE;
    out->first = place, out->count = 1;
}

/* --- Vertices by first use --- */

static uint32_t highest_vertex(const fct_tree *tree, size_t begin, size_t end, uint32_t count) {
    for (size_t i = 3 * begin; i < 3 * end; ++i) {
        uint32_t next = tree->triangles[i] + 1;
        count = next > count ? next : count;
    }
    return count;
}

uint32_t fct_vertices_before(const fct_tree *tree, const fct_outline *outline, size_t place) {
    return highest_vertex(tree, place - place % FCT_SPAN, place, outline->introduced[place / FCT_SPAN]);
}

static void find_highest(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    describer *d = user;
    size_t faces = d->tree->view.face_count;
    for (size_t i = begin; i < end; ++i) {
        size_t last = (i + 1) * FCT_SPAN < faces ? (i + 1) * FCT_SPAN : faces;
        d->outline.introduced[i + 1] = highest_vertex(d->tree, i * FCT_SPAN, last, 0);
    }
}

static void count_vertices(const fct_env *env, describer *d) {
    size_t spans = fct_chunk_count(d->tree->view.face_count, FCT_SPAN);
    uint32_t *introduced = d->outline.introduced;
    introduced[0] = 0;
    fct_parallel_for(env, spans, 1 << 8, find_highest, d);
    for (size_t i = 0; i < spans; ++i)
        if (introduced[i + 1] < introduced[i]) introduced[i + 1] = introduced[i];
}

/* --- Blocks --- */

/* Inner nodes of the subtree level by level, and where their parts are: the memory of a level's nodes is
 * asked for while the level above is walked. */
static uint32_t list_subtree(const fct_tree *tree, uint32_t root, uint32_t first, block_scratch *s) {
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
            __builtin_prefetch(&tree->links[child].cost); /* may be in the next line */
            s->order[count++] = child;
        }
    }
    return count;
}

/* The number of a vertex that other blocks used before, counted from `count` on. */
static uint32_t number_old(uint32_t vertex, uint32_t *count, block_scratch *s) {
    static_assert(SLOTS > CORNERS, "there is always a free slot");
    uint32_t slot = vertex % SLOTS;
    for (; s->slots[slot] != UINT16_MAX; slot = (slot + 1) % SLOTS)
        if (s->old[s->slots[slot]] == vertex) return s->slots[slot];
    s->old[*count] = vertex;
    s->slots[slot] = (uint16_t)*count;
    return (*count)++;
}

static void load_point(const fct_tree_view *view, uint32_t vertex, float point[4]) {
    const float *p = view->positions + 3 * (size_t)vertex;
    point[0] = p[0], point[1] = p[1], point[2] = p[2], point[3] = 0;
}

/* The block's vertices, and which corners are the first at theirs. */
static void load_points(const describer *d, size_t first, size_t faces, block_scratch *s) {
    const fct_tree_view *view = &d->tree->view;
    const uint32_t *corners = view->triangles + 3 * first;
    uint32_t introduced = fct_vertices_before(d->tree, &d->outline, first);
    uint32_t fresh = fct_vertices_before(d->tree, &d->outline, first + faces) - introduced, count = fresh;
    memset(s->slots, 0xFF, sizeof s->slots);
    memset(s->last, 0, 3 * faces * sizeof *s->last);
    for (uint32_t v = 0; v < fresh; ++v) load_point(view, introduced + v, s->points + 4 * v);
    for (uint32_t c = 0; c < 3 * faces; ++c) {
        uint32_t vertex = corners[c] - introduced; /* wraps around for an old one */
        if (vertex >= fresh) vertex = number_old(corners[c], &count, s);
        s->at[c] = 4 * vertex;
        s->before[c] = s->last[vertex];
        s->last[vertex] = c + 1;
    }
    for (uint32_t v = fresh; v < count; ++v) load_point(view, s->old[v], s->points + 4 * v);
}

/* Sums and normals of the block's faces. */
static void load_faces(size_t faces, block_scratch *s) {
    for (size_t i = 0; i < faces; i += 4) {
        const float *corners[3][4];
        for (size_t l = 0; l < 4; ++l)
            for (size_t k = 0; k < 3; ++k)
                corners[k][l] = s->points + s->at[3 * (i + l < faces ? i + l : i) + k];
        fct_sums_four((const float *const(*)[4])corners, s->leaves + i, s->normals + i);
    }
}

/* By the number of faces, exactly as far as many nodes have as many; 0 is the largest. */
static inline uint32_t size_class(uint32_t faces) {
    return SIZES - 1 - (faces < EXACT ? faces : EXACT - 2 + faces / 32);
}

/* Nodes by their faces, so that eight in a row have about as many. */
static void sort_nodes(uint32_t count, block_scratch *s) {
    uint32_t starts[SIZES + 1] = {0};
    for (uint32_t i = 0; i < count; ++i) ++starts[size_class(s->links[i].count) + 1];
    for (uint32_t i = 1; i < SIZES; ++i) starts[i] += starts[i - 1];
    for (uint32_t i = 0; i < count; ++i) s->by_size[starts[size_class(s->links[i].count)]++] = (uint16_t)i;
}

/* Appends where the points of those of eight corners are that are the first at their vertex since `limit`;
 * returns how many. */
static inline uint32_t list_eight(const block_scratch *s, uint32_t corner, i8 limit, uint32_t mask,
                                  uint32_t *list) {
    mask &= i8_lt(i8_load(s->before + corner), limit);
    i8_store_some(list, i8_load(s->at + corner), mask);
    return (uint32_t)__builtin_popcount(mask);
}

/* Where the distinct points of faces [first, end) of the block are; returns how many. */
static uint32_t list_points(const block_scratch *s, uint32_t first, uint32_t end, uint32_t *list) {
    uint32_t count = 0, corner = 3 * first, last = 3 * end;
    i8 limit = i8_set(corner + 1);
    for (; corner + 8 <= last; corner += 8) count += list_eight(s, corner, limit, 255, list + count);
    if (corner < last) count += list_eight(s, corner, limit, (1u << (last - corner)) - 1, list + count);
    return count;
}

/* Lengthens a list by repeating it. */
static inline void repeat_list(uint32_t *list, uint32_t count, uint32_t wanted) {
    if (count < 8)
        for (uint32_t j = count; j < wanted; ++j) list[j] = list[j - count];
    else
        for (uint32_t j = count; j < wanted; j += 8) i8_store(list + j, i8_load(list + j - count));
}

/* Points of eight lists; returns how many rows. */
static uint32_t load_rows(block_scratch *s, const uint32_t counts[8]) {
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

/* Asks for the memory of the records of two nodes: more at once would have the core wait. */
static inline void ask_for_two(const fct_tree *tree, const block_scratch *s, uint32_t i, uint32_t count) {
    for (uint32_t end = i + 2 < count ? i + 2 : count; i < end; ++i) {
        const fct_cluster *c = &tree->clusters[s->order[s->by_size[i]]];
        for (size_t at = 0; at < sizeof *c; at += 64) __builtin_prefetch((const char *)c + at, 1);
    }
}

/* Nodes [begin, begin + 8) by size, or what is left of them; `first`: the block's first face. */
static void describe_eight(const fct_tree *tree, uint32_t first, uint32_t begin, uint32_t count,
                           block_scratch *s) {
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
    ask_for_two(tree, s, begin + 8, count);
    uint32_t rows = load_rows(s, counts);
    ask_for_two(tree, s, begin + 10, count);
    fct_octet_sum(&o, sums);
    fct_octet_cone(&o, &n);
    ask_for_two(tree, s, begin + 12, count);
    fct_octet_turn(&o, s->rows, rows);
    ask_for_two(tree, s, begin + 14, count);
    fct_octet_fit(&o, s->rows, rows);
    fct_octet_store_all(&o, out);
    for (uint32_t i = 0; i < 8; ++i) fct_node_link_store(&s->links[nodes[i]], out[i]);
}

static void describe_block(const describer *d, size_t block, block_scratch *s) {
    const fct_tree *tree = d->tree;
    uint32_t nodes = tree->view.node_count, root = d->outline.blocks[block];
    uint32_t first = root < nodes ? tree->links[root].first : root - nodes;
    uint32_t faces = root < nodes ? tree->links[root].count : 1;
    uint32_t count = list_subtree(tree, root, first, s);
    load_points(d, first, faces, s);
    load_faces(faces, s);
    for (uint32_t i = count; i-- > 0;) fct_sums_join(s->parts[i][0], s->parts[i][1], &s->nodes[i]);
    sort_nodes(count, s);
    for (uint32_t i = 0; i < count; i += 8) describe_eight(tree, first, i, count, s);
    const fct_sums *all = count ? &s->nodes[0] : &s->leaves[0];
    d->outline.sums[block] = *all;
    fct_cap *cap = &d->outline.caps[block];
    v3_store(cap->axis, v3_unit(all->vector));
    cap->angle = count ? tree->clusters[root].cone_angle : 0;
}

static void describe_blocks(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk;
    describer *d = user;
    for (size_t block = begin; block < end; ++block) describe_block(d, block, &d->scratch[thread]);
}

/* --- Outline --- */

/* Notes where a part of its parent went. */
typedef struct visit {
    uint32_t node, parent, side;
} visit;

static void close_upper(fct_outline *o, uint32_t parent, uint32_t side, uint32_t part) {
    if (parent == FCT_NONE) return;
    if (o->upper) o->upper[parent].parts[side] = part;
}

/* Walks the tree from the root to its blocks; counts them where the lists are NULL. Heights are bounded, and
 * so is the stack. */
static void walk(const fct_tree *tree, fct_outline *o) {
    const fct_tree_view *view = &tree->view;
    visit stack[256];
    o->upper_count = o->block_count = 0;
    for (uint32_t r = 0; r < view->root_count; ++r) {
        uint32_t top = 0;
        stack[top++] = (visit){tree->roots[r], FCT_NONE, 0};
        while (top > 0) {
            visit v = stack[--top];
            if (v.node >= view->node_count || tree->links[v.node].count <= FCT_BLOCK) {
                close_upper(o, v.parent, v.side, FCT_IS_BLOCK | o->block_count);
                if (o->blocks) o->blocks[o->block_count] = v.node;
                ++o->block_count;
                continue;
            }
            close_upper(o, v.parent, v.side, o->upper_count);
            if (o->upper) {
                o->upper[o->upper_count].id = v.node;
                o->upper[o->upper_count].first_block = o->block_count;
            }
            stack[top++] = (visit){tree->links[v.node].child[1], o->upper_count, 1};
            stack[top++] = (visit){tree->links[v.node].child[0], o->upper_count, 0};
            ++o->upper_count;
        }
    }
}

static void count_blocks(fct_outline *o) {
    for (uint32_t i = o->upper_count; i-- > 0;) {
        fct_upper *u = &o->upper[i];
        u->block_count = 0;
        for (int k = 0; k < 2; ++k)
            u->block_count += u->parts[k] & FCT_IS_BLOCK ? 1 : o->upper[u->parts[k]].block_count;
    }
}

static fct_result prepare(const fct_env *env, describer *d) {
    fct_outline *o = &d->outline;
    walk(d->tree, o);
    o->upper = fct_allocate(env, o->upper_count, sizeof *o->upper);
    o->blocks = fct_allocate(env, o->block_count, sizeof *o->blocks);
    o->sums = fct_allocate(env, o->block_count, sizeof *o->sums);
    o->caps = fct_allocate(env, o->block_count, sizeof *o->caps);
    o->introduced =
        fct_allocate(env, fct_chunk_count(d->tree->view.face_count, FCT_SPAN) + 1, sizeof *o->introduced);
    d->scratch = fct_allocate(env, fct_env_threads(env), sizeof *d->scratch);
    if (!d->tree->clusters)
        d->tree->clusters = fct_allocate(env, d->tree->view.node_count, sizeof *d->tree->clusters);
    d->tree->nodes = d->tree->clusters;
    if (!o->upper || !o->blocks || !o->sums || !o->caps || !o->introduced || !d->scratch ||
        !d->tree->clusters)
        return fct_fail_memory(env, "boxes");
    walk(d->tree, o);
    count_blocks(o);
    count_vertices(env, d);
    return FCT_OK;
}

fct_result fct_tree_describe(fct_tree *tree) {
    const fct_env *env = tree->env;
    describer d = {.tree = tree};
    fct_result result = prepare(env, &d);
    if (result == FCT_OK)
        result = fct_parallel_for_progress(env, "boxes", d.outline.block_count, 2, describe_blocks, &d);
    if (result == FCT_OK) result = fct_tree_describe_upper(tree, &d.outline);
    fct_release(env, tree->links);
    tree->links = NULL;
    fct_release(env, d.outline.upper);
    fct_release(env, d.outline.blocks);
    fct_release(env, d.outline.sums);
    fct_release(env, d.outline.caps);
    fct_release(env, d.outline.introduced);
    fct_release(env, d.scratch);
    return result;
}
