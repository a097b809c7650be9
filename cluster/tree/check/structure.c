/* cluster/tree/check/structure.c: checks that a tree can be walked safely.
 *
 * In a valid tree the children of each inner node have larger ids, their ranges are the two parts of its own,
 * and the roots partition the places. So a walk reaches each node exactly once: the ranges of
 * different subtrees are disjoint, and F leaves under R roots need all F - R inner nodes.
 * Each chunk records its first fault, and the fault of the first chunk is reported, so the message does not
 * depend on the threads. O(F).
 */
#include "cluster/tree/check/structure.h"

#include <math.h>
#include <string.h>

#include "base/parallel.h"

enum { GRAIN = 1 << 14 };

/* Compares exponents, because the compiler vectorises that and not isfinite. */
static bool all_finite(const void *floats, size_t count) {
    const uint32_t exponent = 0x7F800000;
    const uint32_t *bits = floats;
    uint32_t infinite = 0;
    for (size_t i = 0; i < count; ++i) infinite |= (bits[i] & exponent) == exponent;
    return infinite == 0;
}

const char *fct_tree_node_fault(const fct_tree_view *view, uint32_t node, const fct_cluster *c) {
    uint32_t nodes = view->node_count, faces = view->face_count;
    if (!all_finite(c, offsetof(fct_cluster, child) / sizeof(float))) return "a number that is not finite";
    if (node >= nodes)
        return c->first == node - nodes && c->count == 1 && c->child[0] == FCT_NONE && c->child[1] == FCT_NONE
                   ? NULL
                   : "a face that is not its own";
    if (c->count < 2 || c->count > faces || c->first > faces - c->count) return "range outside the faces";
    for (int k = 0; k < 2; ++k)
        if (c->child[k] <= node || c->child[k] >= nodes + faces) return "child out of order";
    return NULL;
}

const char *fct_tree_parts_fault(const fct_cluster *c, const uint32_t first[2], const uint32_t count[2]) {
    if (first[0] != c->first || count[0] >= c->count || first[1] != c->first + count[0] || count[1] == 0)
        return "child's range is not part of its own";
    return count[0] + count[1] == c->count && count[0] ? NULL : "children do not fill its range";
}

fct_result fct_tree_find_depth(const fct_env *env, const fct_tree *tree, uint32_t *depth, double *mean) {
    const fct_tree_view *view = &tree->view;
    *depth = 0, *mean = 0;
    uint8_t *depths = fct_allocate_zero(env, view->node_count, 1);
    if (!depths) return fct_fail_memory(env, "the tree");
    uint64_t total = 0;
    for (uint32_t i = 0; i < view->node_count; ++i)
        for (int k = 0; k < 2; ++k) {
            uint32_t child = tree->nodes[i].child[k], below = depths[i] + 1u;
            if (child < view->node_count) {
                depths[child] = (uint8_t)(below < 255 ? below : 255);
            } else {
                total += below;
                if (below > *depth) *depth = below;
            }
        }
    fct_release(env, depths);
    *mean = (double)total / view->face_count;
    return FCT_OK;
}

typedef struct fault {
    const char *what; /* NULL: none */
    uint32_t id;
} fault;

typedef struct checker {
    const fct_tree *tree;
    const fct_tree_view *view;
    fault *faults;
    uint32_t *seen; /* a bit per id */
} checker;

static bool is_finite(const float p[3]) {
    return isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2]);
}

static const char *find_node_fault(const fct_tree *tree, uint32_t i) {
    const fct_tree_view *view = &tree->view;
    const fct_cluster *c = &tree->nodes[i];
    const char *own = fct_tree_node_fault(view, i, c);
    if (own) return own;
    if (!(c->cost <= (i ? tree->nodes[i - 1].cost : INFINITY))) return "cost above that of a later merge";
    uint32_t first[2], count[2];
    for (int k = 0; k < 2; ++k) {
        bool leaf = c->child[k] >= view->node_count;
        first[k] = leaf ? c->child[k] - view->node_count : tree->nodes[c->child[k]].first;
        count[k] = leaf ? 1 : tree->nodes[c->child[k]].count;
    }
    return fct_tree_parts_fault(c, first, count);
}

