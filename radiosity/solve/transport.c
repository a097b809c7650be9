/* radiosity/solve/transport.c: see transport.h. Cost: leaves x rays. */
#include "radiosity/solve/transport.h"

#include <string.h>

enum { DIRECT_POINTS = 4, BARE_POINTS = 4, MOST_ROUNDS = 8, MOST_SWEEPS = 1000 };
/* A leaf partly in full shadow may reach under a wall into a room without light: it is split so much sooner.
 */
#define DARK_WEIGHT 16
/* |S| / A of a leaf below which it is bent, and the share of the scene's area that is too small to matter. */
#define BENT            .95
#define LEAST_BENT_AREA 2e-6
/* Kept hits that are no leaf. */
#define HIT_NOTHING FCT_NONE
#define HIT_BLACK   (FCT_NONE - 1)

static const float black[3] = {0, 0, 0};

fct_found fct_transport_look(const fct_elements *set, const float *stored, const float origin[3],
                             const float direction[3]) {
    fct_ray ray = {.t_min = 0, .t_max = INFINITY};
    memcpy(ray.origin, origin, sizeof ray.origin);
    memcpy(ray.direction, direction, sizeof ray.direction);
    fct_scene_hit hit;
    if (!fct_scene_closest_hit(set->scene, &ray, &hit, NULL))
        return (fct_found){black, FCT_NONE, INFINITY, false};
    bool back =
        direction[0] * hit.normal[0] + direction[1] * hit.normal[1] + direction[2] * hit.normal[2] > 0;
    uint32_t leaf = fct_elements_locate(set, hit.instance, back, hit.place, hit.u, hit.v);
    if (leaf == FCT_NONE) return (fct_found){black, FCT_NONE, hit.t, true};
    return (fct_found){stored + 3 * (size_t)leaf, leaf, hit.t, false};
}

typedef struct gathering {
    fct_elements *set;
    const fct_lamps *lamps;
    fct_transport *out;
    const uint32_t *leaves;
    uint32_t *hits;
    float *spread; /* per leaf: how much direct light varies over its points, power */
    float *bare;   /* per leaf: the part of it that no other surface coincides with and is hit in its stead */
    uint64_t *chunk_rays;
    uint32_t rays;
    uint64_t seed;
} gathering;

static void direct_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    gathering *g = user;
    (void)thread;
    uint64_t rays = 0;
    for (size_t l = begin; l < end; ++l) {
        uint32_t id = g->leaves[l];
        const fct_element *e = &g->set->items[id];
        const fct_element_point *points = g->set->points + (size_t)id * FCT_ELEMENT_POINTS;
        double sum[3] = {0, 0, 0}, least[3], most[3], spread = 0;
        const size_t stride = FCT_ELEMENT_POINTS / DIRECT_POINTS;
        bool dark = false;
        /* not the points that decided on splits: what passed their test is biased */
        const uint64_t fresh = g->out->direct ? 1 : 0;
        for (int k = 0; k < DIRECT_POINTS; ++k) {
            const fct_element_point *p =
                &points[(size_t)k * stride + (fct_hash3(g->seed, id, (uint64_t)k) + fresh) % stride];
            double x[3], n[3], irradiance[3];
            for (int c = 0; c < 3; ++c) x[c] = p->position[c], n[c] = p->normal[c];
            fct_lamps_direct(g->lamps, g->set->scene, x, n, p->offset,
                             fct_hash3(g->seed + fresh, id, (uint64_t)k), 2 | FCT_LAMPS_FIXED, irradiance,
                             &rays);
            for (int c = 0; c < 3; ++c) {
                sum[c] += irradiance[c] / DIRECT_POINTS;
                least[c] = k ? fmin(least[c], irradiance[c]) : irradiance[c];
                most[c] = k ? fmax(most[c], irradiance[c]) : irradiance[c];
            }
        }
        for (int c = 0; c < 3; ++c) {
            if (g->out->direct) g->out->direct[3 * (size_t)id + (size_t)c] = sum[c];
            spread += e->reflectance[c] * (most[c] - least[c]) * e->area;
            dark |= least[c] <= 0 && most[c] > 0;
        }
        if (dark) spread *= DARK_WEIGHT;
        if (g->spread) g->spread[l] = (float)spread;
    }
    g->chunk_rays[chunk] += rays;
}

