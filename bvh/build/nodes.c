/* bvh/build/nodes.c: packs the nodes of eight children for rays and points.
 *
 * The kind of a node is the one of less expected work for a random ray. The ray meets a child with a
 * probability proportional to the area of its box. Oriented boxes are smaller, so they save visits of
 * children, but a visit of the node costs more: it takes 2.5 times the arithmetic and 1.75 times the memory.
 */
#include "bvh/build/nodes.h"

#include "base/parallel.h"
#include "bvh/build/boxes.h"

/* What a visit of an oriented node costs above that of an axis node, in visits of a child. Measured with .3,
 * .5 and .7: bytes per triangle of a scan are 32.3, 30.8 and 29.5, primary rays on diagonal beams visit 9.9,
 * 10.7 and 12.0 nodes, and times on scans differ by less than the noise. */
#define ORIENTED_COST .5

enum { NODE_CHUNK = 256 /* nodes per task */ };

typedef struct node_job {
    fct_bvh *bvh;
    const fct_leaf_list *leaves;
    const fct_top *top;
    const fct_wide_list *wide;
    uint32_t *refs; /* per wide node */
} node_job;

static double padded_area(const float b[6]) {
    const double pad = 2 * (double)FCT_AXIS_PAD;
    return fct_half_area((double)b[3] - (double)b[0] + pad, (double)b[4] - (double)b[1] + pad,
                         (double)b[5] - (double)b[2] + pad);
}

static bool prefers_oriented(const node_job *job, uint32_t number) {
    const fct_wide_node *wide = &job->wide->nodes[number];
    const fct_top_node *top = job->top->nodes;
    uint32_t own = wide->parent == FCT_NONE ? 0 : job->wide->nodes[wide->parent].top[wide->slot];
    double saved = 0;
    for (uint32_t i = 0; i < wide->count; ++i)
        saved +=
            padded_area(top[wide->top[i]].bounds) - fct_slabs_area(&job->wide->boxes[8 * (size_t)number + i]);
    return saved > ORIENTED_COST * padded_area(top[own].bounds);
}

/* Sets the references to leaves. link_nodes sets those to nodes. */
static void pack_leaf_refs(const node_job *job, const fct_wide_node *wide, uint32_t child[8]) {
    for (uint32_t i = 0; i < 8; ++i) {
        const fct_top_node *node = &job->top->nodes[wide->top[i < wide->count ? i : 0]];
        child[i] =
            node->left == FCT_NONE ? FCT_REF_LEAF | job->leaves->offsets[job->top->order[node->begin]] : 0;
    }
}

/* Empty slots repeat child 0; `present` masks them. */
static void pack_nodes(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const node_job *job = user;
    for (size_t i = begin; i < end; ++i) {
        const fct_wide_node *wide = &job->wide->nodes[i];
        char *at = job->bvh->nodes + (size_t)(job->refs[i] & ~FCT_REF_ORIENTED) * FCT_REF_UNIT;
        uint32_t present = (1u << wide->count) - 1;
        if (job->refs[i] & FCT_REF_ORIENTED) {
            fct_oriented_node *node = (fct_oriented_node *)(void *)at;
            *node = (fct_oriented_node){.present = present};
            for (uint32_t k = 0; k < 8; ++k)
                fct_pack_oriented_box(&job->wide->boxes[8 * i + (k < wide->count ? k : 0)], k, node);
            pack_leaf_refs(job, wide, node->child);
        } else {
            fct_axis_node *node = (fct_axis_node *)(void *)at;
            *node = (fct_axis_node){.present = present};
            for (uint32_t k = 0; k < 8; ++k)
                fct_pack_axis_box(job->top->nodes[wide->top[k < wide->count ? k : 0]].bounds, k, node);
            pack_leaf_refs(job, wide, node->child);
        }
    }
}

/* Chooses the kind and sets the offset of each node. Returns false if a reference cannot hold the offsets. */
static bool place_nodes(node_job *job) {
    uint64_t units = 0;
    for (uint32_t i = 0; i < job->wide->count; ++i) {
        bool oriented = prefers_oriented(job, i);
        job->refs[i] = (uint32_t)units | (oriented ? FCT_REF_ORIENTED : 0);
        units += (oriented ? sizeof(fct_oriented_node) : sizeof(fct_axis_node)) / FCT_REF_UNIT;
        if (units >= FCT_REF_ORIENTED) return false;
    }
    job->bvh->node_bytes = (size_t)units * FCT_REF_UNIT;
    return true;
}

/* Writes the reference of each node into its parent. */
static void link_nodes(const node_job *job) {
    for (uint32_t i = 1; i < job->wide->count; ++i) {
        const fct_wide_node *wide = &job->wide->nodes[i];
        uint32_t parent = job->refs[wide->parent];
        char *at = job->bvh->nodes + (size_t)(parent & ~FCT_REF_ORIENTED) * FCT_REF_UNIT;
        uint32_t *child = parent & FCT_REF_ORIENTED ? ((fct_oriented_node *)(void *)at)->child
                                                    : ((fct_axis_node *)(void *)at)->child;
        child[wide->slot] = job->refs[i];
    }
}

fct_result fct_nodes_build(fct_bvh *bvh, const fct_leaf_list *leaves, const fct_top *top,
                           const fct_wide_list *wide) {
    const fct_env *env = bvh->env;
    if (wide->count == 0) {
        bvh->root = FCT_REF_LEAF | leaves->offsets[0];
        return FCT_OK;
    }
    node_job job = {.bvh = bvh, .leaves = leaves, .top = top, .wide = wide};
    job.refs = fct_allocate(env, wide->count, sizeof *job.refs);
    if (job.refs && place_nodes(&job)) bvh->nodes = fct_allocate(env, bvh->node_bytes, 1);
    if (bvh->nodes) {
        fct_parallel_for(env, wide->count, NODE_CHUNK, pack_nodes, &job);
        link_nodes(&job);
        bvh->root = job.refs[0];
    }
    fct_release(env, job.refs);
    return bvh->nodes ? FCT_OK : fct_fail_memory(env, "the nodes of a ray structure");
}
