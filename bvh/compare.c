/* bvh/compare.c: how far two surfaces lie apart.
 *
 * Sample points: every vertex a face uses, and samples_per_face points of every face, spread by the R2
 * sequence (steps of the plastic number) shifted by a hash of seed and face. E_avg and E_max as in Garland
 * 1999, (2.8) and (2.7). Sums run over fixed chunks in order: the same bits for every thread count.
 */
#include "base/parallel.h"
#include "bvh/bvh.h"

enum { CHUNK = 64 };

typedef struct sums {
    double squares, largest2;
    double color2, color_largest, own_color2;
    uint64_t samples;
} sums;

typedef struct compare_job {
    const fct_bvh *from, *to;
    uint32_t samples_per_face;
    uint64_t seed;
    bool colors;
    uint32_t *vertices; /* those in use */
    sums *parts;
} compare_job;

static v3 corner_mix(const float *data, const uint32_t *t, double u, double v) {
    v3 a = v3_load(data + 3 * (size_t)t[0]), b = v3_load(data + 3 * (size_t)t[1]),
       c = v3_load(data + 3 * (size_t)t[2]);
    return v3_add(v3_scale(a, 1 - u - v), v3_add(v3_scale(b, u), v3_scale(c, v)));
}

static void add_sample(const compare_job *job, v3 point, const v3 *color, sums *s) {
    fct_near near;
    if (!fct_bvh_near(job->to, point, INFINITY, &near, NULL)) return;
    s->squares += near.distance2;
    if (near.distance2 > s->largest2) s->largest2 = near.distance2;
    ++s->samples;
    if (!color) return;
    const fct_tree_view *view = &job->to->view;
    v3 other = corner_mix(view->colors, view->triangles + 3 * (size_t)near.place, near.u, near.v);
    v3 d = v3_sub(*color, other);
    s->color2 += v3_norm2(d);
    s->own_color2 += v3_norm2(*color);
    s->color_largest = fmax(s->color_largest, fmax(fabs(d.x), fmax(fabs(d.y), fabs(d.z))));
}

static void sample_vertices(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    compare_job *job = user;
    const fct_tree_view *view = &job->from->view;
    sums s = {0};
    for (size_t i = begin; i < end; ++i) {
        size_t vertex = job->vertices[i];
        v3 color = {0, 0, 0};
        if (job->colors) color = v3_load(view->colors + 3 * vertex);
        add_sample(job, v3_load(view->positions + 3 * vertex), job->colors ? &color : NULL, &s);
    }
    job->parts[chunk] = s;
}

static uint64_t hash(uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

static double fraction(double x) {
    return x - floor(x);
}

static void sample_faces(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    compare_job *job = user;
    const fct_tree_view *view = &job->from->view;
    sums s = {0};
    for (size_t place = begin; place < end; ++place) {
        const uint32_t *t = view->triangles + 3 * place;
        uint64_t random = hash(job->seed + 0x9e3779b97f4a7c15u * (1 + (uint64_t)view->face_ids[place]));
        double x0 = (double)(random >> 40) * 0x1p-24, y0 = (double)(random & 0xffffff) * 0x1p-24;
        for (uint32_t i = 0; i < job->samples_per_face; ++i) {
            double u = fraction(x0 + .7548776662466927 * (i + 1.0)),
                   v = fraction(y0 + .5698402909980532 * (i + 1.0));
            if (u + v > 1) u = 1 - u, v = 1 - v;
            v3 color = {0, 0, 0};
            if (job->colors) color = corner_mix(view->colors, t, u, v);
            add_sample(job, corner_mix(view->positions, t, u, v), job->colors ? &color : NULL, &s);
        }
    }
    job->parts[chunk] = s;
}

static void fold(sums *total, const sums *parts, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        total->squares += parts[i].squares;
        total->color2 += parts[i].color2;
        total->own_color2 += parts[i].own_color2;
        total->samples += parts[i].samples;
        total->largest2 = fmax(total->largest2, parts[i].largest2);
        total->color_largest = fmax(total->color_largest, parts[i].color_largest);
    }
}

/* Writes the vertices that faces use to job->vertices, ascending, and returns how many. */
static size_t used_vertices(compare_job *job) {
    const fct_tree_view *view = &job->from->view;
    for (uint32_t i = 0; i < view->vertex_count; ++i) job->vertices[i] = 0;
    for (size_t i = 0; i < 3 * (size_t)view->face_count; ++i) job->vertices[view->triangles[i]] = 1;
    size_t count = 0;
    for (uint32_t i = 0; i < view->vertex_count; ++i)
        if (job->vertices[i]) job->vertices[count++] = i;
    return count;
}

/* Samples of one surface measured to the other. */
static fct_result measure(const fct_env *env, compare_job *job, sums *total) {
    const fct_tree_view *view = &job->from->view;
    size_t larger = view->vertex_count > view->face_count ? view->vertex_count : view->face_count;
    fct_result result = FCT_OK;
    *total = (sums){0};
    job->vertices = fct_allocate(env, view->vertex_count, sizeof *job->vertices);
    job->parts = fct_allocate(env, fct_chunk_count(larger, CHUNK), sizeof *job->parts);
    if (!job->vertices || !job->parts) {
        result = fct_fail_memory(env, "a comparison");
        goto done;
    }
    size_t used = used_vertices(job);
    result = fct_parallel_for_progress(env, "comparing", used, CHUNK, sample_vertices, job);
    if (result != FCT_OK) goto done;
    fold(total, job->parts, fct_chunk_count(used, CHUNK));
    if (job->samples_per_face == 0) goto done;
    result = fct_parallel_for_progress(env, "comparing", view->face_count, CHUNK, sample_faces, job);
    if (result == FCT_OK) fold(total, job->parts, fct_chunk_count(view->face_count, CHUNK));
done:
    fct_release(env, job->vertices);
    fct_release(env, job->parts);
    return result;
}

static double ratio(double a, double b) {
    return b > 0 ? a / b : 0;
}

fct_result fct_mesh_compare(const fct_env *env, const fct_bvh *a, const fct_bvh *b, uint32_t samples_per_face,
                            uint64_t seed, fct_mesh_error *out) {
    sums ab, ba;
    compare_job job = {.from = a, .to = b, .samples_per_face = samples_per_face, .seed = seed};
    job.colors = a->view.colors && b->view.colors;
    fct_result result = measure(env, &job, &ab);
    if (result != FCT_OK) return result;
    job.from = b, job.to = a;
    result = measure(env, &job, &ba);
    if (result != FCT_OK) return result;
    double samples = (double)(ab.samples + ba.samples);
    v3 extent = v3_sub(v3_load(a->bounds.upper), v3_load(a->bounds.lower));
    *out = (fct_mesh_error){
        .e_avg = ratio(ab.squares + ba.squares, samples),
        .e_avg_ab = ratio(ab.squares, (double)ab.samples),
        .e_avg_ba = ratio(ba.squares, (double)ba.samples),
        .e_max = sqrt(fmax(ab.largest2, ba.largest2)),
        .e_max_ab = sqrt(ab.largest2),
        .e_max_ba = sqrt(ba.largest2),
        .diameter = v3_norm(extent),
        .color_rms = sqrt(ratio(ab.color2 + ba.color2, 3 * samples)),
        .color_max = fmax(ab.color_largest, ba.color_largest),
        .samples = (size_t)(ab.samples + ba.samples),
    };
    out->color_rms_relative = ratio(out->color_rms, sqrt(ratio(ab.own_color2, 3 * (double)ab.samples)));
    return FCT_OK;
}
