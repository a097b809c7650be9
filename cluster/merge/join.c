/* cluster/merge/join.c: joins clusters that share no edge, or are too tall to merge, into one tree.
 *
 * Top down: groups of clusters are cut by the surface area heuristic on their axis-aligned boxes, between any
 * two if there are at most FEW, otherwise in 16 bins, so that the tree above them is a good box tree. A cut
 * is taken only if both sides still fit into the remaining height. Clusters of n_i faces in a group of W
 * faces can always be cut in halves of weight so that cluster i ends at most log2(W / n_i) + 2 below the top
 * (Mehlhorn's bisection). With heights of at most 3 log2 n_i - 1, the whole tree stays within 3 log2 F.
 * O(k log k) for k clusters. Small groups are cut in parallel; unions are then made level by level from
 * below.
 */
#include "cluster/merge/join.h"

#include <string.h>

#include "base/math/elementary.h"
#include "base/math/simd.h"
#include "base/parallel.h"

enum { BINS = 16, FEW = 8, STACK = 256, GRAIN = 1 << 8, PORTION = 1 << 12, PORTIONS = 1 << 8 };

#define PART 0x80000000u

/* A cluster to be joined. */
typedef struct part {
    float box[8]; /* lower x y z, 0, minus upper x y z, 0 in the unit model; the union is the minimum */
    uint32_t slot, count;
    float excess; /* its height less log2 of its count */
    uint32_t height;
} part;

/* The sums of a group of parts. */
typedef struct summary {
    f8 range; /* of lower + upper corner: minimum x y z, 0, minus maximum x y z, 0 */
    uint64_t weight;
    float excess; /* the largest of its parts */
} summary;

typedef struct group {
    summary of;
    uint32_t begin, end; /* parts */
    uint32_t node;       /* the first of its end - begin - 1 nodes, which are numbered in preorder */
    int height_left;
    bool keep_order;
} group;

typedef struct joiner {
    fct_work *work;
    const fct_mesh *mesh;
    uint32_t part_count;
    part *parts, *scratch;     /* in the order of the cuts; room to permute them */
    group *portions;           /* PORTIONS groups to be split in parallel */
    uint32_t (*children)[2];   /* per node: a node, or PART | a part */
    uint32_t *ordered, *slots; /* nodes by level from below; the slot of each */
    uint8_t *levels;
} joiner;

/* --- Boxes --- */

/* Half the surface area. */
static inline float area_of(f8 box) {
    float e[8];
    f8_store(e, f8_add(box, f8_swap(box))); /* extents, negated */
    return e[0] * e[1] + e[1] * e[2] + e[2] * e[0];
}

/* Lower plus upper corner, 0, their negative, 0. */
static inline f8 middle_of(const part *p) {
    f8 box = f8_load(p->box);
    return f8_sub(box, f8_swap(box));
}

static inline void summary_add(summary *s, const part *p, f8 middle) {
    s->range = f8_min(s->range, middle);
    s->weight += p->count;
    if (p->excess > s->excess) s->excess = p->excess;
}

static inline summary summary_empty(void) {
    return (summary){f8_set(INFINITY), 0, -INFINITY};
}

static summary summarize(const part *parts, uint32_t begin, uint32_t end) {
    summary s = summary_empty();
    for (uint32_t i = begin; i < end; ++i) summary_add(&s, &parts[i], middle_of(&parts[i]));
    return s;
}

static void bound_face(const joiner *j, uint32_t face, float box[8]) {
    for (size_t c = 0; c < 3; ++c) {
        v3 x = v3_load(j->mesh->positions + 3 * (size_t)j->mesh->triangles[3 * (size_t)face + c]);
        float q[3];
        v3_store(q, v3_scale(v3_sub(x, j->work->metric.origin), j->work->metric.scale));
        for (int k = 0; k < 3; ++k) {
            if (q[k] < box[k]) box[k] = q[k];
            if (-q[k] < box[k + 4]) box[k + 4] = -q[k];
        }
    }
}

/* The boxes of the parts, from their faces. The stack suffices for the largest height. */
static void bound_parts(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const joiner *j = user;
    const fct_work *work = j->work;
    for (size_t i = begin; i < end; ++i) {
        part *p = &j->parts[i];
        for (int k = 0; k < 8; ++k) p->box[k] = k % 4 < 3 ? INFINITY : 0;
        p->count = work->records[p->slot].count, p->height = work->heights[p->slot];
        p->excess = (float)p->height - (p->count > 1 ? (float)fct_log2(p->count) : 0);
        uint32_t stack[STACK], depth = 0;
        stack[depth++] = work->nodes[p->slot];
        while (depth > 0) {
            uint32_t node = stack[--depth];
            if (node < work->face_count) {
                bound_face(j, node, p->box);
            } else {
                stack[depth++] = work->children[node - work->face_count][0];
                stack[depth++] = work->children[node - work->face_count][1];
            }
        }
    }
}