/* Whether a ray that comes down on the point meets its face, or another that lies in the very same place. */
static bool is_bare(const fct_elements *set, uint32_t instance, const fct_element_point *p) {
    fct_ray ray = {.t_min = 0, .t_max = 2};
    fct_scene_hit hit;
    for (int c = 0; c < 3; ++c) {
        ray.origin[c] = p->position[c] + p->offset * p->normal[c];
        ray.direction[c] = -p->offset * p->normal[c];
    }
    if (!fct_scene_closest_hit(set->scene, &ray, &hit, NULL)) return true;
    return hit.instance == instance && hit.place == p->place;
}

static void hit_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    gathering *g = user;
    (void)thread;
    for (size_t l = begin; l < end; ++l) {
        uint32_t id = g->leaves[l];
        uint64_t seed = fct_hash2(g->seed ^ 0x6761746865720001u, id);
        uint32_t instance = g->set->items[id].instance, bare = 0;
        for (int k = 0; k < BARE_POINTS; ++k)
            bare +=
                is_bare(g->set, instance, &g->set->points[(size_t)id * FCT_ELEMENT_POINTS + 4 * (size_t)k]);
        g->bare[l] = (float)bare / BARE_POINTS;
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
        }
    }
    g->chunk_rays[chunk] += (uint64_t)(end - begin) * g->rays;
}

/* Irradiance of leaf l from its direct light and kept hits; halves, if not NULL, receives that of the
 * first and of the second half of the rays. */
static void leaf_irradiance(const gathering *g, size_t l, double total[3], double halves[2]) {
    const uint32_t *hits = g->hits + l * g->rays;
    double sums[2][3] = {{0, 0, 0}, {0, 0, 0}};
    for (uint32_t k = 0; k < g->rays; ++k) {
        if (hits[k] >= HIT_BLACK) continue;
        const float *b = g->out->stored + 3 * (size_t)hits[k];
        for (int c = 0; c < 3; ++c) sums[2 * k >= g->rays][c] += b[c];
    }
    const double *direct = g->out->direct + 3 * (size_t)g->leaves[l];
    for (int c = 0; c < 3; ++c) total[c] = direct[c] + (sums[0][c] + sums[1][c]) / g->rays;
    for (int h = 0; halves && h < 2; ++h) {
        halves[h] = 0;
        for (int c = 0; c < 3; ++c) halves[h] += direct[c] + 2 * sums[h][c] / g->rays;
    }
}

typedef struct sweep {
    const gathering *g;
    double *change, *norm;
    double *irradiance; /* leaf x 3 */
} sweep;

static void sweep_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    sweep *s = user;
    (void)thread;
    double change = 0, norm = 0;
    for (size_t l = begin; l < end; ++l) {
        const fct_element *e = &s->g->set->items[s->g->leaves[l]];
        leaf_irradiance(s->g, l, s->irradiance + 3 * l, NULL);
        for (int c = 0; c < 3; ++c) {
            double d = e->reflectance[c] * (s->irradiance[3 * l + (size_t)c] - e->irradiance[c]);
            double b = e->emission[c] + e->reflectance[c] * s->irradiance[3 * l + (size_t)c];
            change += e->area * d * d;
            norm += e->area * b * b;
        }
    }
    s->change[chunk] = change;
    s->norm[chunk] = norm;
}

/* What gather rays find on a leaf. */
static void store(fct_elements *set, const fct_lamps *lamps, float *stored, uint32_t id) {
    fct_element *e = &set->items[id];
    bool sampled = fct_lamps_sampled(lamps, e->instance);
    for (int c = 0; c < 3; ++c) {
        double reflected = e->reflectance[c] * e->irradiance[c];
        e->radiosity[c] = e->emission[c] + reflected;
        stored[3 * (size_t)id + (size_t)c] = (float)(sampled ? reflected : e->radiosity[c]);
    }
}

