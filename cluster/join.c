/* cluster/join.c: one tree over clusters that share no edge, or may not merge along one for height.
 *
 * Top down: the clusters' axis-aligned boxes are split by the surface area heuristic in 16 bins, so that the
 * tree above them is a good box tree. A split is taken only if both sides can still be finished within the
 * height that is left: a group of weights n_i can always be cut in halves of its weight so that cluster i
 * ends at most log2(W / n_i) + 2 below its top (Mehlhorn's bisection). With heights of at most 3 log2 n_i - 1
 * this keeps the whole within 3 log2 F. O(k log k) for k clusters.
 */
#include <string.h>

#include "cluster/work.h"

enum { BINS = 16, STACK = 256 };

typedef struct part {
    float lower[3], upper[3];
    uint32_t slot, count, height;
} part;

/* A node of the upper tree; below zero a part, else a node. */
typedef struct join_node {
    int64_t child[2];
} join_node;

typedef struct group {
    uint32_t begin, end, parent, side;
    int height_left;
    bool keep_order;
} group;

typedef struct joiner {
    fct_work *work;
    part *parts; /* permuted */
    join_node *nodes;
    uint32_t part_count, node_count;
} joiner;

/* Height within which the parts can be joined for certain. */
static int height_needed(const joiner *j, uint32_t begin, uint32_t end) {
    if (end - begin == 1) return (int)j->parts[begin].height;
    uint64_t weight = 0;
    uint32_t tallest = 0, least = UINT32_MAX;
    for (uint32_t i = begin; i < end; ++i) {
        const part *p = &j->parts[i];
        weight += p->count;
        if (p->height > tallest) tallest = p->height;
        if (p->count < least) least = p->count;
    }
    int needed = 0, simple = (int)tallest + (int)ceil(log2((double)weight / least)) + 2;
    if (tallest == 0) return simple;
    for (uint32_t i = begin; i < end; ++i) {
        const part *p = &j->parts[i];
        int own = (int)p->height + (int)ceil(log2((double)weight / p->count)) + 2;
        if (own > needed) needed = own;
    }
    return needed;
}

static bool fits(const joiner *j, const group *g, uint32_t middle) {
    return height_needed(j, g->begin, middle) < g->height_left &&
           height_needed(j, middle, g->end) < g->height_left;
}

/* In double, as sums, differences and products of large or small floats need not be floats. */
static double middle_of(const part *p, int axis) {
    return 0.5 * ((double)p->lower[axis] + (double)p->upper[axis]);
}

typedef struct bin {
    float lower[3], upper[3];
    uint64_t faces;
} bin;

static const bin empty_bin = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}, 0};

static void bin_add(bin *b, const float *lower, const float *upper, uint64_t faces) {
    for (int k = 0; k < 3; ++k) {
        if (lower[k] < b->lower[k]) b->lower[k] = lower[k];
        if (upper[k] > b->upper[k]) b->upper[k] = upper[k];
    }
    b->faces += faces;
}

static double bin_cost(const bin *b) {
    if (b->faces == 0) return INFINITY;
    double extent[3];
    for (int k = 0; k < 3; ++k) extent[k] = (double)b->upper[k] - (double)b->lower[k];
    double area = extent[0] * extent[1] + extent[1] * extent[2] + extent[2] * extent[0];
    return area * (double)b->faces;
}

static int bin_of(const part *p, int axis, double lower, double factor) {
    int i = (int)((middle_of(p, axis) - lower) * factor);
    return i < 0 ? 0 : i >= BINS ? BINS - 1 : i;
}

/* The cheapest cut of one axis: parts in bins up to *cut go left. */
static double best_cut(const joiner *j, const group *g, int axis, double lower, double factor, int *cut) {
    bin bins[BINS], all = empty_bin;
    for (int i = 0; i < BINS; ++i) bins[i] = empty_bin;
    for (uint32_t i = g->begin; i < g->end; ++i) {
        const part *p = &j->parts[i];
        bin_add(&bins[bin_of(p, axis, lower, factor)], p->lower, p->upper, p->count);
    }
    double right[BINS], best = INFINITY;
    for (int i = BINS - 1; i > 0; --i) {
        bin_add(&all, bins[i].lower, bins[i].upper, bins[i].faces);
        right[i] = bin_cost(&all);
    }
    all = empty_bin;
    for (int i = 0; i + 1 < BINS; ++i) {
        bin_add(&all, bins[i].lower, bins[i].upper, bins[i].faces);
        double cost = bin_cost(&all) + right[i + 1];
        if (cost < best) best = cost, *cut = i;
    }
    return best;
}

