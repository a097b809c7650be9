/* cluster/large/write.c: numbers the nodes of all parts and the upper nodes by falling cost, and writes the
 * hierarchy file of a large mesh from front to back.
 *
 * 1. The nodes of each part, and the upper nodes, are lists in the order of falling (phase, cost). A merge of
 * the lists by their costs alone gives each node its number: 4 bytes per node.
 * 2. If several roots are asked for, the first numbers are dropped, and the faces follow the order of the
 * roots.
 * 3. For one window of ids after another, take the nodes from all lists, replace children, places and costs
 * by those of the whole tree, and write them.
 * 4. mesh.c writes faces and vertices.
 */
#include <string.h>

#include "base/key.h"
#include "base/parallel.h"
#include "base/sift.h"
#include "base/sort.h"
#include "cluster/file/file.h"
#include "cluster/large/large.h"

enum { WINDOW = 1 << 18 }; /* most nodes per window */

/* The first node of a list that has no number yet. */
typedef struct head {
    uint64_t key; /* phase + 1, then cost; 0: the list is empty */
    uint32_t list;
} head;

/* A node of a list. In a part, numbers from node_count on are faces. */
typedef struct place_in_list {
    uint32_t list, node;
} place_in_list;

typedef struct assembler {
    fct_large *large;
    fct_tree_writer *out;
    fct_tree_view view;
    uint32_t list_count;       /* one per part, then the upper nodes */
    uint32_t *ranks;           /* per node of all lists: key of its cost, then its number */
    uint64_t *bases;           /* per list: index of its first node in ranks */
    uint32_t *cursors;         /* per list: its next node */
    float floors[3];           /* per phase: its lowest cost */
    uint32_t dropped;          /* nodes with smaller numbers are not in the file */
    fct_large_root *roots;     /* in the order of ids */
    uint32_t *by_place;        /* roots in the order of `first` */
    uint32_t *firsts, *places; /* per top: its first place in its part, and in the tree with one root */
    uint8_t *depths;           /* per node of the file, at most 255 */
    uint64_t depth_total;
    fct_cluster *run, *window; /* nodes of one list; nodes of the window by id */
    uint32_t run_list, run_first, window_first, window_size;
} assembler;

/* --- Numbers --- */

static uint32_t list_size(const assembler *a, uint32_t list) {
    return list < a->large->part_count ? a->large->parts[list].node_count : a->large->upper_count;
}

static uint32_t phase_at(const assembler *a, uint32_t list, uint32_t node) {
    const fct_large *l = a->large;
    const uint32_t *counts = list < l->part_count ? l->parts[list].phase_counts : l->upper_phase_counts;
    return node < counts[2] ? 2 : node < counts[2] + counts[1] ? 1 : 0;
}

/* The next head of a list; its key is 0 at the end of the list. */
static head next_of(assembler *a, uint32_t list) {
    uint32_t node = a->cursors[list];
    if (node == list_size(a, list)) return (head){0, list};
    return (head){(uint64_t)(phase_at(a, list, node) + 1) << 32 | a->ranks[a->bases[list] + node], list};
}

static bool less_heads(const void *heads, size_t i, size_t j) {
    const head *x = (const head *)heads + i, *y = (const head *)heads + j;
    return x->key != y->key ? x->key < y->key : x->list < y->list;
}

static void swap_heads(void *heads, size_t i, size_t j) {
    head *x = (head *)heads + i, *y = (head *)heads + j, moving = *x;
    *x = *y, *y = moving;
}

/* The floor of a phase is the highest cost of all earlier phases. */
static void find_floors(assembler *a) {
    for (int k = 0; k < 3; ++k) a->floors[k] = -INFINITY;
    for (uint32_t list = 0; list < a->list_count; ++list)
        for (uint32_t node = 0, size = list_size(a, list); node < size;) {
            uint32_t phase = phase_at(a, list, node), begin = node;
            float cost = fct_float_of_key(a->ranks[a->bases[list] + node]);
            for (uint32_t p = phase + 1; p < 3; ++p)
                if (cost > a->floors[p]) a->floors[p] = cost;
            const fct_large *l = a->large;
            const uint32_t *counts =
                list < l->part_count ? l->parts[list].phase_counts : l->upper_phase_counts;
            node = begin + counts[phase]; /* the first node of a phase has the phase's highest cost */
        }
}

