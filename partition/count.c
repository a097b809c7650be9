/* partition/count.c: partitions by count and by cost.
 *
 * Node ids fall with the order of merges, and a child has a larger id than its parent. Therefore the
 * partition into K clusters opens exactly the nodes below id K - R. O(K); reads no other nodes than those of
 * the partition and those that it opens.
 */
#include "cluster/tree/node.h"
#include "cluster/tree/walk.h"
#include "facetree/partition.h"

/* Opens all nodes below id `count` - root_count, depth first. Written ids fill `nodes` from the front and the
 * stack of unvisited nodes fills it from the end. Both together are disjoint clusters, so they never exceed
 * the size of the partition:
 *
 *     nodes:  | written -> |  free  | <- stack |
 *             0         *written   top       count
 */
static fct_result open_nodes(const fct_env *env, const fct_tree *tree, uint32_t count, uint32_t *nodes,
                             uint32_t *written) {
    const fct_tree_view *view = &tree->view;
    uint32_t opened = count - view->root_count, top = count;
    for (uint32_t r = view->root_count; r-- > 0;) nodes[--top] = view->roots[r];
    while (top < count) {
        uint32_t node = nodes[top++], child[2];
        if (node >= opened) {
            nodes[(*written)++] = node;
            continue;
        }
        fct_result result = fct_tree_open_node(env, tree, node, child);
        if (result != FCT_OK) return result;
        nodes[--top] = child[1];
        nodes[--top] = child[0];
    }
    if (*written == count) return FCT_OK;
    return fct_fail(env, FCT_ERROR_DATA, "%s: the partition into %u clusters has %u", tree->path, count,
                    *written);
}

fct_result fct_tree_partition(const fct_env *env, const fct_tree *tree, uint32_t count, uint32_t *nodes,
                              uint32_t *written) {
    const fct_tree_view *view = &tree->view;
    *written = 0;
    if (count < view->root_count) count = view->root_count;
    if (count > view->face_count) count = view->face_count;
    fct_result result = fct_tree_check_roots(env, tree);
    if (result == FCT_OK) result = open_nodes(env, tree, count, nodes, written);
    if (result != FCT_OK) *written = 0;
    return result;
}

uint32_t fct_tree_count_at_cost(const fct_tree *tree, double max_cost) {
    uint32_t low = 0,
             high = tree->view.node_count; /* the merges of nodes from `low` on cost at most max_cost */
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (fct_node_cost(tree, middle) <= max_cost)
            high = middle;
        else
            low = middle + 1;
    }
    return tree->view.root_count + low;
}
