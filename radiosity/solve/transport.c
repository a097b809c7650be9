/* radiosity/solve/transport.c: see transport.h. */
#include "radiosity/solve/transport.h"

#include <string.h>

#include "radiosity/solve/iterate.h"
#include "radiosity/solve/oracle.h"
#include "radiosity/surface/cover.h"
#include "scene/coarse.h"
#include "scene/rays.h"

/* Points per leaf for direct light, shadow rays per point and lamp, and points that test for coincident
 * faces. The mean over many leaves is unbiased with any number; fewer points make single leaves noisier. */
enum { DIRECT_POINTS = 4, DIRECT_RAYS = 2, BARE_POINTS = 4 };
/* Rounds of splits at shadow borders: each halves a cluster's area or quarters a triangle's. Sweeps: the
 * error falls by the factor rho per sweep, so 1000 reach a tolerance of 1e-4 up to a reflectance of .99. */
enum { MOST_ROUNDS = 8, MOST_SWEEPS = 1000 };
/* A leaf with |S| / A below BENT has sides that see different light, and a ray that hits it finds their mean.
 * Without these splits, indirect light on the museum's pierced sphere was 5.7 % too high (1.6 % with them,
 * for 7 % more rays). LEAST_BENT_AREA is a share of the scene's area: it keeps the number of splits
 * independent of the number of triangles. */
#define BENT            .95
#define LEAST_BENT_AREA 2e-6
enum { LEAF_GRAIN = 16 }; /* leaves per chunk */
/* The least open part of a leaf that counts. Its direct light comes from few points, so a smaller divisor
 * would make single leaves far too bright. */
#define LEAST_OPEN .125F
/* Hits that are not a leaf. */
#define HIT_NOTHING FCT_NONE
#define HIT_BLACK   (FCT_NONE - 1)

static const float black[3] = {0, 0, 0};

fct_found fct_transport_look(const fct_elements *set, const float *stored, const float origin[3],
                             const float direction[3]) {
    fct_ray ray = {.t_min = 0, .t_max = INFINITY};
    memcpy(ray.origin, origin, sizeof ray.origin);
    memcpy(ray.direction, direction, sizeof ray.direction);
    fct_scene_hit hit;
    if (!fct_scene_light_hit(set->scene, &ray, &hit, NULL))
        return (fct_found){.radiosity = black, .leaf = FCT_NONE, .distance = INFINITY};
    double cosine = v3_dot(v3_load(direction), v3_load(hit.normal));
    const fct_coarse *coarse = fct_scene_coarse_model(set->scene, set->view.instances[hit.instance].model);
    /* The back of a patch of a closed surface: the ray has passed between patches that do not meet. */
    const bool back = cosine > 0 && !(coarse && coarse->closed);
    uint32_t leaf = fct_elements_locate(set, hit.instance, back, hit.place, hit.u, hit.v);
    if (leaf == FCT_NONE)
        return (fct_found){.radiosity = black, .leaf = FCT_NONE, .distance = hit.t, .black = true};
    const v3 normal = v3_scale(v3_load(hit.normal), cosine > 0 ? -1 : 1);
    return (fct_found){stored + 3 * (size_t)leaf, leaf, hit.t, fabs(cosine), false, normal};
}

typedef struct gathering {
    fct_elements *set;
    const fct_lamps *lamps;
    fct_transport *out;
    const uint32_t *leaves;
    size_t leaf_count;
    uint32_t *hits; /* leaf x rays: the element hit, HIT_NOTHING or HIT_BLACK */
    float *spread;  /* per leaf: fct_direct_spread; NULL once splitting is over */
    float *bare;    /* per leaf: fraction of the surface that no other face covers exactly */
    float *open; /* per leaf: fraction of the surface that some ray can see, at least LEAST_OPEN; 1 if none */
    double *irradiance; /* per leaf x 3: of the sweep under way */
    uint64_t *chunk_rays;
    uint32_t rays; /* per leaf */
    uint64_t seed;
} gathering;

