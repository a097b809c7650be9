/* radiosity/light/lamp.c: see lamp.h.
 *
 * 1. fct_lamp_estimate gives a rough light of every lamp; their sum, and the receiver's light from
 * elsewhere, is `total`.
 * 2. A major lamp, whose estimate exceeds MAJOR_SHARE of the total, gets its exact light without blockers
 * times a visible fraction from its own rays.
 * 3. The minor lamps bring their exact light too, but they share one set of rays and one visible fraction per
 *    channel. Systematic sampling distributes these rays in proportion to the estimates.
 * A visible fraction is sum(G V) / sum(G) over points that are drawn roughly in proportion to the light G. So
 * it is exactly 1 or 0 where nothing or everything is hidden.
 */
#include "radiosity/light/lamp.h"

#include "base/env.h"
#include "base/math/round.h"
#include "cluster/tree/node.h"
#include "radiosity/light/lamp_cut.h"
#include "radiosity/sample.h"
#include "scene/transform.h"

/* Share of the total above which a lamp has rays of its own. Smaller: more lamps, more rays per receiver.
 * Larger: one visible fraction stands for lamps that differ visibly. */
#define MAJOR_SHARE .025
/* Rays per lamp where the first ones disagree: a multiple of RAY_STEP, at most MAX_RAYS. */
#define RAY_STEP 4
#define MAX_RAYS 64
/* First rays to lamps in doubt, which must find a border that the rays of a neighbour have found. */
#define DOUBT_RAYS 32
/* Rays to the minor lamps together if the first ones disagree, at least and at most. */
#define LEAST_MINOR_RAYS 4
#define MOST_MINOR_RAYS  16
/* A lamp above this share of the total gets twice the first rays: a wrong agreement would show. */
#define BRIGHT_SHARE .2
/* Wanted standard error of a lamp's light as a share of the receiver's light, times the first rays per lamp.
 */
#define RAY_ERROR .02
/* The standard error of a visible fraction f from n stratified rays is about .6 sqrt(f (1 - f)) / n^(3/4). */
#define STRATIFIED .6
/* An emitter above this share of the scene's area, if bent, is not a lamp (see fct_lamps_sampled). */
#define LARGE_AREA .25
/* |S| / A above which an emitter counts as flat: it does not shine on itself. */
#define FLAT_ENOUGH .9

struct fct_lamps {
    const fct_env *env;
    uint32_t count, instance_count;
    fct_lamp *lamps;
    bool *sampled; /* per instance */
};

/* The state of one call. */
typedef struct query {
    const fct_lamps *lamps;
    const fct_scene *scene;
    const double *point, *normal;
    float origin[3];
    uint64_t seed;
    uint32_t base_rays, doubt;
    uint32_t slots;  /* of the lamps to measure: all, or those in doubt */
    fct_sight known; /* of the earlier call, if lamps are in doubt */
    fct_sight sight;
    bool fixed;
    double error; /* wanted standard error of a lamp's light as a share of the receiver's light */
    double total; /* the receiver's light: sum of the lamps' estimates times strength, and other light */
    double scale; /* the same, with exact light in place of the estimates of lamps seen so far */
    uint64_t rays;
} query;

enum { MINOR_SLOT = 31 };

static uint32_t find_slot(const query *q, const fct_lamp *lamp) {
    return 1u << (lamp - q->lamps->lamps) % MINOR_SLOT;
}

static void note_sight(query *q, uint32_t slot, bool visible) {
    *(visible ? &q->sight.open : &q->sight.blocked) |= slot;
}

/* The visible fraction that the earlier call added: 0 or 1, because its rays to lamps in doubt agreed. */
static double known_fraction(const query *q, uint32_t slot) {
    return q->known.open & slot ? 1 : 0;
}

static bool point_is_visible(query *q, const fct_lamp *lamp, v3 y) {
    const double *m = lamp->to_world, p[3] = {y.x, y.y, y.z};
    fct_ray ray = {.t_min = 0};
    double distance2 = 0, largest = 0;
    for (int k = 0; k < 3; ++k) {
        double world = m[4 * k] * p[0] + m[4 * k + 1] * p[1] + m[4 * k + 2] * p[2] + m[4 * k + 3];
        double d = world - q->origin[k];
        ray.origin[k] = q->origin[k], ray.direction[k] = (float)d;
        distance2 += d * d;
        largest = fct_max(largest, fct_max(fabs(world), fabs(q->origin[k])));
    }
    /* The ray ends before the lamp, by more than the rounding of a coordinate. */
    ray.t_max = (float)(1 - 1e-4 - 1e-6 * largest / sqrt(distance2));
    ++q->rays;
    return !(ray.t_max > 0) || !fct_scene_any_hit(q->scene, &ray, NULL);
}

