/* cluster/tree/order.c: turns the merges of a clustering into the numbering of the tree.
 *
 * 1. Raise each cost to the maximum over its subtree and over all merges of earlier phases.
 * 2. Sort the merges by cost with a stable radix sort, so children stay before parents. The merge of rank i
 *    becomes inner node M - 1 - i.
 * 3. Hand ranges down from the roots, which places the faces.
 * 4. Number vertices in order of first use, so the vertices that a cluster is the first to use are one run.
 * Passes over the tree are in the order of merges and not of nodes, because successive merges are neighbours
 * in memory. Links and costs stay in their own arrays, so each record is written only once.
 */
#include "cluster/tree/order.h"

#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "base/key.h"
#include "base/parallel.h"
#include "base/sort.h"

enum { GRAIN = 1 << 13 };

typedef struct orderer {
    fct_work *work;
    const fct_mesh *mesh;
    fct_tree *tree;
    uint64_t *sorted;             /* per rank: cost << 32 | merge */
    uint32_t *ranks;              /* per merge */
    uint32_t *counts, *firsts;    /* per merge: number of faces, place of the first */
    uint8_t *depths;              /* per merge */
    uint32_t kept;                /* merges that become nodes */
    _Atomic uint32_t *first_uses; /* per vertex: its first corner in the tree's order */
    uint32_t *renamed;            /* per vertex: its new id */
    uint32_t *places;             /* per chunk: first uses, then the id of its first new vertex */
} orderer;

/* Raises costs so that they never fall from child to parent or from phase to phase, and counts faces. */
static void raise_costs(const orderer *o) {
    const fct_work *work = o->work;
    uint32_t faces = work->face_count;
    float floor = -INFINITY, highest = -INFINITY;
    for (uint32_t m = 0, phase = 0; m < work->merge_count; ++m) {
        for (; phase < 2 && m >= work->phase_ends[phase]; ++phase) floor = highest;
        float cost = work->costs[m] > floor ? work->costs[m] : floor;
        uint32_t count = 0;
        for (int k = 0; k < 2; ++k) {
            uint32_t child = work->children[m][k];
            count += child < faces ? 1 : o->counts[child - faces];
            if (child >= faces && work->costs[child - faces] > cost) cost = work->costs[child - faces];
        }
        work->costs[m] = cost, o->counts[m] = count;
        if (cost > highest) highest = cost;
    }
}

static void list_costs(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    orderer *o = user;
    for (size_t m = begin; m < end; ++m) o->sorted[m] = (uint64_t)fct_float_key(o->work->costs[m]) << 32 | m;
}

static void list_ranks(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    orderer *o = user;
    for (size_t i = begin; i < end; ++i) o->ranks[(uint32_t)o->sorted[i]] = (uint32_t)i;
}

/* The number of merges that become nodes: down to root_count clusters, none above max_cost. */
static uint32_t count_kept(const orderer *o, const fct_tree_def *def) {
    const fct_work *work = o->work;
    uint32_t roots = def->root_count > 1 ? def->root_count : 1;
    uint32_t kept = roots < work->face_count ? work->face_count - roots : 0;
    if (kept > work->merge_count) kept = work->merge_count;
    while (kept > 0 && (double)work->costs[(uint32_t)o->sorted[kept - 1]] > def->max_cost) --kept;
    return kept;
}

static bool is_kept(const orderer *o, uint32_t merge) {
    return o->kept == o->work->merge_count || o->ranks[merge] < o->kept;
}

/* Places roots in order of node id, then faces that are roots. held: per face, then per merge: has a parent.
 */
