/* radiosity/output/smooth.c: see smooth.h. */
#include "radiosity/output/smooth.h"

#include <math.h>
#include <string.h>

#include "base/env.h"
#include "base/math/vec.h"
#include "base/parallel.h"
#include "radiosity/surface/split.h"

/* Difference of two neighbours over the sum of their light that may be noise of the rays. Larger values blur
 * contacts, smaller ones leave the noise of anchors that are close together. */
#define NOISE .1
/* Least standard error of direct light, as a share of it: rays that agree may have missed something. */
#define LEAST_NOISE .005
/* Share of the variance of a vertex that those around it have at least: in the dark, the light is no measure.
 */
#define OWN_SHARE .1
/* Chi-square per degree of freedom above which a fit changes the light less, with the square of the ratio.
 * Noise alone gives 1. Light that bends a little gives more, and the fit is still better than the noise. */
#define MOST_MISFIT 6.
/* A fit takes vertices within one edge, and another one those within two. The first 64 are enough. */
enum { RINGS = 2, MOST_GROUP = 64 };
/* Passes: each reaches one edge further. */
enum { PASSES = 2 };
/* Vertices at one position, without twins, that the search for a twin looks at. */
enum { MOST_OTHERS = 8 };
enum { VERTEX_GRAIN = 256 }; /* vertices per chunk */

static bool can_mix(const fct_surface *f, const uint8_t *covered, uint32_t v) {
    return f->flat[v] && !covered[v];
}

/* Difference of the light of two vertices over the largest that may be noise. */
static double compare_light(const float *light, uint32_t a, uint32_t b) {
    const float *x = light + 3 * (size_t)a, *y = light + 3 * (size_t)b;
    double difference = 0, level = 0;
    for (int c = 0; c < 3; ++c) difference += fabs((double)x[c] - y[c]), level += (double)x[c] + y[c];
    return level > 0 ? difference / (level * NOISE) : 0;
}

/* Two vertices at one position count as one if both can mix, they are in one plane, and their light is alike:
 * a wall may stand between them. */
static bool are_twins(const fct_surface *f, const uint8_t *covered, const float *light, uint32_t a,
                      uint32_t b) {
    return can_mix(f, covered, a) && can_mix(f, covered, b) && compare_light(light, a, b) < 1 &&
           fct_shading_same(v3_load(f->normals + 3 * (size_t)a), v3_load(f->normals + 3 * (size_t)b));
}

/* twins[v]: the lowest twin of v, or v. Triangles of one plane that share no vertices have them. */
static fct_result find_twins(const fct_env *env, const fct_surface *f, const uint8_t *covered,
                             const float *light, uint32_t *twins) {
    const uint32_t count = f->mesh.vertex_count;
    uint32_t *first; /* per vertex: the lowest one at its position */
    uint32_t *next;  /* per vertex: the next one there that has no lower twin */
    const fct_array arrays[] = {FCT_ARRAY(first, count), FCT_ARRAY(next, count)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "the output");
    if (result != FCT_OK) return result;
    result = fct_weld(env, count, f->mesh.positions, first);
    for (uint32_t v = 0; v < count && result == FCT_OK; ++v) {
        twins[v] = v, next[v] = FCT_NONE;
        uint32_t u = first[v];
        for (int k = 0; u != v && twins[v] == v; ++k) {
            if (are_twins(f, covered, light, u, v)) twins[v] = u;
            if (k == MOST_OTHERS) break;
            if (twins[v] == v && next[u] == FCT_NONE) next[u] = v;
            u = next[u];
        }
    }
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    return result;
}

/* Gives each vertex without a lower twin the mean light of its twins. counts: their number. */
static void join_twins(const uint32_t *twins, uint32_t count, uint32_t *counts, float *light) {
    for (uint32_t v = 0; v < count; ++v) {
        counts[v] = 1;
        if (twins[v] == v) continue;
        ++counts[twins[v]];
        for (size_t c = 0; c < 3; ++c) light[3 * (size_t)twins[v] + c] += light[3 * (size_t)v + c];
    }
    for (uint32_t v = 0; v < count; ++v)
        for (size_t c = 0; c < 3; ++c) light[3 * (size_t)v + c] /= (float)counts[v];
}