/* Direct irradiance at DIRECT_POINTS points of an element. The points that measure the stored light (fresh 1)
 * differ from those that decided on splits (fresh 0): a leaf that passed the test has points that are more
 * alike than its surface. */
static void sample_direct(const gathering *g, uint32_t id, uint64_t fresh, double irradiance[][3],
                          uint64_t *rays) {
    const uint64_t stride = FCT_ELEMENT_POINTS / DIRECT_POINTS;
    for (int k = 0; k < DIRECT_POINTS; ++k) {
        const uint64_t turn = (fct_hash3(g->seed, id, (uint64_t)k) + fresh) % stride;
        fct_element_point p;
        fct_element_point_at(g->set, id, (uint32_t)((uint64_t)k * stride + turn), &p);
        double x[3], n[3];
        for (int c = 0; c < 3; ++c) x[c] = p.position[c], n[c] = p.normal[c];
        fct_lamps_direct(g->lamps, g->set->scene, x, n, p.offset, fct_hash3(g->seed + fresh, id, (uint64_t)k),
                         DIRECT_RAYS | FCT_LAMPS_FIXED, NULL, NULL, irradiance[k], rays);
    }
}

static void direct_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    gathering *g = user;
    (void)thread;
    uint64_t rays = 0;
    for (size_t l = begin; l < end; ++l) {
        uint32_t id = g->leaves[l];
        double irradiance[DIRECT_POINTS][3];
        sample_direct(g, id, g->spread ? 0 : 1, irradiance, &rays);
        if (g->spread) {
            g->spread[l] =
                (float)fct_direct_spread(&g->set->items[id], DIRECT_POINTS, (const double(*)[3])irradiance);
            continue;
        }
        double *mean = g->out->direct + 3 * (size_t)id;
        for (int c = 0; c < 3; ++c) {
            mean[c] = 0;
            for (int k = 0; k < DIRECT_POINTS; ++k) mean[c] += irradiance[k][c] / DIRECT_POINTS;
        }
    }
    g->chunk_rays[chunk] += rays;
}

/* True unless a ray straight down onto the point hits another face, which then coincides with the point's. A
 * patch overlaps its neighbours. */
static bool is_bare(const fct_elements *set, uint32_t instance, const fct_element_point *p) {
    if (fct_scene_coarse_model(set->scene, set->view.instances[instance].model)) return true;
    fct_ray ray = {.t_min = 0, .t_max = 2};
    fct_scene_hit hit;
    for (int c = 0; c < 3; ++c) {
        ray.origin[c] = p->position[c] + p->offset * p->normal[c];
        ray.direction[c] = -p->offset * p->normal[c];
    }
    if (!fct_scene_light_hit(set->scene, &ray, &hit, NULL)) return true;
    return hit.instance == instance && hit.place == p->place;
}

static bool is_covered(const gathering *g, const fct_element_point *p, uint64_t seed, uint64_t *rays) {
    return fct_point_is_covered(g->set->scene, p->position, p->normal, p->offset, seed, NULL, rays);
}

/* The fraction of the uncovered surface that no other face covers exactly. */
static float measure_bare(const gathering *g, uint32_t id, uint64_t seed, uint64_t *rays) {
    uint32_t bare = 0, points = 0;
    for (uint32_t k = 0; k < BARE_POINTS; ++k) {
        fct_element_point p;
        fct_element_point_at(g->set, id, 4 * k, &p);
        const bool alone = is_bare(g->set, g->set->items[id].instance, &p);
        if (!alone && is_covered(g, &p, fct_hash3(seed, k, 1), rays)) continue;
        ++points, bare += alone;
    }
    return points > 0 ? (float)bare / (float)points : 1;
}

