/* cluster/tree/check/verify.c: compares every number of a tree with its triangles.
 *
 * For each node, direct sums over its faces give area, area vector S, moment M and centroid. The box must
 * contain all vertices and end at one on each axis, the cone must contain all normals, and the plane must
 * have the least E_fit (8.1), pass through the centroid and point along S. O(F log F), parallel.
 *
 * Tolerances are those of floats relative to the size of the cluster. Where almost none of the faces have an
 * area, the centroid need only lie in the box, and the plane need only hold the centroid.
 */
#include "cluster/tree/check/verify.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/math/eigen.h"
#include "base/math/elementary.h"
#include "base/parallel.h"
#include "cluster/tree/check/edges.h"
#include "cluster/tree/check/structure.h"

enum {
    GRAIN = 64,
    TOP = 4096 /* the first nodes have many faces: each is a task of its own */
};

typedef struct verifier {
    const fct_tree_view *view;
    const fct_cluster *clusters;
    size_t first; /* first record that is checked */
    const uint32_t
        *leaves;         /* ids of records of the cut, of which only leaves are checked; NULL: all records */
    const char **faults; /* per chunk */
    uint32_t *nodes;
} verifier;

/* Sums over the faces of a node. Points are relative to the centre of the box. */
typedef struct totals {
    double area, weight, moment[6], second[6], lower[3], upper[3], narrowest;
    v3 vector, first;
} totals;

/* The frame of the node's box. */
typedef struct frame {
    v3 center, axes[3];
} frame;

/* Equal up to the rounding of a float of magnitude `size`. */
static bool is_close(double stored, double value, double size) {
    if (size > FLT_MAX) return true; /* describe.c stored the end of the range */
    return fabs(stored - value) <= 1e-5 * size + FLT_MIN;
}

/* Without calls of fmin and fmax, which took half of the time. */
static inline double least(double a, double b) {
    return a < b ? a : b;
}
static inline double most(double a, double b) {
    return a > b ? a : b;
}

static void add_face(const fct_tree_view *view, size_t place, const frame *box, v3 cone, totals *t) {
    v3 q[3], p[3]; /* q keeps the digits that small faces lose when p is taken from the centre */
    for (size_t k = 0; k < 3; ++k) {
        q[k] = v3_load(view->positions + 3 * (size_t)view->triangles[3 * place + k]);
        p[k] = v3_sub(q[k], box->center);
        for (int i = 0; i < 3; ++i) {
            double x = v3_dot(p[k], box->axes[i]);
            t->lower[i] = least(t->lower[i], x), t->upper[i] = most(t->upper[i], x);
        }
    }
    v3 u = v3_sub(q[1], q[0]), v = v3_sub(q[2], q[0]), s = v3_scale(v3_cross(u, v), 0.5);
    v3 middle = v3_mad(p[0], 1.0 / 3, v3_add(u, v));
    double area = v3_norm(s), weight = area;
    if (area > 0) {
        sym3_add_outer(t->moment, 1 / area, s);
        t->narrowest = least(t->narrowest, v3_dot(s, cone) / area);
    } else {
        weight = 1e-20 * most(v3_norm2(u), most(v3_norm2(v), v3_norm2(v3_sub(v, u))));
    }
    t->area += area, t->weight += weight;
    t->vector = v3_add(t->vector, s);
    t->first = v3_mad(t->first, weight, middle);
    sym3_add_outer(t->second, weight, middle);
    for (int k = 0; k < 3; ++k) sym3_add_outer(t->second, weight / 12, v3_sub(p[k], middle));
}

