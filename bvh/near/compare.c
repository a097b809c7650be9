/* bvh/near/compare.c: the distance between two surfaces, and between their colours.
 *
 * E_max and E_avg are (2.7) and (2.8) of Garland 1999. Samples: each vertex that a face uses, and
 * samples_per_face points per face, from the R2 sequence (powers of the plastic number) shifted by a hash of
 * the seed and the face id.
 *
 * If several faces are equally near, up to TIE, the colour comes from the face whose normal is closest to the
 * sample's. So the floor under a plinth is not compared with the underside of the plinth. Sums run over fixed
 * chunks in order, so the thread count does not change the bits.
 */
#include "base/key.h"
#include "base/parallel.h"
#include "base/sort.h"
#include "bvh/near/nearest.h"

enum { CHUNK = 64 }; /* vertices or faces per task */

/* Steps of the R2 sequence: 1 / p and 1 / p^2 with p^3 = p + 1. */
#define R2_U .7548776662466927
#define R2_V .5698402909980532
/* Faces whose distances differ by less, in diameters, are equally near. */
#define TIE 1e-6
/* If the nearest face's normal has this cosine to the sample's, no other face is searched. */
#define AGREE .99
/* The colour bound is the colour that this part of the area does not exceed. */
#define COVERED .95

typedef struct sums {
    double squares, largest2;
    double color2, color_largest;
    double bounded2, own2; /* squares of colour differences and of own colours, each cut at the bound */
    uint64_t samples;
} sums;

typedef struct compare_job {
    const fct_bvh *from, *to;
    uint32_t samples_per_face;
    uint64_t seed;
    bool colors;
    double tie;         /* distance */
    v3 bound;           /* of colours */
    uint32_t *vertices; /* that faces use */
    v3 *normals;        /* per vertex, the sum of its faces' area vectors; NULL without colours */
    sums *parts;
} compare_job;

static v3 mix_corners(const float *data, const uint32_t *t, double u, double v) {
    v3 a = v3_load(data + 3 * (size_t)t[0]), b = v3_load(data + 3 * (size_t)t[1]),
       c = v3_load(data + 3 * (size_t)t[2]);
    return v3_add(v3_scale(a, 1 - u - v), v3_add(v3_scale(b, u), v3_scale(c, v)));
}

static v3 area_vector(const fct_tree_view *view, uint32_t place) {
    const uint32_t *t = view->triangles + 3 * (size_t)place;
    v3 a = v3_load(view->positions + 3 * (size_t)t[0]);
    return v3_cross(v3_sub(v3_load(view->positions + 3 * (size_t)t[1]), a),
                    v3_sub(v3_load(view->positions + 3 * (size_t)t[2]), a));
}

/* Sum of squares of the channels, each cut at the bound. */
static double bounded_norm2(v3 color, v3 bound) {
    return v3_norm2(
        (v3){fmin(fabs(color.x), bound.x), fmin(fabs(color.y), bound.y), fmin(fabs(color.z), bound.z)});
}

static void add_color_difference(const compare_job *job, v3 point, v3 normal, v3 color, fct_near near,
                                 sums *s) {
    const fct_tree_view *view = &job->to->view;
    v3 unit = v3_unit(normal);
    if (v3_dot(unit, v3_unit(area_vector(view, near.place))) < AGREE) {
        fct_near facing;
        if (fct_nearest_search(job->to, point, &unit, sqrt(near.distance2) + job->tie, &facing, NULL))
            near = facing;
    }
    v3 d = v3_sub(color, mix_corners(view->colors, view->triangles + 3 * (size_t)near.place, near.u, near.v));
    s->color2 += v3_norm2(d);
    s->color_largest = fmax(s->color_largest, fmax(fabs(d.x), fmax(fabs(d.y), fabs(d.z))));
    s->bounded2 += bounded_norm2(d, job->bound);
    s->own2 += bounded_norm2(color, job->bound);
}

/* `normal` (of any length) and `color` count only if both meshes have colours. */
static void add_sample(const compare_job *job, v3 point, v3 normal, v3 color, sums *s) {
    fct_near near;
    if (!fct_nearest_search(job->to, point, NULL, INFINITY, &near, NULL)) return;
    s->squares += near.distance2;
    if (near.distance2 > s->largest2) s->largest2 = near.distance2;
    ++s->samples;
    if (job->colors) add_color_difference(job, point, normal, color, near, s);
}