static void hit_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    gathering *g = user;
    (void)thread;
    uint64_t rays = (uint64_t)(end - begin) * g->rays;
    for (size_t l = begin; l < end; ++l) {
        uint32_t id = g->leaves[l], covered = 0;
        uint64_t seed = fct_hash2(g->seed ^ 0x6761746865720001u, id);
        g->bare[l] = measure_bare(g, id, seed, &rays);
        for (uint32_t k = 0; k < g->rays; ++k) {
            double plane[2], place[2];
            fct_plane_point(k, seed, plane);
            fct_plane_point(fct_shuffle_index(k, (uint32_t)seed), fct_hash(seed), place);
            fct_element_point p;
            fct_element_sample(g->set, id, (k + place[0]) / g->rays, place[1],
                               fct_uniform(fct_hash2(seed, k)), &p);
            v3 d = fct_cosine_direction(v3_load(p.normal), plane[0], plane[1]);
            float origin[3], direction[3];
            v3_store(origin, v3_mad(v3_load(p.position), p.offset, v3_load(p.normal)));
            v3_store(direction, d);
            fct_found found = fct_transport_look(g->set, g->out->stored, origin, direction);
            g->hits[l * g->rays + k] = found.leaf != FCT_NONE ? found.leaf
                                       : found.black          ? HIT_BLACK
                                                              : HIT_NOTHING;
            covered += found.black && is_covered(g, &p, fct_hash3(seed, k, 2), &rays);
        }
        const float open = 1 - (float)covered / (float)g->rays;
        g->open[l] = open == 0 ? 1 : open > LEAST_OPEN ? open : LEAST_OPEN;
    }
    g->chunk_rays[chunk] += rays;
}

/* Irradiance of leaf l: direct light plus the mean over the hits. halves (may be NULL) receives the
 * irradiance, summed over channels, from the first and from the second half of the rays alone. */
static void leaf_irradiance(const gathering *g, size_t l, double total[3], double halves[2]) {
    const uint32_t *hits = g->hits + l * g->rays;
    double sums[2][3] = {{0, 0, 0}, {0, 0, 0}};
    for (uint32_t k = 0; k < g->rays; ++k) {
        if (hits[k] >= HIT_BLACK) continue;
        const float *b = g->out->stored + 3 * (size_t)hits[k];
        for (int c = 0; c < 3; ++c) sums[2 * k >= g->rays][c] += b[c];
    }
    const double *direct = g->out->direct + 3 * (size_t)g->leaves[l];
    const double open = g->open[l];
    for (int c = 0; c < 3; ++c) total[c] = (direct[c] + (sums[0][c] + sums[1][c]) / g->rays) / open;
    for (int h = 0; halves && h < 2; ++h) {
        halves[h] = 0;
        for (int c = 0; c < 3; ++c) halves[h] += (direct[c] + 2 * sums[h][c] / g->rays) / open;
    }
}

static void gather_leaves(void *user, size_t begin, size_t end, fct_change *sum) {
    gathering *g = user;
    for (size_t l = begin; l < end; ++l) {
        leaf_irradiance(g, l, g->irradiance + 3 * l, NULL);
        fct_change_add(sum, &g->set->items[g->leaves[l]], g->irradiance + 3 * l);
    }
}

/* Sets the radiosity of a leaf, and the part of it that a gather ray finds. */
static void store_leaf(gathering *g, uint32_t id) {
    fct_element *e = &g->set->items[id];
    bool sampled = fct_lamps_sampled(g->lamps, e->instance);
    for (int c = 0; c < 3; ++c) {
        double reflected = e->reflectance[c] * e->irradiance[c];
        e->radiosity[c] = e->emission[c] + reflected;
        g->out->stored[3 * (size_t)id + (size_t)c] = (float)(sampled ? reflected : e->radiosity[c]);
    }
}

static void publish_leaves(void *user) {
    gathering *g = user;
    for (size_t l = 0; l < g->leaf_count; ++l) {
        fct_element *e = &g->set->items[g->leaves[l]];
        memcpy(e->irradiance, g->irradiance + 3 * l, sizeof e->irradiance);
        store_leaf(g, g->leaves[l]);
    }
}

