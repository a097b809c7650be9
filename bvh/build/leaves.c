/* bvh/build/leaves.c: chooses the face clusters that become leaves, and packs them.
 *
 * Input: the cluster tree. Output: leaves that hold the faces one after the other in the tree's order, each
 * face once. A leaf is the largest cluster of at most 16 faces and 16 vertices. It stores each vertex once
 * and its corners as bytes: at most 256 bytes, about 22 bytes per triangle on a scan. O(F): the leaves are
 * chosen and packed in parallel, but one thread lists the clusters, adds up their surfaces and numbers the
 * leaves.
 *
 * A line through a scan meets the boxes of one or two leaves. Where a model fills its volume, as stacked
 * blocks do, boxes overlap and a line meets dozens. Then sets of small clusters, split by surface area cost,
 * make better leaves. Their faces are not in the tree's order: bvh->places lists them.
 */
#include "bvh/build/leaves.h"

#include <string.h>

#include "base/parallel.h"
#include "bvh/build/slabs.h"
#include "cluster/tree/node.h"

/* Lists the vertices of a cluster in order of first use and returns their number, or FCT_LEAF_VERTICES + 1 if
 * there are too many. `corners` receives 3 * count indices into `vertices`. */
static uint32_t gather_vertices(const fct_tree_view *view, const uint32_t *places, uint32_t first,
                                uint32_t count, uint32_t vertices[FCT_LEAF_VERTICES], uint8_t *corners) {
    uint32_t vertex_count = 0;
    for (uint32_t i = 0; i < 3 * count; ++i) {
        uint32_t place = places ? places[first + i / 3] : first + i / 3, at = 0;
        uint32_t vertex = view->triangles[3 * (size_t)place + i % 3];
        while (at < vertex_count && vertices[at] != vertex) ++at;
        if (at == vertex_count) {
            if (vertex_count == FCT_LEAF_VERTICES) return FCT_LEAF_VERTICES + 1;
            vertices[vertex_count++] = vertex;
        }
        corners[i] = (uint8_t)at;
    }
    return vertex_count;
}

/* Bytes of a leaf of at most FCT_LEAF_FACES triangles, or 0 if it has too many vertices. */
static size_t measure_leaf(const fct_tree_view *view, const uint32_t *places, uint32_t first,
                           uint32_t count) {
    uint32_t vertices[FCT_LEAF_VERTICES];
    uint8_t corners[3 * FCT_LEAF_FACES];
    uint32_t vertex_count = gather_vertices(view, places, first, count, vertices, corners);
    return vertex_count > FCT_LEAF_VERTICES ? 0 : fct_leaf_bytes(count, (vertex_count + 7) / 8);
}

/* Lists the largest clusters of at most `most` faces in the order of their faces, and returns their number.
 * `stack` has room for depth + root_count + 1 nodes. */
static uint32_t list_candidates(const fct_tree *tree, uint32_t most, uint32_t *stack, uint32_t *candidates) {
    const fct_tree_view *view = &tree->view;
    uint32_t height = 0, count = 0;
    for (uint32_t r = view->root_count; r-- > 0;) stack[height++] = view->roots[r];
    while (height) {
        uint32_t node = stack[--height];
        if (fct_node_faces(tree, node) <= most) {
            candidates[count++] = node;
            continue;
        }
        stack[height++] = fct_node_child(tree, node, 1);
        stack[height++] = fct_node_child(tree, node, 0);
    }
    return count;
}

/* A model is dense if a line through its bounds meets the boxes of more than DENSE candidates on average: 1.2
 * to 1.9 on scans and beams, 2.5 to 3.6 on separate cubes, 47 on 100,000 triangles of stacked blocks, 80 on
 * as many needles. On the blocks, leaves of at most DENSE_FACES faces that are put together of clusters of
 * PART_FACES faces take 37 bytes per triangle instead of 28, and an incoherent ray tests 12 triangles. */
#define DENSE 16
enum { DENSE_FACES = 8, PART_FACES = 2 };

/* The area of the small clusters over half of the surface of their bounds: 1 on stacked blocks, .015 on
 * needles in all directions. Splits do not separate boxes that overlap so much, and clusters make leaves as
 * good. */
#define LEAST_FILLED .1

/* A line that meets the bounds meets a box inside with the probability of their ratio of surfaces. Bounds
 * without surface are not dense. Many copies of one triangle are dense: other leaves gain nothing there, and
 * lose nothing but memory. */