static void sample_vertices(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    compare_job *job = user;
    const fct_tree_view *view = &job->from->view;
    sums s = {0};
    for (size_t i = begin; i < end; ++i) {
        size_t vertex = job->vertices[i];
        v3 color = {0, 0, 0}, normal = {0, 0, 0};
        if (job->colors) color = v3_load(view->colors + 3 * vertex), normal = job->normals[vertex];
        add_sample(job, v3_load(view->positions + 3 * vertex), normal, color, &s);
    }
    job->parts[chunk] = s;
}

static uint64_t mix_bits(uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

static double fraction_of(double x) {
    return x - floor(x);
}

static void sample_faces(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    compare_job *job = user;
    const fct_tree_view *view = &job->from->view;
    sums s = {0};
    for (size_t place = begin; place < end; ++place) {
        const uint32_t *t = view->triangles + 3 * place;
        v3 normal = area_vector(view, (uint32_t)place);
        uint64_t random = mix_bits(job->seed + 0x9e3779b97f4a7c15u * (1 + (uint64_t)view->face_ids[place]));
        double x0 = (double)(random >> 40) * 0x1p-24, y0 = (double)(random & 0xffffff) * 0x1p-24;
        for (uint32_t i = 0; i < job->samples_per_face; ++i) {
            double u = fraction_of(x0 + R2_U * (i + 1.0)), v = fraction_of(y0 + R2_V * (i + 1.0));
            if (u + v > 1) u = 1 - u, v = 1 - v;
            v3 color = {0, 0, 0};
            if (job->colors) color = mix_corners(view->colors, t, u, v);
            add_sample(job, mix_corners(view->positions, t, u, v), normal, color, &s);
        }
    }
    job->parts[chunk] = s;
}

static void add_sums(sums *total, const sums *parts, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        total->squares += parts[i].squares;
        total->color2 += parts[i].color2;
        total->bounded2 += parts[i].bounded2;
        total->own2 += parts[i].own2;
        total->samples += parts[i].samples;
        total->largest2 = fmax(total->largest2, parts[i].largest2);
        total->color_largest = fmax(total->color_largest, parts[i].color_largest);
    }
}

/* Lists the vertices that faces use in job->vertices, ascending, and returns their number. */
static size_t list_used_vertices(compare_job *job) {
    const fct_tree_view *view = &job->from->view;
    for (uint32_t i = 0; i < view->vertex_count; ++i) job->vertices[i] = 0;
    for (size_t i = 0; i < 3 * (size_t)view->face_count; ++i) job->vertices[view->triangles[i]] = 1;
    size_t count = 0;
    for (uint32_t i = 0; i < view->vertex_count; ++i)
        if (job->vertices[i]) job->vertices[count++] = i;
    return count;
}

static void sum_vertex_normals(compare_job *job) {
    const fct_tree_view *view = &job->from->view;
    for (uint32_t i = 0; i < view->face_count; ++i) {
        v3 n = area_vector(view, i);
        for (uint32_t k = 0; k < 3; ++k) {
            v3 *sum = &job->normals[view->triangles[3 * (size_t)i + k]];
            *sum = v3_add(*sum, n);
        }
    }
}

/* Sets the colour bound per channel: sorts the faces by their mean colour, and takes the largest corner
 * colour of the darkest faces that make up COVERED of the area. */
static fct_result find_color_bound(const fct_env *env, const fct_tree_view *view, v3 *out) {
    uint64_t *keys = fct_allocate(env, view->face_count, sizeof *keys);
    uint32_t *places = fct_allocate(env, view->face_count, sizeof *places);
    fct_result result = keys && places ? FCT_OK : fct_fail_memory(env, "a comparison");
    double bound[3] = {0, 0, 0}, area = 0;
    for (uint32_t i = 0; i < view->face_count && result == FCT_OK; ++i) area += v3_norm(area_vector(view, i));
    for (uint32_t channel = 0; channel < 3 && result == FCT_OK; ++channel) {
        for (uint32_t i = 0; i < view->face_count; ++i) {
            v3 mean = mix_corners(view->colors, view->triangles + 3 * (size_t)i, 1. / 3, 1. / 3);
            double value = channel == 0 ? mean.x : channel == 1 ? mean.y : mean.z;
            keys[i] = fct_float_key((float)fabs(value));
            places[i] = i;
        }
        result = fct_sort_pairs(env, keys, places, view->face_count);
        double below = 0;
        for (uint32_t i = 0; i < view->face_count && result == FCT_OK && below <= COVERED * area; ++i) {
            const uint32_t *t = view->triangles + 3 * (size_t)places[i];
            for (uint32_t k = 0; k < 3; ++k)
                bound[channel] = fmax(bound[channel], fabs((double)view->colors[3 * (size_t)t[k] + channel]));
            below += v3_norm(area_vector(view, places[i]));
        }
    }
    *out = (v3){bound[0], bound[1], bound[2]};
    fct_release(env, keys);
    fct_release(env, places);
    return result;
}

