/* radiosity/rivals/reference.c: see reference.h.
 *
 * A cosine-distributed ray returns the radiosity B of its hit, and the irradiance E is the mean. At each
 * point of a path:
 * 1. add the light of an emitter point that is sampled by area and power;
 * 2. follow a cosine-distributed ray, and add the emission of its hit. Veach's balance heuristic weighs 1 and
 * 2 against each other;
 * 3. multiply by the reflectance of the hit. From the fourth bounce on, the path survives with the
 * probability of the largest reflectance and is divided by it, which keeps the mean. First directions and
 * first emitter points are stratified over the paths of a point.
 */
#include "radiosity/rivals/reference.h"

#include "base/parallel.h"
#include "radiosity/sample.h"
#include "scene/rays.h"
#include "scene/transform.h"

#include <float.h>
#include <string.h>

/* Bounces without Russian roulette. */
#define SAFE_BOUNCES 3
/* The light of longer paths is below rho^65536. */
#define MAX_BOUNCES 65536
/* Below FEW_POINTS points, a work item is a block of a point's paths, so that all threads have work. */
#define BLOCK      512
#define FEW_POINTS 4096

/* An emitting instance, with running sums of the world area of its faces. */
typedef struct emitter {
    uint32_t instance, face_count;
    bool two_sided;
    double emission[3], strength;
    double area;  /* world */
    double *sums; /* face_count */
    double begin; /* its part [begin, begin + share) of [0, 1), in proportion to power */
    double share;
} emitter;

typedef struct tracer {
    const fct_env *env;
    const fct_scene *scene;
    fct_scene_view view;
    fct_tree_view *trees; /* per model */
    emitter *emitters;
    uint32_t emitter_count;
    uint32_t *emitter_of; /* per instance, FCT_NONE */
    const float *points, *normals, *offsets;
    uint32_t samples, blocks;
    uint64_t seed;
    bool indirect_only;
    float *irradiance, *lost; /* lost may be NULL */
    double *parts;            /* count x blocks x 4, as trace_paths sums, or NULL where blocks is 1 */
    uint64_t *rays;           /* per chunk */
} tracer;

/* A point on a surface with the normal of the side that receives light. */
typedef struct spot {
    v3 p, n;
    double offset;
} spot;

static void world_triangle(const tracer *t, uint32_t instance, uint32_t place, v3 out[3]) {
    const fct_instance *placed = t->view.instances + instance;
    const fct_tree_view *tree = t->trees + placed->model;
    const uint32_t *corners = tree->triangles + 3 * (size_t)place;
    for (int k = 0; k < 3; ++k)
        out[k] = fct_transform_point(placed->to_world, v3_load(tree->positions + 3 * (size_t)corners[k]));
    if (placed->mirrored) {
        v3 swap = out[1];
        out[1] = out[2], out[2] = swap;
    }
}

static double largest_coordinate(v3 p) {
    return fct_max(fabs(p.x), fct_max(fabs(p.y), fabs(p.z)));
}

/* Offset of a ray's origin: the error of its rounded coordinates. */
static double choose_offset(v3 p, double reach) {
    return 8 * FLT_EPSILON * fct_max(largest_coordinate(p), reach);
}

static fct_ray ray_from(const spot *from, v3 direction, double t_max) {
    fct_ray ray = {.t_min = 0, .t_max = (float)t_max};
    v3_store(ray.origin, v3_mad(from->p, from->offset, from->n));
    v3_store(ray.direction, direction);
    return ray;
}

/* Density per area with which sample_emitter chooses points of an emitter. */
static double find_emitter_density(const emitter *e) {
    return e->share / e->area;
}

