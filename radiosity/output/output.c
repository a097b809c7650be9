/* radiosity/output/output.c: see output.h.
 *
 * A vertex's light is what reaches its sample point: from the lamps by shadow rays, from all else by the
 * anchors. Flat ground is then refined where neighbouring vertices differ, so that shadow borders fall on
 * edges, and the new vertices are lit in turn.
 */
#include "radiosity/output/output.h"

#include <string.h>

#include "cluster/tree/node.h"
#include "scene/transform.h"

/* Light of neighbours that differs by less, as a share of its sum, may be one light and noise. */
#define ALIKE .04

enum { BORDER_ROUNDS = 2, PROBE_RAYS = 1024 };

typedef struct lighting {
    const fct_solution *s;
    fct_surface *surface;
    const fct_anchors *anchors;
    uint32_t instance;
    bool back;
    uint32_t first; /* vertices below have their light */
    uint64_t *chunk_rays;
} lighting;

static void finish(const fct_solution *s, uint32_t instance, const double irradiance[3], float radiosity[3]) {
    const fct_scene_view *view = &s->elements.view;
    const fct_material *m = &view->materials[view->instances[instance].material];
    for (int c = 0; c < 3; ++c)
        radiosity[c] =
            (float)((s->def.indirect_only ? 0 : m->emission[c]) + m->reflectance[c] * irradiance[c]);
}

static void direct(const fct_solution *s, const float point[3], const float normal[3], float offset,
                   uint64_t seed, uint32_t rays_each, double irradiance[3], uint64_t *rays) {
    irradiance[0] = irradiance[1] = irradiance[2] = 0;
    if (s->def.indirect_only) return;
    double p[3] = {point[0], point[1], point[2]}, n[3] = {normal[0], normal[1], normal[2]};
    fct_lamps_direct(s->lamps, s->scene, p, n, offset, seed, rays_each, irradiance, rays);
}

/* A small scene has few vertices: they take up to four times the rays, and it is done in seconds all the
 * same. */
static double care(const fct_solution *s) {
    double faces = fmax((double)s->elements.view.face_count, 1);
    return fmin(fmax(sqrt(2e5 / faces), 1), 4);
}

static uint32_t lamp_rays(const fct_solution *s, uint32_t least) {
    return (uint32_t)fmin(fmax(least * s->fineness, least), 64);
}

/* Barycentrics of the point on the face at `place`, or of the nearest point of its plane within it. */
static void place_point(const fct_solution *s, uint32_t instance, uint32_t place, const float point[3],
                        float uv[2]) {
    const fct_instance *in = &s->elements.view.instances[instance];
    fct_tree_view t = fct_tree_get(s->elements.view.models[in->model].tree);
    v3 p[3];
    for (int k = 0; k < 3; ++k) {
        const float *corner = t.positions + 3 * (size_t)t.triangles[3 * (size_t)place + (size_t)k];
        p[k] = fct_transform_point(in->to_world, v3_load(corner));
    }
    v3 e = v3_sub(p[1], p[0]), f = v3_sub(p[2], p[0]), d = v3_sub(v3_load(point), p[0]), n = v3_cross(e, f);
    double scale = v3_norm2(n);
    double u = scale > 0 ? v3_dot(v3_cross(d, f), n) / scale : 1 / 3.,
           v = scale > 0 ? v3_dot(v3_cross(e, d), n) / scale : 1 / 3.;
    u = fmin(fmax(u, 0), 1), v = fmin(fmax(v, 0), 1 - u);
    uv[0] = (float)u, uv[1] = (float)v;
}

