/* cluster/tree/describe/outline.c: see outline.h. O(F). */
#include "cluster/tree/describe/outline.h"

#include "base/parallel.h"

/* A node to visit, and where its index goes in the record of its parent. */
typedef struct visit {
    uint32_t node, parent, side;
} visit;

static void link_part(fct_outline *o, uint32_t parent, uint32_t side, uint32_t part) {
    if (parent != FCT_NONE && o->upper) o->upper[parent].parts[side] = part;
}

/* Walks from the roots to the blocks. Only counts while the lists are NULL. The stack cannot overflow,
 * because the depth is at most 3 log2 F < 96. */
static void walk_outline(const fct_tree *tree, fct_outline *o) {
    const fct_tree_view *view = &tree->view;
    visit stack[256];
    o->upper_count = o->block_count = 0;
    for (uint32_t r = 0; r < view->root_count; ++r) {
        uint32_t top = 0;
        stack[top++] = (visit){tree->roots[r], FCT_NONE, 0};
        while (top > 0) {
            visit v = stack[--top];
            if (v.node >= view->node_count || tree->links[v.node].count <= FCT_BLOCK) {
                link_part(o, v.parent, v.side, FCT_IS_BLOCK | o->block_count);
                if (o->blocks) o->blocks[o->block_count] = v.node;
                ++o->block_count;
                continue;
            }
            link_part(o, v.parent, v.side, o->upper_count);
            if (o->upper) {
                o->upper[o->upper_count].id = v.node;
                o->upper[o->upper_count].first_block = o->block_count;
            }
            stack[top++] = (visit){tree->links[v.node].child[1], o->upper_count, 1};
            stack[top++] = (visit){tree->links[v.node].child[0], o->upper_count, 0};
            ++o->upper_count;
        }
    }
}

static void count_blocks(fct_outline *o) {
    for (uint32_t i = o->upper_count; i-- > 0;) {
        fct_upper *u = &o->upper[i];
        u->block_count = 0;
        for (int k = 0; k < 2; ++k)
            u->block_count += u->parts[k] & FCT_IS_BLOCK ? 1 : o->upper[u->parts[k]].block_count;
    }
}

/* --- Vertices by first use --- */

/* 1 + the highest vertex of faces [begin, end), or `count` if that is larger. */
static uint32_t find_vertex_end(const fct_tree *tree, size_t begin, size_t end, uint32_t count) {
    for (size_t i = 3 * begin; i < 3 * end; ++i) {
        uint32_t next = tree->triangles[i] + 1;
        count = next > count ? next : count;
    }
    return count;
}

uint32_t fct_vertices_before(const fct_tree *tree, const fct_outline *outline, size_t place) {
    return find_vertex_end(tree, place - place % FCT_SPAN, place, outline->introduced[place / FCT_SPAN]);
}

typedef struct vertex_job {
    const fct_tree *tree;
    uint32_t *introduced;
} vertex_job;

static void scan_spans(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const vertex_job *job = user;
    size_t faces = job->tree->view.face_count;
    for (size_t i = begin; i < end; ++i) {
        size_t last = (i + 1) * FCT_SPAN < faces ? (i + 1) * FCT_SPAN : faces;
        job->introduced[i + 1] = find_vertex_end(job->tree, i * FCT_SPAN, last, 0);
    }
}

static void count_vertices(const fct_env *env, const fct_tree *tree, uint32_t *introduced) {
    size_t spans = fct_chunk_count(tree->view.face_count, FCT_SPAN);
    vertex_job job = {tree, introduced};
    introduced[0] = 0;
    fct_parallel_for(env, spans, 1 << 8, scan_spans, &job);
    for (size_t i = 0; i < spans; ++i)
        if (introduced[i + 1] < introduced[i]) introduced[i + 1] = introduced[i];
}

fct_result fct_outline_create(const fct_env *env, const fct_tree *tree, fct_outline *o) {
    *o = (fct_outline){0};
    walk_outline(tree, o);
    const fct_array arrays[] = {
        FCT_ARRAY(o->upper, o->upper_count), FCT_ARRAY(o->blocks, o->block_count),
        FCT_ARRAY(o->sums, o->block_count), FCT_ARRAY(o->caps, o->block_count),
        FCT_ARRAY(o->introduced, fct_chunk_count(tree->view.face_count, FCT_SPAN) + 1)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "boxes");
    if (result != FCT_OK) return result;
    walk_outline(tree, o);
    count_blocks(o);
    count_vertices(env, tree, o->introduced);
    return FCT_OK;
}

void fct_outline_release(const fct_env *env, fct_outline *o) {
    const fct_array arrays[] = {FCT_ARRAY(o->upper, 0), FCT_ARRAY(o->blocks, 0), FCT_ARRAY(o->sums, 0),
                                FCT_ARRAY(o->caps, 0), FCT_ARRAY(o->introduced, 0)};
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
}