static bool is_dense(const fct_bvh *bvh, const uint32_t *candidates, uint32_t count) {
    const fct_bounds *b = &bvh->bounds;
    double side[3], sum = 0;
    for (int k = 0; k < 3; ++k) side[k] = (double)b->upper[k] - (double)b->lower[k];
    for (uint32_t i = 0; i < count; ++i) {
        fct_cluster room;
        const float *half = fct_node_cluster(bvh->tree, candidates[i], &room)->box_half;
        double x = (double)half[0], y = (double)half[1], z = (double)half[2];
        sum += 4 * (x * y + y * z + z * x);
    }
    double surface = side[0] * side[1] + side[1] * side[2] + side[2] * side[0];
    return surface > 0 && sum > DENSE * surface;
}

/* Per triangle in the order of the leaves: what fct_leaf_list.nodes holds for the leaf that starts there, or
 * FCT_NONE, and the size of that leaf. */
typedef struct choice {
    uint32_t node, units;
} choice;

typedef struct choose_job {
    const fct_tree *tree;
    const uint32_t *candidates;
    choice *choices;
} choose_job;

enum {
    CHOOSE_CHUNK = 1024,
    PACK_CHUNK = 1024,
    FACE_CHUNK = 4096
}; /* candidates or nodes, leaves, faces per task */

/* Descends from each candidate to the clusters that fit a leaf. */
static void choose_leaves(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const choose_job *job = user;
    const fct_tree *tree = job->tree;
    for (size_t i = begin; i < end; ++i) {
        uint32_t stack[FCT_LEAF_FACES], height = 1;
        stack[0] = job->candidates[i];
        while (height) {
            uint32_t node = stack[--height];
            size_t bytes =
                measure_leaf(&tree->view, NULL, fct_node_first(tree, node), fct_node_faces(tree, node));
            if (bytes == 0) {
                stack[height++] = fct_node_child(tree, node, 1);
                stack[height++] = fct_node_child(tree, node, 0);
            } else {
                job->choices[fct_node_first(tree, node)] =
                    (choice){.node = node, .units = (uint32_t)(bytes / FCT_REF_UNIT)};
            }
        }
    }
}

/* Small clusters, which are put together to leaves. */
typedef struct regroup_job {
    fct_bvh *bvh;
    const uint32_t *parts; /* part_count clusters of at most PART_FACES faces */
    float *bounds;         /* of each, scaled */
    uint32_t *starts;      /* faces before each, in the order of the top; part_count + 1 */
    fct_top top;
    choice *choices;
} regroup_job;

static void bound_parts(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const regroup_job *job = user;
    const fct_tree *tree = job->bvh->tree;
    for (size_t i = begin; i < end; ++i) {
        float *b = job->bounds + 6 * i;
        const size_t first = 3 * (size_t)fct_node_first(tree, job->parts[i]),
                     last = first + 3 * (size_t)fct_node_faces(tree, job->parts[i]);
        for (size_t c = first; c < last; ++c) {
            float p[3];
            fct_bvh_position(job->bvh, job->bvh->view.triangles[c], p);
            for (int k = 0; k < 3; ++k) {
                if (c == first || p[k] < b[k]) b[k] = p[k];
                if (c == first || p[k] > b[3 + k]) b[3 + k] = p[k];
            }
        }
    }
}

/* Whether faces are wide enough for splits to separate them, see LEAST_FILLED. */
static bool fill_their_bounds(const regroup_job *job, uint32_t count) {
    const fct_tree *tree = job->bvh->tree;
    double area = 0, bounds = 0;
    for (uint32_t i = 0; i < count; ++i) {
        const float *b = job->bounds + 6 * (size_t)i;
        bounds += fct_half_area((double)(b[3] - b[0]), (double)(b[4] - b[1]), (double)(b[5] - b[2]));
        area += (double)fct_node_area(tree, job->parts[i]);
    }
    return area * job->bvh->scale * job->bvh->scale > LEAST_FILLED * bounds;
}

/* Lists the places in the order of the top. */
static void list_places(regroup_job *job, uint32_t count) {
    const fct_tree *tree = job->bvh->tree;
    uint32_t at = 0;
    for (uint32_t i = 0; i < count; ++i) {
        const uint32_t part = job->parts[job->top.order[i]], first = fct_node_first(tree, part);
        job->starts[i] = at;
        for (uint32_t k = 0; k < fct_node_faces(tree, part); ++k) job->bvh->places[at++] = first + k;
    }
    job->starts[count] = at;
}

