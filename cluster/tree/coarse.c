/* cluster/tree/coarse.c: see coarse.h.
 *
 * Ids of the coarse tree with R roots and K patches, of which B have two triangles:
 *     0 .. K - R - 1            the nodes above the cut, as in the large tree
 *     K - R .. K - R + B - 1    patches of two triangles, in order of place
 *     then                      leaves: the triangles
 * O(K log K), and as many records of the large tree are read.
 */
#include "cluster/tree/coarse.h"

#include <math.h>
#include <string.h>

#include "cluster/tree/walk.h"

/* The clusters of the cut, in order of place. */
typedef struct cut {
    uint32_t count, boxes; /* boxes: clusters of more than one face */
    fct_cluster *records;
    uint32_t *nodes;
    uint32_t *places; /* first place in the coarse tree */
    uint32_t *ids;    /* in the coarse tree */
} cut;

enum { PAGE = 4096 };

/* The pages that hold the first `top` records and those of the cut. */
static uint64_t measure_touched(const fct_env *env, const fct_tree *tree, uint32_t top, const cut *c) {
    if (!tree->file.data) return 0;
    const size_t size = sizeof(fct_cluster), all = tree->view.node_count * size / PAGE + 1;
    size_t count = 0;
    uint8_t *pages = fct_allocate_zero(env, all, 1);
    if (!pages) return 0; /* a statistic alone */
    for (size_t i = 0; i < (size_t)top + c->count; ++i) {
        const size_t node = i < top ? i : c->nodes[i - top];
        if (node >= tree->view.node_count) continue;
        pages[node * size / PAGE] = pages[(node * size + size - 1) / PAGE] = 1;
    }
    for (size_t i = 0; i < all; ++i) count += pages[i];
    fct_release(env, pages);
    return count * PAGE;
}

/* Walks down from the roots, first child first, and fills the cut and the records above it. */
static fct_result walk_to_cut(const fct_env *env, const fct_tree *tree, uint32_t top, cut *c,
                              fct_cluster *records) {
    const fct_tree_view *view = &tree->view;
    uint32_t height = 0, opened = 0;
    uint32_t *stack = fct_allocate(env, (size_t)view->depth + view->root_count + 2, sizeof *stack);
    if (!stack) return fct_fail_memory(env, "a coarse tree");
    fct_result result = fct_tree_check_roots(env, tree);
    c->count = 0;
    for (uint32_t r = view->root_count; r-- > 0;) stack[height++] = view->roots[r];
    while (height > 0 && result == FCT_OK) {
        const uint32_t node = stack[--height];
        fct_cluster record, children[2];
        result = fct_tree_cluster(tree, node, &record);
        if (result != FCT_OK) break;
        if (node < top) {
            /* In a damaged file a path may be longer than the header says. */
            if (height + 2 > view->depth + view->root_count + 2) break;
            ++opened;
            result = fct_tree_children(tree, node, children);
            records[node] = record;
            stack[height++] = record.child[1];
            stack[height++] = record.child[0];
        } else { /* the walk visits no node twice (walk.h), so at most root_count + top of them */
            if (record.count == 1) result = fct_tree_check_face(env, tree, record.first);
            c->nodes[c->count] = node;
            c->records[c->count++] = record;
        }
    }
    fct_release(env, stack);
    if (result == FCT_OK && opened != top)
        result = fct_fail(env, FCT_ERROR_DATA, "%s: the nodes are not in the order of their costs",
                          tree->path ? tree->path : "a tree");
    return result;
}

/* Numbers the patches and their triangles. Returns the number of triangles. */
static uint32_t number_patches(uint32_t top, cut *c) {
    uint32_t places = 0;
    c->boxes = 0;
    for (uint32_t i = 0; i < c->count; ++i) {
        c->places[i] = places;
        if (c->records[i].count > 1) c->ids[i] = top + c->boxes++;
        places += c->records[i].count > 1 ? 2 : 1;
    }
    for (uint32_t i = 0; i < c->count; ++i)
        if (c->records[i].count == 1) c->ids[i] = top + c->boxes + c->places[i];
    return places;
}