/* Chooses a point of all emitters in proportion to power. */
static const emitter *sample_emitter(const tracer *t, double u, double v, v3 *point, v3 *normal) {
    uint32_t low = 0, high = t->emitter_count - 1;
    while (low < high) {
        uint32_t middle = (low + high + 1) / 2;
        if (t->emitters[middle].begin <= u)
            low = middle;
        else
            high = middle - 1;
    }
    const emitter *e = t->emitters + low;
    double target = (u - e->begin) / e->share * e->area;
    uint32_t first = 0, last = e->face_count - 1;
    while (first < last) {
        uint32_t middle = (first + last) / 2;
        if (e->sums[middle] > target)
            last = middle;
        else
            first = middle + 1;
    }
    double below = first ? e->sums[first - 1] : 0, width = e->sums[first] - below, b[2];
    double within = width > 0 ? fct_min(fct_max((target - below) / width, 0), 1) : 0;
    v3 c[3];
    world_triangle(t, e->instance, first, c);
    fct_triangle_point(within, v, b);
    v3 e1 = v3_sub(c[1], c[0]), e2 = v3_sub(c[2], c[0]);
    *point = v3_mad(v3_mad(c[0], b[0], e1), b[1], e2);
    *normal = v3_unit(v3_cross(e1, e2));
    return e;
}

/* Adds the light of one sampled emitter point at `at`, times `through`. */
static void add_emitter(const tracer *t, const spot *at, const double through[3], double u, double v,
                        double sum[3], uint64_t *rays) {
    v3 y, ny;
    const emitter *e = sample_emitter(t, u, v, &y, &ny);
    v3 from = v3_mad(at->p, at->offset, at->n), d = v3_sub(y, from);
    double r2 = v3_norm2(d), height = v3_dot(d, at->n), toward = -v3_dot(d, ny);
    if (e->two_sided) toward = fabs(toward);
    if (!(height > 0) || !(toward > 0)) return;
    double kernel = height * toward / (FCT_PI * r2 * r2), density = find_emitter_density(e);
    double reach = fct_max(largest_coordinate(from), largest_coordinate(y));
    double t_max = 1 - 1e-5 - 4 * FLT_EPSILON * reach / sqrt(r2);
    ++*rays;
    fct_ray ray = ray_from(at, d, t_max);
    if (t_max > 0 && fct_scene_any_hit(t->scene, &ray, NULL)) return;
    for (int k = 0; k < 3; ++k) sum[k] += through[k] * e->emission[k] * kernel / (density + kernel);
}

/* Follows a ray to its hit: spot, reflectance, emitter (or NULL), and kernel cos cos' / (pi r^2). False on a
 * miss and on a black back. */
static bool follow_ray(const tracer *t, const spot *from, v3 direction, spot *to, float reflectance[3],
                       const emitter **source, double *kernel) {
    fct_ray ray = ray_from(from, direction, INFINITY);
    fct_scene_hit hit;
    if (!fct_scene_light_hit(t->scene, &ray, &hit, NULL)) return false;
    v3 c[3];
    world_triangle(t, hit.instance, hit.place, c);
    v3 n = v3_unit(v3_cross(v3_sub(c[1], c[0]), v3_sub(c[2], c[0])));
    v3 origin = v3_load(ray.origin), p = v3_mad(origin, hit.t, direction);
    /* Project onto the plane, because t has a relative error. */
    p = v3_mad(p, -v3_dot(v3_sub(p, c[0]), n), n);
    double cosine = -v3_dot(n, direction);
    if (cosine < 0) {
        if (!t->view.materials[t->view.instances[hit.instance].material].two_sided) return false;
        n = v3_scale(n, -1), cosine = -cosine;
    }
    *source = t->emitter_of[hit.instance] == FCT_NONE ? NULL : t->emitters + t->emitter_of[hit.instance];
    v3 d = v3_sub(p, origin);
    double r2 = v3_norm2(d);
    *kernel = r2 > 0 ? v3_dot(direction, from->n) * cosine / (FCT_PI * r2) : INFINITY;
    *to = (spot){p, n, choose_offset(p, largest_coordinate(c[0]))};
    fct_scene_reflectance(t->scene, hit.instance, hit.place, hit.u, hit.v, 0, reflectance);
    return true;
}

/* Traces one path and adds its estimate of the irradiance to sum[0..2], and 1 to sum[3] if its first ray is
 * lost. */