static fct_result iterate_leaves(gathering *g, double tolerance) {
    fct_sweep_def def = {.gather = gather_leaves,
                         .publish = publish_leaves,
                         .user = g,
                         .count = g->leaf_count,
                         .grain = 64,
                         .tolerance = tolerance,
                         .most = MOST_SWEEPS,
                         .phase = "iteration"};
    fct_sweep_result done;
    fct_result result = fct_iterate(g->set, &def, &done);
    g->out->sweeps = done.sweeps, g->out->change = done.change, g->out->converged = done.converged;
    return result;
}

/* Power balance and noise. Emitted, absorbed and escaped power are counted separately, so that emitted =
 * absorbed + escaped is a check and not a definition: a surface absorbs (1 - rho) E, and its rays carry b out
 * of the scene or onto black backs. Of faces that coincide, rays hit one only; `bare` counts it once. */
static void balance_power(gathering *g) {
    fct_transport *out = g->out;
    double noise = 0, level = 0;
    for (size_t l = 0; l < g->leaf_count; ++l) {
        const fct_element *e = &g->set->items[g->leaves[l]];
        double irradiance[3], halves[2], lost = 0, dark = 0, area = e->area * g->bare[l],
                                         hidden = 1 - g->open[l];
        leaf_irradiance(g, l, irradiance, halves);
        for (uint32_t k = 0; k < g->rays; ++k) {
            lost += g->hits[l * g->rays + k] == HIT_NOTHING;
            dark += g->hits[l * g->rays + k] == HIT_BLACK;
        }
        for (int c = 0; c < 3; ++c) {
            double b = e->emission[c] + e->reflectance[c] * irradiance[c];
            out->emitted += e->emission[c] * area;
            out->absorbed += (1 - e->reflectance[c]) * irradiance[c] * area * (1 - hidden);
            out->absorbed += (b * (dark / g->rays - hidden) + e->emission[c] * hidden) * area;
            out->escaped += b * area * lost / g->rays;
        }
        level += e->area * (halves[0] + halves[1]) * (halves[0] + halves[1]) / 4;
        noise += e->area * (halves[0] - halves[1]) * (halves[0] - halves[1]) / 4;
    }
    out->noise = level > 0 ? sqrt(noise / level) : 0;
}

/* Rays per leaf at the default error, by the number of leaves. Few leaves need more rays each, because each
 * one's noise shows on a large part of the scene. */
static double rays_per_leaf(size_t leaf_count) {
    return leaf_count < 4096 ? 512 : leaf_count < 16384 ? 128 : 64;
}

static size_t list_leaves(const fct_elements *set, size_t from, uint32_t *leaves) {
    size_t n = 0;
    for (size_t id = from; id < set->count; ++id) {
        const fct_element *e = &set->items[id];
        if (e->child_count == 0 && e->kind != FCT_ELEMENT_VOLUME && e->area > 0) leaves[n++] = (uint32_t)id;
    }
    return n;
}

/* Splits bent leaves down to LEAST_BENT_AREA. */
static fct_result split_bent_leaves(fct_elements *set) {
    const double least = LEAST_BENT_AREA * set->items[0].area;
    for (size_t id = 0; id < set->count; ++id) {
        const fct_element *e = &set->items[id];
        if (e->kind != FCT_ELEMENT_CLUSTER || e->area < least || !fct_elements_can_split(set, (uint32_t)id))
            continue;
        if (v3_norm(e->vector) > BENT * e->area) continue;
        fct_result result = fct_elements_split(set, (uint32_t)id);
        if (result != FCT_OK) return result;
    }
    return FCT_OK;
}