/* Prefetches the children of a node, because they are scattered in memory. */
static void prefetch_children(const fct_tree *tree, size_t i) {
    if (i >= tree->view.node_count) return;
    for (int k = 0; k < 2; ++k) {
        uint32_t child = tree->nodes[i].child[k];
        if (child < tree->view.node_count) __builtin_prefetch(&tree->nodes[child].first);
    }
}

static void check_nodes(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    checker *check = user;
    for (size_t i = begin; i < end && !check->faults[chunk].what; ++i) {
        prefetch_children(check->tree, i + 16);
        check->faults[chunk] = (fault){find_node_fault(check->tree, (uint32_t)i), (uint32_t)i};
    }
}

static void check_triangles(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    checker *check = user;
    const fct_tree_view *view = check->view;
    for (size_t f = begin; f < end && !check->faults[chunk].what; ++f) {
        const uint32_t *t = view->triangles + 3 * f;
        if (t[0] >= view->vertex_count || t[1] >= view->vertex_count || t[2] >= view->vertex_count)
            check->faults[chunk] = (fault){"vertex out of range", (uint32_t)f};
        else if (view->materials && view->materials[f] >= view->material_count)
            check->faults[chunk] = (fault){"material out of range", (uint32_t)f};
    }
}

static void check_positions(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    checker *check = user;
    for (size_t v = begin; v < end && !check->faults[chunk].what; ++v)
        if (!is_finite(check->view->positions + 3 * v))
            check->faults[chunk] = (fault){"a position that is not finite", (uint32_t)v};
        else if (check->view->colors && !is_finite(check->view->colors + 3 * v))
            check->faults[chunk] = (fault){"a color that is not finite", (uint32_t)v};
}

static fct_result run_checks(const fct_env *env, const char *name, const char *kind, size_t count,
                             checker *check, fct_chunk_body *body) {
    size_t chunks = fct_chunk_count(count, GRAIN);
    memset(check->faults, 0, chunks * sizeof *check->faults);
    fct_parallel_for(env, count, GRAIN, body, check);
    for (size_t i = 0; i < chunks; ++i)
        if (check->faults[i].what)
            return fct_fail(env, FCT_ERROR_DATA, "%s: %s %u: %s", name, kind, check->faults[i].id,
                            check->faults[i].what);
    return FCT_OK;
}

static fct_result check_permutation(const fct_env *env, const char *name, const char *kind,
                                    const uint32_t *ids, uint32_t count, uint32_t *seen) {
    memset(seen, 0, ((size_t)count / 32 + 1) * sizeof *seen);
    for (uint32_t i = 0; i < count; ++i) {
        if (ids[i] >= count || seen[ids[i] / 32] >> ids[i] % 32 & 1)
            return fct_fail(env, FCT_ERROR_DATA, "%s: %s at place %u has the input id %u, which is %s", name,
                            kind, i, ids[i], ids[i] >= count ? "out of range" : "there twice");
        seen[ids[i] / 32] |= 1u << ids[i] % 32;
    }
    return FCT_OK;
}

static fct_result check_roots(const fct_env *env, const char *name, const fct_tree *tree) {
    const fct_tree_view *view = &tree->view;
    uint32_t place = 0;
    for (uint32_t r = 0; r < view->root_count; ++r) {
        uint32_t root = view->roots[r];
        if (root >= view->node_count + view->face_count || (r && root <= view->roots[r - 1]))
            return fct_fail(env, FCT_ERROR_DATA, "%s: root %u is out of order", name, r);
        bool leaf = root >= view->node_count;
        uint32_t first = leaf ? root - view->node_count : tree->nodes[root].first;
        if (first != place)
            return fct_fail(env, FCT_ERROR_DATA, "%s: root %u does not begin where the one before it ends",
                            name, r);
        place += leaf ? 1 : tree->nodes[root].count;
    }
    if (place == view->face_count) return FCT_OK;
    return fct_fail(env, FCT_ERROR_DATA, "%s: the roots hold %u of %u faces", name, place, view->face_count);
}