static float final_cost(const assembler *a, uint32_t phase, float cost) {
    return cost > a->floors[phase] ? cost : a->floors[phase];
}

static fct_result merge_lists(assembler *a, head *heap) {
    const fct_tree_def *def = a->large->def;
    uint32_t count = a->list_count, wanted = def->root_count > 1 ? def->root_count : 1;
    for (uint32_t i = 0; i < count; ++i) heap[i] = next_of(a, i);
    fct_sift_all(heap, count, less_heads, swap_heads);
    for (uint32_t number = 0; heap[0].key != 0; ++number) {
        uint32_t list = heap[0].list, phase = (uint32_t)(heap[0].key >> 32) - 1;
        double cost = (double)final_cost(a, phase, fct_float_of_key((uint32_t)heap[0].key));
        if (a->dropped == number && (number + 1 < wanted || cost > def->max_cost)) ++a->dropped;
        a->ranks[a->bases[list] + a->cursors[list]++] = number;
        heap[0] = next_of(a, list);
        fct_sift_down(heap, 0, count, less_heads, swap_heads);
        if (number % (1 << 20) == 0) {
            fct_result result =
                fct_progress(a->large->env, "order", number / (a->large->info.face_count + 1.0));
            if (result != FCT_OK) return result;
        }
    }
    return FCT_OK;
}

static fct_result number_nodes(assembler *a) {
    fct_large *l = a->large;
    uint64_t base = 0;
    for (uint32_t i = 0; i < a->list_count; ++i) {
        a->bases[i] = base;
        base += list_size(a, i);
    }
    a->ranks = fct_allocate(l->env, base, sizeof *a->ranks);
    head *heap = fct_allocate(l->env, a->list_count, sizeof *heap);
    fct_result result = FCT_OK;
    uint64_t inside = a->bases[l->part_count];
    if (!a->ranks || !heap)
        result = fct_fail_memory(l->env, "ordering the tree");
    else
        result = fct_spool_read(&l->costs, 0, a->ranks, inside * sizeof *a->ranks);
    if (result == FCT_OK) {
        for (uint64_t i = 0; i < inside; ++i) {
            float cost;
            memcpy(&cost, &a->ranks[i], sizeof cost);
            a->ranks[i] = fct_float_key(cost);
        }
        for (uint32_t i = 0; i < l->upper_count; ++i) a->ranks[inside + i] = fct_float_key(l->upper[i].cost);
        find_floors(a);
        result = merge_lists(a, heap);
    }
    fct_release(l->env, heap);
    fct_spool_close(&l->costs);
    return result;
}

/* --- Places --- */

/* Converts a place of a part to a place of the tree with one root. */
static uint32_t tree_place(const assembler *a, uint32_t list, uint32_t place) {
    const fct_part *part = &a->large->parts[list];
    uint32_t low = part->first_top, high = low + part->top_count;
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (a->firsts[middle] <= place)
            low = middle;
        else
            high = middle;
    }
    return a->places[low] + (place - a->firsts[low]);
}

/* Converts a place of the tree with one root to a place of the file. */
static uint32_t final_place(const assembler *a, uint32_t place) {
    if (a->dropped == 0) return place;
    uint32_t low = 0, high = a->view.root_count;
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (a->roots[a->by_place[middle]].first <= place)
            low = middle;
        else
            high = middle;
    }
    const fct_large_root *r = &a->roots[a->by_place[low]];
    return r->to + (place - r->first);
}

/* The child of a node: a node of the same list, or the node of a top in its part. */
static place_in_list child_of(const assembler *a, uint32_t list, uint32_t child) {
    const fct_large *l = a->large;
    if (list < l->part_count || child < l->upper_count) return (place_in_list){list, child};
    const fct_top *top = &l->all_tops[child - l->upper_count];
    return (place_in_list){top->part, top->node};
}

static bool is_face(const assembler *a, place_in_list at) {
    return at.list < a->large->part_count && at.node >= list_size(a, at.list);
}