/* The number of rays after `sent` ones of which some were blocked. share: the lamp's light over all light. */
static uint32_t count_wanted_rays(const query *q, double visible, uint32_t sent, double share) {
    /* Counts one more ray as half visible, because the variance of few rays is often too small. */
    const double fraction = (visible * sent + .5) / (sent + 1);
    const double ratio = STRATIFIED * sqrt(fraction * (1 - fraction)) * share / q->error;
    uint32_t rays = RAY_STEP;
    while (rays < MAX_RAYS && rays * sqrt(rays) < ratio * ratio) rays += RAY_STEP;
    return rays;
}

/* Adds the variance of light of `power` whose visible fraction f comes from rays of which some were blocked.
 * deviation: the standard error of f over sqrt(f (1 - f)). */
static void add_variance(query *q, double power, double visible, uint32_t sent, double deviation) {
    const double fraction = (visible * sent + .5) / (sent + 1), error = deviation * power;
    q->sight.variance += (float)(error * error * fraction * (1 - fraction));
}

/* The visible fraction of a lamp whose light is `power` (strength included). */
static double measure_visible_fraction(query *q, const fct_lamp *lamp, const fct_receiver *rec,
                                       const fct_cut *cut, double power) {
    uint64_t seed = fct_hash2(q->seed, lamp->instance);
    double all = 0, seen = 0;
    uint32_t sent = 0;
    const uint32_t slot = find_slot(q, lamp);
    uint32_t first = !q->fixed && power > BRIGHT_SHARE * q->total ? 2 * q->base_rays : q->base_rays;
    const uint32_t known = q->doubt & slot ? first : 0; /* the rays of the earlier call: they agree */
    if (q->doubt & slot) {
        const uint32_t wanted = count_wanted_rays(q, .5, 1, power / q->scale);
        const uint32_t enough = wanted < DOUBT_RAYS ? wanted : DOUBT_RAYS;
        first = first > enough ? first : enough;
    }
    for (uint32_t goal = first; sent < goal;) {
        for (; sent < goal; ++sent) {
            double u[2];
            fct_plane_point(sent, seed, u);
            fct_lamp_point point = fct_cut_point(lamp, rec, cut, u[0], u[1]);
            if (point.weight <= 0) continue;
            const bool visible =
                sent < known ? known_fraction(q, slot) > 0 : point_is_visible(q, lamp, point.y);
            all += point.weight;
            if (visible) seen += point.weight;
            note_sight(q, slot, visible);
        }
        bool mixed = all <= 0 || (seen > 0 && seen < all);
        if (!mixed || (q->fixed && (all > 0 || sent >= MAX_RAYS))) break;
        if (q->fixed) { /* no point has a weight yet; without any, the light would be lost */
            goal += q->base_rays;
            continue;
        }
        goal = count_wanted_rays(q, all > 0 ? seen / all : .5, sent, all > 0 ? power / q->scale : 1);
    }
    const double visible = all > 0 ? seen / all : 0;
    if (seen > 0 && seen < all) add_variance(q, power, visible, sent, STRATIFIED / sqrt(sent * sqrt(sent)));
    return visible;
}

static double estimate_lamp(const query *q, const fct_lamp *lamp) {
    fct_receiver rec = fct_lamp_receiver(lamp, q->point, q->normal);
    return fct_lamp_estimate(lamp, &rec) * lamp->strength;
}

/* Sends about `count` rays to the minor lamps, whose estimates sum to `sum`. Sets the light per channel of
 * all rays and of those that arrive. Returns true if some arrive and some do not. */