/* The cut must be the partition of its size, with the records of the nodes. */
static fct_result check_cut(const fct_env *env, const char *name, const fct_tree *tree) {
    const fct_tree_view *view = &tree->view;
    uint32_t opened = tree->cut_count - view->root_count;
    for (uint32_t i = 0; i < tree->cut_count; ++i) {
        uint32_t id = tree->cut_ids[i];
        const fct_cluster *c = &tree->cut[i];
        bool right =
            id >= opened && id < view->node_count + view->face_count && (i == 0 || id > tree->cut_ids[i - 1]);
        if (right && id < view->node_count) right = !memcmp(c, &tree->nodes[id], sizeof *c);
        if (!right || fct_tree_node_fault(view, id, c))
            return fct_fail(env, FCT_ERROR_DATA, "%s: entry %u of the cut is not that of its node", name, i);
    }
    return FCT_OK;
}

static fct_result check_depth(const fct_env *env, const char *name, const fct_tree *tree) {
    const fct_tree_view *view = &tree->view;
    uint32_t depth;
    double mean;
    fct_result result = fct_tree_find_depth(env, tree, &depth, &mean);
    if (result != FCT_OK) return result;
    if (view->face_count > 1 && depth > 3 * log2(view->face_count))
        return fct_fail(env, FCT_ERROR_DATA, "%s: the tree is %u deep, more than 3 log2 of its %u faces",
                        name, depth, view->face_count);
    if (depth != view->depth || !(fabs(mean - view->mean_depth) <= 1e-9 * mean))
        return fct_fail(env, FCT_ERROR_DATA,
                        "%s: the tree is %u deep, %g in the mean; its header says %u, %g", name, depth, mean,
                        view->depth, view->mean_depth);
    return FCT_OK;
}

static fct_result check_all(const fct_env *env, const char *name, const fct_tree *tree, checker *check) {
    const fct_tree_view *view = &tree->view;
    fct_result result = run_checks(env, name, "node", view->node_count, check, check_nodes);
    if (result == FCT_OK) result = check_roots(env, name, tree);
    if (result == FCT_OK) result = check_cut(env, name, tree);
    if (result == FCT_OK)
        result = run_checks(env, name, "face at place", view->face_count, check, check_triangles);
    if (result == FCT_OK)
        result = run_checks(env, name, "vertex", view->vertex_count, check, check_positions);
    if (result == FCT_OK)
        result = check_permutation(env, name, "the face", view->face_ids, view->face_count, check->seen);
    if (result == FCT_OK)
        result =
            check_permutation(env, name, "the vertex", view->vertex_ids, view->vertex_count, check->seen);
    return result == FCT_OK ? check_depth(env, name, tree) : result;
}

fct_result fct_tree_check_structure(const fct_env *env, const fct_tree *tree) {
    const fct_tree_view *view = &tree->view;
    size_t most = view->face_count > view->vertex_count ? view->face_count : view->vertex_count;
    checker check = {.tree = tree, .view = view};
    const fct_array arrays[] = {FCT_ARRAY(check.faults, fct_chunk_count(most, GRAIN)),
                                FCT_ARRAY(check.seen, most / 32 + 1)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "checking a hierarchy");
    if (result == FCT_OK) result = check_all(env, tree->path ? tree->path : "tree", tree, &check);
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    return result;
}

fct_result fct_tree_check(const fct_env *env, const fct_tree *tree) {
    if (!atomic_load_explicit(&tree->unchecked, memory_order_acquire)) return FCT_OK;
    fct_file_advise(&tree->file, 0, tree->file.size, FCT_FILE_WHOLE);
    fct_result result = fct_tree_check_structure(env, tree);
    fct_file_advise(&tree->file, 0, tree->file.size, FCT_FILE_USUAL);
    /* The cast is safe: fct_tree_new makes all trees, and none of them is a const object. */
    if (result == FCT_OK) atomic_store_explicit(&((fct_tree *)tree)->unchecked, false, memory_order_release);
    return result;
}