static void place_roots(const orderer *o, uint8_t *held) {
    const fct_work *work = o->work;
    fct_tree *tree = o->tree;
    uint32_t faces = work->face_count, place = 0, count = 0;
    memset(held, 0, (size_t)faces + work->merge_count);
    for (uint32_t m = 0; m < work->merge_count; ++m)
        if (is_kept(o, m)) held[work->children[m][0]] = held[work->children[m][1]] = 1;
    for (uint32_t i = 0; i < o->kept && place < faces; ++i) {
        uint32_t merge = (uint32_t)o->sorted[o->kept - 1 - i];
        if (held[faces + merge]) continue;
        o->firsts[merge] = place, o->depths[merge] = 0;
        place += o->counts[merge];
        tree->roots[count++] = i;
    }
    for (uint32_t f = 0; f < faces && place < faces; ++f) {
        if (held[f]) continue;
        tree->roots[count++] = o->kept + place;
        tree->face_ids[place++] = f;
    }
    tree->view.root_count = count;
}

/* Hands places and depths from parents to children. */
static void place_faces(const orderer *o) {
    const fct_work *work = o->work;
    uint32_t faces = work->face_count, deepest = 0;
    uint64_t total = 0;
    for (uint32_t m = work->merge_count; m-- > 0;) {
        if (!is_kept(o, m)) continue;
        uint32_t first = o->firsts[m], depth = o->depths[m] + 1u;
        for (int k = 0; k < 2; ++k) {
            uint32_t child = work->children[m][k];
            if (child < faces) {
                o->tree->face_ids[first++] = child;
                total += depth;
                if (depth > deepest) deepest = depth;
            } else {
                o->firsts[child - faces] = first, o->depths[child - faces] = (uint8_t)depth;
                first += o->counts[child - faces];
            }
        }
    }
    o->tree->view.depth = deepest;
    o->tree->view.mean_depth = (double)total / faces;
}

/* Makes links of the kept merges. */
static void link_nodes(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const orderer *o = user;
    uint32_t faces = o->work->face_count, kept = o->kept;
    for (uint32_t m = (uint32_t)begin; m < end; ++m) {
        if (!is_kept(o, m)) continue;
        fct_node_link *link = &o->tree->links[kept - 1 - o->ranks[m]];
        *link = (fct_node_link){.first = o->firsts[m], .count = o->counts[m], .cost = o->work->costs[m]};
        for (uint32_t k = 0, place = o->firsts[m]; k < 2; ++k) {
            uint32_t child = o->work->children[m][k];
            link->child[k] = child < faces ? kept + place : kept - 1 - o->ranks[child - faces];
            place += child < faces ? 1 : o->counts[child - faces];
        }
    }
}

/* --- Vertices in order of first use --- */

static void copy_triangles(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    orderer *o = user;
    for (size_t f = begin; f < end; ++f) {
        const uint32_t *from = o->mesh->triangles + 3 * (size_t)o->tree->face_ids[f];
        for (size_t i = 3 * f; i < 3 * f + 3; ++i) {
            uint32_t v = *from++, corner = (uint32_t)i;
            o->tree->triangles[i] = v;
            uint32_t first = atomic_load_explicit(&o->first_uses[v], memory_order_relaxed);
            while (corner < first &&
                   !atomic_compare_exchange_weak_explicit(&o->first_uses[v], &first, corner,
                                                          memory_order_relaxed, memory_order_relaxed))
                continue;
        }
        if (o->tree->materials) o->tree->materials[f] = o->mesh->materials[o->tree->face_ids[f]];
    }
}

static bool is_first_use(const orderer *o, size_t corner) {
    return atomic_load_explicit(&o->first_uses[o->tree->triangles[corner]], memory_order_relaxed) == corner;
}

static void count_first_uses(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    orderer *o = user;
    uint32_t count = 0;
    for (size_t i = 3 * begin; i < 3 * end; ++i) count += is_first_use(o, i);
    o->places[chunk] = count;
}

static void rename_vertices(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    orderer *o = user;
    uint32_t next = o->places[chunk];
    for (size_t i = 3 * begin; i < 3 * end; ++i) {
        if (!is_first_use(o, i)) continue;
        o->tree->vertex_ids[next] = o->tree->triangles[i];
        o->renamed[o->tree->triangles[i]] = next++;
    }
}

static void rename_corners(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    orderer *o = user;
    for (size_t i = 3 * begin; i < 3 * end; ++i) o->tree->triangles[i] = o->renamed[o->tree->triangles[i]];
}