static bool sample_minor_lamps(query *q, double sum, uint32_t count, double all[3], double seen[3],
                               fct_cut *cut) {
    uint64_t seed = fct_hash2(q->seed, FCT_NONE);
    double step = sum / count, next = step * fct_uniform(fct_hash2(seed, count)), below = 0;
    bool hit = false, miss = false;
    uint32_t number = 0;
    for (int k = 0; k < 3; ++k) all[k] = seen[k] = 0;
    for (uint32_t i = 0; i < q->lamps->count; ++i) {
        const fct_lamp *lamp = q->lamps->lamps + i;
        double share = estimate_lamp(q, lamp);
        if (share > MAJOR_SHARE * q->total) continue;
        bool ready = false;
        fct_receiver rec = fct_lamp_receiver(lamp, q->point, q->normal);
        for (below += share; next < below; next += step) {
            double u[2];
            if (!ready) fct_lamp_cut(lamp, &rec, cut);
            ready = true;
            fct_plane_point(number++, seed, u);
            fct_lamp_point point = fct_cut_point(lamp, &rec, cut, u[0], u[1]);
            if (point.weight <= 0) continue;
            bool free = point_is_visible(q, lamp, point.y);
            note_sight(q, 1u << MINOR_SLOT, free);
            for (int k = 0; k < 3; ++k) {
                double weight = point.weight * lamp->emission[k] / share;
                all[k] += weight;
                if (free) seen[k] += weight;
            }
            hit |= !free, miss |= free;
        }
    }
    return hit && miss;
}

/* Adds the minor lamps' light times their common visible fraction. */
static void add_minor_lamps(query *q, const double light[3], double sum, double irradiance[3], fct_cut *cut) {
    double all[3], seen[3];
    /* Rays to different lamps are not stratified: n rays leave a standard error of at most 1/2 / sqrt(n). */
    const double ratio = .5 * sum / q->scale / q->error;
    const uint32_t wanted = (uint32_t)fct_min(fct_max(ratio * ratio, LEAST_MINOR_RAYS), MOST_MINOR_RAYS);
    const bool more = wanted > q->base_rays && !q->fixed;
    if (q->doubt && !more) return; /* the same rays again */
    bool mixed = more && q->doubt >> MINOR_SLOT & 1;
    if (!mixed)
        mixed = sample_minor_lamps(q, sum, q->base_rays, all, seen, cut) || !(all[0] + all[1] + all[2] > 0);
    if (mixed && more) sample_minor_lamps(q, sum, wanted, all, seen, cut);
    double grey = all[0] + all[1] + all[2];
    grey = grey > 0 ? (seen[0] + seen[1] + seen[2]) / grey : 1;
    const double known = known_fraction(q, 1u << MINOR_SLOT);
    for (int k = 0; k < 3; ++k) irradiance[k] += light[k] * ((all[k] > 0 ? seen[k] / all[k] : grey) - known);
    const uint32_t sent = mixed && more ? wanted : q->base_rays;
    if (grey > 0 && grey < 1) add_variance(q, light[0] + light[1] + light[2], grey, sent, 1 / sqrt(sent));
}

/* Adds the light of the lamps in q->slots. With q->doubt, adds only its difference from the light that the
 * earlier call gave. Returns the light of all lamps without blockers, summed over channels. */
static double add_lamps(query *q, double irradiance[3]) {
    double minor = 0, open = 0, minor_light[3] = {0, 0, 0};
    fct_cut cut;
    for (uint32_t i = 0; i < q->lamps->count; ++i) q->total += estimate_lamp(q, q->lamps->lamps + i);
    q->scale = q->total;
    for (uint32_t i = 0; i < q->lamps->count; ++i) {
        const fct_lamp *lamp = q->lamps->lamps + i;
        fct_receiver rec = fct_lamp_receiver(lamp, q->point, q->normal);
        double share = fct_lamp_estimate(lamp, &rec) * lamp->strength;
        if (share <= 0) continue;
        fct_lamp_cut(lamp, &rec, &cut);
        bool major = share > MAJOR_SHARE * q->total;
        if (!major) minor += share;
        double light = cut.light < 1 ? cut.light : 1;
        q->scale += light * lamp->strength - share;
        if (light <= 0) continue;
        open += light * lamp->strength;
        const uint32_t slot = major ? find_slot(q, lamp) : 1u << MINOR_SLOT;
        if (!(q->slots & slot)) continue;
        if (q->base_rays && major)
            light *= measure_visible_fraction(q, lamp, &rec, &cut, light * lamp->strength) -
                     known_fraction(q, slot);
        double *to = q->base_rays && !major ? minor_light : irradiance;
        for (int k = 0; k < 3; ++k) to[k] += light * lamp->emission[k];
    }
    if (minor_light[0] + minor_light[1] + minor_light[2] > 0)
        add_minor_lamps(q, minor_light, minor, irradiance, &cut);
    return open;
}