/* --- Cuts --- */

/* Whether the group can be joined within less than this height, by Mehlhorn's bound. */
static bool group_fits(const joiner *j, const summary *s, uint32_t begin, uint32_t end, int height_left) {
    if (end - begin == 1) return (int)j->parts[begin].height < height_left;
    int bits = 64 - __builtin_clzll(s->weight);
    if (s->excess + (float)(bits + 3) < (float)height_left) return true; /* a cheap bound on log2 first */
    return ceil((double)s->excess + fct_log2((double)s->weight) + 1e-5) + 2 < height_left;
}

/* The cheapest cut of a row of boxes: the first *cut + 1 go left. Returns its cost. */
static float best_cut(const f8 *boxes, const uint32_t *weights, uint32_t count, uint32_t *cut) {
    float right[BINS], best = INFINITY;
    uint64_t weight = 0;
    f8 all = f8_set(INFINITY);
    for (uint32_t i = count - 1; i > 0; --i) {
        all = f8_min(all, boxes[i]);
        weight += weights[i];
        right[i] = weight ? area_of(all) * (float)weight : INFINITY;
    }
    all = f8_set(INFINITY), weight = 0;
    for (uint32_t i = 0; i + 1 < count; ++i) {
        all = f8_min(all, boxes[i]);
        weight += weights[i];
        float cost = weight ? area_of(all) * (float)weight + right[i + 1] : INFINITY;
        if (cost < best) best = cost, *cut = i;
    }
    return best;
}

/* The cheapest cut of at most FEW parts, sorted along each axis. Returns the end of the left side. */
static uint32_t cut_few(const joiner *j, const group *g, summary sides[2]) {
    part *parts = j->parts + g->begin, *scratch = j->scratch + g->begin;
    uint32_t count = g->end - g->begin, orders[3][FEW], best_axis = 0, middle = 0;
    float best = INFINITY, middles[FEW][8];
    for (uint32_t i = 0; i < count; ++i) f8_store(middles[i], middle_of(&parts[i]));
    for (uint32_t axis = 0; axis < 3; ++axis) {
        uint32_t *order = orders[axis], weights[FEW], cut = 0;
        f8 boxes[FEW];
        for (uint32_t i = 0, k; i < count; ++i) {
            for (k = i; k > 0 && middles[order[k - 1]][axis] > middles[i][axis]; --k) order[k] = order[k - 1];
            order[k] = i;
        }
        for (uint32_t i = 0; i < count; ++i)
            boxes[i] = f8_load(parts[order[i]].box), weights[i] = parts[order[i]].count;
        float cost = best_cut(boxes, weights, count, &cut);
        if (axis == 0 || cost < best) best = cost, best_axis = axis, middle = cut + 1;
    }
    memcpy(scratch, parts, count * sizeof *parts);
    for (uint32_t i = 0; i < count; ++i) parts[i] = scratch[orders[best_axis][i]];
    middle += g->begin;
    sides[0] = summarize(j->parts, g->begin, middle);
    sides[1] = summarize(j->parts, middle, g->end);
    return middle;
}

/* The map from a part's middle to its bins. */
typedef struct grid {
    f8 least, factor;
} grid;

static inline void bins_of(const grid *where, f8 middle, uint32_t bins[8]) {
    f8 place = f8_mul(f8_sub(middle, where->least), where->factor);
    i8_store(bins, i8_trunc(f8_min(place, f8_set(BINS - 1))));
}

/* BINS along each axis; the factor is 0 where all middles are equal. */
static grid make_grid(const summary *s) {
    float range[8], least[8] = {0}, factor[8] = {0};
    f8_store(range, s->range);
    for (int k = 0; k < 3; ++k) {
        float extent = -range[k + 4] - range[k];
        if (extent > 1e-30f) least[k] = range[k], factor[k] = BINS / extent;
    }
    return (grid){f8_load(least), f8_load(factor)};
}