/* The first cluster of the cut at or behind a place of the large tree. */
static uint32_t find_in_cut(const cut *c, uint32_t first) {
    uint32_t low = 0, high = c->count;
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        if (c->records[middle].first < first)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static void place_node(const fct_tree *tree, const cut *c, uint32_t top, uint32_t triangles,
                       fct_cluster *node) {
    const uint32_t begin = find_in_cut(c, node->first), end = find_in_cut(c, node->first + node->count);
    for (int k = 0; k < 2; ++k) {
        if (node->child[k] < top) continue;
        fct_cluster child;
        (void)!fct_tree_cluster(tree, node->child[k], &child);
        node->child[k] = c->ids[find_in_cut(c, child.first)];
    }
    node->first = c->places[begin];
    node->count = (end < c->count ? c->places[end] : triangles) - node->first;
}

/* A patch whose box is thinner than this share of its size is part of flat ground, which its neighbours
 * continue. */
#define FLAT .05

/* Least share of a rectangle that counts as the outline: a closed body has an area vector of zero. */
#define LEAST_COVER .1

/* The factor that makes the rectangle of a bent patch as large as the geometric mean of itself and of the
 * outline: less, and rays pass between patches; more, and thin parts and rims cast too wide shadows (a porous
 * statue of the museum is 6.5 % too dark with whole rectangles, 3 % with these). Flat patches stay whole,
 * because walls must not leak. */
static double shrink_bent(double height, double size, double fill) {
    const double bent = fct_min(height / (FLAT * size), 1);
    return size > 0 ? 1 - bent * (1 - sqrt(sqrt(fill))) : 1;
}

/* The rectangle of a patch, corners in order around it. */
static void span_rectangle(const fct_cluster *c, float corners[12], float *fill, float *height) {
    static const int signs[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    const v3 n = v3_load(c->plane);
    fct_box box;
    v3 sides[2];
    int across = 0;
    fct_cluster_box(c, &box);
    for (int k = 1; k < 3; ++k)
        if (fabs(v3_dot(n, v3_load(box.axes[k]))) > fabs(v3_dot(n, v3_load(box.axes[across])))) across = k;
    for (int k = 0; k < 2; ++k) {
        const int axis = (across + 1 + k) % 3;
        const v3 a = v3_load(box.axes[axis]);
        sides[k] = v3_scale(v3_mad(a, -v3_dot(a, n), n), box.half[axis]);
    }
    const v3 whole = v3_cross(sides[0], sides[1]);
    const double area = 4 * v3_norm(whole), outline = v3_norm(v3_load(c->area_vector));
    const double covered = area > 0 ? fct_min(fct_max(outline / area, LEAST_COVER), 1) : 1;
    const double factor = shrink_bent(box.half[across], sqrt(v3_norm(whole)), covered);
    const v3 middle = v3_load(box.center);
    const v3 at = v3_mad(middle, -(v3_dot(n, middle) + c->plane[3]), n);
    sides[0] = v3_scale(sides[0], factor);
    sides[1] = v3_scale(sides[1], v3_dot(whole, n) < 0 ? -factor : factor);
    for (int i = 0; i < 4; ++i)
        v3_store(corners + 3 * i, v3_mad(v3_mad(at, signs[i][0], sides[0]), signs[i][1], sides[1]));
    *fill = (float)fct_min(covered / (factor * factor), 1);
    *height = box.half[across];
}

/* Adds the triangles of a patch at its places. Returns the number of vertices. */
static uint32_t place_patch(const fct_tree_view *from, const cut *c, uint32_t patch, fct_coarse *out,
                            uint32_t vertex) {
    static const uint32_t halves[2][3] = {{0, 1, 2}, {0, 2, 3}};
    fct_tree *to = out->tree;
    const fct_cluster *record = &c->records[patch];
    const uint32_t place = c->places[patch], pieces = record->count > 1 ? 2 : 1;
    float *corners = to->positions + 3 * (size_t)vertex;
    if (pieces == 2) {
        span_rectangle(record, corners, &out->fill[patch], &out->height[patch]);
    } else {
        const uint32_t *t = from->triangles + 3 * (size_t)record->first;
        for (size_t k = 0; k < 3; ++k)
            memcpy(corners + 3 * k, from->positions + 3 * (size_t)t[k], 3 * sizeof *corners);
        out->fill[patch] = 1, out->height[patch] = 0;
    }
    for (uint32_t i = 0; i < pieces; ++i) {
        out->patches[place + i] = patch;
        for (size_t k = 0; k < 3; ++k) to->triangles[3 * (size_t)(place + i) + k] = vertex + halves[i][k];
    }
    return pieces + 2;
}

/* Fills the records of patches, the mesh and the view. */
static void fill_tree(const fct_tree *tree, const cut *c, uint32_t triangles, fct_coarse *out) {
    fct_tree *to = out->tree;
    const fct_tree_view *from = &tree->view;
    const uint32_t top = out->top_count, inner = top + c->boxes;
    uint32_t vertices = 0;
    for (uint32_t i = 0; i < top; ++i) place_node(tree, c, top, triangles, &to->clusters[i]);
    for (uint32_t i = 0; i < c->count; ++i) {
        out->nodes[i] = c->nodes[i];
        vertices += place_patch(from, c, i, out, vertices);
        if (c->records[i].count == 1) continue;
        fct_cluster *node = &to->clusters[c->ids[i]];
        *node = c->records[i];
        node->first = c->places[i], node->count = 2;
        for (uint32_t k = 0; k < 2; ++k) node->child[k] = inner + c->places[i] + k;
    }
    for (uint32_t i = 0; i < triangles; ++i) to->face_ids[i] = i;
    for (uint32_t i = 0; i < vertices; ++i) to->vertex_ids[i] = i;
    for (uint32_t r = 0; r < from->root_count; ++r) {
        fct_cluster root;
        (void)!fct_tree_cluster(tree, from->roots[r], &root);
        to->roots[r] = from->roots[r] < top ? from->roots[r] : c->ids[find_in_cut(c, root.first)];
    }
    to->nodes = to->clusters;
    to->view = (fct_tree_view){.face_count = triangles,
                               .vertex_count = vertices,
                               .node_count = inner,
                               .root_count = from->root_count,
                               .depth = from->depth + 1,
                               .boundary_edges = from->boundary_edges,
                               .nonmanifold_edges = from->nonmanifold_edges,
                               .component_count = from->component_count,
                               .inward = from->inward,
                               .roots = to->roots,
                               .face_ids = to->face_ids,
                               .vertex_ids = to->vertex_ids,
                               .positions = to->positions,
                               .triangles = to->triangles,
                               .source = "",
                               .origin = {from->origin[0], from->origin[1], from->origin[2]},
                               .def = from->def};
    fct_tree_measure_bounds(to);
}

fct_result fct_tree_coarsen(const fct_env *env, const fct_tree *tree, uint32_t patch_count, fct_coarse *out) {
    const fct_tree_view *view = &tree->view;
    const uint32_t top = patch_count - view->root_count;
    const size_t most_places = 2 * (size_t)patch_count, most_vertices = 4 * (size_t)patch_count;
    cut c = {.count = patch_count};
    *out = (fct_coarse){.top_count = top,
                        .patch_count = patch_count,
                        .closed = view->boundary_edges == 0 && view->nonmanifold_edges == 0};
    fct_tree *to = out->tree = fct_tree_new(env);
    if (!to) return fct_fail_memory(env, "a coarse tree");
    const fct_array scratch[] = {FCT_ARRAY(c.records, patch_count), FCT_ARRAY(c.nodes, patch_count),
                                 FCT_ARRAY(c.places, patch_count), FCT_ARRAY(c.ids, patch_count)};
    const fct_array kept[] = {FCT_ARRAY(to->clusters, top + most_places / 2),
                              FCT_ARRAY(to->roots, view->root_count),
                              FCT_ARRAY(to->face_ids, most_places),
                              FCT_ARRAY(to->vertex_ids, most_vertices),
                              FCT_ARRAY(to->triangles, 3 * most_places),
                              FCT_ARRAY(to->positions, 3 * most_vertices),
                              FCT_ARRAY(out->nodes, patch_count),
                              FCT_ARRAY(out->patches, most_places),
                              FCT_ARRAY(out->fill, patch_count),
                              FCT_ARRAY(out->height, patch_count)};
    fct_result result = fct_allocate_all(env, scratch, FCT_LENGTH(scratch), "a coarse tree");
    if (result == FCT_OK) result = fct_allocate_all(env, kept, FCT_LENGTH(kept), "a coarse tree");
    if (result == FCT_OK) result = walk_to_cut(env, tree, top, &c, to->clusters);
    if (result == FCT_OK) out->touched_bytes = measure_touched(env, tree, top, &c);
    if (result == FCT_OK) fill_tree(tree, &c, number_patches(top, &c), out);
    fct_release_all(env, scratch, FCT_LENGTH(scratch));
    if (result != FCT_OK) fct_coarse_release(env, out);
    return result;
}

void fct_coarse_release(const fct_env *env, fct_coarse *coarse) {
    fct_tree_destroy(coarse->tree);
    fct_release(env, coarse->nodes);
    fct_release(env, coarse->patches);
    fct_release(env, coarse->fill);
    fct_release(env, coarse->height);
    *coarse = (fct_coarse){0};
}

uint32_t fct_coarse_origin(const fct_coarse *coarse, uint32_t node) {
    const fct_tree_view *view = &coarse->tree->view;
    if (node < coarse->top_count) return node;
    const uint32_t place =
        node < view->node_count ? coarse->tree->nodes[node].first : node - view->node_count;
    return coarse->nodes[coarse->patches[place]];
}