static void spread_twins(const uint32_t *twins, uint32_t count, float *light) {
    for (uint32_t v = 0; v < count; ++v)
        if (twins[v] != v) memcpy(light + 3 * (size_t)v, light + 3 * (size_t)twins[v], 3 * sizeof *light);
}

/* Adds the light of vertex b to the sum of vertex a (light and weight). */
static void add_neighbour(const float *light, uint32_t a, uint32_t b, float *sums) {
    const float *y = light + 3 * (size_t)b;
    const double apart = compare_light(light, a, b);
    if (apart >= 1) return;
    float weight = (float)((1 - apart * apart) * (1 - apart * apart));
    for (int c = 0; c < 3; ++c) sums[4 * (size_t)a + (size_t)c] += weight * y[c];
    sums[4 * (size_t)a + 3] += weight;
}

fct_result fct_light_smooth(const fct_env *env, const fct_surface *f, const uint8_t *covered, float *light) {
    const fct_mesh *m = &f->mesh;
    float *sums;
    uint32_t *twins, *counts;
    const fct_array arrays[] = {FCT_ARRAY(sums, 4 * (size_t)m->vertex_count),
                                FCT_ARRAY(twins, m->vertex_count), FCT_ARRAY(counts, m->vertex_count)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "the output");
    if (result != FCT_OK) return result;
    result = find_twins(env, f, covered, light, twins);
    if (result == FCT_OK) join_twins(twins, m->vertex_count, counts, light);
    for (int pass = 0; pass < PASSES && result == FCT_OK; ++pass) {
        memset(sums, 0, 4 * (size_t)m->vertex_count * sizeof *sums);
        for (size_t c = 0; c < 3 * (size_t)m->face_count; ++c) {
            const uint32_t a = twins[m->triangles[c]], b = twins[m->triangles[c % 3 == 2 ? c - 2 : c + 1]];
            if (!can_mix(f, covered, a) || !can_mix(f, covered, b)) continue;
            add_neighbour(light, a, b, sums);
            add_neighbour(light, b, a, sums);
        }
        for (size_t v = 0; v < m->vertex_count; ++v)
            for (int c = 0; c < 3; ++c)
                light[3 * v + (size_t)c] =
                    (light[3 * v + (size_t)c] + sums[4 * v + (size_t)c]) / (1 + sums[4 * v + 3]);
    }
    if (result == FCT_OK) spread_twins(twins, m->vertex_count, light);
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    return result;
}

/* The flat neighbours of vertex v: list[begin[v]] to list[begin[v + 1] - 1], twice for an edge of two faces.
 */
typedef struct neighbours {
    size_t *begin;
    uint32_t *list;
} neighbours;

/* The twins at the ends of the edge from corner c to the next one. Returns false if one of them cannot mix.
 */
static bool load_edge(const fct_surface *f, const uint8_t *covered, const uint32_t *twins, size_t c,
                      uint32_t ends[2]) {
    const uint32_t *t = f->mesh.triangles;
    ends[0] = twins[t[c]], ends[1] = twins[t[c % 3 == 2 ? c - 2 : c + 1]];
    return can_mix(f, covered, ends[0]) && can_mix(f, covered, ends[1]);
}