static void vertex_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    lighting *l = user;
    const fct_solution *s = l->s;
    fct_surface *f = l->surface;
    (void)thread;
    for (size_t i = l->first + begin; i < l->first + end; ++i) {
        float *color = f->mesh.colors + 3 * i, normal[3];
        const float *point = f->sample_points + 3 * i;
        double irradiance[3] = {0, 0, 0}, indirect[3];
        for (int c = 0; c < 3; ++c)
            normal[c] = l->back ? -f->normals[3 * i + (size_t)c] : f->normals[3 * i + (size_t)c];
        if (f->places[i] == FCT_NONE || (normal[0] == 0 && normal[1] == 0 && normal[2] == 0)) {
            color[0] = color[1] = color[2] = 0;
            continue;
        }
        if (s->def.final == FCT_FINAL_NONE) {
            float uv[2];
            place_point(s, l->instance, f->places[i], point, uv);
            uint32_t leaf =
                fct_elements_locate(&s->elements, l->instance, l->back, f->places[i], uv[0], uv[1]);
            fct_links_irradiance(&s->elements, &s->links, leaf, v3_load(point), v3_load(normal), irradiance);
        } else {
            uint64_t seed = fct_hash3(s->def.seed + 1, l->instance, i);
            direct(s, point, normal, f->offsets[i], seed, lamp_rays(s, (uint32_t)(4 * care(s))), irradiance,
                   &l->chunk_rays[chunk]);
            fct_anchors_irradiance(l->anchors, &s->elements, point, normal, f->offsets[i], f->flat[i],
                                   indirect, &l->chunk_rays[chunk]);
            for (int c = 0; c < 3; ++c) irradiance[c] += indirect[c];
        }
        finish(s, l->instance, irradiance, color);
    }
}

static fct_result light_vertices(lighting *l, uint64_t *rays) {
    const fct_env *env = l->s->env;
    size_t count = l->surface->mesh.vertex_count - l->first, chunks = fct_chunk_count(count, 64);
    l->chunk_rays = fct_allocate_zero(env, chunks + 1, sizeof *l->chunk_rays);
    if (!l->chunk_rays) return fct_fail_memory(env, "the output");
    fct_result result = fct_parallel_for_progress(env, "vertices", count, 64, vertex_chunk, l);
    for (size_t c = 0; c < chunks; ++c) *rays += l->chunk_rays[c];
    fct_release(env, l->chunk_rays);
    l->first = l->surface->mesh.vertex_count;
    return result;
}

/* Light changes along an edge that is long enough to be worth two. */
static bool crosses_border(void *user, uint32_t a, uint32_t b) {
    const lighting *l = user;
    const fct_mesh *m = &l->surface->mesh;
    const float *p = m->positions + 3 * (size_t)a, *q = m->positions + 3 * (size_t)b;
    if (v3_norm(v3_sub(v3_load(p), v3_load(q))) < l->s->max_edge / 7) return false;
    double difference = 0, level = 0;
    for (int c = 0; c < 3; ++c) {
        double x = m->colors[3 * (size_t)a + (size_t)c], y = m->colors[3 * (size_t)b + (size_t)c];
        difference += fabs(x - y);
        level += x + y;
    }
    return difference > .1 * level + .04 * l->s->mean_radiosity;
}

/* Adds to a vertex's sum what a neighbour of like light on the same flat ground says of it. */
static void mix(const fct_surface *f, uint32_t a, uint32_t b, float *sums) {
    const float *x = f->mesh.colors + 3 * (size_t)a, *y = f->mesh.colors + 3 * (size_t)b;
    double difference = 0, level = 0;
    for (int c = 0; c < 3; ++c) difference += fabs((double)x[c] - y[c]), level += (double)x[c] + y[c];
    double apart = level > 0 ? difference / (level * ALIKE) : 0;
    if (apart >= 1 || !f->flat[a] || !f->flat[b]) return;
    float weight = (float)((1 - apart * apart) * (1 - apart * apart));
    for (int c = 0; c < 3; ++c) sums[4 * (size_t)a + (size_t)c] += weight * y[c];
    sums[4 * (size_t)a + 3] += weight;
}

/* Evens out the noise of few rays where the eye would see it, on flat ground: neighbours whose light is alike
 * but for it take each other's mean, those across a border do not. */
static fct_result even_out(const fct_env *env, fct_surface *f) {
    const fct_mesh *m = &f->mesh;
    float *sums = fct_allocate(env, 4 * (size_t)m->vertex_count, sizeof *sums);
    if (!sums) return fct_fail_memory(env, "the output");
    for (int pass = 0; pass < 2; ++pass) {
        memset(sums, 0, 4 * (size_t)m->vertex_count * sizeof *sums);
        for (size_t i = 0; i < m->face_count; ++i)
            for (int k = 0; k < 3; ++k) {
                uint32_t a = m->triangles[3 * i + (size_t)k], b = m->triangles[3 * i + (size_t)(k + 1) % 3];
                mix(f, a, b, sums);
                mix(f, b, a, sums);
            }
        for (size_t v = 0; v < m->vertex_count; ++v)
            for (int c = 0; c < 3; ++c)
                m->colors[3 * v + (size_t)c] =
                    (m->colors[3 * v + (size_t)c] + sums[4 * v + (size_t)c]) / (1 + sums[4 * v + 3]);
    }
    fct_release(env, sums);
    return FCT_OK;
}

