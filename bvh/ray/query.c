/* bvh/ray/query.c: the public ray queries, single and in batches, over either backend. */
#include <string.h>

#include "base/parallel.h"
#include "base/sift.h"
#include "bvh/ray/embree.h"
#include "bvh/ray/traverse.h"

/* Items per task of a batch: both are 1,024 rays. */
enum { CLOSEST_CHUNK = 1024, WORD_CHUNK = 1024 / 64 };
enum { TURNS_BYTES = 4 << 20 };
#define ALIKE (1.F / 32) /* in scaled units, and in the tangents of directions */
enum { GROUP = 128 };    /* rays that are traversed together; of any hits, whole words */

/* The scaled normal in the model's unit. If a float would overflow or vanish, the result is another positive
 * multiple of it. */
static void unscale_normal(const fct_bvh *bvh, v3 n, float out[3]) {
    double unit = 1 / bvh->scale, factor = unit * unit, x = fabs(n.x), y = fabs(n.y), z = fabs(n.z);
    double largest = (x > y ? (x > z ? x : z) : y > z ? y : z) * factor;
    if (largest > 0x1p126 || (largest > 0 && largest < 0x1p-100)) factor *= ldexp(1, -ilogb(largest));
    v3_store(out, v3_scale(n, factor));
}

bool fct_ray_closest(const fct_bvh *bvh, const fct_ray *ray, fct_raw_hit *hit, double *t,
                     fct_visits *visits) {
    if (bvh->embree) return fct_embree_closest(bvh, ray, hit, t);
    fct_prepared_ray prepared;
    if (!fct_ray_prepare(bvh, ray, &prepared) || !fct_traverse_closest(bvh, &prepared, hit, visits))
        return false;
    *t = fct_ray_unscale_t(&prepared, hit->t);
    return true;
}

static void report_miss(fct_hit *hit) {
    *hit = (fct_hit){.t = INFINITY, .face = FCT_NONE, .place = FCT_NONE};
}

static void report_hit(const fct_bvh *bvh, const fct_ray *ray, const fct_raw_hit *raw, double t,
                       fct_hit *hit) {
    hit->t = fct_ray_clamp_t(ray, t);
    hit->u = raw->u, hit->v = raw->v;
    hit->place = raw->place;
    hit->face = bvh->view.face_ids[raw->place];
    unscale_normal(bvh, raw->normal, hit->normal);
}

bool fct_bvh_closest_hit(const fct_bvh *bvh, const fct_ray *ray, fct_hit *hit, fct_visits *visits) {
    fct_raw_hit raw;
    double t;
    bool found = fct_ray_closest(bvh, ray, &raw, &t, visits);
    if (found)
        report_hit(bvh, ray, &raw, t, hit);
    else
        report_miss(hit);
    return found;
}

bool fct_bvh_closest_hit_except(const fct_bvh *bvh, const fct_ray *ray, uint32_t face, fct_hit *hit,
                                fct_visits *visits) {
    fct_raw_hit raw;
    fct_prepared_ray prepared;
    report_miss(hit);
    if (bvh->embree || !fct_ray_prepare(bvh, ray, &prepared)) return false;
    prepared.except = face;
    if (!fct_traverse_closest(bvh, &prepared, &raw, visits)) return false;
    report_hit(bvh, ray, &raw, fct_ray_unscale_t(&prepared, raw.t), hit);
    return true;
}

void fct_ray_visit_hits(const fct_bvh *bvh, const fct_ray *ray, fct_visit_hit *visit, void *user,
                        fct_visits *visits) {
    fct_prepared_ray prepared;
    if (!bvh->embree && fct_ray_prepare(bvh, ray, &prepared))
        fct_traverse_all(bvh, ray, &prepared, visit, user, visits);
}

void fct_hit_set_normal(const fct_bvh *bvh, fct_hit *hit) {
    const uint32_t *corners = bvh->view.triangles + 3 * (size_t)hit->place;
    v3 p[3];
    for (int c = 0; c < 3; ++c)
        p[c] = fct_bvh_to_scaled(bvh, v3_load(bvh->view.positions + 3 * (size_t)corners[c]));
    unscale_normal(bvh, v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])), hit->normal);
}

/* The first `capacity` hits so far: a heap, the last hit on top. */
typedef struct hit_list {
    fct_hit *hits;
    size_t capacity, found; /* found counts all hits */
} hit_list;

static bool is_before(const void *items, size_t i, size_t j) {
    const fct_hit *a = (const fct_hit *)items + i, *b = (const fct_hit *)items + j;
    return a->t < b->t || (a->t == b->t && a->face < b->face);
}

static void swap_hits(void *items, size_t i, size_t j) {
    fct_hit *hits = items, kept = hits[i];
    hits[i] = hits[j];
    hits[j] = kept;
}

static void keep_hit(void *user, const fct_hit *hit) {
    hit_list *list = user;
    size_t found = list->found++;
    if (found < list->capacity) {
        list->hits[found] = *hit;
        fct_sift_up(list->hits, found, is_before, swap_hits);
    } else if (list->capacity) {
        const fct_hit both[2] = {*hit, list->hits[0]};
        if (!is_before(both, 0, 1)) return;
        list->hits[0] = *hit;
        fct_sift_down(list->hits, 0, list->capacity, is_before, swap_hits);
    }
}

size_t fct_bvh_all_hits(const fct_bvh *bvh, const fct_ray *ray, size_t capacity, fct_hit *hits,
                        fct_visits *visits) {
    hit_list list = {hits, capacity, 0};
    fct_ray_visit_hits(bvh, ray, keep_hit, &list, visits);
    size_t kept = list.found < capacity ? list.found : capacity;
    fct_sift_sort(hits, kept, is_before, swap_hits);
    for (size_t i = 0; i < kept; ++i) fct_hit_set_normal(bvh, &hits[i]);
    return list.found;
}

