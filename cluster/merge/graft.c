/* cluster/merge/graft.c: puts clusters that are too tall to merge into the trees of their neighbours.
 *
 * Where the height limit leaves adjacent clusters unmerged, the smaller one becomes the sibling of a node
 * inside its neighbour: of the highest node that holds an adjacent face and has height to spare. Every node
 * on the path stays connected, so partitions do too. No record changes inside the tree; the cost of the new
 * merge is held between those of the nodes above and below. Clusters without a place are left to join.c.
 * Merges are renumbered afterwards, children first. O(F), and up to MOST_PATHS paths per cluster.
 * Caterpillars of the cost MEAN, hubs and graded strips come here, other meshes hardly ever.
 */
#include "cluster/merge/graft.h"

#include <string.h>

#include "base/parallel.h"
#include "base/sort.h"
#include "facetree/dual.h"

enum { MOST_PATHS = 256, MOST_HEIGHT = 128 };

typedef struct grafter {
    fct_work *work;
    uint32_t *parents;            /* per build id; FCT_NONE above roots */
    uint32_t *slots;              /* per build id of a root */
    uint8_t *heights;             /* per build id */
    uint32_t *starts, *neighbors; /* per face: its neighbours are starts[f] to starts[f + 1] - 1 */
    uint32_t *stack;
} grafter;

/* A place for a cluster: beside `node`, which is `depth` below `root`. */
typedef struct place {
    uint32_t node, root, depth;
} place;

static void link_nodes(grafter *g) {
    fct_work *work = g->work;
    uint32_t faces = work->face_count;
    memset(g->heights, 0, faces);
    for (uint32_t m = 0; m < work->merge_count; ++m) {
        const uint32_t *child = work->children[m];
        uint8_t left = g->heights[child[0]], right = g->heights[child[1]];
        g->heights[faces + m] = (uint8_t)((left > right ? left : right) + 1);
        g->parents[child[0]] = g->parents[child[1]] = faces + m;
    }
    for (uint32_t s = 0; s < faces; ++s)
        if (work->nodes[s] != FCT_NONE) {
            g->parents[work->nodes[s]] = FCT_NONE;
            g->slots[work->nodes[s]] = s;
        }
}

static fct_result link_faces(grafter *g, const fct_mesh *mesh) {
    const fct_env *env = g->work->env;
    fct_dual dual;
    fct_result result = fct_dual_build(env, mesh, &dual);
    if (result != FCT_OK) return result;
    uint32_t faces = mesh->face_count;
    g->neighbors = fct_allocate(env, dual.edge_count, 2 * sizeof *g->neighbors);
    if (g->neighbors) {
        memset(g->starts, 0, ((size_t)faces + 2) * sizeof *g->starts);
        for (size_t i = 0; i < 2 * (size_t)dual.edge_count; ++i) ++g->starts[dual.edges[i] + 2];
        for (uint32_t f = 0; f < faces; ++f) g->starts[f + 2] += g->starts[f + 1];
        for (size_t i = 0; i < 2 * (size_t)dual.edge_count; ++i)
            g->neighbors[g->starts[dual.edges[i] + 1]++] = dual.edges[i ^ 1];
    } else {
        result = fct_fail_memory(env, "clustering");
    }
    fct_dual_release(env, &dual);
    return result;
}

/* Searches the path from a face to its root for the highest node that the cluster of `slot` fits beside.
 * Returns false if the face is in that cluster. */
static bool look_up(const grafter *g, uint32_t face, uint32_t root, uint32_t slot, place *best) {
    uint32_t path[MOST_HEIGHT], length = 0;
    for (uint32_t node = face; node != FCT_NONE; node = g->parents[node]) path[length++] = node;
    uint32_t top = path[length - 1];
    if (top == root) return false;
    const fct_work *work = g->work;
    uint32_t limit = fct_height_limit(work->records[slot].count + work->records[g->slots[top]].count, false);
    uint32_t own = g->heights[root];
    for (uint32_t depth = 0; depth < length && depth < best->depth; ++depth) {
        uint32_t node = path[length - 1 - depth], height = g->heights[node];
        if (depth + 1 + (height > own ? height : own) > limit) continue;
        *best = (place){node, top, depth};
        break;
    }
    return true;
}

static place find_place(const grafter *g, uint32_t slot) {
    uint32_t faces = g->work->face_count, root = g->work->nodes[slot], top = 0, paths = 0;
    place best = {FCT_NONE, FCT_NONE, UINT32_MAX};
    g->stack[top++] = root;
    while (top > 0 && paths < MOST_PATHS) {
        uint32_t node = g->stack[--top];
        if (node >= faces) {
            g->stack[top++] = g->work->children[node - faces][1];
            g->stack[top++] = g->work->children[node - faces][0];
            continue;
        }
        for (uint32_t i = g->starts[node]; i < g->starts[node + 1]; ++i)
            paths += look_up(g, g->neighbors[i], root, slot, &best);
    }
    return best;
}

static float cost_of(const fct_work *work, uint32_t node, float other) {
    return node == FCT_NONE || node < work->face_count ? other : work->costs[node - work->face_count];
}

