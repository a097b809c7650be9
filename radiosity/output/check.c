/* radiosity/output/check.c: see check.h.
 *
 * The error of a statue is in few places: in creases, under its base, across shadow borders. Points by area
 * alone would miss them. So one half of the points is distributed by area, and the other half by area times
 * the squared difference of the light at the corners of a face, because errors are large where light changes
 * across a face. A point that the density q chose counts area / q, over the sum of these weights.
 */
#include "radiosity/output/check.h"

#include <string.h>

#include "radiosity/surface/cover.h"

/* Points per scene, by area; at most MOST_POINTS per side of an instance, and at least its part of
 * SMALL_POINTS, within the limits of LEAST_POINTS. Otherwise no more than one per VERTICES_PER_POINT
 * vertices. */
enum { SCENE_POINTS = 2048, MOST_POINTS = 512, VERTICES_PER_POINT = 32, SMALL_POINTS = 4096 };
static const double LEAST_POINTS[2] = {16, 64};
/* Share of the points that follow the differences of light. A larger share leaves too few points where the
 * light is even, of which each then counts too much. */
#define STEEP_SHARE .5
/* Gather rays, and first rays per lamp, of each of the two gathers. */
enum { GATHER_RAYS = 64, LAMP_RAYS = 16 };
enum { POINT_GRAIN = 4 }; /* points per chunk */

typedef struct checking {
    const fct_solution *s;
    const fct_surface *surface;
    const float *light;
    const uint8_t *covered;
    uint32_t instance;
    bool back;
    double *sums;    /* running sums of the density over the faces; the last one is 1 */
    double *weights; /* per face: area over density */
    fct_guide *guides;
    size_t count;
    fct_check *parts; /* per point; area: its weight, points: 1 if it is not covered */
    uint64_t *chunk_rays;
    uint64_t seed;
} checking;

double fct_check_error(const fct_check *sums) {
    if (!(sums->light > 0)) return 0;
    return sqrt(fct_max(sums->square, 0) * sums->area) / sums->light;
}

/* The area of a face that is not covered, else 0, and the squared difference of the light at its corners. */
static double measure_face(const checking *k, size_t face, double *steep) {
    const fct_mesh *m = &k->surface->mesh;
    const uint32_t *t = m->triangles + 3 * face;
    const v3 a = v3_load(m->positions + 3 * (size_t)t[0]);
    const v3 e1 = v3_sub(v3_load(m->positions + 3 * (size_t)t[1]), a);
    const v3 e2 = v3_sub(v3_load(m->positions + 3 * (size_t)t[2]), a);
    *steep = 0;
    if (k->covered[t[0]] && k->covered[t[1]] && k->covered[t[2]]) return 0;
    for (int i = 0; i < 3; ++i)
        *steep += v3_norm2(
            v3_sub(v3_load(k->light + 3 * (size_t)t[i]), v3_load(k->light + 3 * (size_t)t[(i + 1) % 3])));
    return .5 * v3_norm(v3_cross(e1, e2));
}

/* The density of points. Returns the area of the faces that are not covered. */
static double spread_points(const checking *k) {
    const size_t faces = k->surface->mesh.face_count;
    double area = 0, steep = 0, sum = 0;
    for (size_t f = 0; f < faces; ++f) {
        area += k->weights[f] = measure_face(k, f, &k->sums[f]);
        steep += k->sums[f] *= k->weights[f];
    }
    if (!(area > 0)) return 0;
    const double share = steep > 0 ? STEEP_SHARE : 0;
    for (size_t f = 0; f < faces; ++f) {
        const double density =
            (1 - share) * k->weights[f] / area + (share > 0 ? share * k->sums[f] / steep : 0);
        if (density > 0) k->weights[f] /= density;
        k->sums[f] = sum += density;
    }
    for (size_t f = 0; f < faces; ++f) k->sums[f] /= sum;
    return area;
}