/* The part of largest area of a node of the top. */
static uint32_t find_largest_part(const regroup_job *job, const fct_top_node *node) {
    float largest = -1;
    uint32_t found = FCT_NONE;
    for (uint32_t i = node->begin; i < node->end; ++i) {
        const uint32_t part = job->parts[job->top.order[i]];
        const float area = fct_node_area(job->bvh->tree, part);
        if (area > largest) largest = area, found = part;
    }
    return found;
}

/* Makes a leaf of each set that the top does not split. A set of too many vertices is halved until it fits.
 */
static void cut_top(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const regroup_job *job = user;
    for (size_t n = begin; n < end; ++n) {
        const fct_top_node *node = &job->top.nodes[n];
        if (node->left != FCT_NONE) continue;
        const uint32_t last = job->starts[node->end], largest = find_largest_part(job, node);
        for (uint32_t first = job->starts[node->begin], count; first < last; first += count) {
            size_t bytes;
            count = last - first;
            while (!(bytes = measure_leaf(&job->bvh->view, job->bvh->places, first, count))) count /= 2;
            job->choices[first] = (choice){.node = largest, .units = (uint32_t)(bytes / FCT_REF_UNIT)};
        }
    }
}

/* Chooses leaves by splits of the parts, and sets bvh->places; or leaves it NULL, if that would not pay. */
static fct_result regroup_faces(fct_bvh *bvh, const uint32_t *parts, uint32_t count, choice *choices) {
    const fct_env *env = bvh->env;
    regroup_job job = {.bvh = bvh, .parts = parts, .choices = choices};
    const fct_array scratch[] = {FCT_ARRAY(job.bounds, 6 * (size_t)count),
                                 FCT_ARRAY(job.starts, (size_t)count + 1)};
    fct_result result = fct_allocate_all(env, scratch, FCT_LENGTH(scratch), "the leaves of a ray structure");
    if (result != FCT_OK) return result;
    fct_parallel_for(env, count, FACE_CHUNK, bound_parts, &job);
    if (fill_their_bounds(&job, count)) {
        const fct_leaf_list list = {.count = count, .bounds = job.bounds};
        bvh->places = fct_allocate(env, bvh->view.face_count, sizeof *bvh->places);
        result = bvh->places ? fct_top_build(env, &list, DENSE_FACES / PART_FACES, &job.top)
                             : fct_fail_memory(env, "the leaves of a ray structure");
    }
    if (job.top.order) {
        list_places(&job, count);
        fct_parallel_for(env, job.top.node_count, CHOOSE_CHUNK, cut_top, &job);
    }
    fct_top_release(env, &job.top);
    fct_release_all(env, scratch, FCT_LENGTH(scratch));
    return result;
}

typedef struct pack_job {
    fct_bvh *bvh;
    fct_leaf_list *list;
} pack_job;

static void pack_leaf(const fct_bvh *bvh, uint32_t first, uint32_t count, fct_leaf *leaf, float bounds[6]) {
    uint32_t vertices[FCT_LEAF_VERTICES];
    uint8_t corners[3 * FCT_LEAF_FACES];
    uint32_t vertex_count = gather_vertices(&bvh->view, bvh->places, first, count, vertices, corners);
    *leaf = (fct_leaf){
        .first = first, .count = (uint8_t)count, .vertex_octets = (uint8_t)((vertex_count + 7) / 8)};
    uint8_t *bytes = (uint8_t *)(leaf + 1);
    memset(bytes, 0, 24 * (size_t)fct_leaf_octets(leaf));
    for (uint32_t i = 0; i < count; ++i) {
        if (!fct_bvh_degenerate(bvh, fct_leaf_place(bvh, leaf, i))) leaf->mask |= (uint16_t)(1u << i);
        for (uint32_t c = 0; c < 3; ++c) bytes[24 * (i / 8) + 8 * c + i % 8] = corners[3 * i + c];
    }
    float *rows = (float *)(void *)(bytes + 24 * (size_t)fct_leaf_octets(leaf));
    uint32_t stride = 8u * leaf->vertex_octets;
    for (uint32_t i = 0; i < stride; ++i) {
        float p[3];
        fct_bvh_position(bvh, vertices[i < vertex_count ? i : 0], p);
        for (uint32_t k = 0; k < 3; ++k) {
            rows[k * stride + i] = p[k];
            if (i == 0) bounds[k] = bounds[3 + k] = p[k];
            if (p[k] < bounds[k]) bounds[k] = p[k];
            if (p[k] > bounds[3 + k]) bounds[3 + k] = p[k];
        }
    }
}