static fct_result list_neighbours(const fct_env *env, const fct_surface *f, const uint8_t *covered,
                                  const uint32_t *twins, neighbours *out) {
    const size_t vertices = f->mesh.vertex_count, corners = 3 * (size_t)f->mesh.face_count;
    uint32_t ends[2];
    out->begin = fct_allocate_zero(env, vertices + 2, sizeof *out->begin);
    if (!out->begin) return fct_fail_memory(env, "the output");
    for (size_t c = 0; c < corners; ++c)
        if (load_edge(f, covered, twins, c, ends)) ++out->begin[ends[0] + 2], ++out->begin[ends[1] + 2];
    for (size_t v = 0; v < vertices; ++v) out->begin[v + 2] += out->begin[v + 1];
    out->list = fct_allocate(env, out->begin[vertices + 1], sizeof *out->list);
    if (!out->list) return fct_fail_memory(env, "the output");
    for (size_t c = 0; c < corners; ++c) {
        if (!load_edge(f, covered, twins, c, ends)) continue;
        out->list[out->begin[ends[0] + 1]++] = ends[1];
        out->list[out->begin[ends[1] + 1]++] = ends[0];
    }
    return FCT_OK;
}

/* Appends the neighbours of vertex v that are not in the group yet, until it is full. */
static void add_neighbours(const neighbours *n, uint32_t v, uint32_t *group, uint32_t *count) {
    for (size_t i = n->begin[v]; i < n->begin[v + 1] && *count < MOST_GROUP; ++i) {
        uint32_t k = 0;
        while (k < *count && group[k] != n->list[i]) ++k;
        if (k == *count) group[(*count)++] = n->list[i];
    }
}

/* Sums of weighted least squares over a vertex and those around it: positions (x, y) in the plane and light,
 * all relative to the vertex. w: weights, 1 / variance; c: light per channel; t: of all channels. */
typedef struct fit {
    double count, w, x, y, xx, xy, yy, t, tx, ty, tt, c[3], cx[3], cy[3];
} fit;

static double sum_channels(const float *light) {
    return (double)light[0] + light[1] + light[2];
}

/* Two unit vectors across the unit vector n. */
static void span_plane(v3 n, v3 axes[2]) {
    const v3 across = fabs(n.x) < .6 ? v3_make(1, 0, 0) : v3_make(0, 1, 0);
    axes[0] = v3_unit(v3_cross(n, across));
    axes[1] = v3_cross(n, axes[0]);
}

/* What a fit reads, and the light that it changes. */
typedef struct smoothing {
    const fct_surface *f;
    const uint8_t *covered;
    const neighbours *near;
    const float *variances, *light;
    float *smooth;
} smoothing;

/* Adds vertex b to the sums of vertex a. */
static void add_to_fit(const smoothing *s, const v3 axes[2], uint32_t a, uint32_t b, fit *to) {
    const float *own = s->light + 3 * (size_t)a, *other = s->light + 3 * (size_t)b;
    const v3 d =
        v3_sub(v3_load(s->f->mesh.positions + 3 * (size_t)b), v3_load(s->f->mesh.positions + 3 * (size_t)a));
    const double least = LEAST_NOISE * fct_max(sum_channels(own), sum_channels(other));
    const double variance = (double)s->variances[b] + OWN_SHARE * (double)s->variances[a] + least * least;
    const double x = v3_dot(d, axes[0]), y = v3_dot(d, axes[1]);
    const double w = 1 / variance;
    const double t = sum_channels(other) - sum_channels(own);
    to->count += 1, to->w += w;
    to->x += w * x, to->y += w * y, to->xx += w * x * x, to->xy += w * x * y, to->yy += w * y * y;
    to->t += w * t, to->tx += w * t * x, to->ty += w * t * y, to->tt += w * t * t;
    for (int k = 0; k < 3; ++k) {
        const double c = w * ((double)other[k] - own[k]);
        to->c[k] += c, to->cx[k] += c * x, to->cy[k] += c * y;
    }
}

/* Sets the difference of the vertex's light from the plane through the sums. Returns chi-square per degree of
 * freedom; infinity if the vertices are close to one line. */
