/* cluster/tree.c: reading a tree: views, single clusters, partitions, labels, the mesh in its own order. */
#include "cluster/tree.h"

#include <string.h>

fct_tree *fct_tree_new(const fct_env *env) {
    fct_tree *tree = fct_allocate_zero(env, 1, sizeof *tree);
    if (tree) {
        tree->env = env;
        tree->view.source = "";
    }
    return tree;
}

void fct_tree_destroy(fct_tree *tree) {
    if (!tree) return;
    const fct_env *env = tree->env;
    fct_release(env, tree->clusters);
    fct_node_links_release(env, &tree->links);
    fct_release(env, tree->roots);
    fct_release(env, tree->face_ids);
    fct_release(env, tree->vertex_ids);
    fct_release(env, tree->triangles);
    fct_release(env, tree->materials);
    fct_release(env, tree->positions);
    fct_release(env, tree->colors);
    bool own_names = tree->names && !tree->file.data;
    for (uint32_t i = 0; own_names && i < tree->view.material_count; ++i) fct_release(env, tree->names[i]);
    fct_release(env, tree->names);
    fct_release(env, tree->source);
    fct_file_close(env, &tree->file);
    fct_release(env, tree);
}

fct_tree_view fct_tree_get(const fct_tree *tree) {
    return tree->view;
}

fct_result fct_tree_measure_depth(fct_tree *tree) {
    fct_tree_view *view = &tree->view;
    view->depth = 0, view->mean_depth = 0;
    uint8_t *depths = fct_allocate_zero(tree->env, view->node_count, 1);
    if (!depths) return fct_fail_memory(tree->env, "the tree");
    uint64_t total = 0;
    for (uint32_t i = 0; i < view->node_count; ++i)
        for (int k = 0; k < 2; ++k) {
            uint32_t child = view->clusters[i].child[k], depth = depths[i] + 1u;
            if (child < view->node_count) {
                depths[child] = (uint8_t)(depth < 255 ? depth : 255);
            } else {
                total += depth;
                if (depth > view->depth) view->depth = depth;
            }
        }
    fct_release(tree->env, depths);
    view->mean_depth = (double)total / view->face_count;
    return FCT_OK;
}

void fct_tree_cluster(const fct_tree *tree, uint32_t node, fct_cluster *out) {
    const fct_tree_view *view = &tree->view;
    if (node < view->node_count) {
        *out = view->clusters[node];
        return;
    }
    uint32_t place = node - view->node_count;
    memset(out, 0, sizeof *out);
    fct_cluster_describe_face(view, place, out);
    out->child[0] = out->child[1] = FCT_NONE;
}

fct_result fct_tree_mesh(const fct_env *env, const fct_tree *tree, fct_mesh *out) {
    const fct_tree_view *view = &tree->view;
    unsigned arrays = (view->colors ? FCT_MESH_COLORS : 0u) | (view->materials ? FCT_MESH_MATERIALS : 0u);
    fct_result result = fct_mesh_create(env, view->vertex_count, view->face_count, arrays, out);
    if (result != FCT_OK) return result;
    for (size_t v = 0; v < view->vertex_count; ++v) {
        size_t to = 3 * (size_t)view->vertex_ids[v];
        memcpy(out->positions + to, view->positions + 3 * v, 3 * sizeof(float));
        if (out->colors) memcpy(out->colors + to, view->colors + 3 * v, 3 * sizeof(float));
    }
    for (size_t f = 0; f < view->face_count; ++f) {
        for (size_t k = 0; k < 3; ++k)
            out->triangles[3 * (size_t)view->face_ids[f] + k] = view->vertex_ids[view->triangles[3 * f + k]];
        if (out->materials) out->materials[view->face_ids[f]] = view->materials[f];
    }
    if (!view->material_names) {
        out->material_count = view->material_count;
        return FCT_OK;
    }
    out->material_names = fct_allocate_zero(env, view->material_count, sizeof *out->material_names);
    if (out->material_names) out->material_count = view->material_count;
    bool complete = out->material_names != NULL;
    for (uint32_t i = 0; i < out->material_count; ++i) {
        size_t size = strlen(view->material_names[i]) + 1;
        out->material_names[i] = fct_allocate(env, size, 1);
        if (out->material_names[i])
            memcpy(out->material_names[i], view->material_names[i], size);
        else
            complete = false;
    }
    if (complete) return FCT_OK;
    fct_mesh_release(env, out);
    return fct_fail_memory(env, "material names");
}

uint32_t fct_tree_partition(const fct_tree *tree, uint32_t count, uint32_t *nodes) {
    const fct_tree_view *view = &tree->view;
    if (count < view->root_count) count = view->root_count;
    if (count > view->face_count) count = view->face_count;
    uint32_t opened = count - view->root_count; /* nodes below this id are opened */
    /* What is written and what is still to be visited are disjoint clusters of the partition's size at most:
     * the stack grows from the far end of the same array. */
    uint32_t written = 0, top = count;
    for (uint32_t r = view->root_count; r-- > 0;) nodes[--top] = view->roots[r];
    while (top < count) {
        uint32_t node = nodes[top++];
        if (node >= opened) {
            nodes[written++] = node;
        } else {
            nodes[--top] = view->clusters[node].child[1];
            nodes[--top] = view->clusters[node].child[0];
        }
    }
    return written;
}

uint32_t fct_tree_count_at_cost(const fct_tree *tree, double max_cost) {
    const fct_tree_view *view = &tree->view;
    uint32_t low = 0, high = view->node_count; /* nodes from `low` on are done */
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if ((double)view->clusters[middle].cost <= max_cost)
            high = middle;
        else
            low = middle + 1;
    }
    return view->root_count + low;
}

void fct_tree_labels(const fct_tree *tree, const uint32_t *nodes, uint32_t count, uint32_t *labels) {
    const fct_tree_view *view = &tree->view;
    for (uint32_t i = 0; i < count; ++i) {
        bool leaf = nodes[i] >= view->node_count;
        uint32_t first = leaf ? nodes[i] - view->node_count : view->clusters[nodes[i]].first;
        uint32_t faces = leaf ? 1 : view->clusters[nodes[i]].count;
        for (uint32_t place = first; place < first + faces; ++place) labels[view->face_ids[place]] = i;
    }
}
