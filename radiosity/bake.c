/* radiosity/bake.c: the public functions: solve or prepare, then light on demand. */
#include <string.h>

#include "facetree/radiosity.h"
#include "radiosity/output/output.h"
#include "radiosity/output/probe.h"
#include "radiosity/rivals/reference.h"
#include "radiosity/solve/refine.h"
#include "radiosity/surface/tessellate.h"

#define DEFAULT_ERROR 2e-5
/* Diagonals of bounds whose parts have areas that floats can tell. */
#define LEAST_SIZE 1e-15
#define MOST_SIZE  1e18

enum { PASSES = 5, REFERENCE_SAMPLES = 256 };

struct fct_bake {
    fct_solution solution;
    fct_bake_stats stats;
};

fct_bake_def fct_bake_def_default(void) {
    return (fct_bake_def){
        .size = sizeof(fct_bake_def), .final = FCT_FINAL_GATHER, .error = DEFAULT_ERROR, .seed = 1};
}

/* Power that leaves the scene's lamps, summed over channels. */
static double emitted_power(const fct_elements *set) {
    double power = 0;
    for (uint32_t i = 0; i < set->view.instance_count; ++i) {
        const fct_material *m = &set->view.materials[set->view.instances[i].material];
        uint32_t sides = m->two_sided ? 2 : 1;
        for (uint32_t k = 0; k < sides * set->root_counts[i]; ++k)
            for (int c = 0; c < 3; ++c) power += set->items[set->roots[i] + k].area * m->emission[c];
    }
    return power;
}

static fct_result solve(fct_bake *bake) {
    fct_solution *s = &bake->solution;
    fct_bake_stats *stats = &bake->stats;
    const fct_env *env = s->env;
    double begin = fct_seconds();
    fct_result result = fct_links_create(env, &s->links);
    if (result != FCT_OK) return result;
    /* the threshold starts sixteen times larger and is halved with each pass: early passes know little of the
     * light */
    double power = emitted_power(&s->elements), last = s->def.error * power;
    for (int pass = 0; pass < PASSES && power > 0; ++pass) {
        double epsilon = last * (1 << (PASSES - 1 - pass));
        double start = fct_seconds();
        result = fct_links_refine(&s->elements, &s->links, epsilon, "links", pass / (double)PASSES);
        stats->seconds_open += fct_seconds() - start;
        if (result != FCT_OK) return result;
        start = fct_seconds();
        uint32_t most = pass + 1 < PASSES ? 4 : 100;
        result = fct_links_solve(&s->elements, &s->links, 1e-3, most, &stats->passes);
        stats->seconds_solve += fct_seconds() - start;
        if (result != FCT_OK) return result;
    }
    double start = fct_seconds();
    fct_transport_def def = {
        .seed = s->def.seed, .epsilon = 4 * last, .tolerance = 1e-4, .fineness = s->fineness};
    result = fct_transport_solve(&s->elements, s->lamps, &def, &s->transport);
    if (result != FCT_OK) return result;
    stats->seconds_solve += fct_seconds() - start;
    stats->passes += s->transport.sweeps;
    stats->converged = s->transport.converged;
    stats->elements = s->elements.count;
    stats->links = s->links.count;
    stats->rays = s->links.rays + s->transport.rays;
    stats->power_emitted = s->transport.emitted;
    stats->power_absorbed = s->transport.absorbed;
    stats->power_escaped = s->transport.escaped;
    stats->error_estimate = s->transport.noise + s->transport.change;
    stats->seconds_total = fct_seconds() - begin;
    return FCT_OK;
}

/* Areas are floats in the hierarchies: where they end or vanish, so would the light. What is a single point
 * is as dark as it should be. */
static fct_result check_extents(const fct_env *env, const fct_scene_view *view) {
    for (uint32_t m = 0; m <= view->model_count; ++m) {
        fct_bounds b = m < view->model_count ? fct_bvh_bounds(view->models[m].bvh) : view->bounds;
        double size = v3_norm(v3_sub(v3_load(b.upper), v3_load(b.lower)));
        if (size != 0 && !(size >= LEAST_SIZE && size <= MOST_SIZE))
            return fct_fail(env, FCT_ERROR_DATA, "%s is %g across, light needs %g to %g",
                            m < view->model_count ? view->models[m].name : "the scene", size, LEAST_SIZE,
                            MOST_SIZE);
    }
    return FCT_OK;
}

