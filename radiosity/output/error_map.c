/* radiosity/output/error_map.c: see error_map.h.
 *
 * The variance of the irradiance E of a channel at a vertex is a sum of three parts:
 * 1. that of the blend of anchors (blend.h), which is common to many vertices: blotches;
 * 2. the mean over the edges at the vertex of the squared height of a tent (below): noise that differs from
 *    vertex to vertex, and borders of shadows and bends that the triangles are too large for;
 * 3. a small share of E^2, so that no light counts as exact.
 * With the reflectance rho, error^2 = mean over channels of rho^2 times the variance.
 *
 *        c            Light is linear on both faces at the edge a b. The tent is the difference, at the edge,
 *       / \           between the light of a and b and that of c and d on a straight line across the edge:
 *      a---b              (slope from the edge to c + slope to d) h_c h_d / (h_c + h_d),
 *       \ /           with the distances h of c and d from the edge.
 *        d
 *
 * Where shadow rays disagree is no part: it tells nothing about the error, because more rays follow there.
 * Cost: O(V + F), and a blend per vertex.
 */
#include "radiosity/output/error_map.h"

#include <string.h>

#include "radiosity/output/blend.h"
#include "radiosity/surface/paint.h"
#include "radiosity/surface/split.h"

/* Variance over that of the blend. Residuals of a fit are smaller than errors, and neighbours are not
 * independent. Fits to the squared errors of five scenes against paths give 1.1 to 4.4, mostly 2.0. */
#define BLEND_SHARE 2
/* Variance between vertices over the squared height of a tent. Noise of variance s^2 at each vertex gives, in
 * a regular mesh, tents of s^2 and the variance s^2 / 2 inside triangles. The same fits give .1 to .7. */
#define TENT_SHARE .5
/* Least standard error over the irradiance. */
#define LEAST_SHARE .003
/* The squared scale of the pattern counts as much as this number of points of the check, because the points
 * of small surfaces may miss the few places with large errors. */
#define PATTERN_POINTS 32
/* Least factor on the squared pattern, because a check may come out negative by chance. */
#define LEAST_FACTOR (1. / 9)
enum { VERTEX_GRAIN = 64 }; /* vertices per chunk */

typedef struct mapping {
    const fct_error_map_def *def;
    double *tents;    /* per vertex x 3: sums of squared heights */
    uint32_t *counts; /* per vertex: of tents */
    float *error;
    uint64_t *chunk_rays;
} mapping;

/* Slope from the line a b to the corner, per channel, and its distance from the line; false if it is 0. */
static bool find_slope(const fct_error_map_def *d, uint32_t a, uint32_t b, uint32_t corner, double slope[3],
                       double *distance) {
    const float *positions = d->surface->mesh.positions;
    const v3 from = v3_load(positions + 3 * (size_t)a);
    const v3 edge = v3_sub(v3_load(positions + 3 * (size_t)b), from);
    const v3 way = v3_sub(v3_load(positions + 3 * (size_t)corner), from);
    const double length2 = v3_norm2(edge);
    if (!(length2 > 0)) return false;
    const double along = v3_dot(way, edge) / length2;
    *distance = v3_norm(v3_mad(way, -along, edge));
    if (!(*distance > 0)) return false;
    for (size_t c = 0; c < 3; ++c) {
        const double p = d->light[3 * (size_t)a + c], q = d->light[3 * (size_t)b + c];
        slope[c] = (d->light[3 * (size_t)corner + c] - (p + along * (q - p))) / *distance;
    }
    return true;
}

/* Adds the tent over the edge a b, with the faces' other corners, to its ends. Covered vertices have no
 * light, and cuts beside them are narrow. */
static void add_tent(const mapping *m, uint32_t a, uint32_t b, uint32_t other, uint32_t another) {
    const uint8_t *covered = m->def->covered;
    double slopes[2][3], distances[2];
    if (covered[a] || covered[b] || covered[other] || covered[another]) return;
    if (!find_slope(m->def, a, b, other, slopes[0], &distances[0])) return;
    if (!find_slope(m->def, a, b, another, slopes[1], &distances[1])) return;
    const double reach = distances[0] * distances[1] / (distances[0] + distances[1]);
    for (size_t c = 0; c < 3; ++c) {
        const double height = (slopes[0][c] + slopes[1][c]) * reach;
        m->tents[3 * (size_t)a + c] += height * height;
        m->tents[3 * (size_t)b + c] += height * height;
    }
    ++m->counts[a], ++m->counts[b];
}

