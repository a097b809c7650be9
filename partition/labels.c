/* partition/labels.c: see labels.h. */
#include "partition/labels.h"

#include "cluster/tree/node.h"
#include "facetree/partition.h"

fct_result fct_labels_check(const fct_env *env, const fct_mesh *mesh, const uint32_t *labels,
                            uint32_t count) {
    fct_result result = fct_mesh_validate(env, mesh);
    for (uint32_t f = 0; result == FCT_OK && f < mesh->face_count; ++f)
        if (labels[f] >= count)
            result = fct_fail(env, FCT_ERROR_DATA, "face %u: label %u is out of range, of %u clusters", f,
                              labels[f], count);
    return result;
}

fct_result fct_tree_labels(const fct_env *env, const fct_tree *tree, const uint32_t *nodes, uint32_t count,
                           uint32_t *labels) {
    fct_result result = fct_tree_check(env, tree);
    if (result != FCT_OK) return result;
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t first = fct_node_first(tree, nodes[i]), end = first + fct_node_faces(tree, nodes[i]);
        for (uint32_t place = first; place < end; ++place) labels[tree->view.face_ids[place]] = i;
    }
    return FCT_OK;
}
