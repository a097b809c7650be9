/* cluster/order.c: from merges in the order they were found to the tree's numbering.
 *
 * Each merge's cost becomes the running maximum over its subtree, and no less than that of any merge of an
 * earlier phase; a stable radix sort by it then keeps children before parents. Inner node M - 1 - i is the
 * merge of rank i. Ranges are handed down from the roots, which places the faces; vertices are numbered in
 * order of first use by the faces, so that a cluster's new vertices are one run.
 */
#include <string.h>

#include "base/sort.h"
#include "cluster/tree.h"

/* Raises costs so that they never fall from child to parent or from phase to phase. */
static void make_monotone(fct_work *work) {
    float floor = -INFINITY, highest = -INFINITY;
    for (uint32_t m = 0, phase = 0; m < work->merge_count; ++m) {
        for (; phase < 2 && m >= work->phase_ends[phase]; ++phase) floor = highest;
        float cost = work->costs[m] > floor ? work->costs[m] : floor;
        for (int k = 0; k < 2; ++k) {
            uint32_t child = work->children[m][k];
            if (child >= work->face_count && work->costs[child - work->face_count] > cost)
                cost = work->costs[child - work->face_count];
        }
        work->costs[m] = cost;
        if (cost > highest) highest = cost;
    }
}

/* ranks[m]: place of merge m by cost. */
static fct_result rank_merges(const fct_work *work, uint32_t *ranks, uint32_t *sorted) {
    uint64_t *keys = fct_allocate(work->env, work->merge_count, sizeof *keys);
    if (!keys) return fct_fail_memory(work->env, "ordering the tree");
    for (uint32_t m = 0, phase = 0; m < work->merge_count; ++m) {
        for (; phase < 2 && m >= work->phase_ends[phase]; ++phase) continue;
        keys[m] = (uint64_t)phase << 32 | fct_float_key(work->costs[m]);
        sorted[m] = m;
    }
    fct_result result = fct_sort_pairs(work->env, keys, sorted, work->merge_count);
    for (uint32_t i = 0; result == FCT_OK && i < work->merge_count; ++i) ranks[sorted[i]] = i;
    fct_release(work->env, keys);
    return result;
}

/* How many merges the tree keeps: down to root_count clusters, none above max_cost. */
static uint32_t kept_merges(const fct_work *work, const fct_tree_def *def, const uint32_t *sorted) {
    uint32_t roots = def->root_count > 1 ? def->root_count : 1;
    uint32_t kept = roots < work->face_count ? work->face_count - roots : 0;
    if (kept > work->merge_count) kept = work->merge_count;
    while (kept > 0 && (double)work->costs[sorted[kept - 1]] > def->max_cost) --kept;
    return kept;
}

/* Inner nodes with children as build ids for leaves, marked by first = FCT_NONE; counts. */
static void number_nodes(const fct_work *work, const uint32_t *ranks, uint32_t kept, fct_cluster *clusters) {
    for (uint32_t m = 0; m < work->merge_count; ++m) {
        if (ranks[m] >= kept) continue;
        fct_cluster *c = &clusters[kept - 1 - ranks[m]];
        memset(c, 0, sizeof *c);
        c->cost = work->costs[m];
        c->first = FCT_NONE;
        for (int k = 0; k < 2; ++k) {
            uint32_t child = work->children[m][k];
            bool leaf = child < work->face_count;
            uint32_t id = leaf ? child : kept - 1 - ranks[child - work->face_count];
            c->child[k] = leaf ? kept + child : id;
            c->count += leaf ? 1 : clusters[id].count;
        }
    }
}

/* Hands ranges from parents to children; leaves get the ids of their places. */
static void place_faces(fct_tree *tree, uint32_t kept) {
    fct_cluster *clusters = tree->clusters;
    uint32_t place = 0, roots = 0;
    for (uint32_t i = 0; i < kept; ++i) {
        fct_cluster *c = &clusters[i];
        if (c->first == FCT_NONE) {
            tree->roots[roots++] = i;
            c->first = place;
            place += c->count;
        }
        uint32_t first = c->first;
        for (int k = 0; k < 2; ++k) {
            uint32_t child = c->child[k];
            if (child < kept) {
                clusters[child].first = first;
                first += clusters[child].count;
            } else {
                tree->face_ids[first] = child - kept;
                c->child[k] = kept + first++;
            }
        }
    }
    tree->view.root_count = roots;
}

/* Faces that no inner node holds become roots. */
static void place_loose_faces(fct_tree *tree, const fct_work *work, const uint32_t *ranks, uint32_t kept,
                              uint8_t *held) {
    memset(held, 0, work->face_count);
    uint32_t place = 0;
    for (uint32_t m = 0; m < work->merge_count; ++m) {
        if (ranks[m] >= kept) continue;
        for (int k = 0; k < 2; ++k)
            if (work->children[m][k] < work->face_count) held[work->children[m][k]] = 1, ++place;
    }
    for (uint32_t f = 0; f < work->face_count; ++f) {
        if (held[f]) continue;
        tree->roots[tree->view.root_count++] = kept + place;
        tree->face_ids[place++] = f;
    }
}