/* Measures the samples of job->from to job->to. */
static fct_result measure_one_way(const fct_env *env, compare_job *job, sums *total) {
    const fct_tree_view *view = &job->from->view;
    size_t larger = view->vertex_count > view->face_count ? view->vertex_count : view->face_count;
    fct_result result = FCT_OK;
    *total = (sums){0};
    job->vertices = fct_allocate(env, view->vertex_count, sizeof *job->vertices);
    job->parts = fct_allocate(env, fct_chunk_count(larger, CHUNK), sizeof *job->parts);
    job->normals = NULL;
    if (job->colors) job->normals = fct_allocate_zero(env, view->vertex_count, sizeof *job->normals);
    if (!job->vertices || !job->parts || (job->colors && !job->normals)) {
        result = fct_fail_memory(env, "a comparison");
        goto done;
    }
    size_t used = list_used_vertices(job);
    if (job->colors) sum_vertex_normals(job);
    result = fct_parallel_for_progress(env, "comparing", used, CHUNK, sample_vertices, job);
    if (result != FCT_OK) goto done;
    add_sums(total, job->parts, fct_chunk_count(used, CHUNK));
    if (job->samples_per_face == 0) goto done;
    result = fct_parallel_for_progress(env, "comparing", view->face_count, CHUNK, sample_faces, job);
    if (result == FCT_OK) add_sums(total, job->parts, fct_chunk_count(view->face_count, CHUNK));
done:
    fct_release(env, job->vertices);
    fct_release(env, job->parts);
    fct_release(env, job->normals);
    return result;
}

static double divide_or_zero(double a, double b) {
    return b > 0 ? a / b : 0;
}

fct_result fct_mesh_compare(const fct_env *env, const fct_bvh *a, const fct_bvh *b, uint32_t samples_per_face,
                            uint64_t seed, fct_mesh_error *out) {
    sums ab, ba;
    compare_job job = {.from = a, .to = b, .samples_per_face = samples_per_face, .seed = seed};
    job.colors = a->view.colors && b->view.colors;
    double diameter = v3_norm(v3_sub(v3_load(a->bounds.upper), v3_load(a->bounds.lower)));
    job.tie = TIE * diameter;
    fct_result result = job.colors ? find_color_bound(env, &a->view, &job.bound) : FCT_OK;
    if (result == FCT_OK) result = measure_one_way(env, &job, &ab);
    if (result != FCT_OK) return result;
    job.from = b, job.to = a;
    result = measure_one_way(env, &job, &ba);
    if (result != FCT_OK) return result;
    double samples = (double)(ab.samples + ba.samples);
    *out = (fct_mesh_error){
        .e_avg = divide_or_zero(ab.squares + ba.squares, samples),
        .e_avg_ab = divide_or_zero(ab.squares, (double)ab.samples),
        .e_avg_ba = divide_or_zero(ba.squares, (double)ba.samples),
        .e_max = sqrt(fmax(ab.largest2, ba.largest2)),
        .e_max_ab = sqrt(ab.largest2),
        .e_max_ba = sqrt(ba.largest2),
        .diameter = diameter,
        .color_rms = sqrt(divide_or_zero(ab.color2 + ba.color2, 3 * samples)),
        .color_max = fmax(ab.color_largest, ba.color_largest),
        .samples = (size_t)(ab.samples + ba.samples),
    };
    double bounded = divide_or_zero(ab.bounded2 + ba.bounded2, samples),
           own = divide_or_zero(ab.own2, (double)ab.samples);
    out->color_rms_relative = sqrt(divide_or_zero(bounded, own));
    return FCT_OK;
}