static size_t find_face(const checking *k, double target) {
    size_t low = 0, high = k->surface->mesh.face_count - 1;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (target < k->sums[middle])
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

/* A point of a face with what its vertices say there. */
typedef struct spot {
    fct_anchor at;
    uint32_t place; /* of the model's face */
    double light[3];
} spot;

static spot mix_spot(const checking *k, size_t face, const double weights[3]) {
    const fct_surface *f = k->surface;
    spot result = {.place = f->face_places[face]};
    v3 point = {0, 0, 0}, normal = {0, 0, 0};
    for (size_t c = 0; c < 3; ++c) {
        const size_t v = f->mesh.triangles[3 * face + c];
        point = v3_mad(point, weights[c], v3_load(f->mesh.positions + 3 * v));
        normal = v3_mad(normal, weights[c], v3_load(f->normals + 3 * v));
        result.at.offset = fmaxf(result.at.offset, f->offsets[v]);
        for (int i = 0; i < 3; ++i) result.light[i] += weights[c] * k->light[3 * v + (size_t)i];
    }
    v3_store(result.at.position, fct_shading_lift(&f->shading, result.place, point));
    v3_store(result.at.normal, v3_scale(v3_unit(normal), k->back ? -1 : 1));
    return result;
}

static void gather_spot(const checking *k, spot *p, fct_guide *guide, uint64_t seed, double light[3],
                        uint64_t *rays) {
    const fct_solution *s = k->s;
    const fct_source source = fct_solution_source(s);
    fct_solution_direct(s, p->at.position, p->at.normal, p->at.offset, seed, LAMP_RAYS, NULL, NULL, light,
                        rays);
    *rays += fct_anchor_gather(&source, guide, GATHER_RAYS, fct_hash(seed), &p->at);
    for (int c = 0; c < 3; ++c) light[c] += p->at.irradiance[c];
}

static void check_point(const checking *k, size_t i, fct_guide *guide, uint64_t *rays) {
    const fct_elements *set = &k->s->elements;
    const float *reflectance = set->items[set->roots[k->instance]].reflectance; /* of textures the mean */
    const uint64_t seed = fct_hash2(k->seed, i);
    const size_t face = find_face(k, (i + fct_uniform(seed)) / (double)k->count);
    fct_check *part = &k->parts[i];
    double plane[2], w[2], truths[2][3];
    fct_plane_point((uint32_t)i, k->seed, plane);
    fct_triangle_point(plane[0], plane[1], w);
    spot p = mix_spot(k, face, (const double[3]){1 - w[0] - w[1], w[0], w[1]});
    part->area = k->weights[face];
    if (v3_norm2(v3_load(p.at.normal)) <= 0) return;
    if (fct_point_is_covered(k->s->scene, p.at.position, p.at.normal, p.at.offset, seed, NULL, rays)) return;
    const v3 point = v3_load(p.at.position);
    part->points = 1;
    const uint32_t leaf = fct_elements_locate_point(&k->s->elements, k->instance, k->back, p.place, point);
    if (!fct_guide_aim(guide, leaf, point, v3_load(p.at.normal))) guide = NULL;
    for (uint64_t h = 0; h < 2; ++h) gather_spot(k, &p, guide, fct_hash3(k->seed, i, h + 1), truths[h], rays);
    for (int c = 0; c < 3; ++c) {
        const double rho = reflectance[c] / 3., a = p.light[c] - truths[0][c], b = p.light[c] - truths[1][c];
        part->light += rho * (truths[0][c] + truths[1][c]) / 2;
        part->square += 3 * rho * rho * a * b;
        part->bias += rho * (a + b) / 2;
    }
}

static void check_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    checking *k = user;
    for (size_t i = begin; i < end; ++i) check_point(k, i, &k->guides[thread], &k->chunk_rays[chunk]);
}

static size_t count_points(const checking *k, double area) {
    const double share = area / k->s->elements.items[0].area;
    const double small = fct_min(LEAST_POINTS[1], SMALL_POINTS / (double)k->s->elements.view.instance_count);
    const double most = fct_max(k->surface->mesh.vertex_count / VERTICES_PER_POINT + 1, small);
    const double least = fct_max(LEAST_POINTS[0], small);
    return (size_t)fct_min(fct_min(fct_max(share * SCENE_POINTS, least), MOST_POINTS), most);
}

/* Adds the points that are not covered to the sums of the surface, whose faces have the area. */
static void add_points(const checking *k, double area, fct_check *sums) {
    double weight = 0;
    for (size_t i = 0; i < k->count; ++i) weight += k->parts[i].area;
    for (size_t i = 0; i < k->count && weight > 0; ++i) {
        const fct_check *part = &k->parts[i];
        const double share = area * part->area / weight;
        if (!part->points) continue;
        sums->area += share;
        sums->light += share * part->light;
        sums->square += share * part->square;
        sums->bias += share * part->bias;
        ++sums->points;
    }
}

/* Checks `count` points of a surface of this area. */
static fct_result check_points(const fct_env *env, checking *k, double area, fct_check *sums,
                               uint64_t *rays) {
    const size_t chunks = fct_chunk_count(k->count, POINT_GRAIN);
    const fct_array arrays[] = {FCT_ARRAY_ZERO(k->parts, k->count), FCT_ARRAY_ZERO(k->chunk_rays, chunks)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "the estimate of the error");
    if (result != FCT_OK) return result;
    result = fct_parallel_for_progress(env, "check", k->count, POINT_GRAIN, check_chunk, k);
    for (size_t c = 0; result == FCT_OK && c < chunks; ++c) *rays += k->chunk_rays[c];
    if (result == FCT_OK) add_points(k, area, sums);
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    return result;
}

fct_result fct_check_surface(const fct_solution *s, const fct_surface *surface, uint32_t instance, bool back,
                             const float *light, const uint8_t *covered, fct_check *sums, uint64_t *rays) {
    const fct_env *env = s->env;
    const uint32_t threads = fct_env_threads(env);
    checking k = {.s = s, .surface = surface, .light = light, .covered = covered, .instance = instance};
    k.back = back;
    k.seed = fct_hash3(s->def.seed + 5, instance, back);
    const fct_array arrays[] = {FCT_ARRAY(k.sums, surface->mesh.face_count),
                                FCT_ARRAY(k.weights, surface->mesh.face_count),
                                FCT_ARRAY_ZERO(k.guides, threads)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "the estimate of the error");
    if (result != FCT_OK) return result;
    for (uint32_t t = 0; t < threads && result == FCT_OK; ++t)
        result = fct_guide_create(&s->guides, &k.guides[t]);
    const double area = result == FCT_OK ? spread_points(&k) : 0;
    k.count = area > 0 ? count_points(&k, area) : 0;
    if (k.count > 0) result = check_points(env, &k, area, sums, rays);
    for (uint32_t t = 0; t < threads; ++t) fct_guide_release(env, &k.guides[t]);
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    return result;
}
