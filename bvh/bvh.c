/* bvh/bvh.c: creation, and the public ray queries over either backend. */
#include "bvh/bvh.h"
#include "base/parallel.h"
#include "bvh/ray/ray.h"

#include <float.h>
#include <string.h>

static const float *corner(const fct_bvh *bvh, uint32_t place, int c) {
    return bvh->view.positions + 3 * (size_t)bvh->view.triangles[3 * (size_t)place + (size_t)c];
}

bool fct_bvh_degenerate(const fct_bvh *bvh, uint32_t place) {
    const float *p[3] = {corner(bvh, place, 0), corner(bvh, place, 1), corner(bvh, place, 2)};
    double scale = bvh->scale, e[2][3];
    for (int i = 0; i < 2; ++i)
        for (int k = 0; k < 3; ++k) e[i][k] = scale * (double)p[i + 1][k] - scale * (double)p[0][k];
    /* Products of sides need more digits than a double has. */
    for (int i = 0; i < 3; ++i) {
        int j = (i + 1) % 3;
        if ((long double)e[0][i] * (long double)e[1][j] != (long double)e[0][j] * (long double)e[1][i])
            return false;
    }
    return true;
}

/* A scaled normal in the model's own unit, or where a float could not tell it, some positive multiple. */
static void unscale_normal(const fct_bvh *bvh, v3 n, float out[3]) {
    double unit = 1 / bvh->scale, largest = fmax(fabs(n.x), fmax(fabs(n.y), fabs(n.z))) * unit * unit;
    double factor = unit * unit;
    if (largest > 0x1p126 || (largest > 0 && largest < 0x1p-100)) factor *= ldexp(1, -ilogb(largest));
    v3_store(out, v3_scale(n, factor));
}

/* Bounds over the vertices that faces use, and the scale that brings the model to unit size. */
static void measure(fct_bvh *bvh) {
    const fct_tree_view *view = &bvh->view;
    fct_bounds b = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    for (size_t i = 0; i < 3 * (size_t)view->face_count; ++i) {
        const float *p = view->positions + 3 * (size_t)view->triangles[i];
        for (int k = 0; k < 3; ++k) {
            if (p[k] < b.lower[k]) b.lower[k] = p[k];
            if (p[k] > b.upper[k]) b.upper[k] = p[k];
        }
    }
    bvh->bounds = b;
    double half = 0, farthest = 0;
    for (int k = 0; k < 3; ++k) {
        half = fmax(half, ((double)b.upper[k] - (double)b.lower[k]) / 2);
        farthest = fmax(farthest, fmax(fabs((double)b.upper[k]), fabs((double)b.lower[k])));
    }
    double size = half > 0 ? half : farthest;
    bvh->scale = size > 0 ? ldexp(1, -ilogb(size) - 1) : 1;
    for (int k = 0; k < 3; ++k) {
        double lower = bvh->scale * (double)b.lower[k], upper = bvh->scale * (double)b.upper[k];
        bvh->center[k] = (float)((lower + upper) / 2);
        /* Rays moved here from afar start outside of every padded box. */
        bvh->lower[k] = nextafterf((float)lower - .01f, -INFINITY);
        bvh->upper[k] = nextafterf((float)upper + .01f, INFINITY);
    }
}

static fct_result build_obb(fct_bvh *bvh) {
    fct_leaf_list leaves = {0};
    fct_top top = {0};
    fct_result result = fct_progress(bvh->env, "ray structure", 0);
    if (result == FCT_OK) result = fct_leaves_build(bvh, &leaves);
    if (result == FCT_OK) result = fct_progress(bvh->env, "ray structure", .2);
    if (result == FCT_OK) result = fct_top_build(bvh->env, &leaves, &top);
    if (result == FCT_OK) result = fct_progress(bvh->env, "ray structure", .5);
    if (result == FCT_OK) result = fct_nodes_build(bvh, &leaves, &top);
    if (result == FCT_OK) result = fct_progress(bvh->env, "ray structure", 1);
    fct_top_release(bvh->env, &top);
    fct_leaf_list_release(bvh->env, &leaves);
    return result;
}