static void turn_over(fct_mesh *mesh) {
    for (size_t f = 0; f < mesh->face_count; ++f) {
        uint32_t *t = mesh->triangles + 3 * f, swap = t[1];
        t[1] = t[2], t[2] = swap;
    }
}

/* Whether the back of the instance takes in more light than its front. */
static bool back_is_brighter(const fct_solution *s, uint32_t instance) {
    const fct_elements *set = &s->elements;
    const fct_scene_view *view = &set->view;
    if (!view->materials[view->instances[instance].material].two_sided) return false;
    double power[2] = {0, 0};
    uint32_t root = set->roots[instance], n = set->root_counts[instance];
    for (uint32_t i = 0; i < 2 * n; ++i)
        for (int c = 0; c < 3; ++c)
            power[i >= n] += set->items[root + i].area * set->items[root + i].radiosity[c];
    return power[1] > power[0] * (1 + 1e-6);
}

fct_result fct_output_instance(const fct_solution *s, uint32_t instance, fct_mesh *out, uint64_t *rays) {
    const fct_env *env = s->env;
    fct_surface surface = {0};
    fct_anchors anchors = {0};
    fct_result result = fct_surface_build(env, s->scene, instance, s->max_edge, &surface);
    if (result != FCT_OK) return result;
    lighting l = {.s = s, .surface = &surface, .anchors = &anchors, .instance = instance};
    l.back = back_is_brighter(s, instance);
    if (s->def.final != FCT_FINAL_NONE) {
        bool dense = s->def.final == FCT_FINAL_GATHER;
        fct_anchors_def def = {.rays =
                                   s->def.samples ? s->def.samples : (uint32_t)(64 * s->fineness * care(s)),
                               .tolerance = (dense ? .4 : .9) / sqrt(fmax(s->fineness, .5)),
                               .side = l.back ? -1 : 1,
                               .seed = fct_hash2(s->def.seed, instance)};
        result = fct_anchors_create(env, &s->elements, s->transport.stored, &surface, &def, &anchors);
        *rays += anchors.rays;
    }
    for (int round = 0; result == FCT_OK; ++round) {
        uint32_t added = 0;
        if ((result = light_vertices(&l, rays)) != FCT_OK || round == BORDER_ROUNDS) break;
        result = fct_surface_refine(env, &surface, crosses_border, &l, &added);
        if (added == 0) break;
    }
    if (result == FCT_OK && s->def.final != FCT_FINAL_NONE) result = even_out(env, &surface);
    if (result == FCT_OK) {
        *out = surface.mesh;
        surface.mesh = (fct_mesh){0};
        if (l.back) turn_over(out);
    }
    fct_anchors_release(env, &anchors);
    fct_surface_release(env, &surface);
    return result;
}