/* Measures the direct light of the leaves from element `from` on, and splits those that vary too much. */
static fct_result split_round(gathering *g, size_t from, double epsilon) {
    fct_elements *set = g->set;
    const fct_env *env = set->env;
    size_t most = set->count - from, chunks = fct_chunk_count(set->count, LEAF_GRAIN);
    uint32_t *leaves;
    const fct_array arrays[] = {FCT_ARRAY(leaves, most), FCT_ARRAY(g->spread, most),
                                FCT_ARRAY_ZERO(g->chunk_rays, chunks)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "direct light");
    if (result != FCT_OK) return result;
    size_t count = list_leaves(set, from, leaves);
    g->leaves = leaves;
    fct_parallel_for(env, count, LEAF_GRAIN, direct_chunk, g);
    for (size_t c = 0; c < chunks; ++c) g->out->rays += g->chunk_rays[c];
    for (size_t l = 0; l < count && result == FCT_OK; ++l)
        if (g->spread[l] > epsilon && fct_elements_can_split(set, leaves[l]))
            result = fct_elements_split(set, leaves[l]);
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    g->leaves = NULL;
    return result;
}

/* Splits leaves that a border of direct light crosses; each round looks at the elements of the round before.
 */
static fct_result split_by_direct(gathering *g, double epsilon) {
    fct_elements *set = g->set;
    fct_result result = FCT_OK;
    size_t from = 0;
    for (int round = 0; round < MOST_ROUNDS && result == FCT_OK && from < set->count; ++round) {
        if ((result = fct_progress(set->env, "direct light", round / (double)MOST_ROUNDS)) != FCT_OK) break;
        fct_elements_make_points(set);
        size_t count = set->count;
        result = split_round(g, from, epsilon);
        from = count;
    }
    fct_elements_make_points(set);
    return result;
}

/* Gathers over the leaves and solves. g->out has its arrays. */
static fct_result gather_and_solve(gathering *g, double tolerance) {
    const fct_env *env = g->set->env;
    size_t count = g->leaf_count, chunks = fct_chunk_count(count, LEAF_GRAIN);
    const fct_array arrays[] = {FCT_ARRAY(g->hits, count * g->rays), FCT_ARRAY_ZERO(g->chunk_rays, chunks),
                                FCT_ARRAY(g->bare, count), FCT_ARRAY(g->open, count),
                                FCT_ARRAY(g->irradiance, 3 * count)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "the solution");
    if (result != FCT_OK) return result;
    result = fct_parallel_for_progress(env, "direct light", count, LEAF_GRAIN, direct_chunk, g);
    if (result != FCT_OK) goto done;
    result = fct_parallel_for_progress(env, "gathering", count, LEAF_GRAIN, hit_chunk, g);
    if (result != FCT_OK) goto done;
    for (size_t c = 0; c < chunks; ++c) g->out->rays += g->chunk_rays[c];
    for (size_t l = 0; l < count; ++l) store_leaf(g, g->leaves[l]);
    if ((result = iterate_leaves(g, tolerance)) == FCT_OK) balance_power(g);
done:
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    return result;
}

fct_result fct_transport_solve(fct_elements *set, const fct_lamps *lamps, const fct_transport_def *def,
                               fct_transport *out) {
    const fct_env *env = set->env;
    *out = (fct_transport){0};
    gathering g = {.set = set, .lamps = lamps, .out = out, .seed = def->seed};
    fct_result result = split_bent_leaves(set);
    if (result == FCT_OK) result = split_by_direct(&g, def->epsilon);
    if (result != FCT_OK) return result;
    uint32_t *leaves;
    const fct_array arrays[] = {FCT_ARRAY_ZERO(out->stored, 3 * set->count),
                                FCT_ARRAY_ZERO(out->direct, 3 * set->count), FCT_ARRAY(leaves, set->count)};
    result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "the solution");
    if (result != FCT_OK) return result;
    g.leaves = leaves;
    g.leaf_count = list_leaves(set, 0, leaves);
    g.rays = (uint32_t)(def->fineness * rays_per_leaf(g.leaf_count));
    result = gather_and_solve(&g, def->tolerance);
    if (result == FCT_OK) fct_elements_pull(set);
    fct_release(env, leaves);
    if (result != FCT_OK) fct_transport_release(env, out);
    return result;
}

void fct_transport_release(const fct_env *env, fct_transport *t) {
    fct_release(env, t->stored);
    fct_release(env, t->direct);
    *t = (fct_transport){0};
}