/* Cuts by the surface area heuristic; returns the end of the left side, or g->begin where all parts lie in
 * one place. Keeps the order within both sides. */
static uint32_t cut_by_area(joiner *j, const group *g, part *scratch) {
    double lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (uint32_t i = g->begin; i < g->end; ++i)
        for (int k = 0; k < 3; ++k) {
            double m = middle_of(&j->parts[i], k);
            if (m < lower[k]) lower[k] = m;
            if (m > upper[k]) upper[k] = m;
        }
    double best = INFINITY, factor = 0;
    int best_axis = -1, best_bin = 0;
    for (int k = 0; k < 3; ++k) {
        if (!(upper[k] > lower[k])) continue;
        double f = BINS / (upper[k] - lower[k]);
        int cut = 0;
        double cost = best_cut(j, g, k, lower[k], f, &cut);
        if (best_axis < 0 || cost < best) best = cost, best_axis = k, best_bin = cut, factor = f;
    }
    if (best_axis < 0 || best == INFINITY) return g->begin;
    uint32_t left = g->begin, right = 0;
    for (uint32_t i = g->begin; i < g->end; ++i) {
        const part *p = &j->parts[i];
        if (bin_of(p, best_axis, lower[best_axis], factor) <= best_bin)
            j->parts[left++] = *p;
        else
            scratch[right++] = *p;
    }
    memcpy(j->parts + left, scratch, right * sizeof *scratch);
    return left;
}

/* The cut that leaves the two weights most alike. */
static uint32_t cut_by_weight(const joiner *j, const group *g) {
    uint64_t total = 0, left = 0, best = UINT64_MAX;
    uint32_t middle = g->begin + 1;
    for (uint32_t i = g->begin; i < g->end; ++i) total += j->parts[i].count;
    for (uint32_t i = g->begin; i + 1 < g->end; ++i) {
        left += j->parts[i].count;
        uint64_t difference = 2 * left > total ? 2 * left - total : total - 2 * left;
        if (difference < best) best = difference, middle = i + 1;
    }
    return middle;
}

/* Brings a part of more than half the weight to the front; returns whether there is one. */
static bool heaviest_first(joiner *j, const group *g) {
    uint64_t total = 0;
    uint32_t heaviest = g->begin;
    for (uint32_t i = g->begin; i < g->end; ++i) {
        total += j->parts[i].count;
        if (j->parts[i].count > j->parts[heaviest].count) heaviest = i;
    }
    if (2 * (uint64_t)j->parts[heaviest].count <= total) return false;
    part heavy = j->parts[heaviest];
    memmove(j->parts + g->begin + 1, j->parts + g->begin, (heaviest - g->begin) * sizeof heavy);
    j->parts[g->begin] = heavy;
    return true;
}

static uint32_t cut(joiner *j, group *g, part *scratch) {
    if (!g->keep_order) {
        uint32_t middle = cut_by_area(j, g, scratch);
        if (middle > g->begin && middle < g->end && fits(j, g, middle)) return middle;
        if (heaviest_first(j, g) && fits(j, g, g->begin + 1)) return g->begin + 1;
        g->keep_order = height_needed(j, g->begin, g->end) >= g->height_left;
    }
    return cut_by_weight(j, g);
}

static void split_all(joiner *j, part *scratch, int height) {
    group stack[STACK];
    uint32_t depth = 0;
    stack[depth++] = (group){0, j->part_count, FCT_NONE, 0, height, false};
    while (depth > 0) {
        group g = stack[--depth];
        bool leaf = g.end - g.begin == 1;
        int64_t id = leaf ? -1 - (int64_t)g.begin : (int64_t)j->node_count++;
        if (g.parent != FCT_NONE) j->nodes[g.parent].child[g.side] = id;
        if (leaf) continue;
        uint32_t middle = cut(j, &g, scratch);
        uint32_t node = (uint32_t)id;
        stack[depth++] = (group){middle, g.end, node, 1, g.height_left - 1, g.keep_order};
        stack[depth++] = (group){g.begin, middle, node, 0, g.height_left - 1, g.keep_order};
    }
}