fct_site fct_output_site(const fct_scene *scene, const float point[3], const float normal[3]) {
    fct_scene_view view = fct_scene_get(scene);
    fct_site site = {.instance = FCT_NONE, .face = FCT_NONE, .place = FCT_NONE};
    v3 extent = v3_sub(v3_load(view.bounds.upper), v3_load(view.bounds.lower));
    double reach = 1e-3 * v3_norm(extent);
    site.offset = (float)(1e-3 * reach);
    memcpy(site.point, point, sizeof site.point);
    /* what lies just under the point, along its normal, from a little above */
    fct_ray ray = {.t_min = 0, .t_max = (float)(2 * reach)};
    for (int c = 0; c < 3; ++c) {
        ray.origin[c] = (float)(point[c] + reach * normal[c]);
        ray.direction[c] = -normal[c];
    }
    fct_scene_hit hit;
    fct_closest closest;
    float least = INFINITY;
    /* from above there may be another surface in the way: go on until the one nearest to the point is known
     */
    for (int k = 0; k < 16 && fct_scene_closest_hit(scene, &ray, &hit, NULL); ++k) {
        float away = fabsf(hit.t - (float)reach);
        double facing = 0;
        for (int c = 0; c < 3; ++c) facing += (double)hit.normal[c] * normal[c];
        bool two_sided = view.materials[view.instances[hit.instance].material].two_sided;
        if (away < least && (facing > 0 || two_sided)) {
            least = away;
            site = (fct_site){hit.instance, hit.face,   hit.place,   hit.u,
                              hit.v,        facing < 0, site.offset, {0, 0, 0}};
            for (int c = 0; c < 3; ++c) site.point[c] = ray.origin[c] + hit.t * ray.direction[c];
        }
        ray.t_min = nextafterf(hit.t, INFINITY);
    }
    if (site.instance == FCT_NONE) {
        uint32_t instance;
        if (fct_scene_closest_point(scene, point, (float)reach, &instance, &closest)) {
            const fct_instance *in = &view.instances[instance];
            const fct_tree *tree = view.models[in->model].tree;
            fct_tree_view t = fct_tree_get(tree);
            site.place = closest.place;
            fct_cluster room;
            const fct_cluster *c = fct_node_cluster(tree, t.node_count + site.place, &room);
            double facing = 0;
            for (int r = 0; r < 3; ++r)
                for (int k = 0; k < 3; ++k)
                    facing += (double)in->normal_matrix[3 * r + k] * c->area_vector[k] * normal[r];
            if (in->mirrored) facing = -facing;
            bool two_sided = view.materials[in->material].two_sided;
            if (facing > 0 || two_sided) {
                site.instance = instance, site.face = closest.face;
                site.u = closest.u, site.v = closest.v;
                site.back = facing < 0;
                memcpy(site.point, closest.point, sizeof site.point);
            }
        }
    }
    return site;
}

typedef struct probing {
    const fct_solution *s;
    const float *points, *normals;
    fct_probe *out;
    uint64_t *chunk_rays;
} probing;

static void probe_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    probing *b = user;
    const fct_solution *s = b->s;
    (void)thread;
    for (size_t i = begin; i < end; ++i) {
        float normal[3];
        v3_store(normal, v3_unit(v3_load(b->normals + 3 * i)));
        fct_site site = fct_output_site(s->scene, b->points + 3 * i, normal);
        const float *point = site.point;
        double irradiance[3];
        if (s->def.final == FCT_FINAL_NONE && site.instance != FCT_NONE) {
            uint32_t leaf =
                fct_elements_locate(&s->elements, site.instance, site.back, site.place, site.u, site.v);
            fct_links_irradiance(&s->elements, &s->links, leaf, v3_load(point), v3_load(normal), irradiance);
        } else {
            uint64_t seed = fct_hash3(s->def.seed + 2, i, 0);
            direct(s, point, normal, site.offset, seed, lamp_rays(s, 16), irradiance, &b->chunk_rays[chunk]);
            fct_anchor a = {.offset = site.offset};
            memcpy(a.position, point, sizeof a.position);
            memcpy(a.normal, normal, sizeof a.normal);
            uint32_t rays_each = (uint32_t)(PROBE_RAYS * fmax(s->fineness, 1));
            fct_anchor_gather(&s->elements, s->transport.stored, rays_each, fct_hash(seed), &a);
            b->chunk_rays[chunk] += rays_each;
            for (int c = 0; c < 3; ++c) irradiance[c] += a.irradiance[c];
        }
        fct_probe *p = &b->out[i];
        *p = (fct_probe){.instance = site.instance, .face = site.face};
        for (int c = 0; c < 3; ++c) p->irradiance[c] = (float)irradiance[c];
        if (site.instance != FCT_NONE) finish(s, site.instance, irradiance, p->radiosity);
    }
}

fct_result fct_output_probe(const fct_solution *s, size_t count, const float *points, const float *normals,
                            fct_probe *out, uint64_t *rays) {
    probing b = {.s = s, .points = points, .normals = normals, .out = out};
    size_t chunks = fct_chunk_count(count, 4);
    b.chunk_rays = fct_allocate_zero(s->env, chunks + 1, sizeof *b.chunk_rays);
    if (!b.chunk_rays) return fct_fail_memory(s->env, "the probes");
    fct_result result = fct_parallel_for_progress(s->env, "probes", count, 4, probe_chunk, &b);
    for (size_t c = 0; c < chunks; ++c) *rays += b.chunk_rays[c];
    fct_release(s->env, b.chunk_rays);
    return result;
}
