/* cluster/verify.c: everything a finished tree promises, read from end to end: checksums, structure, and for
 * every node that its numbers are finite, its box holds its vertices, its cone its normals, and its area and
 * area vector are those of its triangles. O(F log F), parallel. */
#include <float.h>
#include <string.h>

#include "base/parallel.h"
#include "cluster/file.h"

enum { GRAIN = 64 };

typedef struct verifier {
    const fct_tree_view *view;
    const char **faults; /* per chunk */
    uint32_t *nodes;
} verifier;

/* Within rounding of a float and of the largest term. */
static bool alike(double stored, double value, double size) {
    if (size > FLT_MAX) return true; /* held at the end of the range */
    return fabs(stored - value) <= 1e-5 * size + FLT_MIN;
}

static const char *node_fault(const fct_tree_view *view, const fct_cluster *c) {
    fct_box box;
    fct_cluster_box(c, &box);
    v3 center = v3_load(box.center),
       axes[3] = {v3_load(box.axes[0]), v3_load(box.axes[1]), v3_load(box.axes[2])};
    v3 cone = v3_unit(v3_load(c->area_vector)), vector = {0, 0, 0};
    double area = 0, narrowest = 1;
    for (size_t place = c->first; place < (size_t)c->first + c->count; ++place) {
        v3 p[3];
        for (size_t k = 0; k < 3; ++k) {
            p[k] = v3_load(view->positions + 3 * (size_t)view->triangles[3 * place + k]);
            for (int i = 0; i < 3; ++i)
                if (!(fabs(v3_dot(v3_sub(p[k], center), axes[i])) <= (double)box.half[i]))
                    return "a vertex outside its box";
        }
        v3 normal = v3_scale(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])), 0.5);
        area += v3_norm(normal);
        vector = v3_add(vector, normal);
        if (v3_norm2(normal) > 0) narrowest = fmin(narrowest, v3_dot(v3_unit(normal), cone));
    }
    if (v3_norm2(cone) > 0 && acos(fmax(narrowest, -1)) > (double)c->cone_angle + 1e-7)
        return "a face outside its cone of normals";
    if (!alike((double)c->area, area, area)) return "an area that is not that of its faces";
    v3 stored = v3_load(c->area_vector);
    if (!alike(stored.x, vector.x, area) || !alike(stored.y, vector.y, area) ||
        !alike(stored.z, vector.z, area))
        return "an area vector that is not that of its faces";
    return NULL;
}

static void check_nodes(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    verifier *v = user;
    for (size_t i = begin; i < end && !v->faults[chunk]; ++i) {
        v->faults[chunk] = node_fault(v->view, &v->view->clusters[i]);
        v->nodes[chunk] = (uint32_t)i;
    }
}

static fct_result check_geometry(const fct_env *env, verifier *v, size_t chunks) {
    fct_result result = fct_parallel_for_progress(env, "verify", v->view->node_count, GRAIN, check_nodes, v);
    if (result != FCT_OK) return result;
    for (size_t i = 0; i < chunks; ++i)
        if (v->faults[i]) return fct_fail(env, FCT_ERROR_DATA, "node %u has %s", v->nodes[i], v->faults[i]);
    return FCT_OK;
}

fct_result fct_tree_verify(const fct_env *env, const fct_tree *tree) {
    fct_result result = fct_tree_check_sums(env, tree);
    if (result == FCT_OK) result = fct_tree_check_structure(env, tree);
    if (result != FCT_OK) return result;
    size_t chunks = fct_chunk_count(tree->view.node_count, GRAIN);
    verifier v = {.view = &tree->view};
    v.faults = fct_allocate_zero(env, chunks, sizeof *v.faults);
    v.nodes = fct_allocate(env, chunks, sizeof *v.nodes);
    result = v.faults && v.nodes ? check_geometry(env, &v, chunks) : fct_fail_memory(env, "verifying");
    fct_release(env, v.faults);
    fct_release(env, v.nodes);
    return result;
}