static uint32_t number_of(const assembler *a, place_in_list at) {
    return a->ranks[a->bases[at.list] + at.node];
}

static uint32_t place_of_face(const assembler *a, place_in_list at) {
    return tree_place(a, at.list, at.node - list_size(a, at.list));
}

/* Reads a node as its list has it, except that `first` is a place of the tree with one root. */
static fct_result read_node(const assembler *a, place_in_list at, fct_cluster *out) {
    const fct_large *l = a->large;
    *out = (fct_cluster){0};
    if (at.list == l->part_count) {
        *out = l->upper[at.node];
        return FCT_OK;
    }
    uint64_t offset = (l->parts[at.list].first_node + at.node) * sizeof *out;
    fct_result result = fct_spool_read(&l->nodes, offset, out, sizeof *out);
    if (result == FCT_OK) out->first = tree_place(a, at.list, out->first);
    return result;
}

/* Lists the children of a dropped node that are not dropped themselves: they are roots. */
static fct_result list_roots_below(assembler *a, place_in_list at, uint32_t *found) {
    fct_cluster c, child;
    fct_result result = read_node(a, at, &c);
    for (int k = 0; k < 2 && result == FCT_OK; ++k) {
        place_in_list below = child_of(a, at.list, c.child[k]);
        if (is_face(a, below)) {
            uint32_t place = place_of_face(a, below);
            a->roots[(*found)++] = (fct_large_root){place, 1, 0, a->view.node_count + place};
        } else if (number_of(a, below) >= a->dropped) {
            result = read_node(a, below, &child);
            a->roots[(*found)++] =
                (fct_large_root){child.first, child.count, 0, number_of(a, below) - a->dropped};
        }
    }
    return result;
}

static fct_result list_roots(assembler *a, uint32_t *found) {
    fct_result result = FCT_OK;
    for (uint32_t list = 0; list < a->list_count; ++list)
        for (uint32_t node = 0; node < list_size(a, list) && result == FCT_OK; ++node) {
            place_in_list at = {list, node};
            if (number_of(a, at) >= a->dropped) break;
            result = list_roots_below(a, at, found);
        }
    return result;
}

/* Sorts the roots by id, and gives their faces consecutive places in that order. */
static fct_result order_roots(assembler *a, uint64_t *keys, uint32_t *order, fct_large_root *sorted) {
    const fct_env *env = a->large->env;
    uint32_t count = a->view.root_count, to = 0;
    for (uint32_t i = 0; i < count; ++i) keys[i] = a->roots[i].id, order[i] = i;
    fct_result result = fct_sort_pairs(env, keys, order, count);
    for (uint32_t i = 0; i < count && result == FCT_OK; ++i) {
        sorted[i] = a->roots[order[i]];
        sorted[i].to = to;
        if (sorted[i].id >= a->view.node_count) sorted[i].id = a->view.node_count + to;
        to += sorted[i].count;
    }
    if (result != FCT_OK) return result;
    memcpy(a->roots, sorted, count * sizeof *sorted);
    for (uint32_t i = 0; i < count; ++i) keys[i] = a->roots[i].first, a->by_place[i] = i;
    return fct_sort_pairs(env, keys, a->by_place, count);
}

static fct_result find_roots(assembler *a) {
    const fct_env *env = a->large->env;
    uint32_t count = a->view.root_count = a->dropped + 1, found = 0;
    a->view.node_count = a->view.face_count - count;
    a->roots = fct_allocate(env, count, sizeof *a->roots);
    a->by_place = fct_allocate(env, count, sizeof *a->by_place);
    uint64_t *keys = fct_allocate(env, count, sizeof *keys);
    uint32_t *order = fct_allocate(env, count, sizeof *order);
    fct_large_root *sorted = fct_allocate(env, count, sizeof *sorted);
    fct_result result = FCT_OK;
    if (!a->roots || !a->by_place || !keys || !order || !sorted) {
        result = fct_fail_memory(env, "ordering the tree");
    } else if (a->dropped == 0) {
        a->roots[0] = (fct_large_root){0, a->view.face_count, 0, 0};
        a->by_place[0] = 0;
    } else {
        result = list_roots(a, &found);
        if (result == FCT_OK) result = order_roots(a, keys, order, sorted);
    }
    fct_release(env, keys);
    fct_release(env, order);
    fct_release(env, sorted);
    return result;
}

