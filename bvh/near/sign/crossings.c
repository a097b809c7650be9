/* bvh/near/sign/crossings.c: see crossings.h.
 *
 * Whether the surface is closed follows from one sum over all sides of faces. A side from a to b adds a hash
 * h(a, b) = -h(b, a) of its ends' positions, modulo 2^64. The sum is 0 if all sides cancel, and otherwise
 * with a probability of 2^-64.
 */
#include "bvh/near/sign/crossings.h"

#include <float.h>
#include <string.h>

#include "base/hash.h"
#include "base/parallel.h"
#include "bvh/ray/ray.h"

enum { CHUNK = 1 << 15 /* faces per parallel task */ };

/* Hits nearer than this share of the model's extent do not tell on which side the point is. */
#define CLEAR 1e-5
/* The same, over the coordinates of the point. */
#define COORDINATE_CLEAR (8 * FLT_EPSILON)
/* Rays go along an axis, but not through rows of vertices. */
#define LEAN   .0137
#define LEAN_2 .0071

typedef struct side_sums {
    const fct_bvh *bvh;
    uint64_t *sums; /* per chunk */
} side_sums;

static uint64_t hash_position(const float p[3]) {
    uint64_t hash = 0;
    for (int k = 0; k < 3; ++k) {
        float x = p[k] + 0.0f; /* no -0 */
        uint32_t bits;
        memcpy(&bits, &x, sizeof bits);
        hash = fct_hash(hash ^ bits);
    }
    return hash;
}

static uint64_t hash_side(uint64_t a, uint64_t b) {
    return fct_hash(a + fct_hash(b)) - fct_hash(b + fct_hash(a));
}

static void sum_sides(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    const side_sums *s = user;
    const fct_tree_view *view = &s->bvh->view;
    uint64_t sum = 0;
    for (size_t f = begin; f < end; ++f) {
        uint64_t p[3];
        for (size_t k = 0; k < 3; ++k)
            p[k] = hash_position(view->positions + 3 * (size_t)view->triangles[3 * f + k]);
        sum += hash_side(p[0], p[1]) + hash_side(p[1], p[2]) + hash_side(p[2], p[0]);
    }
    s->sums[chunk] = sum;
}

fct_result fct_crossings_prepare(fct_bvh *bvh) {
    const fct_env *env = bvh->env;
    size_t faces = bvh->view.face_count, chunks = fct_chunk_count(faces, CHUNK);
    side_sums s = {bvh, fct_allocate(env, chunks, sizeof *s.sums)};
    if (!s.sums) return fct_fail_memory(env, "winding numbers");
    fct_parallel_for(env, faces, CHUNK, sum_sides, &s);
    uint64_t sum = 0;
    for (size_t c = 0; c < chunks; ++c) sum += s.sums[c];
    bvh->is_closed = sum == 0;
    fct_release(env, s.sums);
    return FCT_OK;
}

typedef struct crossings {
    const fct_bvh *bvh;
    v3 direction;
    double clear; /* the least t of a clear hit */
    bool is_clear;
    int64_t sum;
} crossings;

static void add_crossing(void *user, const fct_hit *hit) {
    crossings *c = user;
    fct_hit crossed = *hit;
    fct_hit_set_normal(c->bvh, &crossed);
    double along = v3_dot(v3_load(crossed.normal), c->direction);
    if (!((double)hit->t > c->clear) || along == 0) c->is_clear = false;
    c->sum += along > 0 ? 1 : -1;
}

/* The axis along which the border of the bounds is nearest, turned a little. Returns false if the point is
 * outside the bounds. */
static bool find_direction(const fct_bvh *bvh, v3 scaled, v3 *out) {
    const double p[3] = {scaled.x, scaled.y, scaled.z};
    double nearest = INFINITY, d[3];
    int axis = 0;
    for (int k = 0; k < 3; ++k) {
        double below = p[k] - (double)bvh->lower[k], above = (double)bvh->upper[k] - p[k];
        if (below < 0 || above < 0) return false;
        if (fmin(below, above) < nearest) nearest = fmin(below, above), axis = above <= below ? k : k + 3;
    }
    d[axis % 3] = axis < 3 ? 1 : -1, d[(axis + 1) % 3] = LEAN, d[(axis + 2) % 3] = LEAN_2;
    *out = (v3){d[0], d[1], d[2]};
    return true;
}

bool fct_crossings_count(const fct_bvh *bvh, v3 point, int64_t *winding, fct_visits *visits) {
    *winding = 0;
    if (!bvh->is_closed) return false;
    crossings c = {.bvh = bvh, .is_clear = true};
    if (!find_direction(bvh, fct_bvh_to_scaled(bvh, point), &c.direction)) return true;
    double extent = 0;
    for (int k = 0; k < 3; ++k)
        extent = fmax(extent, ((double)bvh->upper[k] - (double)bvh->lower[k]) / bvh->scale);
    double largest = fmax(fabs(point.x), fmax(fabs(point.y), fabs(point.z)));
    double clear = CLEAR * extent + COORDINATE_CLEAR * largest;
    fct_ray ray = {.t_min = 0, .t_max = INFINITY};
    v3_store(ray.origin, v3_mad(point, -clear, c.direction));
    v3_store(ray.direction, c.direction);
    c.direction = v3_load(ray.direction);
    c.clear = 2 * clear;
    fct_ray_visit_hits(bvh, &ray, add_crossing, &c, visits);
    *winding = c.sum;
    return c.is_clear;
}