/* The axis and the last bin that goes left; false if all parts lie in one bin. */
static bool find_cut(const joiner *j, const group *g, const grid *where, uint32_t *axis, uint32_t *cut) {
    f8 boxes[3][BINS];
    uint32_t weights[3][BINS] = {{0}}, bins[8];
    for (int k = 0; k < 3; ++k)
        for (int i = 0; i < BINS; ++i) boxes[k][i] = f8_set(INFINITY);
    for (uint32_t i = g->begin; i < g->end; ++i) {
        const part *p = &j->parts[i];
        bins_of(where, middle_of(p), bins);
        for (int k = 0; k < 3; ++k) {
            boxes[k][bins[k]] = f8_min(boxes[k][bins[k]], f8_load(p->box));
            weights[k][bins[k]] += p->count;
        }
    }
    float best = INFINITY;
    for (uint32_t k = 0; k < 3; ++k) {
        uint32_t at = 0;
        float cost = best_cut(boxes[k], weights[k], BINS, &at);
        if (cost < best) best = cost, *axis = k, *cut = at;
    }
    return best < INFINITY;
}

/* Returns the end of the left side, or g->begin if all parts lie in one bin. Keeps the order within both
 * sides.
 */
static uint32_t cut_by_area(const joiner *j, const group *g, summary sides[2]) {
    if (g->end - g->begin <= FEW) return cut_few(j, g, sides);
    uint32_t axis, cut, bins[8], left = g->begin, right = g->begin;
    grid where = make_grid(&g->of);
    if (!find_cut(j, g, &where, &axis, &cut)) return g->begin;
    sides[0] = sides[1] = summary_empty();
    for (uint32_t i = g->begin; i < g->end; ++i) {
        part p = j->parts[i];
        f8 middle = middle_of(&p);
        bins_of(&where, middle, bins);
        uint32_t side = bins[axis] > cut;
        j->parts[left] = p, j->scratch[right] = p;
        left += !side, right += side;
        summary_add(&sides[side], &p, middle);
    }
    memcpy(j->parts + left, j->scratch + g->begin, (right - g->begin) * sizeof *j->parts);
    return left;
}

/* The cut with the least difference of weights. */
static uint32_t cut_by_weight(const joiner *j, const group *g) {
    uint64_t left = 0, best = UINT64_MAX;
    uint32_t middle = g->begin + 1;
    for (uint32_t i = g->begin; i + 1 < g->end; ++i) {
        left += j->parts[i].count;
        uint64_t difference = 2 * left > g->of.weight ? 2 * left - g->of.weight : g->of.weight - 2 * left;
        if (difference < best) best = difference, middle = i + 1;
    }
    return middle;
}

/* Moves the part with more than half the weight to the front; false if there is none. */
static bool heaviest_first(const joiner *j, const group *g) {
    uint32_t heaviest = g->begin;
    for (uint32_t i = g->begin; i < g->end; ++i)
        if (j->parts[i].count > j->parts[heaviest].count) heaviest = i;
    if (2 * (uint64_t)j->parts[heaviest].count <= g->of.weight) return false;
    part heavy = j->parts[heaviest];
    memmove(j->parts + g->begin + 1, j->parts + g->begin, (heaviest - g->begin) * sizeof heavy);
    j->parts[g->begin] = heavy;
    return true;
}

static bool both_fit(const joiner *j, const group *g, uint32_t middle, const summary sides[2]) {
    return group_fits(j, &sides[0], g->begin, middle, g->height_left) &&
           group_fits(j, &sides[1], middle, g->end, g->height_left);
}

static uint32_t cut_group(const joiner *j, group *g, summary sides[2]) {
    uint32_t middle;
    if (!g->keep_order) {
        middle = cut_by_area(j, g, sides);
        if (middle > g->begin && middle < g->end && both_fit(j, g, middle, sides)) return middle;
        middle = g->begin + 1;
        if (heaviest_first(j, g)) {
            sides[0] = summarize(j->parts, g->begin, middle), sides[1] = summarize(j->parts, middle, g->end);
            if (both_fit(j, g, middle, sides)) return middle;
        }
        g->keep_order = !group_fits(j, &g->of, g->begin, g->end, g->height_left);
    }
    middle = cut_by_weight(j, g);
    sides[0] = summarize(j->parts, g->begin, middle), sides[1] = summarize(j->parts, middle, g->end);
    return middle;
}

/* --- Tree --- */

/* Splits a group in two; writes the sides that have several parts to `out` and returns their number. */
static uint32_t split_group(const joiner *j, group *g, group *out) {
    summary sides[2];
    uint32_t middle = cut_group(j, g, sides), bounds[3] = {g->begin, middle, g->end}, count = 0;
    for (int k = 1; k >= 0; --k) {
        uint32_t node = k ? g->node + (middle - g->begin) : g->node + 1;
        bool leaf = bounds[k + 1] - bounds[k] == 1;
        j->children[g->node][k] = leaf ? PART | bounds[k] : node;
        if (!leaf)
            out[count++] =
                (group){sides[k], bounds[k], bounds[k + 1], node, g->height_left - 1, g->keep_order};
    }
    return count;
}

