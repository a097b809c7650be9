/* cluster/work.c: see work.h. */
#include "cluster/work.h"

#include <string.h>

#include "base/parallel.h"
#include "base/sort.h"
#include "facetree/dual.h"

typedef struct face_job {
    fct_work *work;
    const fct_mesh *mesh;
    const float *perimeters;
} face_job;

uint32_t fct_height_limit(uint32_t count, bool mild) {
    if (count < 2) return 0;
    double levels = log2(count), steep = 3 * levels - 1, gentle = 2 * levels + 8;
    return (uint32_t)(mild && gentle < steep ? gentle : steep);
}

static void make_records(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    face_job *job = user;
    fct_work *work = job->work;
    for (size_t f = begin; f < end; ++f) {
        fct_metric_face(&work->metric, job->mesh->positions, job->mesh->triangles + 3 * f, job->perimeters[f],
                        &work->records[f], work->directions ? &work->directions[f] : NULL);
        work->counts[f] = 1;
        work->heights[f] = 0;
        work->nodes[f] = (uint32_t)f;
    }
}

static fct_bounds mesh_bounds(const fct_mesh *mesh) {
    fct_bounds bounds = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    for (size_t i = 0; i < 3 * (size_t)mesh->face_count; ++i) {
        const float *p = mesh->positions + 3 * (size_t)mesh->triangles[i];
        for (int k = 0; k < 3; ++k) {
            if (p[k] < bounds.lower[k]) bounds.lower[k] = p[k];
            if (p[k] > bounds.upper[k]) bounds.upper[k] = p[k];
        }
    }
    return bounds;
}

static fct_result take_dual(const fct_env *env, const fct_mesh *mesh, fct_work *work) {
    fct_dual dual;
    fct_result result = fct_dual_build(env, mesh, &dual);
    if (result != FCT_OK) return result;
    face_job job = {work, mesh, dual.perimeters};
    fct_parallel_for(env, mesh->face_count, 1 << 14, make_records, &job);
    work->edge_count = dual.edge_count;
    work->boundary_edges = dual.boundary_edges, work->nonmanifold_edges = dual.nonmanifold_edges;
    work->edges = fct_allocate(env, dual.edge_count, sizeof *work->edges);
    if (work->edges)
        for (uint32_t e = 0; e < dual.edge_count; ++e)
            work->edges[e] = (fct_edge){dual.edges[2 * (size_t)e], dual.edges[2 * (size_t)e + 1],
                                        (float)((double)dual.lengths[e] * work->metric.scale)};
    else
        result = fct_fail_memory(env, "clustering");
    fct_dual_release(env, &dual);
    return result;
}

fct_result fct_work_create_within(const fct_env *env, const fct_mesh *mesh, const fct_bounds *bounds,
                                  const fct_tree_def *def, fct_work *out) {
    uint32_t faces = mesh->face_count;
    *out = (fct_work){.env = env, .face_count = faces, .materials = mesh->materials};
    out->metric = fct_metric_make(def, bounds);
    out->records = fct_allocate(env, faces, sizeof *out->records);
    bool directions = def->cost == FCT_COST_MEAN;
    if (directions) out->directions = fct_allocate(env, faces, sizeof *out->directions);
    out->counts = fct_allocate(env, faces, sizeof *out->counts);
    out->heights = fct_allocate(env, faces, sizeof *out->heights);
    out->nodes = fct_allocate(env, faces, sizeof *out->nodes);
    out->children = fct_allocate(env, faces, sizeof *out->children);
    out->costs = fct_allocate(env, faces, sizeof *out->costs);
    fct_result result;
    if (!out->records || (directions && !out->directions) || !out->counts || !out->heights || !out->nodes ||
        !out->children || !out->costs)
        result = fct_fail_memory(env, "clustering");
    else
        result = take_dual(env, mesh, out);
    if (result != FCT_OK) fct_work_release(out);
    return result;
}

fct_result fct_work_create(const fct_env *env, const fct_mesh *mesh, const fct_tree_def *def, fct_work *out) {
    fct_bounds bounds = mesh_bounds(mesh);
    return fct_work_create_within(env, mesh, &bounds, def, out);
}

void fct_work_release(fct_work *work) {
    fct_release(work->env, work->records);
    fct_release(work->env, work->directions);
    fct_release(work->env, work->counts);
    fct_release(work->env, work->heights);
    fct_release(work->env, work->nodes);
    fct_release(work->env, work->children);
    fct_release(work->env, work->costs);
    fct_release(work->env, work->edges);
    const fct_env *env = work->env;
    *work = (fct_work){.env = env};
}

float fct_work_cost(const fct_work *work, uint32_t a, uint32_t b, float shared) {
    return fct_metric_cost(&work->metric, &work->records[a], &work->records[b], shared,
                           work->directions ? &work->directions[a] : NULL,
                           work->directions ? &work->directions[b] : NULL);
}

bool fct_work_allowed(const fct_work *work, uint32_t a, uint32_t b) {
    uint32_t taller = work->heights[a] > work->heights[b] ? work->heights[a] : work->heights[b];
    return taller < 8 || taller + 1 <= fct_height_limit(work->counts[a] + work->counts[b], !work->steep);
}

void fct_work_merge_as(fct_work *work, uint32_t merge, uint32_t a, uint32_t b, float shared, float cost) {
    work->children[merge][0] = work->nodes[a];
    work->children[merge][1] = work->nodes[b];
    work->costs[merge] = cost;
    fct_metric_merge(&work->metric, &work->records[a], &work->records[b], shared,
                     work->directions ? &work->directions[a] : NULL,
                     work->directions ? &work->directions[b] : NULL);
    work->counts[a] += work->counts[b];
    uint8_t taller = work->heights[a] > work->heights[b] ? work->heights[a] : work->heights[b];
    work->heights[a] = (uint8_t)(taller + 1);
    work->nodes[a] = work->face_count + merge;
    work->nodes[b] = FCT_NONE;
}

void fct_work_merge(fct_work *work, uint32_t a, uint32_t b, float shared, float cost) {
    fct_work_merge_as(work, work->merge_count++, a, b, shared, cost);
}