static void trace_path(const tracer *t, const spot *start, const double first[4], fct_random *random,
                       double sum[4], uint64_t *rays) {
    spot at = *start;
    double through[3] = {1, 1, 1};
    for (uint32_t bounce = 0; bounce < MAX_BOUNCES; ++bounce) {
        double u[4];
        for (int k = 0; k < 4; ++k) u[k] = bounce ? fct_random_next(random) : first[k];
        bool direct = bounce > 0 || !t->indirect_only;
        if (direct && t->emitter_count) add_emitter(t, &at, through, u[2], u[3], sum, rays);
        v3 direction = fct_cosine_direction(at.n, u[0], u[1]);
        float reflectance[3];
        const emitter *source;
        double kernel, survival = 0;
        spot next;
        ++*rays;
        if (!follow_ray(t, &at, direction, &next, reflectance, &source, &kernel)) {
            sum[3] += bounce == 0;
            return;
        }
        if (direct && source) {
            double weight = isfinite(kernel) ? kernel / (kernel + find_emitter_density(source)) : 1;
            for (int k = 0; k < 3; ++k) sum[k] += through[k] * source->emission[k] * weight;
        }
        for (int k = 0; k < 3; ++k) {
            through[k] *= reflectance[k];
            survival = fct_max(survival, reflectance[k]);
        }
        if (bounce >= SAFE_BOUNCES) {
            if (fct_random_next(random) >= survival) return;
            for (int k = 0; k < 3; ++k) through[k] /= survival;
        }
        if (!(through[0] > 0 || through[1] > 0 || through[2] > 0)) return;
        at = next;
    }
}

/* Sums the estimates of paths [begin, end) of point i. */
static void trace_paths(const tracer *t, size_t i, uint32_t begin, uint32_t end, double sum[4],
                        uint64_t *rays) {
    spot start = {v3_load(t->points + 3 * i), v3_unit(v3_load(t->normals + 3 * i)), 0};
    start.offset = t->offsets ? t->offsets[i] : choose_offset(start.p, 0);
    uint64_t seed = fct_hash2(t->seed, i), ways = fct_hash2(seed, 1), lights = fct_hash2(seed, 2);
    sum[0] = sum[1] = sum[2] = sum[3] = 0;
    if (v3_norm2(start.n) == 0) return;
    for (uint32_t s = begin; s < end; ++s) {
        double first[4];
        fct_plane_point(s, ways, first);
        fct_plane_point(fct_shuffle_index(s, (uint32_t)lights), fct_hash(lights), first + 2);
        fct_random random = {fct_hash3(seed, 3, s)};
        trace_path(t, &start, first, &random, sum, rays);
    }
}

static void store_sums(const tracer *t, size_t i, const double sum[4]) {
    for (int k = 0; k < 3; ++k) t->irradiance[3 * i + (size_t)k] = (float)(sum[k] / t->samples);
    if (t->lost) t->lost[i] = (float)(sum[3] / t->samples);
}

/* A work item is a point, or a block of a point's paths. */
static void trace_items(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    const tracer *t = user;
    uint64_t rays = 0;
    for (size_t item = begin; item < end; ++item) {
        size_t i = item / t->blocks, block = item % t->blocks;
        uint32_t from = (uint32_t)((uint64_t)t->samples * block / t->blocks);
        uint32_t to = (uint32_t)((uint64_t)t->samples * (block + 1) / t->blocks);
        double sum[4];
        trace_paths(t, i, from, to, sum, &rays);
        if (t->parts)
            memcpy(t->parts + 4 * item, sum, sizeof sum);
        else
            store_sums(t, i, sum);
    }
    t->rays[chunk] = rays;
}

/* Adds an instance to the emitters if it emits and has area. */
static fct_result add_emitter_instance(tracer *t, uint32_t instance) {
    const fct_instance *placed = t->view.instances + instance;
    const fct_material *material = t->view.materials + placed->material;
    const fct_tree_view *tree = t->trees + placed->model;
    emitter e = {.instance = instance, .face_count = tree->face_count, .two_sided = material->two_sided};
    for (int k = 0; k < 3; ++k) e.strength += e.emission[k] = material->emission[k];
    if (!(e.strength > 0)) return FCT_OK;
    e.sums = fct_allocate(t->env, e.face_count, sizeof *e.sums);
    if (!e.sums) return fct_fail_memory(t->env, "emitters");
    for (uint32_t place = 0; place < e.face_count; ++place) {
        v3 c[3];
        world_triangle(t, instance, place, c);
        e.area += .5 * v3_norm(v3_cross(v3_sub(c[1], c[0]), v3_sub(c[2], c[0])));
        e.sums[place] = e.area;
    }
    if (!(e.area > 0)) {
        fct_release(t->env, e.sums);
        return FCT_OK;
    }
    t->emitter_of[instance] = t->emitter_count;
    t->emitters[t->emitter_count++] = e;
    return FCT_OK;
}