/* Boxes of the parts in the unit model, through the part of every face. */
static fct_result bound_parts(joiner *j, const fct_mesh *mesh) {
    fct_work *work = j->work;
    size_t nodes = (size_t)work->face_count + work->merge_count;
    uint32_t *owner = fct_allocate(work->env, nodes, sizeof *owner);
    if (!owner) return fct_fail_memory(work->env, "joining parts");
    for (uint32_t i = 0; i < j->part_count; ++i) owner[work->nodes[j->parts[i].slot]] = i;
    for (uint32_t m = work->merge_count; m-- > 0;)
        owner[work->children[m][0]] = owner[work->children[m][1]] = owner[work->face_count + m];
    for (uint32_t f = 0; f < work->face_count; ++f) {
        part *p = &j->parts[owner[f]];
        for (int c = 0; c < 3; ++c) {
            v3 x = v3_load(mesh->positions + 3 * (size_t)mesh->triangles[3 * (size_t)f + (size_t)c]);
            float q[3];
            v3_store(q, v3_scale(v3_sub(x, work->metric.origin), work->metric.scale));
            for (int k = 0; k < 3; ++k) {
                if (q[k] < p->lower[k]) p->lower[k] = q[k];
                if (q[k] > p->upper[k]) p->upper[k] = q[k];
            }
        }
    }
    fct_release(work->env, owner);
    return FCT_OK;
}

static uint32_t slot_of(const joiner *j, const uint32_t *slots, int64_t id) {
    return id < 0 ? j->parts[-1 - id].slot : slots[id];
}

static fct_result join_parts(joiner *j, const fct_mesh *mesh, part *scratch, uint32_t *slots) {
    fct_work *work = j->work;
    for (uint32_t f = 0, i = 0; f < work->face_count; ++f)
        if (work->nodes[f] != FCT_NONE)
            j->parts[i++] = (part){{INFINITY, INFINITY, INFINITY},
                                   {-INFINITY, -INFINITY, -INFINITY},
                                   f,
                                   work->records[f].count,
                                   work->heights[f]};
    fct_result result = bound_parts(j, mesh);
    if (result != FCT_OK) return result;
    uint64_t faces = 0; /* more than slots, where slots begin as clusters */
    for (uint32_t i = 0; i < j->part_count; ++i) faces += j->parts[i].count;
    split_all(j, scratch, (int)(3 * log2((double)faces)));
    for (uint32_t node = j->node_count; node-- > 0;) {
        uint32_t a = slot_of(j, slots, j->nodes[node].child[0]),
                 b = slot_of(j, slots, j->nodes[node].child[1]);
        fct_work_merge(work, a, b, 0, fct_work_cost(work, a, b, 0));
        slots[node] = a;
    }
    return fct_progress(work->env, "clusters", 1);
}

fct_result fct_work_join(fct_work *work, const fct_mesh *mesh) {
    joiner j = {.work = work, .part_count = work->face_count - work->merge_count};
    if (j.part_count < 2) return FCT_OK;
    j.parts = fct_allocate(work->env, j.part_count, sizeof *j.parts);
    j.nodes = fct_allocate(work->env, j.part_count, sizeof *j.nodes);
    part *scratch = fct_allocate(work->env, j.part_count, sizeof *scratch);
    uint32_t *slots = fct_allocate(work->env, j.part_count, sizeof *slots);
    fct_result result;
    if (!j.parts || !j.nodes || !scratch || !slots)
        result = fct_fail_memory(work->env, "joining parts");
    else
        result = join_parts(&j, mesh, scratch, slots);
    fct_release(work->env, j.parts);
    fct_release(work->env, j.nodes);
    fct_release(work->env, scratch);
    fct_release(work->env, slots);
    return result;
}
