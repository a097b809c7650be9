/* cluster/large/contract.c: contracts the tops of all parts of a large mesh to one tree, in memory, and
 * numbers the upper nodes by falling cost.
 *
 * The code of cluster/merge contracts tops instead of faces: slot i begins with the record, count and height
 * of top i. Within a phase, a parent costs at least as much as its children, tops included. Components are
 * counted from the edges, so limits of height and joins by proximity do not change the count.
 */
#include <math.h>
#include <string.h>

#include "base/key.h"
#include "base/sort.h"
#include "base/union_find.h"
#include "cluster/large/large.h"
#include "cluster/merge/greedy.h"
#include "cluster/merge/join.h"

/* A sum of float lengths below this share of their magnitudes is 0. */
#define ROUNDING 1e-6

typedef struct upper {
    fct_large *large;
    fct_work work;
    uint32_t *materials;
} upper;

/* Creates one slot per top. take_edges adds the edges. */
static fct_result open_work(const fct_env *env, const fct_metric *metric, const fct_top *tops,
                            const fct_mean_record *means, uint32_t count, fct_work *work) {
    *work = (fct_work){.env = env, .metric = *metric, .face_count = count};
    work->records = fct_allocate(env, count, sizeof *work->records);
    if (means) work->means = fct_allocate(env, count, sizeof *work->means);
    work->heights = fct_allocate(env, count, sizeof *work->heights);
    work->nodes = fct_allocate(env, count, sizeof *work->nodes);
    work->children = fct_allocate(env, count, sizeof *work->children);
    work->costs = fct_allocate(env, count, sizeof *work->costs);
    if (!work->records || (means && !work->means) || !work->heights || !work->nodes || !work->children ||
        !work->costs)
        return fct_fail_memory(env, "the clusters of all parts");
    for (uint32_t i = 0; i < count; ++i) {
        work->records[i] = tops[i].record;
        work->heights[i] = tops[i].height;
        work->nodes[i] = i;
    }
    if (means) memcpy(work->means, means, count * sizeof *means);
    return FCT_OK;
}

/* Joins the remaining clusters by proximity. The box of each top stands in for its faces, as one triangle
 * from corner to corner. */
static fct_result join_work(fct_work *work, const fct_top *tops) {
    uint32_t count = work->face_count;
    const fct_env *env = work->env;
    if (count - work->merge_count < 2) return FCT_OK;
    fct_mesh boxes = {.vertex_count = 2 * count, .face_count = count};
    boxes.positions = fct_allocate(env, count, 6 * sizeof *boxes.positions);
    boxes.triangles = fct_allocate(env, count, 3 * sizeof *boxes.triangles);
    fct_metric metric = work->metric;
    fct_result result = FCT_OK;
    if (!boxes.positions || !boxes.triangles) {
        result = fct_fail_memory(env, "joining parts");
    } else {
        for (uint32_t i = 0; i < count; ++i) {
            memcpy(boxes.positions + 6 * (size_t)i, tops[i].lower, sizeof tops[i].lower);
            memcpy(boxes.positions + 6 * (size_t)i + 3, tops[i].upper, sizeof tops[i].upper);
            uint32_t corners[3] = {2 * i, 2 * i + 1, 2 * i + 1};
            memcpy(boxes.triangles + 3 * (size_t)i, corners, sizeof corners);
        }
        work->metric.origin = (v3){0, 0, 0}, work->metric.scale = 1; /* boxes are in the unit model */
        result = fct_work_join(work, &boxes);
        work->metric = metric;
    }
    fct_release(env, boxes.positions);
    fct_release(env, boxes.triangles);
    return result;
}

fct_result fct_large_join(const fct_env *env, const fct_metric *metric, const fct_top *tops,
                          const fct_mean_record *means, uint32_t count, uint32_t (*children)[2],
                          float *costs) {
    fct_work work;
    fct_result result = open_work(env, metric, tops, means, count, &work);
    if (result == FCT_OK) result = join_work(&work, tops);
    if (result == FCT_OK) {
        memcpy(children, work.children, work.merge_count * sizeof *children);
        memcpy(costs, work.costs, work.merge_count * sizeof *costs);
    }
    fct_work_release(&work);
    return result;
}

/* --- Edges --- */

/* Adds up the edges between the same two tops. A top that was joined by proximity keeps no edges, because its
 * faces are not connected. */