static void graft_cluster(grafter *g, uint32_t slot, place at) {
    fct_work *work = g->work;
    uint32_t root = work->nodes[slot], host = g->slots[at.root], above = g->parents[at.node];
    uint32_t merge = work->merge_count, node = work->face_count + merge;
    float cost = fct_work_cost(work, host, slot, 0);
    float low = cost_of(work, at.node, cost), high = cost_of(work, above, cost);
    cost = cost < low ? low : cost > high ? high : cost;
    fct_work_merge(work, host, slot, 0, cost);
    work->children[merge][0] = at.node;
    work->children[merge][1] = root;
    g->parents[at.node] = g->parents[root] = node;
    g->parents[node] = above;
    if (above == FCT_NONE) {
        g->slots[node] = host;
    } else {
        uint32_t *child = work->children[above - work->face_count];
        child[child[1] == at.node] = node;
        work->nodes[host] = at.root;
    }
    for (uint32_t up = node; up != FCT_NONE; up = g->parents[up]) {
        const uint32_t *child = work->children[up - work->face_count];
        uint8_t left = g->heights[child[0]], right = g->heights[child[1]];
        g->heights[up] = (uint8_t)((left > right ? left : right) + 1);
    }
    work->heights[host] = g->heights[work->nodes[host]];
}

/* Renumbers merges so that children come before parents: the reverse of a preorder. */
static fct_result renumber(grafter *g) {
    fct_work *work = g->work;
    const fct_env *env = work->env;
    uint32_t faces = work->face_count, count = work->merge_count, next = count, top = 0;
    uint32_t(*children)[2];
    float *costs;
    const fct_array arrays[] = {FCT_ARRAY(children, faces), FCT_ARRAY(costs, faces)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "clustering");
    if (result != FCT_OK) return result;
    uint32_t *numbers = g->parents; /* of merges: the new number, by the old */
    for (uint32_t s = 0; s < faces; ++s) {
        if (work->nodes[s] == FCT_NONE || work->nodes[s] < faces) continue;
        g->stack[top++] = work->nodes[s] - faces;
        while (top > 0) {
            uint32_t merge = g->stack[--top];
            numbers[merge] = --next;
            for (int k = 0; k < 2; ++k)
                if (work->children[merge][k] >= faces) g->stack[top++] = work->children[merge][k] - faces;
        }
        work->nodes[s] = faces + numbers[work->nodes[s] - faces];
    }
    for (uint32_t m = 0; m < count; ++m) {
        costs[numbers[m]] = work->costs[m];
        for (int k = 0; k < 2; ++k) {
            uint32_t child = work->children[m][k];
            children[numbers[m]][k] = child < faces ? child : faces + numbers[child - faces];
        }
    }
    fct_release(env, work->children);
    fct_release(env, work->costs);
    work->children = children, work->costs = costs;
    return FCT_OK;
}

/* Whether the cluster has an adjacent face outside. A finished part of the mesh has none. */
static bool has_neighbors(const grafter *g, uint32_t slot) {
    place none = {FCT_NONE, FCT_NONE, 0};
    uint32_t faces = g->work->face_count, top = 0;
    g->stack[top++] = g->work->nodes[slot];
    while (top > 0) {
        uint32_t node = g->stack[--top];
        if (node >= faces) {
            g->stack[top++] = g->work->children[node - faces][1];
            g->stack[top++] = g->work->children[node - faces][0];
            continue;
        }
        for (uint32_t i = g->starts[node]; i < g->starts[node + 1]; ++i)
            if (look_up(g, g->neighbors[i], g->work->nodes[slot], slot, &none)) return true;
    }
    return false;
}

static fct_result graft_all(grafter *g, const fct_mesh *mesh, uint64_t *keys, uint32_t *order) {
    fct_work *work = g->work;
    uint32_t count = 0;
    link_nodes(g);
    fct_result result = link_faces(g, mesh);
    if (result != FCT_OK) return result;
    for (uint32_t s = 0; s < work->face_count; ++s)
        if (work->nodes[s] != FCT_NONE) keys[count] = work->records[s].count, order[count++] = s;
    result = fct_sort_pairs(work->env, keys, order, count);
    /* repeat while it helps: a host that has grown may be taller */
    for (uint32_t before = 0; result == FCT_OK && count != before;) {
        before = count;
        count = 0;
        for (uint32_t i = 0; result == FCT_OK && i < before; ++i) {
            if (i % 1024 == 0) result = fct_progress(work->env, "clusters", 1);
            place at = find_place(g, order[i]);
            if (at.node != FCT_NONE)
                graft_cluster(g, order[i], at);
            else
                order[count++] = order[i];
        }
    }
    for (uint32_t i = 0; result == FCT_OK && i < count; ++i) work->stranded += has_neighbors(g, order[i]);
    return result == FCT_OK ? renumber(g) : result;
}

fct_result fct_work_graft(fct_work *work, const fct_mesh *mesh) {
    /* a graft could put a merge across materials below one within a material */
    if (work->edge_count == 0 || work->materials) return FCT_OK;
    const fct_env *env = work->env;
    size_t faces = work->face_count, live = faces - work->merge_count;
    grafter g = {.work = work};
    uint64_t *keys;
    uint32_t *order;
    const fct_array arrays[] = {FCT_ARRAY(g.parents, 2 * faces), FCT_ARRAY(g.slots, 2 * faces),
                                FCT_ARRAY(g.heights, 2 * faces), FCT_ARRAY(g.starts, faces + 2),
                                FCT_ARRAY(g.stack, faces),       FCT_ARRAY(keys, live),
                                FCT_ARRAY(order, live)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "clustering");
    if (result == FCT_OK) result = graft_all(&g, mesh, keys, order);
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    fct_release(env, g.neighbors);
    return result;
}
