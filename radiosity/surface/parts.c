/* radiosity/surface/parts.c: see parts.h. */
#include "radiosity/surface/parts.h"

#include "base/env.h"
#include "base/union_find.h"
#include "cluster/tree/node.h"
#include "radiosity/surface/split.h"

/* Joins the vertices of each face, and vertices of equal position. */
static fct_result join_vertices(const fct_env *env, const fct_tree_view *view, uint32_t *sets) {
    fct_result result = fct_weld(env, view->vertex_count, view->positions, sets);
    if (result != FCT_OK) return result;
    for (size_t place = 0; place < view->face_count; ++place) {
        const uint32_t *t = view->triangles + 3 * place;
        fct_sets_join(sets, t[0], t[1]);
        fct_sets_join(sets, t[0], t[2]);
    }
    return FCT_OK;
}

fct_result fct_parts_create(const fct_env *env, const fct_tree *tree, fct_parts *out) {
    const fct_tree_view view = fct_tree_get(tree);
    *out = (fct_parts){0};
    if (view.component_count < 2) return FCT_OK;
    uint32_t *sets;
    const fct_array scratch[] = {FCT_ARRAY(sets, view.vertex_count)};
    const fct_array kept[] = {FCT_ARRAY(out->faces, view.face_count),
                              FCT_ARRAY(out->nodes, (size_t)view.node_count + view.face_count)};
    fct_result result = fct_allocate_all(env, scratch, FCT_LENGTH(scratch), "the parts of a model");
    if (result != FCT_OK) return result;
    result = fct_allocate_all(env, kept, FCT_LENGTH(kept), "the parts of a model");
    if (result == FCT_OK) result = join_vertices(env, &view, sets);
    for (size_t place = 0; place < view.face_count && result == FCT_OK; ++place) {
        const uint32_t part = fct_sets_find(sets, view.triangles[3 * place]);
        out->faces[view.face_ids[place]] = out->nodes[view.node_count + place] = part;
    }
    /* Children have larger ids. */
    for (uint32_t node = view.node_count; node-- > 0 && result == FCT_OK;) {
        const uint32_t a = out->nodes[fct_node_child(tree, node, 0)],
                       b = out->nodes[fct_node_child(tree, node, 1)];
        out->nodes[node] = a == b ? a : FCT_NONE;
    }
    fct_release(env, sets);
    if (result != FCT_OK) fct_parts_release(env, out);
    return result;
}

void fct_parts_release(const fct_env *env, fct_parts *parts) {
    fct_release(env, parts->faces);
    fct_release(env, parts->nodes);
    *parts = (fct_parts){0};
}