static void copy_vertices(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    orderer *o = user;
    for (size_t v = begin; v < end; ++v) {
        size_t from = 3 * (size_t)o->tree->vertex_ids[v];
        for (size_t k = 0; k < 3; ++k) o->tree->positions[3 * v + k] = o->mesh->positions[from + k];
        for (size_t k = 0; k < 3 && o->tree->colors; ++k)
            o->tree->colors[3 * v + k] = o->mesh->colors[from + k];
    }
}

/* Does the work of the four passes above in one pass, for one thread. Returns the number of used vertices. */
static uint32_t copy_alone(const orderer *o) {
    const fct_tree *tree = o->tree;
    uint32_t used = 0;
    memset(o->renamed, 0xFF, (size_t)o->mesh->vertex_count * sizeof *o->renamed);
    for (size_t f = 0; f < o->mesh->face_count; ++f) {
        const uint32_t *from = o->mesh->triangles + 3 * (size_t)tree->face_ids[f];
        for (size_t k = 0; k < 3; ++k) {
            uint32_t *renamed = &o->renamed[from[k]];
            if (*renamed == FCT_NONE) {
                tree->vertex_ids[used] = from[k];
                *renamed = used++;
            }
            tree->triangles[3 * f + k] = *renamed;
        }
        if (tree->materials) tree->materials[f] = o->mesh->materials[tree->face_ids[f]];
    }
    return used;
}

static uint32_t copy_side_by_side(const fct_env *env, orderer *o) {
    size_t faces = o->mesh->face_count, vertices = o->mesh->vertex_count;
    memset((void *)o->first_uses, 0xFF, vertices * sizeof *o->first_uses);
    memset(o->renamed, 0xFF, vertices * sizeof *o->renamed);
    fct_parallel_for(env, faces, GRAIN, copy_triangles, o);
    fct_parallel_for(env, faces, GRAIN, count_first_uses, o);
    uint32_t used = 0;
    for (size_t i = 0; i < fct_chunk_count(faces, GRAIN); ++i) {
        uint32_t count = o->places[i];
        o->places[i] = used;
        used += count;
    }
    fct_parallel_for(env, faces, GRAIN, rename_vertices, o);
    fct_parallel_for(env, faces, GRAIN, rename_corners, o);
    return used;
}

/* Triangles and materials by place, vertices in order of first use, vertices without a face last. */
static void copy_mesh(const fct_env *env, orderer *o) {
    size_t vertices = o->mesh->vertex_count;
    uint32_t used = fct_env_threads(env) == 1 ? copy_alone(o) : copy_side_by_side(env, o);
    for (uint32_t v = 0; used < vertices; ++v)
        if (o->renamed[v] == FCT_NONE) o->tree->vertex_ids[used++] = v;
    fct_parallel_for(env, vertices, GRAIN, copy_vertices, o);
}

static fct_result copy_names(const fct_env *env, const fct_mesh *mesh, fct_tree *tree) {
    tree->view.material_count = mesh->material_count;
    memcpy(tree->view.origin, mesh->origin, sizeof tree->view.origin);
    if (!mesh->material_names) return FCT_OK;
    tree->names = fct_allocate_zero(env, mesh->material_count, sizeof *tree->names);
    if (!tree->names) return fct_fail_memory(env, "material names");
    tree->view.material_names = (const char *const *)tree->names;
    for (uint32_t i = 0; i < mesh->material_count; ++i) {
        size_t size = strlen(mesh->material_names[i]) + 1;
        tree->names[i] = fct_allocate(env, size, 1);
        if (!tree->names[i]) return fct_fail_memory(env, "material names");
        memcpy(tree->names[i], mesh->material_names[i], size);
    }
    return FCT_OK;
}