static fct_result read_edges(upper *u, const fct_top_edge *from, uint32_t count, uint64_t *keys,
                             uint32_t *order, uint32_t *parents) {
    fct_work *work = &u->work;
    const fct_top *tops = u->large->all_tops;
    uint32_t listed = 0;
    fct_sets_create(parents, work->face_count);
    for (uint32_t e = 0; e < count; ++e) {
        uint32_t a = from[e].a, b = from[e].b;
        fct_sets_join(parents, a, b);
        if (tops[a].phase == 2 || tops[b].phase == 2) continue;
        keys[listed] = fct_pair_key(a, b);
        order[listed++] = e;
    }
    uint32_t components = u->large->loose_joins;
    for (uint32_t i = 0; i < work->face_count; ++i) components += parents[i] == i;
    u->large->component_count = components;
    fct_result result = fct_sort_pairs(work->env, keys, order, listed);
    for (uint32_t i = 0, end; i < listed && result == FCT_OK; i = end) {
        double shared = 0, size = 0;
        bool reduced = false;
        for (end = i; end < listed && keys[end] == keys[i]; ++end) {
            double length = (double)from[order[end]].shared;
            shared += length, size += fabs(length), reduced |= signbit(length) != 0;
        }
        if (reduced && shared <= ROUNDING * size) continue; /* seam.c took back the whole border */
        work->edges[work->edge_count++] =
            (fct_edge){(uint32_t)(keys[i] >> 32), (uint32_t)keys[i], (float)fmax(shared, 0)};
    }
    return result;
}

static fct_result take_edges(upper *u) {
    fct_large *l = u->large;
    const fct_env *env = l->env;
    size_t count = l->edges.size / sizeof(fct_top_edge);
    if (count > UINT32_MAX / 4) return fct_fail_memory(env, "so many edges between parts");
    fct_top_edge *from = fct_allocate(env, count, sizeof *from);
    uint64_t *keys = fct_allocate(env, count, sizeof *keys);
    uint32_t *order = fct_allocate(env, count, sizeof *order);
    uint32_t *parents = fct_allocate(env, u->work.face_count, sizeof *parents);
    u->work.edges = fct_allocate(env, count, sizeof *u->work.edges);
    fct_result result;
    if (!from || !keys || !order || !parents || !u->work.edges)
        result = fct_fail_memory(env, "the edges between parts");
    else
        result = fct_spool_read(&l->edges, 0, from, count * sizeof *from);
    if (result == FCT_OK) result = read_edges(u, from, (uint32_t)count, keys, order, parents);
    fct_release(env, from);
    fct_release(env, keys);
    fct_release(env, order);
    fct_release(env, parents);
    fct_spool_close(&l->edges);
    return result;
}

/* --- Contraction --- */

static fct_result contract_edges(fct_work *work, bool across) {
    work->steep = false;
    fct_result result = fct_work_greedy(work, across);
    work->steep = true;
    return result == FCT_OK ? fct_work_greedy(work, across) : result;
}

static fct_result contract(upper *u) {
    fct_work *work = &u->work;
    fct_result result = FCT_OK;
    if (u->materials) result = contract_edges(work, false);
    work->phase_ends[0] = work->merge_count;
    if (result == FCT_OK) result = contract_edges(work, true);
    work->phase_ends[1] = work->merge_count;
    if (result == FCT_OK) result = join_work(work, u->large->all_tops);
    work->phase_ends[2] = work->merge_count;
    return result;
}

/* Raises the cost of each merge to at least that of its children in the same phase. */
static void make_monotone(upper *u) {
    fct_work *work = &u->work;
    uint32_t count = work->face_count;
    for (uint32_t m = 0, phase = 0; m < work->merge_count; ++m) {
        for (; phase < 2 && m >= work->phase_ends[phase]; ++phase) continue;
        for (int k = 0; k < 2; ++k) {
            uint32_t child = work->children[m][k];
            const fct_top *top = child < count ? &u->large->all_tops[child] : NULL;
            bool same = top ? top->count > 1 && top->phase == phase
                            : child - count >= (phase ? work->phase_ends[phase - 1] : 0);
            float cost = top ? top->cost : work->costs[child - count];
            if (same && cost > work->costs[m]) work->costs[m] = cost;
        }
    }
}

/* Sets children, costs and counts of the upper nodes. ids: node id per merge. */
static void link_nodes(upper *u, const uint32_t *ids) {
    const fct_work *work = &u->work;
    fct_large *l = u->large;
    uint32_t tops = work->face_count, count = work->merge_count;
    for (uint32_t m = 0; m < count; ++m) {
        fct_cluster *c = &l->upper[ids[m]];
        *c = (fct_cluster){.cost = work->costs[m]};
        for (int k = 0; k < 2; ++k) {
            uint32_t child = work->children[m][k];
            c->child[k] = child < tops ? count + child : ids[child - tops];
            c->count += child < tops ? l->all_tops[child].count : l->upper[c->child[k]].count;
        }
    }
    l->upper_count = count;
    for (int k = 0; k < 3; ++k)
        l->upper_phase_counts[k] = work->phase_ends[k] - (k ? work->phase_ends[k - 1] : 0);
}