fct_result fct_bake_create(const fct_env *env, const fct_scene *scene, const fct_bake_def *def,
                           fct_bake **out) {
    *out = NULL;
    if (def->size != sizeof *def || !(def->error > 0) || !(def->max_edge >= 0))
        return fct_fail(env, FCT_ERROR_DATA, "error must be positive and max_edge not negative");
    fct_scene_view view = fct_scene_get(scene);
    fct_result result = check_extents(env, &view);
    if (result != FCT_OK) return result;
    fct_bake *bake = fct_allocate_zero(env, 1, sizeof *bake);
    if (!bake) return fct_fail_memory(env, "a bake");
    fct_solution *s = &bake->solution;
    s->env = env, s->scene = scene, s->def = *def;
    s->max_edge = def->max_edge > 0 ? def->max_edge : fct_surface_default_edge(scene);
    s->fineness = fmin(fmax(sqrt(DEFAULT_ERROR / def->error), .25), 16);
    if (def->method == FCT_BAKE_FACE) {
        result = fct_lamps_create(env, scene, &s->lamps);
        if (result == FCT_OK) result = fct_elements_create(env, scene, s->max_edge / 4, &s->elements);
        if (result == FCT_OK) result = solve(bake);
        if (result == FCT_OK) {
            const fct_element *root = &s->elements.items[0];
            for (int c = 0; c < 3; ++c) s->mean_radiosity += root->radiosity[c] / 3;
        }
    } else {
        bake->stats.converged = true;
        s->elements.view = view;
    }
    if (result != FCT_OK) {
        fct_bake_destroy(bake);
        return result;
    }
    *out = bake;
    return FCT_OK;
}

void fct_bake_destroy(fct_bake *bake) {
    if (!bake) return;
    const fct_env *env = bake->solution.env;
    fct_transport_release(env, &bake->solution.transport);
    fct_links_release(env, &bake->solution.links);
    fct_elements_release(&bake->solution.elements);
    fct_lamps_destroy(bake->solution.lamps);
    fct_release(env, bake);
}

fct_bake_stats fct_bake_get_stats(const fct_bake *bake) {
    fct_bake_stats stats = bake->stats;
    if (bake->solution.elements.env) stats.touched_bytes = fct_elements_touched(&bake->solution.elements);
    stats.seconds_total += stats.seconds_push;
    return stats;
}

static uint32_t reference_samples(const fct_bake *bake) {
    return bake->solution.def.samples ? bake->solution.def.samples : REFERENCE_SAMPLES;
}

/* Vertex colours of an instance by path tracing, on the surface as it is tessellated before any light is
 * known. */
static fct_result reference_instance(fct_bake *bake, uint32_t instance, fct_mesh *out) {
    fct_solution *s = &bake->solution;
    const fct_scene_view *view = &s->elements.view;
    const fct_material *m = &view->materials[view->instances[instance].material];
    fct_surface f;
    fct_result result = fct_surface_build(s->env, s->scene, instance, s->max_edge, &f);
    if (result != FCT_OK) return result;
    result = fct_reference_estimate(s->env, s->scene, f.mesh.vertex_count, f.sample_points, f.normals,
                                    f.offsets, reference_samples(bake), fct_hash2(s->def.seed, instance),
                                    s->def.indirect_only, f.mesh.colors, &bake->stats.output_rays);
    for (size_t i = 0; result == FCT_OK && i < f.mesh.vertex_count; ++i)
        for (int c = 0; c < 3; ++c) {
            float *x = &f.mesh.colors[3 * i + (size_t)c];
            *x = (s->def.indirect_only ? 0 : m->emission[c]) + m->reflectance[c] * *x;
        }
    if (result == FCT_OK) {
        *out = f.mesh;
        f.mesh = (fct_mesh){0};
    }
    fct_surface_release(s->env, &f);
    return result;
}

fct_result fct_bake_instance(fct_bake *bake, uint32_t instance, fct_mesh *out) {
    *out = (fct_mesh){0};
    double start = fct_seconds();
    fct_result result = bake->solution.def.method == FCT_BAKE_FACE
                            ? fct_output_instance(&bake->solution, instance, out, &bake->stats.output_rays)
                            : reference_instance(bake, instance, out);
    bake->stats.seconds_push += fct_seconds() - start;
    bake->stats.vertices += out->vertex_count;
    bake->stats.faces += out->face_count;
    return result;
}

