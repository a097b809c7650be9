/* cluster/merge/work.c: see work.h. */
#include "cluster/merge/work.h"

#include <string.h>

#include "base/parallel.h"
#include "cluster/merge/bound.h"

enum { GRAIN = 1 << 13 };

typedef struct face_job {
    fct_work *work;
    const fct_mesh *mesh;
    fct_bounds *bounds; /* per chunk */
} face_job;

uint32_t fct_height_limit(uint32_t count, bool mild) {
    if (count < 2) return 0;
    double levels = log2(count), steep = 3 * levels - 1, gentle = 2 * levels + 8;
    return (uint32_t)(mild && gentle < steep ? gentle : steep);
}

static void bound_faces(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    face_job *job = user;
    fct_bound_faces(job->mesh, begin, end, &job->bounds[chunk]);
}

/* Of the vertices that faces use. */
static fct_result bound_mesh(const fct_env *env, const fct_mesh *mesh, fct_bounds *out) {
    size_t chunks = fct_chunk_count(mesh->face_count, GRAIN);
    face_job job = {.mesh = mesh, .bounds = fct_allocate(env, chunks, sizeof *job.bounds)};
    if (!job.bounds) return fct_fail_memory(env, "clustering");
    fct_parallel_for(env, mesh->face_count, GRAIN, bound_faces, &job);
    *out = job.bounds[0];
    for (size_t i = 1; i < chunks; ++i)
        for (int k = 0; k < 3; ++k) {
            if (job.bounds[i].lower[k] < out->lower[k]) out->lower[k] = job.bounds[i].lower[k];
            if (job.bounds[i].upper[k] > out->upper[k]) out->upper[k] = job.bounds[i].upper[k];
        }
    fct_release(env, job.bounds);
    return FCT_OK;
}

static void make_records(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    face_job *job = user;
    fct_work *work = job->work;
    const float *positions = job->mesh->positions;
    for (size_t f = begin; f < end; f += FCT_LANES)
        fct_metric_faces(&work->metric, positions, job->mesh->triangles + 3 * f, work->lists.perimeters + f,
                         end - f < FCT_LANES ? (uint32_t)(end - f) : FCT_LANES, work->records + f);
    for (size_t f = begin; f < end && work->directions; ++f)
        fct_metric_direction(&work->metric, positions, job->mesh->triangles + 3 * f, &work->directions[f]);
    for (size_t f = begin; f < end; ++f) work->nodes[f] = (uint32_t)f;
    memset(work->heights + begin, 0, end - begin);
}

static fct_result allocate_clusters(fct_work *work, bool directions) {
    const fct_env *env = work->env;
    size_t faces = work->face_count;
    const fct_array arrays[] = {
        FCT_ARRAY(work->records, faces),  FCT_ARRAY_IF(directions, work->directions, faces),
        FCT_ARRAY(work->heights, faces),  FCT_ARRAY(work->nodes, faces),
        FCT_ARRAY(work->children, faces), FCT_ARRAY(work->costs, faces)};
    return fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "clustering");
}

fct_result fct_work_create_within(const fct_env *env, const fct_mesh *mesh, const fct_bounds *bounds,
                                  const fct_tree_def *def, fct_work *out) {
    *out = (fct_work){.env = env, .face_count = mesh->face_count, .materials = mesh->materials};
    out->metric = fct_metric_make(def, bounds);
    fct_result result = fct_lists_build(env, mesh, out->metric.scale, &out->lists);
    if (result == FCT_OK) result = allocate_clusters(out, def->cost == FCT_COST_MEAN);
    if (result != FCT_OK) {
        fct_work_release(out);
        return result;
    }
    out->boundary_edges = out->lists.boundary_edges, out->nonmanifold_edges = out->lists.nonmanifold_edges;
    face_job job = {.work = out, .mesh = mesh};
    fct_parallel_for(env, mesh->face_count, GRAIN, make_records, &job);
    fct_release(env, out->lists.perimeters);
    out->lists.perimeters = NULL;
    return FCT_OK;
}

fct_result fct_work_create(const fct_env *env, const fct_mesh *mesh, const fct_tree_def *def, fct_work *out) {
    fct_bounds bounds;
    fct_result result = bound_mesh(env, mesh, &bounds);
    return result == FCT_OK ? fct_work_create_within(env, mesh, &bounds, def, out) : result;
}

void fct_work_release_clusters(fct_work *work) {
    fct_release(work->env, work->records);
    fct_release(work->env, work->directions);
    fct_release(work->env, work->heights);
    fct_release(work->env, work->nodes);
    fct_release(work->env, work->edges);
    fct_lists_release(work->env, &work->lists);
    work->records = NULL, work->directions = NULL, work->heights = NULL;
    work->nodes = NULL, work->edges = NULL, work->edge_count = 0;
}

void fct_work_release(fct_work *work) {
    const fct_env *env = work->env;
    fct_work_release_clusters(work);
    fct_release(env, work->children);
    fct_release(env, work->costs);
    *work = (fct_work){.env = env};
}

bool fct_work_allowed(const fct_work *work, uint32_t a, uint32_t b) {
    uint32_t taller = work->heights[a] > work->heights[b] ? work->heights[a] : work->heights[b];
    return taller < FCT_FREE_HEIGHT ||
           taller + 1 <= fct_height_limit(work->records[a].count + work->records[b].count, !work->steep);
}

void fct_work_merges(fct_work *work, uint32_t merge, const fct_pair *pairs, const float *costs,
                     uint32_t count) {
    for (uint32_t i = 0; i < count; ++i, ++merge) {
        uint32_t a = pairs[i].a, b = pairs[i].b;
        work->children[merge][0] = work->nodes[a];
        work->children[merge][1] = work->nodes[b];
        work->costs[merge] = costs[i];
        uint8_t taller = work->heights[a] > work->heights[b] ? work->heights[a] : work->heights[b];
        work->heights[a] = (uint8_t)(taller + 1);
        work->nodes[a] = work->face_count + merge;
        work->nodes[b] = FCT_NONE;
    }
    fct_metric_merges(&work->metric, work->records, work->directions, pairs, count);
}

void fct_work_merge(fct_work *work, uint32_t a, uint32_t b, float shared, float cost) {
    fct_work_merges(work, work->merge_count++, &(fct_pair){a, b, shared}, &cost, 1);
}

fct_result fct_work_list_edges(fct_work *work) {
    const fct_lists *lists = &work->lists;
    if (!lists->neighbors) return FCT_OK;
    uint32_t count = 0;
    for (uint32_t f = 0; f < work->face_count; ++f)
        for (uint32_t i = 0; i < lists->counts[f]; ++i) count += lists->neighbors[lists->starts[f] + i] > f;
    work->edges = fct_allocate(work->env, count, sizeof *work->edges);
    if (!work->edges) return fct_fail_memory(work->env, "clustering");
    for (uint32_t f = 0; f < work->face_count; ++f)
        for (uint32_t i = lists->starts[f]; i < lists->starts[f] + lists->counts[f]; ++i)
            if (lists->neighbors[i] > f)
                work->edges[work->edge_count++] = (fct_edge){f, lists->neighbors[i], lists->lengths[i]};
    fct_lists_release(work->env, &work->lists);
    return FCT_OK;
}