static void split_portions(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const joiner *j = user;
    for (size_t i = begin; i < end; ++i) {
        group stack[STACK];
        uint32_t depth = 0;
        stack[depth++] = j->portions[i];
        while (depth > 0) {
            group g = stack[--depth];
            depth += split_group(j, &g, stack + depth);
        }
    }
}

/* Groups of at most PORTION parts wait until there are PORTIONS of them, then go to the threads. */
static void split_all(joiner *j, const group *all) {
    group stack[STACK];
    uint32_t depth = 0, waiting = 0;
    stack[depth++] = *all;
    while (depth > 0) {
        group g = stack[--depth];
        if (g.end - g.begin > PORTION)
            depth += split_group(j, &g, stack + depth);
        else
            j->portions[waiting++] = g;
        if (waiting < PORTIONS && depth > 0) continue;
        fct_parallel_for(j->work->env, waiting, 1, split_portions, j);
        waiting = 0;
    }
}

static inline uint32_t slot_of(const joiner *j, uint32_t child) {
    return child & PART ? j->parts[child & ~PART].slot : j->slots[child];
}

typedef struct level {
    const joiner *joiner;
    const uint32_t *nodes;
    uint32_t merge; /* of the first node */
} level;

static void merge_level(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const level *l = user;
    const joiner *j = l->joiner;
    for (size_t i = begin; i < end; i += FCT_LANES) {
        fct_pair pairs[FCT_LANES];
        float costs[FCT_LANES];
        uint32_t count = end - i < FCT_LANES ? (uint32_t)(end - i) : FCT_LANES;
        for (uint32_t k = 0; k < count; ++k) {
            const uint32_t *children = j->children[l->nodes[i + k]];
            pairs[k] = (fct_pair){slot_of(j, children[0]), slot_of(j, children[1]), 0};
            j->slots[l->nodes[i + k]] = pairs[k].a;
        }
        fct_work_costs(j->work, pairs, count, costs);
        fct_work_merges(j->work, l->merge + (uint32_t)i, pairs, costs, count);
    }
}

/* Merges level by level: unions of two parts first. */
static void merge_nodes(const joiner *j) {
    uint32_t count = j->part_count - 1, ends[STACK] = {0};
    for (uint32_t node = count; node-- > 0;) {
        uint8_t height = 0;
        for (int k = 0; k < 2; ++k) {
            uint32_t child = j->children[node][k];
            if (!(child & PART) && j->levels[child] >= height) height = (uint8_t)(j->levels[child] + 1);
        }
        j->levels[node] = height;
        ++ends[height];
    }
    for (uint32_t i = 1; i < STACK; ++i) ends[i] += ends[i - 1];
    for (uint32_t node = count; node-- > 0;) j->ordered[--ends[j->levels[node]]] = node;
    for (uint32_t i = 0; i < STACK; ++i) { /* ends[i] is now the begin of level i */
        uint32_t end = i + 1 < STACK ? ends[i + 1] : count;
        level l = {j, j->ordered + ends[i], j->work->merge_count};
        fct_parallel_for(j->work->env, end - ends[i], GRAIN, merge_level, &l);
        j->work->merge_count += end - ends[i];
    }
}

static fct_result join_parts(joiner *j) {
    fct_work *work = j->work;
    const fct_env *env = work->env;
    for (uint32_t f = 0, i = 0; f < work->face_count; ++f)
        if (work->nodes[f] != FCT_NONE) j->parts[i++].slot = f;
    fct_parallel_for(env, j->part_count, GRAIN, bound_parts, j);
    group all = {summarize(j->parts, 0, j->part_count), 0, j->part_count, 0, 0, false};
    all.height_left = (int)(3 * fct_log2((double)all.of.weight));
    split_all(j, &all);
    fct_result result = fct_progress(env, "clusters", work->merge_count / (double)work->face_count);
    if (result != FCT_OK) return result;
    merge_nodes(j);
    return fct_progress(env, "clusters", 1);
}

fct_result fct_work_join(fct_work *work, const fct_mesh *mesh) {
    const fct_env *env = work->env;
    uint32_t count = work->face_count - work->merge_count;
    if (count < 2) return FCT_OK;
    joiner j = {.work = work, .mesh = mesh, .part_count = count};
    const fct_array arrays[] = {FCT_ARRAY(j.parts, count),       FCT_ARRAY(j.scratch, count),
                                FCT_ARRAY(j.portions, PORTIONS), FCT_ARRAY(j.children, count - 1),
                                FCT_ARRAY(j.ordered, count - 1), FCT_ARRAY(j.slots, count - 1),
                                FCT_ARRAY(j.levels, count - 1)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "joining parts");
    if (result == FCT_OK) result = join_parts(&j);
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    return result;
}