/* Assigns ranges of places from the root, node 0, downwards. */
static fct_result place_tops(fct_large *l) {
    uint32_t count = l->upper_count;
    uint64_t *keys = fct_allocate(l->env, l->top_count, sizeof *keys);
    if (!keys) return fct_fail_memory(l->env, "ordering the tree");
    keys[0] = 0; /* if there is only one top, no node sets its key */
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t first = l->upper[i].first;
        for (int k = 0; k < 2; ++k) {
            uint32_t child = l->upper[i].child[k];
            if (child < count)
                l->upper[child].first = first, first += l->upper[child].count;
            else
                keys[child - count] = first, first += l->all_tops[child - count].count;
        }
    }
    for (uint32_t i = 0; i < l->top_count; ++i) l->top_order[i] = i;
    fct_result result = fct_sort_pairs(l->env, keys, l->top_order, l->top_count);
    for (uint32_t i = 0; i < l->top_count; ++i) l->top_places[i] = (uint32_t)keys[i];
    l->top_places[l->top_count] = l->info.face_count;
    fct_release(l->env, keys);
    return result;
}

/* Numbers nodes by falling (phase, cost). Among equal ones the later merge comes first, so that parents
 * precede children. */
static fct_result number_nodes(upper *u, uint64_t *keys, uint32_t *order, uint32_t *ids) {
    const fct_work *work = &u->work;
    uint32_t count = work->merge_count;
    for (uint32_t m = 0, phase = 0; m < count; ++m) {
        for (; phase < 2 && m >= work->phase_ends[phase]; ++phase) continue;
        keys[m] = (uint64_t)phase << 32 | fct_float_key(work->costs[m]);
        order[m] = m;
    }
    fct_result result = fct_sort_pairs(work->env, keys, order, count);
    for (uint32_t i = 0; i < count; ++i) ids[order[i]] = count - 1 - i;
    return result;
}

static fct_result order_nodes(upper *u) {
    fct_large *l = u->large;
    uint32_t count = u->work.merge_count;
    uint64_t *keys = fct_allocate(l->env, count, sizeof *keys);
    uint32_t *order = fct_allocate(l->env, count, sizeof *order);
    uint32_t *ids = fct_allocate(l->env, count, sizeof *ids);
    l->upper = fct_allocate(l->env, count, sizeof *l->upper);
    l->top_order = fct_allocate(l->env, l->top_count, sizeof *l->top_order);
    l->top_places = fct_allocate(l->env, (size_t)l->top_count + 1, sizeof *l->top_places);
    fct_result result;
    if (!keys || !order || !ids || !l->upper || !l->top_order || !l->top_places)
        result = fct_fail_memory(l->env, "ordering the tree");
    else
        result = number_nodes(u, keys, order, ids);
    if (result == FCT_OK) link_nodes(u, ids);
    fct_release(l->env, keys);
    fct_release(l->env, order);
    fct_release(l->env, ids);
    return result == FCT_OK ? place_tops(l) : result;
}

static fct_result run(upper *u, fct_mean_record *means) {
    fct_large *l = u->large;
    uint32_t count = l->top_count;
    fct_result result = fct_spool_read(&l->tops, 0, l->all_tops, count * sizeof *l->all_tops);
    if (result == FCT_OK && means) result = fct_spool_read(&l->means, 0, means, count * sizeof *means);
    if (result != FCT_OK) return result;
    fct_metric metric = fct_metric_make(l->def, &l->bounds);
    result = open_work(l->env, &metric, l->all_tops, means, count, &u->work);
    if (result != FCT_OK) return result;
    if (u->materials) {
        /* a cluster of several materials gets a material of its own, which equals no other */
        for (uint32_t i = 0; i < count; ++i) {
            uint32_t material = l->all_tops[i].material;
            u->materials[i] = material == FCT_NONE ? FCT_NONE - i : material;
        }
        u->work.materials = u->materials;
    }
    result = take_edges(u);
    if (result == FCT_OK) result = contract(u);
    if (result != FCT_OK) return result;
    make_monotone(u);
    return order_nodes(u);
}

fct_result fct_large_contract(fct_large *large) {
    const fct_env *env = large->env;
    double start = fct_seconds();
    upper u = {.large = large};
    bool mean = large->def->cost == FCT_COST_MEAN;
    large->all_tops = fct_allocate(env, large->top_count, sizeof *large->all_tops);
    fct_mean_record *means = mean ? fct_allocate(env, large->top_count, sizeof *means) : NULL;
    if (large->info.materials) u.materials = fct_allocate(env, large->top_count, sizeof *u.materials);
    fct_result result;
    if (!large->all_tops || (mean && !means) || (large->info.materials && !u.materials))
        result = fct_fail_memory(env, "the clusters of all parts");
    else
        result = run(&u, means);
    if (u.work.env) fct_work_release(&u.work);
    fct_release(env, u.materials);
    fct_release(env, means);
    large->seconds_contract += fct_seconds() - start;
    return result;
}