static fct_result allocate_arrays(const fct_env *env, const fct_mesh *mesh, uint32_t kept, fct_tree *tree) {
    uint32_t faces = mesh->face_count, vertices = mesh->vertex_count;
    const fct_array arrays[] = {FCT_ARRAY(tree->roots, faces - kept),
                                FCT_ARRAY(tree->face_ids, faces),
                                FCT_ARRAY(tree->vertex_ids, vertices),
                                FCT_ARRAY(tree->triangles, 3 * (size_t)faces),
                                FCT_ARRAY(tree->positions, 3 * (size_t)vertices),
                                FCT_ARRAY_IF(mesh->colors, tree->colors, 3 * (size_t)vertices),
                                FCT_ARRAY_IF(mesh->materials, tree->materials, faces)};
    if (fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "the tree") != FCT_OK) return FCT_ERROR_MEMORY;
    fct_tree_view *view = &tree->view;
    view->face_count = faces, view->vertex_count = vertices, view->node_count = kept;
    view->roots = tree->roots, view->face_ids = tree->face_ids;
    view->vertex_ids = tree->vertex_ids, view->triangles = tree->triangles;
    view->positions = tree->positions, view->colors = tree->colors, view->materials = tree->materials;
    return FCT_OK;
}

static fct_result rank_merges(const fct_env *env, orderer *o) {
    size_t merges = o->work->merge_count;
    const fct_array arrays[] = {FCT_ARRAY(o->counts, merges), FCT_ARRAY(o->sorted, merges),
                                FCT_ARRAY(o->ranks, merges)};
    if (fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "ordering the tree") != FCT_OK)
        return FCT_ERROR_MEMORY;
    raise_costs(o);
    fct_parallel_for(env, merges, GRAIN, list_costs, o);
    fct_result result = fct_sort_items(env, o->sorted, merges);
    if (result == FCT_OK) fct_parallel_for(env, merges, GRAIN, list_ranks, o);
    return result;
}

/* Places the faces and makes the links. */
static fct_result place_nodes(const fct_env *env, orderer *o) {
    size_t faces = o->mesh->face_count, merges = o->work->merge_count;
    fct_tree *tree = o->tree;
    uint8_t *held;
    const fct_array arrays[] = {FCT_ARRAY(held, faces + merges), FCT_ARRAY(o->firsts, merges),
                                FCT_ARRAY(o->depths, merges)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "ordering the tree");
    tree->links = fct_allocate(tree->env, o->kept, sizeof *tree->links);
    if (result == FCT_OK && !tree->links) result = fct_fail_memory(env, "ordering the tree");
    if (result == FCT_OK) {
        place_roots(o, held);
        place_faces(o);
        fct_parallel_for(env, merges, GRAIN, link_nodes, o);
    }
    fct_release(env, held);
    return result;
}

static void release_merges(const fct_env *env, orderer *o) {
    fct_release(env, o->sorted);
    fct_release(env, o->ranks);
    fct_release(env, o->counts);
    fct_release(env, o->firsts);
    fct_release(env, o->depths);
    fct_work_release(o->work);
}

static fct_result order_vertices(const fct_env *env, orderer *o) {
    size_t faces = o->mesh->face_count, vertices = o->mesh->vertex_count;
    const fct_array arrays[] = {FCT_ARRAY(o->first_uses, vertices), FCT_ARRAY(o->renamed, vertices),
                                FCT_ARRAY(o->places, fct_chunk_count(faces, GRAIN))};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "ordering the tree");
    if (result == FCT_OK) copy_mesh(env, o);
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    return result;
}

fct_result fct_tree_order(fct_work *work, const fct_mesh *mesh, const fct_tree_def *def, fct_tree *tree) {
    const fct_env *env = work->env;
    orderer o = {.work = work, .mesh = mesh, .tree = tree};
    fct_work_release_clusters(work);
    fct_result result = rank_merges(env, &o);
    if (result == FCT_OK) result = fct_progress(env, "order", 0.3);
    if (result == FCT_OK) {
        o.kept = count_kept(&o, def);
        result = allocate_arrays(tree->env, mesh, o.kept, tree);
    }
    if (result == FCT_OK) result = place_nodes(env, &o);
    release_merges(env, &o);
    if (result == FCT_OK) result = order_vertices(env, &o);
    if (result == FCT_OK) result = copy_names(tree->env, mesh, tree);
    return result == FCT_OK ? fct_progress(env, "order", 1) : result;
}