void fct_lamps_unoccluded(const fct_lamps *lamps, const double point[3], const double normal[3],
                          double irradiance[3]) {
    query q = {.lamps = lamps, .point = point, .normal = normal, .slots = UINT32_MAX};
    for (int k = 0; k < 3; ++k) irradiance[k] = 0;
    add_lamps(&q, irradiance);
}

double fct_lamps_direct(const fct_lamps *lamps, const fct_scene *scene, const double point[3],
                        const double normal[3], double offset, uint64_t item_seed, uint32_t base_rays,
                        const fct_lamp_goal *goal, fct_sight *sight, double irradiance[3], uint64_t *rays) {
    const uint32_t doubt = goal ? goal->doubt : 0;
    query q = {.lamps = lamps,
               .scene = scene,
               .point = point,
               .normal = normal,
               .seed = item_seed,
               .base_rays = base_rays & ~FCT_LAMPS_FIXED,
               .doubt = doubt,
               .slots = doubt ? doubt : UINT32_MAX,
               .total = goal ? goal->other : 0,
               .fixed = (base_rays & FCT_LAMPS_FIXED) != 0};
    for (int k = 0; k < 3; ++k) q.origin[k] = (float)fct_round(point[k] + offset * normal[k]);
    q.error = RAY_ERROR * (goal ? goal->slack : 1) / fct_max(q.base_rays, 1);
    if (doubt) q.known = q.sight = *sight;
    for (int k = 0; k < 3 && !doubt; ++k) irradiance[k] = 0;
    double open = add_lamps(&q, irradiance);
    for (int k = 0; k < 3; ++k) irradiance[k] = fct_max(irradiance[k], 0); /* 1 - 1 after rounding */
    if (rays) *rays += q.rays;
    if (sight) *sight = q.sight;
    return open > 0 ? (irradiance[0] + irradiance[1] + irradiance[2]) / open : 0;
}

/* Estimates that choose_lamp keeps; it makes those of more lamps twice. */
enum { KEPT_ESTIMATES = 128 };

/* Chooses a lamp in proportion to the estimates; NULL without light. *chance: its probability. */
static const fct_lamp *choose_lamp(const query *q, double u, double *chance) {
    const uint32_t count = q->lamps->count;
    double kept[KEPT_ESTIMATES], sum = 0, below = 0;
    for (uint32_t i = 0; i < count; ++i) {
        const double share = estimate_lamp(q, q->lamps->lamps + i);
        if (i < KEPT_ESTIMATES) kept[i] = share;
        sum += share;
    }
    for (uint32_t i = 0; i < count; ++i) {
        const double share = i < KEPT_ESTIMATES ? kept[i] : estimate_lamp(q, q->lamps->lamps + i);
        below += share;
        if (!(u * sum < below)) continue;
        *chance = share / sum;
        return q->lamps->lamps + i;
    }
    return NULL;
}

void fct_lamps_sample(const fct_lamps *lamps, const fct_scene *scene, const double point[3],
                      const double normal[3], double offset, uint64_t seed, double irradiance[3],
                      uint64_t *rays) {
    query q = {.lamps = lamps, .scene = scene, .point = point, .normal = normal};
    fct_random random = {seed};
    fct_cut cut;
    double chance;
    irradiance[0] = irradiance[1] = irradiance[2] = 0;
    const fct_lamp *lamp = choose_lamp(&q, fct_random_next(&random), &chance);
    if (!lamp) return;
    for (int k = 0; k < 3; ++k) q.origin[k] = (float)fct_round(point[k] + offset * normal[k]);
    const fct_receiver rec = fct_lamp_receiver(lamp, point, normal);
    fct_lamp_cut(lamp, &rec, &cut);
    const double u = fct_random_next(&random), v = fct_random_next(&random);
    const fct_lamp_point y = fct_cut_point(lamp, &rec, &cut, u, v);
    if (y.weight > 0 && point_is_visible(&q, lamp, y.y))
        for (int k = 0; k < 3; ++k) irradiance[k] = y.weight / chance * lamp->emission[k];
    *rays += q.rays;
}

