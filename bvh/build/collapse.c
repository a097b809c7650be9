/* bvh/build/collapse.c: collapses the binary top to nodes of eight children at the least cost.
 *
 * Ylitie, Karras, Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017,
 * section 3.2. The cost is the sum of the areas of the nodes: proportional to the nodes that a random ray
 * visits. Leaves cost the same in every collapse, so they count 0. For each node n of the top, from the
 * leaves up:
 *
 *     C(n, i) = least cost of the subtree as at most i children of one wide node
 *     D(n, i) = min over k of C(left, k) + C(right, i - k), where 0 < k < i
 *     C(n, 1) = area + D(n, 8)                     n becomes a wide node
 *     C(n, i) = min(D(n, i), C(n, i - 1))          1 < i < 8
 *     C(leaf, i) = 0
 *
 * The choices then lead from the root down. O(leaves). Nodes are numbered depth first, so that a node lies
 * near its first child in memory.
 */
#include "bvh/build/collapse.h"

/* Choices of a node of the top. split[i - 1]: the left child takes this many of i places; 0: i - 1 places
 * cost no more. split[0] belongs to D(n, 8). */
typedef struct choice {
    float cost[7]; /* C(n, 1) to C(n, 7) */
    uint8_t split[7];
} choice;

/* D(n, places), and its k. */
static float split_places(const choice *left, const choice *right, uint32_t places, uint8_t *k) {
    float best = INFINITY;
    for (uint32_t i = 1; i < places; ++i) {
        float cost = left->cost[i - 1] + right->cost[places - i - 1];
        if (cost < best) best = cost, *k = (uint8_t)i;
    }
    return best;
}

static void choose_splits(const fct_top *top, choice *choices) {
    for (uint32_t n = top->node_count; n-- > 0;) {
        const fct_top_node *node = &top->nodes[n];
        choice *c = &choices[n];
        *c = (choice){{0}, {0}};
        if (node->left == FCT_NONE) continue;
        const choice *left = &choices[node->left], *right = &choices[node->right];
        c->cost[0] = node->area + split_places(left, right, 8, &c->split[0]);
        for (uint32_t i = 2; i < 8; ++i) {
            uint8_t k = 1;
            float cost = split_places(left, right, i, &k);
            bool better = cost < c->cost[i - 2];
            c->cost[i - 1] = better ? cost : c->cost[i - 2];
            c->split[i - 1] = better ? k : 0;
        }
    }
}

/* Lists the children of the wide node that node `from` of the top becomes, from left to right. */
static void open_children(const fct_top *top, const choice *choices, uint32_t from, fct_wide_node *wide) {
    struct {
        uint32_t node, places;
    } stack[8];
    uint32_t height = 2, first = choices[from].split[0];
    stack[0].node = top->nodes[from].right, stack[0].places = 8 - first;
    stack[1].node = top->nodes[from].left, stack[1].places = first;
    while (height) {
        uint32_t node = stack[--height].node, places = stack[height].places;
        const choice *c = &choices[node];
        while (places > 1 && c->split[places - 1] == 0) --places;
        if (places == 1) {
            wide->top[wide->count++] = node;
            continue;
        }
        uint32_t k = c->split[places - 1];
        stack[height].node = top->nodes[node].right, stack[height++].places = places - k;
        stack[height].node = top->nodes[node].left, stack[height++].places = k;
    }
}

fct_result fct_collapse(const fct_env *env, const fct_top *top, fct_wide_node *nodes, uint32_t *count) {
    uint32_t stack[3 * (8 * FCT_TOP_DEPTH + 1)], height = 0;
    choice *choices = fct_allocate(env, top->node_count, sizeof *choices);
    if (!choices) return fct_fail_memory(env, "the nodes of a ray structure");
    choose_splits(top, choices);
    *count = 0;
    stack[height++] = 0, stack[height++] = FCT_NONE, stack[height++] = 0;
    while (height) {
        uint32_t slot = stack[--height], parent = stack[--height], from = stack[--height];
        uint32_t number = (*count)++;
        fct_wide_node *wide = &nodes[number];
        *wide = (fct_wide_node){.parent = parent, .slot = slot};
        open_children(top, choices, from, wide);
        for (uint32_t i = wide->count; i-- > 0;) {
            if (top->nodes[wide->top[i]].left == FCT_NONE) continue;
            stack[height++] = wide->top[i], stack[height++] = number, stack[height++] = i;
        }
    }
    fct_release(env, choices);
    return FCT_OK;
}
