/* cluster/merge/work.c: creates a clustering from a mesh, records merges, and turns lists into edges. */
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

fct_metric fct_metric_make(const fct_tree_def *def, const fct_bounds *bounds) {
    const bool mean = def->cost == FCT_COST_MEAN;
    v3 lower = v3_load(bounds->lower), upper = v3_load(bounds->upper);
    double diagonal = v3_norm(v3_sub(upper, lower));
    fct_metric metric = {.cost = def->cost, .measure = def->fit_measure};
    metric.fit_weight = def->fit_weight >= 0 ? def->fit_weight : mean ? 1e6 : 1e4;
    metric.direction_weight = def->direction_weight >= 0 ? def->direction_weight : 1;
    metric.shape_weight = def->shape_weight >= 0 ? def->shape_weight : mean ? 1 : 0.002;
    metric.origin = v3_scale(v3_add(lower, upper), 0.5);
    metric.scale = diagonal > 0 ? 1 / diagonal : 1;
    return metric;
}

static void bound_faces(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    face_job *job = user;
    fct_bound_faces(job->mesh, begin, end, &job->bounds[chunk]);
}

/* Bounds of the vertices that faces use. */
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

/* The record of one face in double, and its borders. */
static void make_mean_record(fct_work *work, const fct_mesh *mesh, uint32_t face) {
    const uint32_t *triangles = mesh->triangles;
    const fct_lists *lists = &work->lists;
    fct_mean_face(&work->metric, mesh->positions, triangles + 3 * (size_t)face, &work->means[face]);
    for (uint32_t i = lists->starts[face]; i < lists->starts[face] + lists->counts[face]; ++i)
        work->entry_borders[i] =
            fct_mean_border(&work->metric, mesh->positions, triangles + 3 * (size_t)face,
                            triangles + 3 * (size_t)lists->neighbors[i], lists->lengths[i]);
}

static void make_records(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    face_job *job = user;
    fct_work *work = job->work;
    const float *positions = job->mesh->positions;
    for (size_t f = begin; f < end; f += FCT_LANES)
        fct_metric_faces(&work->metric, positions, job->mesh->triangles + 3 * f, work->lists.perimeters + f,
                         end - f < FCT_LANES ? (uint32_t)(end - f) : FCT_LANES, work->records + f);
    for (size_t f = begin; f < end && work->means; ++f) make_mean_record(work, job->mesh, (uint32_t)f);
    for (size_t f = begin; f < end; ++f) work->nodes[f] = (uint32_t)f;
    memset(work->heights + begin, 0, end - begin);
}

static fct_result allocate_clusters(fct_work *work) {
    const fct_env *env = work->env;
    size_t faces = work->face_count;
    bool mean = work->metric.cost == FCT_COST_MEAN;
    const fct_array arrays[] = {FCT_ARRAY(work->records, faces),
                                FCT_ARRAY_IF(mean, work->means, faces),
                                FCT_ARRAY_IF(mean, work->entry_borders, work->lists.entry_count),
                                FCT_ARRAY(work->heights, faces),
                                FCT_ARRAY(work->nodes, faces),
                                FCT_ARRAY(work->children, faces),
                                FCT_ARRAY(work->costs, faces)};
    return fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "clustering");
}

fct_result fct_work_create_within(const fct_env *env, const fct_mesh *mesh, const fct_bounds *bounds,
                                  const fct_tree_def *def, fct_work *out) {
    *out = (fct_work){.env = env, .face_count = mesh->face_count, .materials = mesh->materials};
    out->metric = fct_metric_make(def, bounds);
    fct_result result = fct_lists_build(env, mesh, out->metric.scale, &out->lists);
    if (result == FCT_OK) result = allocate_clusters(out);
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
    fct_release(work->env, work->means);
    fct_release(work->env, work->heights);
    fct_release(work->env, work->nodes);
    fct_release(work->env, work->edges);
    fct_release(work->env, work->borders);
    fct_release(work->env, work->entry_borders);
    fct_lists_release(work->env, &work->lists);
    work->records = NULL, work->means = NULL, work->heights = NULL;
    work->borders = work->entry_borders = NULL;
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

/* Writes children, costs and heights of merges, and moves the union to slot a. */
static void note_merges(fct_work *work, uint32_t merge, const fct_pair *pairs, const float *costs,
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
}

void fct_work_merges(fct_work *work, uint32_t merge, const fct_pair *pairs, const float *costs,
                     uint32_t count) {
    note_merges(work, merge, pairs, costs, count);
    fct_metric_merges(&work->metric, work->records, pairs, count);
    for (uint32_t i = 0; i < count && work->means; ++i)
        fct_mean_merge(&work->means[pairs[i].a], &work->means[pairs[i].b], (double)pairs[i].shared);
}

void fct_work_merge(fct_work *work, uint32_t a, uint32_t b, double shared, float cost) {
    const fct_pair pair = {a, b, (float)shared};
    note_merges(work, work->merge_count++, &pair, &cost, 1);
    fct_metric_merges(&work->metric, work->records, &pair, 1);
    if (work->means) fct_mean_merge(&work->means[a], &work->means[b], shared);
}

fct_result fct_work_list_edges(fct_work *work) {
    const fct_lists *lists = &work->lists;
    if (!lists->neighbors) return FCT_OK;
    uint32_t count = 0;
    for (uint32_t f = 0; f < work->face_count; ++f)
        for (uint32_t i = 0; i < lists->counts[f]; ++i) count += lists->neighbors[lists->starts[f] + i] > f;
    work->edges = fct_allocate(work->env, count, sizeof *work->edges);
    if (work->means) work->borders = fct_allocate(work->env, count, sizeof *work->borders);
    if (!work->edges || (work->means && !work->borders)) return fct_fail_memory(work->env, "clustering");
    for (uint32_t f = 0; f < work->face_count; ++f)
        for (uint32_t i = lists->starts[f]; i < lists->starts[f] + lists->counts[f]; ++i) {
            if (lists->neighbors[i] <= f) continue;
            if (work->means) work->borders[work->edge_count] = work->entry_borders[i];
            work->edges[work->edge_count++] = (fct_edge){f, lists->neighbors[i], lists->lengths[i]};
        }
    fct_release(work->env, work->entry_borders);
    work->entry_borders = NULL;
    fct_lists_release(work->env, &work->lists);
    return FCT_OK;
}