/* Appends `part` to `whole`, whose arrays are large enough. */
static void append(fct_mesh *whole, const fct_mesh *part) {
    memcpy(whole->positions + 3 * (size_t)whole->vertex_count, part->positions,
           3 * (size_t)part->vertex_count * sizeof(float));
    memcpy(whole->colors + 3 * (size_t)whole->vertex_count, part->colors,
           3 * (size_t)part->vertex_count * sizeof(float));
    for (size_t i = 0; i < 3 * (size_t)part->face_count; ++i)
        whole->triangles[3 * (size_t)whole->face_count + i] = part->triangles[i] + whole->vertex_count;
    whole->vertex_count += part->vertex_count;
    whole->face_count += part->face_count;
}

fct_result fct_bake_mesh(fct_bake *bake, fct_mesh *out, uint32_t *face_counts) {
    const fct_env *env = bake->solution.env;
    uint32_t count = bake->solution.elements.view.instance_count;
    *out = (fct_mesh){0};
    fct_mesh *parts = fct_allocate_zero(env, count, sizeof *parts);
    if (!parts) return fct_fail_memory(env, "the lit mesh");
    fct_result result = FCT_OK;
    uint64_t vertices = 0, faces = 0;
    for (uint32_t i = 0; i < count && result == FCT_OK; ++i) {
        result = fct_bake_instance(bake, i, &parts[i]);
        vertices += parts[i].vertex_count, faces += parts[i].face_count;
        if (face_counts) face_counts[i] = parts[i].face_count;
    }
    if (result == FCT_OK && (vertices >= INT32_MAX || faces >= INT32_MAX))
        result = fct_fail(env, FCT_ERROR_MEMORY, "the lit mesh has more than 2^31 vertices or faces");
    if (result == FCT_OK)
        result = fct_mesh_create(env, (uint32_t)vertices, (uint32_t)faces, FCT_MESH_COLORS, out);
    if (result == FCT_OK) {
        out->vertex_count = out->face_count = 0;
        for (uint32_t i = 0; i < count; ++i) append(out, &parts[i]);
    }
    for (uint32_t i = 0; i < count; ++i) fct_mesh_release(env, &parts[i]);
    fct_release(env, parts);
    return result;
}

static fct_result reference_probe(fct_bake *bake, size_t count, const float *points, const float *normals,
                                  fct_probe *out) {
    fct_solution *s = &bake->solution;
    const fct_scene_view *view = &s->elements.view;
    float *irradiance = fct_allocate(s->env, 3 * count, sizeof *irradiance);
    float *offsets = fct_allocate(s->env, count, sizeof *offsets);
    float *units = fct_allocate(s->env, 3 * count, sizeof *units);
    float *sites = fct_allocate(s->env, 3 * count, sizeof *sites);
    fct_result result = FCT_ERROR_MEMORY;
    if (!irradiance || !offsets || !units || !sites) goto done;
    for (size_t i = 0; i < count; ++i) {
        v3_store(units + 3 * i, v3_unit(v3_load(normals + 3 * i)));
        fct_site site = fct_probe_site(s->scene, points + 3 * i, units + 3 * i);
        out[i] = (fct_probe){.instance = site.instance, .face = site.face};
        offsets[i] = site.offset;
        memcpy(sites + 3 * i, site.point, sizeof site.point);
    }
    result = fct_reference_estimate(s->env, s->scene, count, sites, units, offsets, reference_samples(bake),
                                    s->def.seed, s->def.indirect_only, irradiance, &bake->stats.output_rays);
    for (size_t i = 0; result == FCT_OK && i < count; ++i)
        for (int c = 0; c < 3; ++c) {
            out[i].irradiance[c] = irradiance[3 * i + (size_t)c];
            if (out[i].instance == FCT_NONE) continue;
            const fct_material *m = &view->materials[view->instances[out[i].instance].material];
            out[i].radiosity[c] =
                (s->def.indirect_only ? 0 : m->emission[c]) + m->reflectance[c] * out[i].irradiance[c];
        }
done:
    fct_release(s->env, irradiance);
    fct_release(s->env, offsets);
    fct_release(s->env, units);
    fct_release(s->env, sites);
    return result == FCT_ERROR_MEMORY ? fct_fail_memory(s->env, "the probes") : result;
}

fct_result fct_bake_probe(fct_bake *bake, size_t count, const float *points, const float *normals,
                          fct_probe *out) {
    double start = fct_seconds();
    fct_result result =
        bake->solution.def.method == FCT_BAKE_FACE
            ? fct_output_probe(&bake->solution, count, points, normals, out, &bake->stats.output_rays)
            : reference_probe(bake, count, points, normals, out);
    bake->stats.seconds_push += fct_seconds() - start;
    return result;
}