/* Triangles by place and vertices in order of first use. */
static fct_result copy_mesh(const fct_env *env, const fct_mesh *mesh, fct_tree *tree) {
    uint32_t *renamed = fct_allocate(env, mesh->vertex_count, sizeof *renamed);
    if (!renamed) return fct_fail_memory(env, "ordering the tree");
    memset(renamed, 0xFF, (size_t)mesh->vertex_count * sizeof *renamed);
    uint32_t used = 0;
    for (size_t i = 0; i < 3 * (size_t)mesh->face_count; ++i) {
        uint32_t v = mesh->triangles[3 * (size_t)tree->face_ids[i / 3] + i % 3];
        if (renamed[v] == FCT_NONE) renamed[v] = used, tree->vertex_ids[used++] = v;
        tree->triangles[i] = renamed[v];
    }
    for (uint32_t v = 0; v < mesh->vertex_count; ++v)
        if (renamed[v] == FCT_NONE) tree->vertex_ids[used++] = v;
    fct_release(env, renamed);
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        size_t from = 3 * (size_t)tree->vertex_ids[v];
        memcpy(tree->positions + 3 * v, mesh->positions + from, 3 * sizeof(float));
        if (tree->colors) memcpy(tree->colors + 3 * v, mesh->colors + from, 3 * sizeof(float));
    }
    for (size_t f = 0; tree->materials && f < mesh->face_count; ++f)
        tree->materials[f] = mesh->materials[tree->face_ids[f]];
    return FCT_OK;
}

static fct_result copy_names(const fct_env *env, const fct_mesh *mesh, fct_tree *tree) {
    tree->view.material_count = mesh->material_count;
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
    tree->clusters = fct_allocate(env, kept, sizeof *tree->clusters);
    tree->roots = fct_allocate(env, faces - kept, sizeof *tree->roots);
    tree->face_ids = fct_allocate(env, faces, sizeof *tree->face_ids);
    tree->vertex_ids = fct_allocate(env, vertices, sizeof *tree->vertex_ids);
    tree->triangles = fct_allocate(env, faces, 3 * sizeof *tree->triangles);
    tree->positions = fct_allocate(env, vertices, 3 * sizeof *tree->positions);
    if (mesh->colors) tree->colors = fct_allocate(env, vertices, 3 * sizeof *tree->colors);
    if (mesh->materials) tree->materials = fct_allocate(env, faces, sizeof *tree->materials);
    if (!tree->clusters || !tree->roots || !tree->face_ids || !tree->vertex_ids || !tree->triangles ||
        !tree->positions || (mesh->colors && !tree->colors) || (mesh->materials && !tree->materials))
        return fct_fail_memory(env, "the tree");
    fct_tree_view *view = &tree->view;
    view->face_count = faces, view->vertex_count = vertices, view->node_count = kept;
    view->clusters = tree->clusters, view->roots = tree->roots, view->face_ids = tree->face_ids;
    view->vertex_ids = tree->vertex_ids, view->triangles = tree->triangles;
    view->positions = tree->positions, view->colors = tree->colors, view->materials = tree->materials;
    return FCT_OK;
}

fct_result fct_tree_order(fct_work *work, const fct_mesh *mesh, const fct_tree_def *def, fct_tree *tree) {
    const fct_env *env = work->env;
    uint32_t *ranks = fct_allocate(env, work->merge_count, sizeof *ranks);
    uint32_t *sorted = fct_allocate(env, work->merge_count, sizeof *sorted);
    uint8_t *held = fct_allocate(env, work->face_count, 1);
    fct_result result = FCT_OK;
    if (!ranks || !sorted || !held) {
        result = fct_fail_memory(env, "ordering the tree");
        goto done;
    }
    make_monotone(work);
    result = rank_merges(work, ranks, sorted);
    if (result != FCT_OK) goto done;
    uint32_t kept = kept_merges(work, def, sorted);
    fct_release(env, work->records); /* the largest arrays go before the tree's come */
    fct_release(env, work->directions);
    fct_release(env, work->edges);
    work->records = NULL, work->directions = NULL, work->edges = NULL;
    result = allocate_arrays(env, mesh, kept, tree);
    if (result != FCT_OK) goto done;
    number_nodes(work, ranks, kept, tree->clusters);
    place_faces(tree, kept);
    place_loose_faces(tree, work, ranks, kept, held);
    result = copy_mesh(env, mesh, tree);
    if (result == FCT_OK) result = copy_names(env, mesh, tree);
    if (result == FCT_OK) result = fct_tree_measure_depth(tree);
done:
    fct_release(env, ranks);
    fct_release(env, sorted);
    fct_release(env, held);
    return result;
}