static double solve_fit(const fit *s, double change[3]) {
    const double a = s->xx * s->yy - s->xy * s->xy, b = s->xy * s->y - s->x * s->yy,
                 c = s->x * s->xy - s->xx * s->y, d = s->w * s->yy - s->y * s->y,
                 e = s->x * s->y - s->w * s->xy, f = s->w * s->xx - s->x * s->x,
                 det = s->w * a + s->x * b + s->y * c;
    change[0] = change[1] = change[2] = 0;
    if (!(s->count > 3 && det > 1e-6 * s->w * s->xx * s->yy)) return (double)INFINITY;
    const double explained = a * s->t * s->t + d * s->tx * s->tx + f * s->ty * s->ty +
                             2 * (b * s->t * s->tx + c * s->t * s->ty + e * s->tx * s->ty);
    for (int k = 0; k < 3; ++k) change[k] = (a * s->c[k] + b * s->cx[k] + c * s->cy[k]) / det;
    return (s->tt - explained / det) / (s->count - 3);
}

/* Moves the light of a vertex towards the plane through it and its neighbours, and then towards the plane
 * through those within two edges: all the way if the misfit is at most MOST_MISFIT, else the less the larger
 * it is. */
static void smooth_vertex(const smoothing *s, uint32_t v, float *out) {
    uint32_t group[MOST_GROUP] = {v}, count = 1, first = 0;
    v3 axes[2];
    fit sums = {0};
    double change[3], all[3] = {0, 0, 0};
    span_plane(v3_load(s->f->normals + 3 * (size_t)v), axes);
    add_to_fit(s, axes, v, v, &sums);
    for (int ring = 0; ring < RINGS; ++ring) {
        const uint32_t last = count;
        for (uint32_t i = first; i < last && count < MOST_GROUP; ++i)
            add_neighbours(s->near, group[i], group, &count);
        for (uint32_t i = last; i < count; ++i) add_to_fit(s, axes, v, group[i], &sums);
        first = last;
        const double misfit = solve_fit(&sums, change),
                     ratio = misfit > MOST_MISFIT ? MOST_MISFIT / misfit : 1, share = ratio * ratio;
        for (int k = 0; k < 3; ++k) all[k] += share * (change[k] - all[k]);
    }
    for (int k = 0; k < 3; ++k) out[k] = (float)fct_max((double)s->light[3 * (size_t)v + k] + all[k], 0);
}

static void smooth_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const smoothing *s = user;
    for (size_t v = begin; v < end; ++v)
        if (s->variances[v] > 0 && can_mix(s->f, s->covered, (uint32_t)v))
            smooth_vertex(s, (uint32_t)v, s->smooth + 3 * v);
}

fct_result fct_direct_smooth(const fct_env *env, const fct_surface *f, const uint8_t *covered,
                             const fct_sight *sights, float *light) {
    const size_t count = f->mesh.vertex_count;
    uint32_t *twins, *counts;
    float *variances, *noisy;
    neighbours near = {0};
    const fct_array arrays[] = {FCT_ARRAY(twins, count), FCT_ARRAY(counts, count),
                                FCT_ARRAY(noisy, 3 * count), FCT_ARRAY_ZERO(variances, count)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "the output");
    if (result != FCT_OK) return result;
    if ((result = find_twins(env, f, covered, light, twins)) != FCT_OK) goto done;
    join_twins(twins, f->mesh.vertex_count, counts, light);
    for (size_t v = 0; v < count; ++v) variances[twins[v]] += sights[v].variance;
    for (size_t v = 0; v < count; ++v) variances[v] /= (float)counts[v] * (float)counts[v];
    if ((result = list_neighbours(env, f, covered, twins, &near)) != FCT_OK) goto done;
    memcpy(noisy, light, 3 * count * sizeof *light);
    smoothing s = {f, covered, &near, variances, noisy, light};
    fct_parallel_for(env, count, VERTEX_GRAIN, smooth_chunk, &s);
    spread_twins(twins, f->mesh.vertex_count, light);
done:
    fct_release(env, near.begin), fct_release(env, near.list);
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    return result;
}
