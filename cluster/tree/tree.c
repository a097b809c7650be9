/* cluster/tree/tree.c: life of a tree, its bounds, and the mesh in the order of the input. */
#include "cluster/tree/tree.h"

#include <math.h>
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
    fct_release(env, tree->links);
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
    fct_release(env, tree->path);
    fct_file_close(env, &tree->file);
    fct_release(env, tree);
}

fct_tree_view fct_tree_get(const fct_tree *tree) {
    return tree->view;
}

void fct_tree_measure_bounds(fct_tree *tree) {
    fct_tree_view *view = &tree->view;
    fct_bounds b = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    for (size_t v = 0; v < view->vertex_count; ++v)
        for (int k = 0; k < 3; ++k) {
            float x = view->positions[3 * v + k];
            if (x < b.lower[k]) b.lower[k] = x;
            if (x > b.upper[k]) b.upper[k] = x;
        }
    view->bounds = b;
}

/* A sum below this share of its terms is 0. */
#define ROUNDING 1e-9

void fct_enclosed_add(fct_enclosed *sum, const fct_tree_view *view, v3 origin) {
    for (size_t f = 0; f < view->face_count; ++f) {
        v3 p[3];
        for (size_t k = 0; k < 3; ++k)
            p[k] = v3_sub(v3_load(view->positions + 3 * (size_t)view->triangles[3 * f + k]), origin);
        double term = v3_dot(p[0], v3_cross(p[1], p[2]));
        v3 cross = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
        sum->volume += term, sum->magnitude += fabs(term);
        sum->vector = v3_add(sum->vector, cross), sum->area += v3_norm(cross);
    }
}

bool fct_enclosed_is_inward(const fct_enclosed *sum, const fct_tree_view *view) {
    bool closed = view->boundary_edges == 0 && view->nonmanifold_edges == 0;
    bool alike = v3_norm(sum->vector) <= ROUNDING * sum->area;
    return closed && alike && sum->volume < -ROUNDING * sum->magnitude;
}

bool fct_tree_is_inward(const fct_tree_view *view) {
    fct_enclosed sum = {0};
    if (view->boundary_edges || view->nonmanifold_edges) return false;
    fct_enclosed_add(&sum, view, v3_load(view->bounds.lower));
    return fct_enclosed_is_inward(&sum, view);
}

fct_result fct_tree_mesh(const fct_env *env, const fct_tree *tree, fct_mesh *out) {
    const fct_tree_view *view = &tree->view;
    unsigned arrays = (view->colors ? FCT_MESH_COLORS : 0u) | (view->materials ? FCT_MESH_MATERIALS : 0u);
    *out = (fct_mesh){0};
    fct_result result = fct_tree_check(env, tree);
    if (result != FCT_OK) return result;
    result = fct_mesh_create(env, view->vertex_count, view->face_count, arrays, out);
    if (result != FCT_OK) return result;
    memcpy(out->origin, view->origin, sizeof out->origin);
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