static fct_result iterate(gathering *g, size_t leaf_count, double tolerance) {
    fct_elements *set = g->set;
    fct_transport *out = g->out;
    size_t chunks = fct_chunk_count(leaf_count, 64);
    double *sums = fct_allocate(set->env, 2 * chunks, sizeof *sums);
    double *irradiance = fct_allocate(set->env, 3 * leaf_count, sizeof *irradiance);
    if (!sums || !irradiance) {
        fct_release(set->env, sums);
        fct_release(set->env, irradiance);
        return fct_fail_memory(set->env, "the iteration");
    }
    double rho = 0;
    for (uint32_t k = 0; k < set->view.material_count; ++k)
        for (int c = 0; c < 3; ++c) rho = fmax(rho, set->view.materials[k].reflectance[c]);
    double bound = rho > 0 ? tolerance * (1 - rho) / rho : HUGE_VAL;
    sweep s = {.g = g, .change = sums, .norm = sums + chunks, .irradiance = irradiance};
    fct_result result = FCT_OK;
    out->change = 1;
    for (out->sweeps = 0; out->sweeps < MOST_SWEEPS && result == FCT_OK; ++out->sweeps) {
        fct_parallel_for(set->env, leaf_count, 64, sweep_chunk, &s);
        for (size_t l = 0; l < leaf_count; ++l) {
            fct_element *e = &set->items[g->leaves[l]];
            memcpy(e->irradiance, irradiance + 3 * l, sizeof e->irradiance);
            store(set, g->lamps, out->stored, g->leaves[l]);
        }
        double norm = fct_sum(s.norm, chunks);
        out->change = norm > 0 ? sqrt(fct_sum(s.change, chunks) / norm) : 0;
        if ((out->converged = out->change <= bound)) {
            ++out->sweeps;
            break;
        }
        result = fct_progress(set->env, "iteration", out->sweeps / (double)MOST_SWEEPS);
    }
    fct_release(set->env, sums);
    fct_release(set->env, irradiance);
    return result;
}

/* Emitted = absorbed + escaped, each counted on its own: what surfaces take in, and what their rays carry out
 * of the scene. */
static void balance(gathering *g, size_t leaf_count) {
    fct_transport *out = g->out;
    double weight = 0, noise = 0, level = 0;
    for (size_t l = 0; l < leaf_count; ++l) {
        const fct_element *e = &g->set->items[g->leaves[l]];
        double irradiance[3], halves[2], lost = 0, dark = 0, area = e->area * g->bare[l];
        leaf_irradiance(g, l, irradiance, halves);
        for (uint32_t k = 0; k < g->rays; ++k) {
            lost += g->hits[l * g->rays + k] == HIT_NOTHING;
            dark += g->hits[l * g->rays + k] == HIT_BLACK;
        }
        for (int c = 0; c < 3; ++c) {
            double b = e->emission[c] + e->reflectance[c] * irradiance[c];
            out->emitted += e->emission[c] * area;
            out->absorbed += (1 - e->reflectance[c]) * irradiance[c] * area + b * area * dark / g->rays;
            out->escaped += b * area * lost / g->rays;
        }
        weight += e->area;
        level += e->area * (halves[0] + halves[1]) * (halves[0] + halves[1]) / 4;
        noise += e->area * (halves[0] - halves[1]) * (halves[0] - halves[1]) / 4;
    }
    out->noise = level > 0 ? sqrt(noise / level) : 0;
}

static size_t list_leaves(const fct_elements *set, size_t from, uint32_t *leaves) {
    size_t n = 0;
    for (size_t id = from; id < set->count; ++id) {
        const fct_element *e = &set->items[id];
        if (e->child_count == 0 && e->kind != FCT_ELEMENT_VOLUME && e->area > 0) leaves[n++] = (uint32_t)id;
    }
    return n;
}

/* A bent leaf has sides that see different light, and what a ray finds on it is their mean: it is split down
 * to a size that does not depend on the triangles. */
static fct_result split_bent(fct_elements *set) {
    const double least = LEAST_BENT_AREA * set->items[0].area;
    for (size_t id = 0; id < set->count; ++id) {
        const fct_element *e = &set->items[id];
        if (e->child_count || e->kind != FCT_ELEMENT_CLUSTER || e->area < least) continue;
        if (v3_norm(e->vector) > BENT * e->area) continue;
        fct_result result = fct_elements_split(set, (uint32_t)id);
        if (result != FCT_OK) return result;
    }
    return FCT_OK;
}