/* Finds the pairs of faces at an edge. Of three or more faces, the first two are a pair, and the next two. */
static fct_result add_tents(const fct_env *env, const mapping *m) {
    const fct_mesh *mesh = &m->def->surface->mesh;
    const uint32_t *t = mesh->triangles;
    fct_edge_table edges;
    fct_result result = fct_edge_table_init(env, 3 * (size_t)mesh->face_count, &edges);
    if (result != FCT_OK) return result;
    for (uint32_t f = 0; f < mesh->face_count; ++f)
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t a = t[3 * (size_t)f + k], b = t[3 * (size_t)f + (k + 1) % 3];
            const uint32_t other = t[3 * (size_t)f + (k + 2) % 3];
            bool fresh;
            uint32_t *waiting = fct_edge_table_insert(&edges, a, b, &fresh);
            if (!fresh && *waiting != FCT_NONE) {
                add_tent(m, a, b, other, *waiting);
                *waiting = FCT_NONE;
            } else {
                *waiting = other;
            }
        }
    fct_edge_table_release(env, &edges);
    return FCT_OK;
}

static double estimate_error(const mapping *m, size_t v, uint64_t *rays) {
    const fct_error_map_def *d = m->def;
    const fct_surface *f = d->surface;
    float normal[3], rho[3];
    double variance[3], square = 0;
    fct_surface_normal(f, v, d->back, normal);
    fct_anchors_variance(d->anchors, &d->solution->elements, f->sample_points + 3 * v, normal, f->offsets[v],
                         f->flat[v], variance, rays);
    fct_surface_reflectance(d->solution->scene, d->instance, f, v, rho);
    for (size_t c = 0; c < 3; ++c) {
        const double least = LEAST_SHARE * (double)d->light[3 * v + c];
        double sum = BLEND_SHARE * variance[c] + least * least;
        if (m->counts[v]) sum += TENT_SHARE * m->tents[3 * v + c] / m->counts[v];
        square += (double)rho[c] * rho[c] * sum / 3;
    }
    return sqrt(square);
}

static void estimate_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    const mapping *m = user;
    (void)thread;
    for (size_t v = begin; v < end; ++v) {
        const bool lit = fct_surface_is_solid(m->def->surface, v) && !m->def->covered[v];
        m->error[v] = lit ? (float)estimate_error(m, v, &m->chunk_rays[chunk]) : 0;
    }
}

/* The integral of the squared error, which is linear on each face, over the faces that the check looks at. */
static double integrate_squares(const mapping *m) {
    const fct_mesh *mesh = &m->def->surface->mesh;
    const uint8_t *covered = m->def->covered;
    double sum = 0;
    for (size_t f = 0; f < mesh->face_count; ++f) {
        const uint32_t *t = mesh->triangles + 3 * f;
        if (covered[t[0]] && covered[t[1]] && covered[t[2]]) continue;
        const v3 a = v3_load(mesh->positions + 3 * (size_t)t[0]);
        const v3 e1 = v3_sub(v3_load(mesh->positions + 3 * (size_t)t[1]), a);
        const v3 e2 = v3_sub(v3_load(mesh->positions + 3 * (size_t)t[2]), a);
        const double x = m->error[t[0]], y = m->error[t[1]], z = m->error[t[2]];
        sum += .5 * v3_norm(v3_cross(e1, e2)) * (x * x + y * y + z * z + x * y + y * z + z * x) / 6;
    }
    return sum;
}

static void scale_errors(const mapping *m) {
    const fct_check *check = m->def->check;
    const double sum = integrate_squares(m), points = (double)check->points;
    if (!(sum > 0)) return;
    const double square = (points * check->square / sum + PATTERN_POINTS) / (points + PATTERN_POINTS);
    const double factor = sqrt(fct_max(square, LEAST_FACTOR));
    for (size_t v = 0; v < m->def->surface->mesh.vertex_count; ++v)
        m->error[v] = (float)(factor * (double)m->error[v]);
}

fct_result fct_error_map_add(const fct_error_map_def *def, fct_mesh *mesh, uint64_t *rays) {
    const fct_env *env = def->solution->env;
    const size_t count = mesh->vertex_count, chunks = fct_chunk_count(count, VERTEX_GRAIN);
    mapping m = {.def = def};
    const fct_array kept[] = {FCT_ARRAY(m.error, count)};
    const fct_array arrays[] = {FCT_ARRAY_ZERO(m.tents, 3 * count), FCT_ARRAY_ZERO(m.counts, count),
                                FCT_ARRAY_ZERO(m.chunk_rays, chunks)};
    fct_result result = fct_allocate_all(env, kept, FCT_LENGTH(kept), "the error of the light");
    if (result != FCT_OK) return result;
    result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "the error of the light");
    if (result == FCT_OK) result = add_tents(env, &m);
    if (result == FCT_OK)
        result = fct_parallel_for_progress(env, "errors", count, VERTEX_GRAIN, estimate_chunk, &m);
    if (result == FCT_OK) scale_errors(&m);
    for (size_t c = 0; result == FCT_OK && c < chunks; ++c) *rays += m.chunk_rays[c];
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    if (result == FCT_OK)
        mesh->error = m.error;
    else
        fct_release(env, m.error);
    return result;
}