bool fct_bvh_any_hit(const fct_bvh *bvh, const fct_ray *ray, fct_visits *visits) {
    if (bvh->embree) return fct_embree_any(bvh, ray);
    fct_prepared_ray prepared;
    return fct_ray_prepare(bvh, ray, &prepared) && fct_traverse_any(bvh, &prepared, visits);
}

typedef struct ray_batch {
    const fct_bvh *bvh;
    const fct_ray *rays;
    size_t count;
    fct_hit *hits;
    uint64_t *occluded;
} ray_batch;

/* Rays that are prepared and then traversed together. */
typedef struct ray_group {
    uint32_t count, number[GROUP]; /* of each ray, from the first of the group */
    fct_prepared_ray rays[GROUP];
    fct_raw_hit hits[GROUP];
} ray_group;

/* Whether rays in turns gain: below this size the caches hold the model, and a ray hardly waits. */
static bool takes_turns(const fct_bvh *bvh) {
    return !bvh->embree && bvh->node_bytes + bvh->leaf_bytes > TURNS_BYTES;
}

/* Whether most rays begin close to the one before, in nearly its direction. Such rays find what they need in
 * the caches, where the one before has been. */
static bool are_alike(const ray_group *g) {
    uint32_t count = 0;
    for (uint32_t i = 1; i < g->count; ++i) {
        const fct_prepared_ray *a = &g->rays[i - 1], *b = &g->rays[i];
        bool alike = a->axis[2] == b->axis[2] && a->side[a->axis[2]] == b->side[a->axis[2]];
        for (int k = 0; k < 3; ++k) alike = alike && fabsf(a->origin[k] - b->origin[k]) < ALIKE;
        for (int k = 0; k < 2; ++k) alike = alike && fabsf(a->shear[k] - b->shear[k]) < ALIKE;
        count += alike;
    }
    return 4 * count >= 3 * g->count;
}

/* Leaves out the rays that cannot hit. */
static void traverse_group(const fct_bvh *bvh, const fct_ray *rays, size_t count, bool any, ray_group *g) {
    g->count = 0;
    for (uint32_t i = 0; i < count; ++i)
        if (fct_ray_prepare(bvh, &rays[i], &g->rays[g->count])) g->number[g->count++] = i;
    if (!are_alike(g)) {
        fct_traverse_many(bvh, g->count, g->rays, any, g->hits);
        return;
    }
    for (uint32_t i = 0; i < g->count; ++i) {
        if (any)
            g->hits[i].place = fct_traverse_any(bvh, &g->rays[i], NULL) ? 0 : FCT_NONE;
        else
            fct_traverse_closest(bvh, &g->rays[i], &g->hits[i], NULL);
    }
}

static void find_closest_hits(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const ray_batch *batch = user;
    const fct_bvh *bvh = batch->bvh;
    ray_group g;
    for (size_t first = begin; first < end; first += GROUP) {
        const size_t count = end - first < GROUP ? end - first : GROUP;
        const fct_ray *rays = batch->rays + first;
        fct_hit *hits = batch->hits + first;
        if (!takes_turns(bvh)) {
            for (size_t i = 0; i < count; ++i) fct_bvh_closest_hit(bvh, &rays[i], &hits[i], NULL);
            continue;
        }
        for (size_t i = 0; i < count; ++i) report_miss(&hits[i]);
        traverse_group(bvh, rays, count, false, &g);
        for (uint32_t i = 0; i < g.count; ++i) {
            const uint32_t n = g.number[i];
            if (g.hits[i].place != FCT_NONE)
                report_hit(bvh, &rays[n], &g.hits[i], fct_ray_unscale_t(&g.rays[i], g.hits[i].t), &hits[n]);
        }
    }
}

void fct_bvh_closest_hits(const fct_bvh *bvh, size_t count, const fct_ray *rays, fct_hit *hits) {
    ray_batch batch = {.bvh = bvh, .rays = rays, .count = count, .hits = hits};
    fct_parallel_for(bvh->env, count, CLOSEST_CHUNK, find_closest_hits, &batch);
}

/* An item is a word of 64 rays, so that two threads never write the same word. */
static void find_any_hits(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const ray_batch *batch = user;
    const fct_bvh *bvh = batch->bvh;
    ray_group g;
    for (size_t first = 64 * begin; first < 64 * end && first < batch->count; first += GROUP) {
        const size_t left = (64 * end < batch->count ? 64 * end : batch->count) - first,
                     count = left < GROUP ? left : GROUP;
        const fct_ray *rays = batch->rays + first;
        uint64_t *words = batch->occluded + first / 64;
        memset(words, 0, (count + 63) / 64 * sizeof *words);
        if (!takes_turns(bvh)) {
            for (size_t i = 0; i < count; ++i)
                words[i / 64] |= (uint64_t)fct_bvh_any_hit(bvh, &rays[i], NULL) << (i % 64);
            continue;
        }
        traverse_group(bvh, rays, count, true, &g);
        for (uint32_t i = 0; i < g.count; ++i)
            words[g.number[i] / 64] |= (uint64_t)(g.hits[i].place != FCT_NONE) << (g.number[i] % 64);
    }
}

void fct_bvh_any_hits(const fct_bvh *bvh, size_t count, const fct_ray *rays, uint64_t *occluded) {
    ray_batch batch = {.bvh = bvh, .rays = rays, .count = count, .occluded = occluded};
    fct_parallel_for(bvh->env, (count + 63) / 64, WORD_CHUNK, find_any_hits, &batch);
}