/* --- Nodes --- */

/* Copies nodes of a list into the window, with the children, places and costs of the file. */
static void place_nodes(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    assembler *a = user;
    uint32_t list = a->run_list;
    bool upper = list == a->large->part_count;
    for (size_t i = begin; i < end; ++i) {
        uint32_t node = a->run_first + (uint32_t)i;
        fct_cluster c = a->run[i];
        c.first = final_place(a, upper ? c.first : tree_place(a, list, c.first));
        c.cost = final_cost(a, phase_at(a, list, node), c.cost);
        for (int k = 0; k < 2; ++k) {
            place_in_list child = child_of(a, list, c.child[k]);
            c.child[k] = is_face(a, child) ? a->view.node_count + final_place(a, place_of_face(a, child))
                                           : number_of(a, child) - a->dropped;
        }
        a->window[a->ranks[a->bases[list] + node] - a->dropped - a->window_first] = c;
    }
}

/* Takes the next nodes of a list, as long as their numbers are below `end`. */
static fct_result take_run(assembler *a, uint32_t list, uint32_t end) {
    fct_large *l = a->large;
    uint32_t first = a->cursors[list], count = 0, size = list_size(a, list);
    const uint32_t *ranks = a->ranks + a->bases[list];
    while (first + count < size && ranks[first + count] < end) ++count;
    a->cursors[list] += count;
    if (count == 0) return FCT_OK;
    fct_result result = FCT_OK;
    if (list < l->part_count) {
        uint64_t at = (l->parts[list].first_node + first) * sizeof *a->run;
        result = fct_spool_read(&l->nodes, at, a->run, count * sizeof *a->run);
        fct_spool_discard(&l->nodes, at, count * sizeof *a->run);
    } else {
        memcpy(a->run, l->upper + first, count * sizeof *a->run);
    }
    a->run_list = list, a->run_first = first;
    if (result == FCT_OK) fct_parallel_for(l->env, count, 1 << 10, place_nodes, a);
    return result;
}

static void measure_depths(assembler *a, uint32_t count) {
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t depth = a->depths[a->window_first + i] + 1u;
        for (int k = 0; k < 2; ++k) {
            uint32_t child = a->window[i].child[k];
            if (child < a->view.node_count) {
                a->depths[child] = (uint8_t)(depth < 255 ? depth : 255);
                continue;
            }
            a->depth_total += depth;
            if (depth > a->view.depth) a->view.depth = depth;
        }
    }
}

static fct_result write_nodes(assembler *a) {
    fct_large *l = a->large;
    uint32_t nodes = a->view.node_count;
    for (uint32_t i = 0; i < a->list_count; ++i) {
        a->cursors[i] = 0;
        while (a->cursors[i] < list_size(a, i) && a->ranks[a->bases[i] + a->cursors[i]] < a->dropped)
            ++a->cursors[i];
    }
    for (uint32_t at = 0; at < nodes; at += a->window_size) {
        uint32_t count = nodes - at < a->window_size ? nodes - at : a->window_size;
        fct_result result = fct_progress(l->env, "write", 0.7 * at / nodes);
        a->window_first = at;
        for (uint32_t i = 0; i < a->list_count && result == FCT_OK; ++i)
            result = take_run(a, i, a->dropped + at + count);
        if (result != FCT_OK) return result;
        measure_depths(a, count);
        result = fct_tree_writer_put(a->out, FCT_SECTION_NODES, a->window, count * sizeof *a->window);
        if (result != FCT_OK) return result;
    }
    a->view.mean_depth = (double)a->depth_total / a->view.face_count;
    fct_spool_close(&l->nodes);
    return FCT_OK;
}

static fct_result write_roots(assembler *a) {
    fct_result result = FCT_OK;
    for (uint32_t i = 0; i < a->view.root_count && result == FCT_OK; ++i)
        result = fct_tree_writer_put(a->out, FCT_SECTION_ROOTS, &a->roots[i].id, sizeof a->roots[i].id);
    return result;
}