static const char *find_box_fault(const fct_cluster *c, const fct_box *box, const totals *t,
                                  double diagonal) {
    const float *q = c->box_rotation;
    double norm2 = 0;
    for (int i = 0; i < 4; ++i) norm2 += (double)q[i] * (double)q[i];
    if (fabs(norm2 - 1) > 1e-5) return "a rotation that is none";
    double slack = 1e-4 * diagonal + 1e-6 * v3_norm(v3_load(box->center)) + FLT_MIN;
    for (int i = 0; i < 3; ++i) {
        double half = (double)box->half[i];
        if (!(t->upper[i] <= half && t->lower[i] >= -half)) return "a vertex outside its box";
        if (half > fmax(t->upper[i], -t->lower[i]) + slack) return "a box that is too large";
    }
    return NULL;
}

static const char *find_sums_fault(const fct_cluster *c, const totals *t) {
    if (!is_close((double)c->area, t->area, t->area)) return "an area that is not that of its faces";
    const double vector[3] = {t->vector.x, t->vector.y, t->vector.z};
    for (int i = 0; i < 3; ++i)
        if (!is_close((double)c->area_vector[i], vector[i], t->area))
            return "an area vector that is not that of its faces";
    for (int i = 0; i < 6; ++i)
        if (!is_close((double)c->moment[i], t->moment[i], t->area))
            return "a moment that is not that of its faces";
    return NULL;
}

static const char *find_plane_fault(const fct_cluster *c, const fct_box *box, const totals *t,
                                    double diagonal) {
    v3 normal = v3_load(c->plane), center = v3_load(box->center);
    if (fabs(v3_norm2(normal) - 1) > 1e-5) return "a plane without a unit normal";
    v3 stored = v3_sub(v3_load(c->centroid), center), mean = stored;
    double slack = 1e-5 * diagonal + 1e-6 * v3_norm(center) + FLT_MIN;
    bool solid = t->area > 1e-10 * diagonal * diagonal;
    if (solid) mean = v3_scale(t->first, 1 / t->weight);
    if (v3_norm(v3_sub(mean, stored)) > slack) return "a centroid that is not that of its faces";
    for (int i = 0; i < 3; ++i)
        if (fabs(v3_dot(stored, v3_load(box->axes[i]))) > (double)box->half[i] + slack)
            return "a centroid outside its box";
    double offset = v3_dot(normal, v3_load(c->centroid));
    if (fabs(offset) < FLT_MAX / 2 && fabs(offset + (double)c->plane[3]) > slack)
        return "a plane that misses its centroid";
    if (v3_dot(normal, t->vector) < -1e-5 * t->area) return "a plane whose normal is against its faces";
    if (!solid) return NULL;
    double values[3], covariance[6];
    v3 axes[3];
    memcpy(covariance, t->second, sizeof covariance);
    sym3_add_outer(covariance, -t->weight, mean);
    fct_eigen3(covariance, values, axes);
    double excess = sym3_form(covariance, normal, normal) / v3_norm2(normal) - values[0];
    return excess > 1e-8 * (covariance[0] + covariance[3] + covariance[5]) ? "a plane that is not the best"
                                                                           : NULL;
}

static const char *find_record_fault(const fct_tree_view *view, const fct_cluster *c) {
    fct_box box;
    fct_cluster_box(c, &box);
    v3 cone = v3_unit(v3_load(c->area_vector));
    double diagonal = 2 * v3_norm(v3_load(box.half));
    totals t = {.narrowest = 1};
    const frame f = {v3_load(box.center), {v3_load(box.axes[0]), v3_load(box.axes[1]), v3_load(box.axes[2])}};
    for (int i = 0; i < 3; ++i) t.lower[i] = INFINITY, t.upper[i] = -INFINITY;
    for (size_t place = c->first; place < (size_t)c->first + c->count; ++place)
        add_face(view, place, &f, cone, &t);
    const char *fault = find_box_fault(c, &box, &t, diagonal);
    if (fault) return fault;
    fault = find_sums_fault(c, &t);
    if (fault) return fault;
    if (!(c->cone_angle >= 0 && c->cone_angle < 3.1416F)) return "a cone of no angle";
    if (v3_norm2(cone) > 0 && fct_acos(fmax(t.narrowest, -1)) > (double)c->cone_angle + 1e-7)
        return "a face outside its cone of normals";
    return find_plane_fault(c, &box, &t, diagonal);
}