static void pack_leaves(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    pack_job *job = user;
    for (size_t i = begin; i < end; ++i) {
        char *at = job->bvh->leaves + (size_t)job->list->offsets[i] * FCT_REF_UNIT;
        const uint32_t first = job->list->firsts[i];
        pack_leaf(job->bvh, first, job->list->firsts[i + 1] - first, (fct_leaf *)(void *)at,
                  job->list->bounds + 6 * i);
    }
}

/* Makes the list of the chosen leaves. *units receives the size of all leaves. */
static void list_leaves(const choice *choices, uint32_t face_count, fct_leaf_list *list, uint64_t *units) {
    uint32_t found = 0;
    *units = 0;
    for (uint32_t p = 0; p < face_count; ++p) {
        if (choices[p].node == FCT_NONE) continue;
        list->nodes[found] = choices[p].node;
        list->firsts[found] = p;
        list->offsets[found++] = (uint32_t)*units;
        *units += choices[p].units;
    }
    list->firsts[found] = face_count;
}

fct_result fct_leaves_build(fct_bvh *bvh, fct_leaf_list *out) {
    const fct_env *env = bvh->env;
    const fct_tree_view *view = &bvh->view;
    *out = (fct_leaf_list){0};
    fct_leaf_list list = {0};
    uint32_t *stack, *candidates, *parts;
    choice *choices;
    const fct_array scratch[] = {FCT_ARRAY(stack, (size_t)view->depth + view->root_count + 2),
                                 FCT_ARRAY(candidates, view->face_count), FCT_ARRAY(parts, view->face_count),
                                 FCT_ARRAY(choices, view->face_count)};
    fct_result result = fct_allocate_all(env, scratch, FCT_LENGTH(scratch), "the leaves of a ray structure");
    if (result != FCT_OK) return result;
    for (uint32_t p = 0; p < view->face_count; ++p) choices[p].node = FCT_NONE;
    const uint32_t candidate_count = list_candidates(bvh->tree, FCT_LEAF_FACES, stack, candidates);
    if (is_dense(bvh, candidates, candidate_count)) {
        const uint32_t part_count = list_candidates(bvh->tree, PART_FACES, stack, parts);
        result = regroup_faces(bvh, parts, part_count, choices);
        if (result != FCT_OK) goto done;
    }
    if (!bvh->places) {
        choose_job choose = {bvh->tree, candidates, choices};
        fct_parallel_for(env, candidate_count, CHOOSE_CHUNK, choose_leaves, &choose);
    }
    for (uint32_t p = 0; p < view->face_count; ++p) list.count += choices[p].node != FCT_NONE;
    const fct_array arrays[] = {
        FCT_ARRAY(list.nodes, list.count), FCT_ARRAY(list.firsts, (size_t)list.count + 1),
        FCT_ARRAY(list.offsets, list.count), FCT_ARRAY(list.bounds, 6 * (size_t)list.count)};
    result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "the leaves of a ray structure");
    if (result != FCT_OK) goto done;
    uint64_t units;
    list_leaves(choices, view->face_count, &list, &units);
    bvh->leaves = units < FCT_REF_LEAF ? fct_allocate(env, (size_t)units, FCT_REF_UNIT) : NULL;
    if (bvh->leaves) {
        bvh->leaf_bytes = (size_t)units * FCT_REF_UNIT;
        pack_job pack = {bvh, &list};
        fct_parallel_for(env, list.count, PACK_CHUNK, pack_leaves, &pack);
        *out = list;
    } else {
        fct_leaf_list_release(env, &list);
        result = fct_fail_memory(env, "the leaves of a ray structure");
    }
done:
    fct_release_all(env, scratch, FCT_LENGTH(scratch));
    return result;
}

void fct_leaf_list_release(const fct_env *env, fct_leaf_list *list) {
    fct_release(env, list->nodes);
    fct_release(env, list->firsts);
    fct_release(env, list->offsets);
    fct_release(env, list->bounds);
    fct_release(env, list->frame_bounds);
    *list = (fct_leaf_list){0};
}