/* --- All --- */

static void fill_view(assembler *a) {
    const fct_large *l = a->large;
    fct_metric metric = fct_metric_make(l->def, &l->bounds);
    a->view = (fct_tree_view){.face_count = l->info.face_count,
                              .vertex_count = l->info.vertex_count,
                              .boundary_edges = (uint32_t)l->boundary_edges,
                              .nonmanifold_edges = (uint32_t)l->nonmanifold_edges,
                              .component_count = l->component_count,
                              .bounds = l->all_bounds,
                              .material_count = l->info.material_count,
                              .material_names = (const char *const *)l->info.material_names,
                              .source = l->def->source ? l->def->source : "",
                              .source_hash = l->def->source_hash,
                              .def = *l->def};
    a->view.def.fit_weight = (double)metric.fit_weight;
    a->view.def.direction_weight = (double)metric.direction_weight;
    a->view.def.shape_weight = (double)metric.shape_weight;
    a->view.def.source = NULL;
    a->view.def.weld = l->joined;
    a->view.inward = fct_enclosed_is_inward(&l->enclosed, &a->view);
    memcpy(a->view.origin, l->info.origin, sizeof a->view.origin);
}

static fct_result prepare(assembler *a) {
    fct_large *l = a->large;
    const fct_env *env = l->env;
    a->bases = fct_allocate(env, a->list_count, sizeof *a->bases);
    a->cursors = fct_allocate_zero(env, a->list_count, sizeof *a->cursors);
    a->firsts = fct_allocate(env, l->top_count, sizeof *a->firsts);
    a->places = fct_allocate(env, l->top_count, sizeof *a->places);
    if (!a->bases || !a->cursors || !a->firsts || !a->places)
        return fct_fail_memory(env, "ordering the tree");
    for (uint32_t i = 0; i < l->top_count; ++i) {
        a->firsts[i] = l->all_tops[i].first;
        a->places[l->top_order[i]] = l->top_places[i];
    }
    fct_result result = number_nodes(a);
    if (result == FCT_OK) result = find_roots(a);
    if (result != FCT_OK) return result;
    a->depths = fct_allocate_zero(env, a->view.node_count, 1);
    size_t window = l->budget / 16 / sizeof *a->window;
    a->window_size = window < WINDOW ? (uint32_t)window : WINDOW;
    a->run = fct_allocate(env, a->window_size, sizeof *a->run);
    a->window = fct_allocate(env, a->window_size, sizeof *a->window);
    return a->depths && a->run && a->window ? FCT_OK : fct_fail_memory(env, "a hierarchy file");
}

static void release_numbers(assembler *a) {
    const fct_env *env = a->large->env;
    fct_release(env, a->ranks);
    fct_release(env, a->depths);
    fct_release(env, a->run);
    fct_release(env, a->window);
    a->ranks = NULL, a->depths = NULL, a->run = a->window = NULL;
}

fct_result fct_large_write(fct_large *large, fct_tree_view *out) {
    const fct_env *env = large->env;
    assembler a = {.large = large, .list_count = (uint32_t)large->part_count + 1};
    fill_view(&a);
    fct_result result = prepare(&a);
    if (result == FCT_OK) {
        unsigned arrays =
            (large->info.colors ? FCT_MESH_COLORS : 0u) | (large->info.materials ? FCT_MESH_MATERIALS : 0u);
        result = fct_tree_writer_open(env, large->path, &a.view, arrays, &a.out);
    }
    if (result == FCT_OK) result = write_roots(&a);
    if (result == FCT_OK) result = write_nodes(&a);
    release_numbers(&a);
    if (result == FCT_OK) result = fct_large_write_mesh(large, a.out, a.roots, a.view.root_count);
    if (result == FCT_OK)
        result = fct_tree_writer_finish(a.out, &a.view);
    else
        fct_tree_writer_abandon(a.out);
    fct_release(env, a.bases);
    fct_release(env, a.cursors);
    fct_release(env, a.firsts);
    fct_release(env, a.places);
    fct_release(env, a.roots);
    fct_release(env, a.by_place);
    *out = a.view;
    return result;
}