fct_result fct_bvh_create(const fct_env *env, const fct_tree *tree, fct_backend backend, fct_bvh **out) {
    *out = NULL;
    fct_result result = fct_tree_check(env, tree);
    if (result != FCT_OK) return result;
    fct_bvh *bvh = fct_allocate_zero(env, 1, sizeof *bvh);
    if (!bvh) return fct_fail_memory(env, "a ray structure");
    bvh->env = env;
    bvh->tree = tree;
    bvh->view = fct_tree_get(tree);
    bvh->backend = backend;
    measure(bvh);
    result = backend == FCT_BACKEND_EMBREE ? fct_embree_create(bvh) : build_obb(bvh);
    if (result == FCT_OK)
        *out = bvh;
    else
        fct_bvh_destroy(bvh);
    return result;
}

void fct_bvh_destroy(fct_bvh *bvh) {
    if (!bvh) return;
    fct_embree_destroy(bvh->env, bvh->embree);
    fct_release(bvh->env, bvh->nodes);
    fct_release(bvh->env, bvh->leaves);
    fct_release(bvh->env, bvh);
}

size_t fct_bvh_bytes(const fct_bvh *bvh) {
    size_t bytes = bvh->embree ? fct_embree_bytes(bvh->embree) : bvh->node_bytes + bvh->leaf_bytes;
    return sizeof *bvh + bytes;
}

fct_bounds fct_bvh_bounds(const fct_bvh *bvh) {
    return bvh->bounds;
}

const fct_tree *fct_bvh_tree(const fct_bvh *bvh) {
    return bvh->tree;
}

bool fct_bvh_closest_hit(const fct_bvh *bvh, const fct_ray *ray, fct_hit *hit, fct_visits *visits) {
    fct_prepared_ray prepared;
    fct_raw_hit raw;
    bool found = fct_ray_prepare(bvh, ray, &prepared) &&
                 (bvh->embree ? fct_embree_closest(bvh, &prepared, &raw)
                              : fct_traverse_closest(bvh, &prepared, &raw, visits));
    if (!found) {
        *hit = (fct_hit){.t = INFINITY, .face = FCT_NONE, .place = FCT_NONE};
        return false;
    }
    hit->t = fct_ray_t(&prepared, ray, raw.t);
    hit->u = raw.u, hit->v = raw.v;
    hit->place = raw.place;
    hit->face = bvh->view.face_ids[raw.place];
    unscale_normal(bvh, raw.normal, hit->normal);
    return true;
}

bool fct_bvh_any_hit(const fct_bvh *bvh, const fct_ray *ray, fct_visits *visits) {
    fct_prepared_ray prepared;
    return fct_ray_prepare(bvh, ray, &prepared) &&
           (bvh->embree ? fct_embree_any(bvh, &prepared) : fct_traverse_any(bvh, &prepared, visits));
}

typedef struct ray_batch {
    const fct_bvh *bvh;
    const fct_ray *rays;
    size_t count;
    fct_hit *hits;
    uint64_t *occluded;
} ray_batch;

static void closest_range(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const ray_batch *batch = user;
    for (size_t i = begin; i < end; ++i)
        fct_bvh_closest_hit(batch->bvh, &batch->rays[i], &batch->hits[i], NULL);
}

void fct_bvh_closest_hits(const fct_bvh *bvh, size_t count, const fct_ray *rays, fct_hit *hits) {
    ray_batch batch = {.bvh = bvh, .rays = rays, .count = count, .hits = hits};
    fct_parallel_for(bvh->env, count, 1024, closest_range, &batch);
}

/* Items are words of 64 rays, so that no two threads write the same word. */
static void any_range(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const ray_batch *batch = user;
    for (size_t word = begin; word < end; ++word) {
        uint64_t bits = 0;
        for (size_t i = 64 * word; i < batch->count && i < 64 * word + 64; ++i)
            bits |= (uint64_t)fct_bvh_any_hit(batch->bvh, &batch->rays[i], NULL) << (i % 64);
        batch->occluded[word] = bits;
    }
}

void fct_bvh_any_hits(const fct_bvh *bvh, size_t count, const fct_ray *rays, uint64_t *occluded) {
    ray_batch batch = {.bvh = bvh, .rays = rays, .count = count, .occluded = occluded};
    fct_parallel_for(bvh->env, (count + 63) / 64, 16, any_range, &batch);
}