static void check_nodes(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    verifier *v = user;
    for (size_t i = v->first + begin; i < v->first + end && !v->faults[chunk]; ++i) {
        v->nodes[chunk] = v->leaves ? v->leaves[i] : (uint32_t)i;
        if (!v->leaves || v->leaves[i] >= v->view->node_count)
            v->faults[chunk] = find_record_fault(v->view, &v->clusters[i]);
    }
}

static fct_result check_range(const fct_env *env, verifier *v, size_t first, size_t end, size_t grain) {
    size_t count = end - first, chunks = fct_chunk_count(count, grain);
    v->first = first;
    memset(v->faults, 0, chunks * sizeof *v->faults);
    fct_result result = fct_parallel_for_progress(env, "verify", count, grain, check_nodes, v);
    for (size_t i = 0; i < chunks && result == FCT_OK; ++i)
        if (v->faults[i]) result = fct_fail(env, FCT_ERROR_DATA, "node %u has %s", v->nodes[i], v->faults[i]);
    return result;
}

static fct_result check_geometry(const fct_env *env, const fct_tree *tree) {
    const fct_tree_view *view = &tree->view;
    size_t nodes = view->node_count, top = nodes < TOP ? nodes : TOP;
    size_t chunks = fct_chunk_count(nodes, GRAIN) + TOP;
    verifier v = {.view = view, .clusters = tree->nodes};
    v.faults = fct_allocate(env, chunks, sizeof *v.faults);
    v.nodes = fct_allocate(env, chunks, sizeof *v.nodes);
    fct_result result = v.faults && v.nodes ? FCT_OK : fct_fail_memory(env, "verifying");
    if (result == FCT_OK) result = check_range(env, &v, 0, top, 1);
    if (result == FCT_OK) result = check_range(env, &v, top, nodes, GRAIN);
    v.clusters = tree->cut, v.leaves = tree->cut_ids;
    if (result == FCT_OK) result = check_range(env, &v, 0, tree->cut_count, GRAIN);
    fct_release(env, v.faults);
    fct_release(env, v.nodes);
    return result;
}

static fct_result check_counts(const fct_env *env, const fct_tree *tree) {
    const fct_tree_view *view = &tree->view;
    fct_tree other = {.view = *view};
    fct_edge_counts counts;
    fct_tree_measure_bounds(&other);
    bool same = true;
    for (int k = 0; k < 3; ++k)
        same = same && other.view.bounds.lower[k] == view->bounds.lower[k] &&
               other.view.bounds.upper[k] == view->bounds.upper[k];
    if (!same) return fct_fail(env, FCT_ERROR_DATA, "the bounds are not those of the vertices");
    fct_result result = fct_tree_count_edges(env, view, FCT_EDGE_PORTION, &counts);
    if (result != FCT_OK) return result;
    if (counts.boundary != view->boundary_edges || counts.nonmanifold != view->nonmanifold_edges ||
        counts.components != view->component_count)
        return fct_fail(env, FCT_ERROR_DATA,
                        "the header has %u boundary edges, %u non-manifold edges and %u components, the mesh "
                        "has %u, %u and %u",
                        view->boundary_edges, view->nonmanifold_edges, view->component_count, counts.boundary,
                        counts.nonmanifold, counts.components);
    if (fct_tree_is_inward(view) != view->inward)
        return fct_fail(env, FCT_ERROR_DATA, "the header says that the surface is %swound inwards",
                        view->inward ? "" : "not ");
    return FCT_OK;
}

fct_result fct_tree_verify_contents(const fct_env *env, const fct_tree *tree) {
    fct_result result = fct_tree_check_structure(env, tree);
    fct_file_advise(&tree->file, 0, tree->file.size, FCT_FILE_USUAL);
    if (result == FCT_OK) result = check_counts(env, tree);
    return result == FCT_OK ? check_geometry(env, tree) : result;
}
