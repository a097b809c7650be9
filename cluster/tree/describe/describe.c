/* cluster/tree/describe/describe.c: area, moment, cone, plane and box of every inner node.
 *
 * 1. outline.c splits the tree into blocks (subtrees of at most FCT_BLOCK faces) and the clusters above them.
 * 2. block.c describes each block as one task, eight clusters at a time. O(F log FCT_BLOCK).
 * 3. upper.c describes the clusters above, which need not read most of their faces. O(F) per level at worst.
 *
 * Degenerate results: where S is 0, the cone is pi and the sign of the plane is that of the eigenvector.
 * Areas above the range of a float become FLT_MAX, and S and M scale with them; areas below it become 0, with
 * a cone of pi. Boxes, planes and centroids depend on neither.
 */
#include "cluster/tree/describe/describe.h"

#include "base/parallel.h"
#include "cluster/tree/describe/block.h"
#include "cluster/tree/describe/upper.h"

typedef struct describer {
    fct_tree *tree;
    fct_outline outline;
    fct_block_scratch *scratch; /* per thread */
} describer;

static void describe_blocks(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk;
    describer *d = user;
    for (size_t block = begin; block < end; ++block)
        fct_block_describe(d->tree, &d->outline, block, &d->scratch[thread]);
}

static fct_result describe_all(const fct_env *env, describer *d) {
    fct_tree *tree = d->tree;
    d->scratch = fct_allocate(env, fct_env_threads(env), sizeof *d->scratch);
    if (!tree->clusters) tree->clusters = fct_allocate(env, tree->view.node_count, sizeof *tree->clusters);
    tree->nodes = tree->clusters;
    if (!d->scratch || !tree->clusters) return fct_fail_memory(env, "boxes");
    fct_result result =
        fct_parallel_for_progress(env, "boxes", d->outline.block_count, 2, describe_blocks, d);
    return result == FCT_OK ? fct_tree_describe_upper(tree, &d->outline) : result;
}

fct_result fct_tree_describe(fct_tree *tree) {
    const fct_env *env = tree->env;
    describer d = {.tree = tree};
    fct_result result = fct_outline_create(env, tree, &d.outline);
    if (result == FCT_OK) result = describe_all(env, &d);
    fct_release(env, tree->links);
    tree->links = NULL;
    fct_outline_release(env, &d.outline);
    fct_release(env, d.scratch);
    return result;
}