/* Lists the emitters and their shares of the power. */
static fct_result list_emitters(tracer *t) {
    uint32_t instances = t->view.instance_count, models = t->view.model_count;
    t->trees = fct_allocate(t->env, models, sizeof *t->trees);
    t->emitters = fct_allocate(t->env, instances, sizeof *t->emitters);
    t->emitter_of = fct_allocate(t->env, instances, sizeof *t->emitter_of);
    if (!t->trees || !t->emitters || !t->emitter_of) return fct_fail_memory(t->env, "a reference");
    for (uint32_t i = 0; i < models; ++i) t->trees[i] = fct_tree_get(t->view.models[i].tree);
    fct_result result = FCT_OK;
    for (uint32_t i = 0; i < instances && result == FCT_OK; ++i) {
        t->emitter_of[i] = FCT_NONE;
        result = add_emitter_instance(t, i);
    }
    double total = 0, begin = 0;
    for (uint32_t i = 0; i < t->emitter_count; ++i) total += t->emitters[i].strength * t->emitters[i].area;
    for (uint32_t i = 0; i < t->emitter_count; ++i) {
        emitter *e = t->emitters + i;
        e->begin = begin;
        e->share = e->strength * e->area / total;
        begin += e->share;
    }
    return result;
}

/* Adds the blocks of each point in order. */
static void join_blocks(tracer *t, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        double sum[4] = {0, 0, 0, 0};
        for (size_t b = 0; b < t->blocks; ++b)
            for (size_t k = 0; k < 4; ++k) sum[k] += t->parts[4 * (i * t->blocks + b) + k];
        store_sums(t, i, sum);
    }
}

fct_result fct_reference_estimate(const fct_env *env, const fct_scene *scene, size_t count,
                                  const float *points, const float *normals, const float *offsets,
                                  uint32_t samples, uint64_t seed, bool indirect_only, float *irradiance,
                                  float *lost, uint64_t *rays) {
    tracer t = {.env = env,
                .scene = scene,
                .view = fct_scene_get(scene),
                .points = points,
                .normals = normals,
                .offsets = offsets,
                .samples = samples,
                .blocks = 1,
                .seed = seed,
                .indirect_only = indirect_only,
                .irradiance = irradiance,
                .lost = lost};
    if (count == 0 || samples == 0) {
        if (count) memset(irradiance, 0, count * 3 * sizeof *irradiance);
        if (count && lost) memset(lost, 0, count * sizeof *lost);
        return FCT_OK;
    }
    if (count < FEW_POINTS) t.blocks = (uint32_t)fct_chunk_count(samples, BLOCK);
    size_t items = count * t.blocks, grain = count < FEW_POINTS ? 1 : 16,
           chunks = fct_chunk_count(items, grain);
    fct_result result = list_emitters(&t);
    if (result != FCT_OK) goto done;
    t.rays = fct_allocate_zero(env, chunks, sizeof *t.rays);
    if (t.blocks > 1) t.parts = fct_allocate(env, 4 * items, sizeof *t.parts);
    if (!t.rays || (t.blocks > 1 && !t.parts)) {
        result = fct_fail_memory(env, "a reference");
        goto done;
    }
    result = fct_parallel_for_progress(env, "reference", items, grain, trace_items, &t);
    if (result == FCT_OK && t.parts) join_blocks(&t, count);
    for (size_t i = 0; rays && i < chunks; ++i) *rays += t.rays[i];
done:
    for (uint32_t i = 0; i < t.emitter_count; ++i) fct_release(env, t.emitters[i].sums);
    fct_release(env, t.emitters);
    fct_release(env, t.emitter_of);
    fct_release(env, t.trees);
    fct_release(env, t.parts);
    fct_release(env, t.rays);
    return result;
}