uint32_t fct_lamps_count(const fct_lamps *lamps) {
    return lamps->count;
}

bool fct_lamps_sampled(const fct_lamps *lamps, uint32_t instance) {
    return instance < lamps->instance_count && lamps->sampled[instance];
}

/* World area of an instance, and the length of its area vector. Adds up faces only under a transform that is
 * not a similarity. */
static double measure_instance(const fct_scene_view *view, uint32_t instance, double *vector) {
    const fct_instance *placed = view->instances + instance;
    const fct_tree *tree = view->models[placed->model].tree;
    fct_tree_view model = fct_tree_get(tree);
    double area = 0;
    v3 sum = {0, 0, 0};
    if (placed->uniform_scale > 0) {
        for (uint32_t i = 0; i < model.root_count; ++i) {
            fct_cluster room;
            const fct_cluster *c = fct_node_cluster(tree, model.roots[i], &room);
            area += c->area;
            sum = v3_add(sum, v3_load(c->area_vector));
        }
        double scale2 = (double)placed->uniform_scale * placed->uniform_scale;
        *vector = scale2 * v3_norm(sum);
        return area * scale2;
    }
    for (size_t place = 0; place < model.face_count; ++place) {
        const uint32_t *t = model.triangles + 3 * place;
        v3 a = v3_load(model.positions + 3 * (size_t)t[0]);
        v3 e1 = v3_sub(v3_load(model.positions + 3 * (size_t)t[1]), a);
        v3 e2 = v3_sub(v3_load(model.positions + 3 * (size_t)t[2]), a);
        v3 s = v3_scale(
            v3_cross(fct_transform_vector(placed->to_world, e1), fct_transform_vector(placed->to_world, e2)),
            .5);
        area += v3_norm(s);
        sum = v3_add(sum, s);
    }
    *vector = v3_norm(sum);
    return area;
}

static bool instance_emits(const fct_scene_view *view, uint32_t instance) {
    const float *e = view->materials[view->instances[instance].material].emission;
    return e[0] > 0 || e[1] > 0 || e[2] > 0;
}

fct_result fct_lamps_create(const fct_env *env, const fct_scene *scene, fct_lamps **out) {
    fct_scene_view view = fct_scene_get(scene);
    fct_result result = FCT_OK;
    double total = 0;
    *out = NULL;
    fct_lamps *lamps = fct_allocate_zero(env, 1, sizeof *lamps);
    double *areas = fct_allocate(env, view.instance_count, sizeof *areas);
    double *vectors = fct_allocate(env, view.instance_count, sizeof *vectors);
    if (lamps) lamps->env = env;
    if (!lamps || !areas || !vectors) {
        result = fct_fail_memory(env, "lamps");
        goto done;
    }
    lamps->instance_count = view.instance_count;
    lamps->sampled = fct_allocate_zero(env, view.instance_count, sizeof *lamps->sampled);
    lamps->lamps = fct_allocate(env, view.instance_count, sizeof *lamps->lamps);
    if (!lamps->sampled || !lamps->lamps) {
        result = fct_fail_memory(env, "lamps");
        goto done;
    }
    for (uint32_t i = 0; i < view.instance_count; ++i)
        total += areas[i] = measure_instance(&view, i, &vectors[i]);
    for (uint32_t i = 0; i < view.instance_count && result == FCT_OK; ++i) {
        if (!instance_emits(&view, i) || !(areas[i] > 0)) continue;
        if (areas[i] > LARGE_AREA * total && vectors[i] < FLAT_ENOUGH * areas[i]) continue;
        result = fct_lamp_init(env, &view, i, lamps->lamps + lamps->count);
        if (result == FCT_OK) lamps->sampled[i] = true, ++lamps->count;
    }
done:
    fct_release(env, areas);
    fct_release(env, vectors);
    if (result != FCT_OK) fct_lamps_destroy(lamps);
    if (result == FCT_OK) *out = lamps;
    return result;
}

void fct_lamps_destroy(fct_lamps *lamps) {
    if (!lamps) return;
    const fct_env *env = lamps->env;
    for (uint32_t i = 0; i < lamps->count; ++i) fct_lamp_release(env, lamps->lamps + i);
    fct_release(env, lamps->lamps);
    fct_release(env, lamps->sampled);
    fct_release(env, lamps);
}