/* Leaves that a border of direct light crosses are split, and their parts looked at in turn. */
static fct_result split_by_direct(gathering *g, const fct_transport_def *def) {
    fct_elements *set = g->set;
    const fct_env *env = set->env;
    fct_result result = FCT_OK;
    size_t from = 0;
    for (int turn = 0; turn < MOST_ROUNDS && result == FCT_OK && from < set->count; ++turn) {
        if ((result = fct_progress(env, "direct light", turn / (double)MOST_ROUNDS)) != FCT_OK) break;
        fct_elements_make_points(set);
        uint32_t *leaves = fct_allocate(env, set->count - from, sizeof *leaves);
        g->spread = fct_allocate(env, set->count - from, sizeof *g->spread);
        g->chunk_rays = fct_allocate_zero(env, fct_chunk_count(set->count, 16), sizeof *g->chunk_rays);
        if (!leaves || !g->spread || !g->chunk_rays) {
            result = fct_fail_memory(env, "direct light");
        } else {
            size_t count = list_leaves(set, from, leaves);
            from = set->count;
            g->leaves = leaves;
            fct_parallel_for(env, count, 16, direct_chunk, g);
            for (size_t c = 0; c < fct_chunk_count(count, 16); ++c) g->out->rays += g->chunk_rays[c];
            for (size_t l = 0; l < count && result == FCT_OK; ++l)
                if (g->spread[l] > def->epsilon && fct_elements_can_split(set, leaves[l]))
                    result = fct_elements_split(set, leaves[l]);
        }
        fct_release(env, leaves);
        fct_release(env, g->spread);
        fct_release(env, g->chunk_rays);
        g->leaves = NULL, g->spread = NULL, g->chunk_rays = NULL;
    }
    fct_elements_make_points(set);
    return result;
}

fct_result fct_transport_solve(fct_elements *set, const fct_lamps *lamps, const fct_transport_def *def,
                               fct_transport *out) {
    const fct_env *env = set->env;
    *out = (fct_transport){0};
    gathering g = {.set = set, .lamps = lamps, .out = out, .seed = def->seed};
    uint32_t *leaves = NULL;
    fct_result result = split_bent(set);
    if (result == FCT_OK) result = split_by_direct(&g, def);
    if (result != FCT_OK) goto done;
    result = FCT_ERROR_MEMORY;
    out->stored = fct_allocate_zero(env, 3 * set->count, sizeof *out->stored);
    out->direct = fct_allocate_zero(env, 3 * set->count, sizeof *out->direct);
    leaves = fct_allocate(env, set->count, sizeof *leaves);
    if (!out->stored || !out->direct || !leaves) goto done;
    size_t count = list_leaves(set, 0, leaves);
    g.leaves = leaves;
    g.rays = (uint32_t)(def->fineness * (count < 4096 ? 512 : count < 16384 ? 128 : 64));
    g.hits = fct_allocate(env, count * g.rays, sizeof *g.hits);
    g.chunk_rays = fct_allocate_zero(env, fct_chunk_count(count, 16), sizeof *g.chunk_rays);
    g.bare = fct_allocate(env, count, sizeof *g.bare);
    if (!g.hits || !g.chunk_rays || !g.bare) goto done;
    result = fct_parallel_for_progress(env, "direct light", count, 16, direct_chunk, &g);
    if (result != FCT_OK) goto done;
    result = fct_parallel_for_progress(env, "gathering", count, 16, hit_chunk, &g);
    if (result != FCT_OK) goto done;
    for (size_t c = 0; c < fct_chunk_count(count, 16); ++c) out->rays += g.chunk_rays[c];
    for (size_t l = 0; l < count; ++l) store(set, lamps, out->stored, leaves[l]);
    if ((result = iterate(&g, count, def->tolerance)) != FCT_OK) goto done;
    balance(&g, count);
    fct_elements_pull(set);
done:
    fct_release(env, g.hits);
    fct_release(env, g.bare);
    fct_release(env, g.chunk_rays);
    fct_release(env, leaves);
    if (result != FCT_OK) fct_transport_release(env, out);
    return result == FCT_ERROR_MEMORY ? fct_fail_memory(env, "the solution") : result;
}

void fct_transport_release(const fct_env *env, fct_transport *t) {
    fct_release(env, t->stored);
    fct_release(env, t->direct);
    *t = (fct_transport){0};
}
