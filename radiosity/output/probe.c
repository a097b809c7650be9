/* radiosity/output/probe.c: see probe.h. */
#include "radiosity/output/probe.h"

#include <string.h>

#include "cluster/tree/node.h"
#include "radiosity/output/anchor.h"

/* Distance within which a probe belongs to a surface, over the scene's diagonal. */
#define SURFACE_REACH 1e-3
/* Offset of a probe's rays over that distance. */
#define OFFSET_SHARE 1e-3
/* Surfaces that a probe's ray passes in search of the nearest one. */
enum { MOST_LAYERS = 16 };
/* Rays of a probe at the default error: gather rays, and first rays per lamp. */
enum { GATHER_RAYS = 1024, LAMP_RAYS = 16 };

/* Looks down along the normal from `reach` above the point. Several surfaces may lie within 2 reach: the one
 * nearest to the point wins. */
static void look_down(const fct_scene *scene, const float point[3], const float normal[3], double reach,
                      fct_site *site) {
    fct_scene_view view = fct_scene_get(scene);
    fct_ray ray = {.t_min = 0, .t_max = (float)(2 * reach)};
    for (int c = 0; c < 3; ++c) {
        ray.origin[c] = (float)(point[c] + reach * normal[c]);
        ray.direction[c] = -normal[c];
    }
    fct_scene_hit hit;
    float least = INFINITY;
    for (int k = 0; k < MOST_LAYERS && fct_scene_closest_hit(scene, &ray, &hit, NULL); ++k) {
        float away = fabsf(hit.t - (float)reach);
        double facing = 0;
        for (int c = 0; c < 3; ++c) facing += (double)hit.normal[c] * normal[c];
        bool two_sided = view.materials[view.instances[hit.instance].material].two_sided;
        if (away < least && (facing > 0 || two_sided)) {
            least = away;
            *site = (fct_site){hit.instance, hit.face,   hit.place,    hit.u,
                               hit.v,        facing < 0, site->offset, {0, 0, 0}};
            for (int c = 0; c < 3; ++c) site->point[c] = ray.origin[c] + hit.t * ray.direction[c];
        }
        ray.t_min = nextafterf(hit.t, INFINITY);
    }
}

/* Takes the nearest surface point within reach, for probes whose normal does not hit the surface. */
static void take_nearest(const fct_scene *scene, const float point[3], const float normal[3], double reach,
                         fct_site *site) {
    fct_scene_view view = fct_scene_get(scene);
    uint32_t instance;
    fct_closest closest;
    if (!fct_scene_closest_point(scene, point, (float)reach, &instance, &closest)) return;
    const fct_instance *in = &view.instances[instance];
    const fct_tree *tree = view.models[in->model].tree;
    site->place = closest.place;
    fct_cluster room;
    const fct_cluster *c = fct_node_cluster(tree, fct_tree_get(tree).node_count + site->place, &room);
    double facing = 0;
    for (int r = 0; r < 3; ++r)
        for (int k = 0; k < 3; ++k)
            facing += (double)in->normal_matrix[3 * r + k] * c->area_vector[k] * normal[r];
    if (in->mirrored) facing = -facing;
    if (!(facing > 0) && !view.materials[in->material].two_sided) return;
    site->instance = instance, site->face = closest.face;
    site->u = closest.u, site->v = closest.v;
    site->back = facing < 0;
    memcpy(site->point, closest.point, sizeof site->point);
}

fct_site fct_probe_site(const fct_scene *scene, const float point[3], const float normal[3]) {
    fct_bounds bounds = fct_scene_get(scene).bounds;
    fct_site site = {.instance = FCT_NONE, .face = FCT_NONE, .place = FCT_NONE};
    double diagonal = v3_norm(v3_sub(v3_load(bounds.upper), v3_load(bounds.lower)));
    double reach = SURFACE_REACH * diagonal;
    site.offset = (float)(OFFSET_SHARE * reach);
    memcpy(site.point, point, sizeof site.point);
    look_down(scene, point, normal, reach, &site);
    if (site.instance == FCT_NONE) take_nearest(scene, point, normal, reach, &site);
    return site;
}

void fct_probe_lift(const fct_solution *s, fct_site *site) {
    if (site->instance == FCT_NONE) return;
    const fct_shading shading = fct_solution_shading(s, site->instance, site->back);
    v3_store(site->point, fct_shading_lift(&shading, site->place, v3_load(site->point)));
}

typedef struct probing {
    const fct_solution *s;
    const float *points, *normals;
    fct_probe *out;
    uint64_t *chunk_rays;
} probing;

/* Direct light with many shadow rays plus a gather of its own. */
static void gather_at_site(const fct_solution *s, const fct_site *site, const float normal[3], uint64_t seed,
                           double irradiance[3], uint64_t *rays) {
    uint32_t gather_rays = (uint32_t)(GATHER_RAYS * fct_max(s->fineness, 1));
    fct_solution_direct(s, site->point, normal, site->offset, seed, fct_solution_lamp_rays(s, LAMP_RAYS),
                        NULL, NULL, irradiance, rays);
    fct_anchor a = {.offset = site->offset};
    memcpy(a.position, site->point, sizeof a.position);
    memcpy(a.normal, normal, sizeof a.normal);
    const fct_source source = fct_solution_source(s);
    *rays += fct_anchor_gather(&source, NULL, gather_rays, fct_hash(seed), &a);
    for (int c = 0; c < 3; ++c) irradiance[c] += a.irradiance[c];
}

static void probe_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    probing *b = user;
    const fct_solution *s = b->s;
    (void)thread;
    for (size_t i = begin; i < end; ++i) {
        float normal[3];
        v3_store(normal, v3_unit(v3_load(b->normals + 3 * i)));
        fct_site site = fct_probe_site(s->scene, b->points + 3 * i, normal);
        fct_probe_lift(s, &site);
        double irradiance[3];
        if (s->def.final == FCT_FINAL_NONE && site.instance != FCT_NONE) {
            uint32_t leaf =
                fct_elements_locate(&s->elements, site.instance, site.back, site.place, site.u, site.v);
            fct_links_irradiance(&s->elements, &s->links, leaf, v3_load(site.point), v3_load(normal),
                                 irradiance);
        } else {
            gather_at_site(s, &site, normal, fct_hash3(s->def.seed + 2, i, 0), irradiance,
                           &b->chunk_rays[chunk]);
        }
        fct_probe *p = &b->out[i];
        *p = (fct_probe){.instance = site.instance, .face = site.face};
        for (int c = 0; c < 3; ++c) p->irradiance[c] = (float)irradiance[c];
        if (site.instance == FCT_NONE) continue;
        float rho[3];
        fct_scene_reflectance(s->scene, site.instance, site.place, site.u, site.v, 0, rho);
        fct_solution_radiosity(s, site.instance, rho, irradiance, p->radiosity);
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
