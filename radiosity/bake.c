/* radiosity/bake.c: the public functions. fct_bake_create solves; the outputs light their vertices on demand.
 */
#include <string.h>

#include "facetree/radiosity.h"
#include "radiosity/bake.h"
#include "radiosity/output/attributes.h"
#include "radiosity/output/output.h"
#include "radiosity/output/probe.h"
#include "radiosity/rivals/reference.h"
#include "radiosity/solve/refine.h"
#include "radiosity/surface/paint.h"
#include "radiosity/surface/tessellate.h"
#include "scene/coarse.h"

/* Default epsilon over the absorbed power: 2.0 % RMS error in the Cornell box, 2.6 % in the museum. Larger
 * values give fewer elements and rays. */
#define DEFAULT_ERROR 2e-5
/* Factors on numbers of rays for errors far from the default. */
#define LEAST_FINENESS .25
#define MOST_FINENESS  16
/* Factor by which one pass may lower the final epsilon. Without a limit, a coarse solution in which hardly
 * any light arrives would open everything. */
#define MOST_FALL 8
/* Tolerances of the iterations over links and over rays; leaves split where direct light varies by this
 * multiple of the last epsilon. */
#define LINK_TOLERANCE      1e-3
#define TRANSPORT_TOLERANCE 1e-4
#define BORDER_EPSILON      4
/* The default of max_links, at the default error and per unit of fineness. The museum has 258,000 links, a
 * classroom of 840 boxes 350,000, 10,000 boxes 489,000; 50,000 books in shelves would have 18 million. */
#define SCENE_LINKS    1000000
#define INSTANCE_LINKS 30
#define MOST_LINKS     4000000000 /* fct_links numbers them with 32 bits */
/* Diagonals for which areas are floats: outside, light would be zero or infinite. */
#define LEAST_SIZE 1e-15
#define MOST_SIZE  1e18

/* Passes of refinement; epsilon starts 2^(PASSES - 1) times larger and is halved with each, because early
 * passes do not know the light yet. Sweeps per pass, and in the last one. */
enum { PASSES = 5, EARLY_SWEEPS = 4, LAST_SWEEPS = 100, REFERENCE_SAMPLES = 256 };

struct fct_bake {
    fct_solution solution;
    fct_bake_stats stats;
    double lit_work, whole_work; /* of the instances that fct_bake_instance has lit, and of all */
    fct_check *checks;           /* per object */
    const fct_env *caller;
    fct_env env;    /* the caller's, with a progress hook that asks def.stop */
    bool listening; /* def.stop is asked */
    bool stopped;   /* it has answered true */
};

/* The progress hook while def.stop is asked. */
static bool ask_stop(void *user, const char *phase, double done) {
    fct_bake *bake = user;
    const fct_bake_def *def = &bake->solution.def;
    const fct_env *caller = bake->caller;
    if (bake->listening && def->stop(def->stop_user)) {
        bake->listening = false, bake->stopped = true;
        return false;
    }
    return !caller->progress || caller->progress(caller->progress_user, phase, done);
}

/* Whether the bake can end with an early solution. */
static bool can_stop(const fct_bake_def *def) {
    return def->stop && def->method == FCT_BAKE_FACE &&
           !(def->outputs & (FCT_MESH_DIRECT | FCT_MESH_INDIRECT | FCT_MESH_ERROR));
}

static void set_env(fct_bake *bake, const fct_env *env) {
    bake->solution.env = bake->caller = env;
    if (!can_stop(&bake->solution.def)) return;
    bake->env = *env;
    bake->env.progress = ask_stop, bake->env.progress_user = bake;
    bake->solution.env = &bake->env;
    bake->listening = true;
}

/* If def.stop was the reason for the end of a call: the rest comes from the links alone. */
static bool go_on_early(fct_bake *bake, fct_result result) {
    if (result != FCT_ERROR_CANCELLED || !bake->stopped || bake->stats.interrupted) return false;
    bake->stats.interrupted = true;
    bake->solution.unchecked = true;
    bake->solution.def.final = FCT_FINAL_NONE;
    return true;
}

fct_bake_def fct_bake_def_default(void) {
    return (fct_bake_def){.size = sizeof(fct_bake_def),
                          .final = FCT_FINAL_GATHER,
                          .error = DEFAULT_ERROR,
                          .seed = 1,
                          .crease = FCT_CREASE_DEGREES};
}

/* Area times emission over all surfaces, summed over channels. */
static double sum_emitted_power(const fct_elements *set) {
    double power = 0;
    for (uint32_t i = 0; i < set->view.instance_count; ++i) {
        const fct_material *m = &set->view.materials[set->view.instances[i].material];
        uint32_t sides = m->two_sided ? 2 : 1;
        for (uint32_t k = 0; k < sides * set->root_counts[i]; ++k)
            for (int c = 0; c < 3; ++c) power += set->items[set->roots[i] + k].area * m->emission[c];
    }
    return power;
}

/* What the surfaces absorb: the emitted power less what leaves an open scene. */
static double sum_absorbed_power(const fct_elements *set) {
    double power = 0;
    for (size_t id = 0; id < set->count; ++id) {
        const fct_element *e = &set->items[id];
        if (e->child_count > 0 || e->kind == FCT_ELEMENT_VOLUME) continue;
        for (int c = 0; c < 3; ++c) power += (1 - e->reflectance[c]) * e->irradiance[c] * e->area;
    }
    return power;
}

/* Refines and solves over the links. *last: the final epsilon, power. Epsilon is a share of the absorbed
 * power, which early passes do not know, so the first one takes the emitted power. Early passes get a part of
 * the links, because the first one, which sees the lamps alone, would leave none for reflected light.
 * *solved: the number of complete passes. */
static fct_result solve_links(fct_bake *bake, double *last, int *solved) {
    fct_solution *s = &bake->solution;
    fct_bake_stats *stats = &bake->stats;
    fct_result result = fct_links_create(s->env, &s->links);
    const double emitted = sum_emitted_power(&s->elements);
    bool limited = false; /* by the limit, in some pass */
    double reached = 1;   /* epsilon of the last complete pass over the one that it was to reach */
    *last = s->def.error * emitted;
    *solved = 0;
    for (int pass = 0; pass < PASSES && emitted > 0 && result == FCT_OK; ++pass) {
        if (pass > 0) {
            double absorbed = fct_min(sum_absorbed_power(&s->elements), emitted);
            *last = fct_max(s->def.error * absorbed, *last / MOST_FALL);
        }
        const fct_refine_def def = {.epsilon = *last * (1 << (PASSES - 1 - pass)),
                                    .most = 1 + (stats->max_links - 1) * (unsigned)(pass + 1) / PASSES,
                                    .limited = limited,
                                    .phase = "links",
                                    .done = pass / (double)PASSES};
        fct_refine_result done;
        double start = fct_seconds();
        result = fct_links_refine(&s->elements, &s->links, &def, &done);
        stats->seconds_open += fct_seconds() - start;
        if (result != FCT_OK) break;
        limited = limited || done.limited;
        stats->links_limited = done.limited;
        reached = fct_max(done.epsilon / *last, 1);
        start = fct_seconds();
        uint32_t most = pass + 1 < PASSES ? EARLY_SWEEPS : LAST_SWEEPS;
        result = fct_links_solve(&s->elements, &s->links, LINK_TOLERANCE, most, &stats->passes);
        stats->seconds_solve += fct_seconds() - start;
        ++*solved;
    }
    stats->link_error = s->def.error * reached;
    return result;
}

static void fill_stats(fct_bake *bake) {
    const fct_solution *s = &bake->solution;
    const fct_transport *t = &s->transport;
    fct_bake_stats *stats = &bake->stats;
    stats->passes += t->sweeps;
    stats->converged = t->converged;
    stats->elements = s->elements.count;
    stats->links = s->links.count;
    stats->rays = s->links.rays + t->rays;
    stats->power_emitted = t->emitted;
    stats->power_absorbed = t->absorbed;
    stats->power_escaped = t->escaped;
    stats->error_estimate = t->noise + t->change;
}

/* The mean of rho E over area and channels. */
static double find_mean_reflection(const fct_elements *set) {
    double power = 0, area = 0;
    for (size_t id = 0; id < set->count; ++id) {
        const fct_element *e = &set->items[id];
        if (e->child_count > 0 || e->kind == FCT_ELEMENT_VOLUME) continue;
        for (int c = 0; c < 3; ++c) power += e->area * (e->radiosity[c] - e->emission[c]) / 3;
        area += e->area;
    }
    return area > 0 ? power / area : 0;
}

/* Solves over links and rays. *solved: the number of complete passes over the links. */
static fct_result solve_steps(fct_bake *bake, int *solved) {
    fct_solution *s = &bake->solution;
    double last;
    fct_result result = solve_links(bake, &last, solved);
    if (result != FCT_OK) return result;
    double start = fct_seconds();
    fct_transport_def def = {.seed = s->def.seed,
                             .epsilon = BORDER_EPSILON * last,
                             .tolerance = TRANSPORT_TOLERANCE,
                             .fineness = s->fineness};
    result = fct_transport_solve(&s->elements, s->lamps, &def, &s->transport);
    if (result != FCT_OK) return result;
    bake->stats.seconds_solve += fct_seconds() - start;
    return fct_guides_create(&s->elements, &s->links, s->transport.stored, &s->guides);
}

static fct_result solve_scene(fct_bake *bake) {
    fct_solution *s = &bake->solution;
    double begin = fct_seconds();
    int solved;
    fct_result result = solve_steps(bake, &solved);
    bake->listening = false;
    const bool early = solved > 0 && go_on_early(bake, result);
    if (result != FCT_OK && !early) return result;
    if (early) fct_elements_pull(&s->elements); /* leaves may be new, or lit by a sweep over rays */
    bake->stats.seconds_total = fct_seconds() - begin;
    fill_stats(bake);
    if (early) {
        bake->stats.power_emitted = sum_emitted_power(&s->elements);
        bake->stats.power_absorbed = sum_absorbed_power(&s->elements);
    }
    s->mean_radiosity = find_mean_reflection(&s->elements);
    return FCT_OK;
}

/* Estimates how long an instance takes to light, in a unit of its own. The progress needs it. A face of a
 * dense mesh takes less time than a face of a large surface. */
static double estimate_work(const fct_scene_view *view, uint32_t instance, double max_edge) {
    const fct_instance *i = &view->instances[instance];
    const fct_tree *tree = view->models[i->model].tree;
    fct_tree_view tree_view = fct_tree_get(tree);
    double area = 0, scale2 = 0;
    for (uint32_t r = 0; r < tree_view.root_count; ++r) {
        fct_cluster cluster;
        if (fct_tree_cluster(tree, tree_view.roots[r], &cluster) == FCT_OK) area += (double)cluster.area;
    }
    for (int k = 0; k < 9; ++k) scale2 += (double)i->normal_matrix[k] * (double)i->normal_matrix[k] / 3;
    return tree_view.face_count + 12 * area * sqrt(scale2) / (max_edge * max_edge);
}

/* Rejects diagonals outside [LEAST_SIZE, MOST_SIZE]. A scene that is a single point is valid and dark. */
static fct_result check_extents(const fct_env *env, const fct_scene_view *view) {
    for (uint32_t m = 0; m <= view->model_count; ++m) {
        const fct_model *model = view->models + m;
        fct_bounds b = m < view->model_count ? fct_scene_model_bounds(model->tree, model->bvh) : view->bounds;
        double size = v3_norm(v3_sub(v3_load(b.upper), v3_load(b.lower)));
        if (size != 0 && !(size >= LEAST_SIZE && size <= MOST_SIZE))
            return fct_fail(env, FCT_ERROR_DATA, "%s is %g across; light needs %g to %g",
                            m < view->model_count ? view->models[m].name : "the scene", size, LEAST_SIZE,
                            MOST_SIZE);
    }
    return FCT_OK;
}

/* Counts the corners of models with normals, once per model, at its first instance. */
static fct_result count_normals(fct_bake *bake) {
    const fct_solution *s = &bake->solution;
    const fct_scene_view *view = &s->elements.view;
    bool *seen = fct_allocate_zero(s->env, view->model_count, sizeof *seen);
    if (!seen) return fct_fail_memory(s->env, "a bake");
    for (uint32_t i = 0; i < view->instance_count; ++i) {
        const fct_shading shading = fct_solution_shading(s, i, false);
        const uint32_t model = view->instances[i].model;
        uint64_t corners;
        if (seen[model] || shading.rule != FCT_NORMALS_FILE) continue;
        seen[model] = true;
        bake->stats.normals_unusable += fct_shading_count_unusable(&shading, &corners);
        bake->stats.normals_given += corners;
    }
    fct_release(s->env, seen);
    return FCT_OK;
}

fct_result fct_bake_create(const fct_env *env, const fct_scene *scene, const fct_bake_def *def,
                           fct_bake **out) {
    *out = NULL;
    if (def->size != sizeof *def || !(def->error > 0) || !(def->max_edge >= 0))
        return fct_fail(env, FCT_ERROR_DATA, "error must be positive and max_edge not negative");
    if (!(def->crease > 0 && def->crease <= 180))
        return fct_fail(env, FCT_ERROR_DATA, "a crease angle is over 0 and at most 180 degrees, found %g",
                        def->crease);
    if (def->max_links > MOST_LINKS)
        return fct_fail(env, FCT_ERROR_DATA, "max_links is %llu; at most %llu are possible",
                        (unsigned long long)def->max_links, (unsigned long long)MOST_LINKS);
    fct_scene_view view = fct_scene_get(scene);
    fct_result result = fct_attributes_check(env, def);
    if (result == FCT_OK) result = check_extents(env, &view);
    if (result != FCT_OK) return result;
    fct_bake *bake = fct_allocate_zero(env, 1, sizeof *bake);
    if (!bake) return fct_fail_memory(env, "a bake");
    fct_solution *s = &bake->solution;
    s->scene = scene, s->def = *def;
    set_env(bake, env);
    const double edge = fct_surface_default_edge(scene);
    s->max_edge = def->max_edge > 0 ? def->max_edge : edge;
    s->longest_reach = FCT_LONGEST_REACH * edge;
    s->fineness = fct_min(fct_max(sqrt(DEFAULT_ERROR / def->error), LEAST_FINENESS), MOST_FINENESS);
    bake->stats.max_links =
        def->max_links
            ? def->max_links
            : (uint64_t)fct_min(s->fineness * (SCENE_LINKS + INSTANCE_LINKS * (double)view.instance_count),
                                MOST_LINKS);
    bake->checks = fct_allocate_zero(env, view.object_count, sizeof *bake->checks);
    if (!bake->checks) {
        result = fct_fail_memory(env, "a bake");
    } else if (def->method == FCT_BAKE_FACE) {
        result = fct_lamps_create(s->env, scene, &s->lamps);
        if (result == FCT_OK)
            result = fct_elements_create(s->env, fct_scene_coarse(scene), s->max_edge / 4, &s->elements);
        if (result == FCT_OK) result = solve_scene(bake);
    } else {
        bake->stats.converged = true;
        s->elements.view = view;
    }
    if (result == FCT_OK) result = count_normals(bake);
    if (result != FCT_OK) {
        fct_bake_destroy(bake);
        return result;
    }
    for (uint32_t i = 0; i < view.instance_count; ++i)
        bake->whole_work += estimate_work(&view, i, s->max_edge);
    *out = bake;
    return FCT_OK;
}

void fct_bake_destroy(fct_bake *bake) {
    if (!bake) return;
    const fct_env *env = bake->solution.env;
    fct_guides_release(env, &bake->solution.guides);
    fct_transport_release(env, &bake->solution.transport);
    fct_links_release(env, &bake->solution.links);
    fct_elements_release(&bake->solution.elements);
    fct_lamps_destroy(bake->solution.lamps);
    fct_release(env, bake->checks);
    fct_release(env, bake);
}

/* Sets the error over the objects without emission that have been lit, if there are such objects. */
static void estimate_error(const fct_bake *bake, double *error) {
    const fct_scene_view *view = &bake->solution.elements.view;
    fct_check all = {0};
    uint32_t last = FCT_NONE;
    for (uint32_t i = 0; i < view->instance_count; ++i) {
        const fct_instance *in = &view->instances[i];
        const fct_check *c = &bake->checks[in->object];
        const float *e = view->materials[in->material].emission;
        if (in->object == last || e[0] > 0 || e[1] > 0 || e[2] > 0) continue;
        last = in->object;
        all.area += c->area, all.light += c->light, all.square += c->square;
    }
    if (all.area > 0) *error = fct_check_error(&all);
}

fct_bake_stats fct_bake_get_stats(const fct_bake *bake) {
    fct_bake_stats stats = bake->stats;
    if (bake->solution.elements.env) stats.touched_bytes = fct_elements_touched(&bake->solution.elements);
    stats.seconds_total += stats.seconds_push;
    stats.max_edge = bake->solution.max_edge;
    estimate_error(bake, &stats.error_estimate);
    return stats;
}

fct_bake_error fct_bake_get_error(const fct_bake *bake, uint32_t object) {
    const fct_check *c = &bake->checks[object];
    return (fct_bake_error){.area = c->area,
                            .light = c->area > 0 ? c->light / c->area : 0,
                            .error = fct_check_error(c),
                            .bias = c->light > 0 ? c->bias / c->light : 0};
}

static uint32_t choose_samples(const fct_bake *bake) {
    return bake->solution.def.samples ? bake->solution.def.samples : REFERENCE_SAMPLES;
}

/* Adds the power of a vertex: its area emits, absorbs (1 - rho) E, and sends b to the share `lost` of its
 * directions. */
static void count_power(fct_bake_stats *stats, const fct_material *m, const float *reflectance, double area,
                        const float *irradiance, double lost) {
    for (int c = 0; c < 3; ++c) {
        double e = irradiance[c], b = m->emission[c] + reflectance[c] * e;
        stats->power_emitted += area * m->emission[c];
        stats->power_absorbed += area * (1 - reflectance[c]) * e;
        stats->power_escaped += area * b * lost;
    }
}

static void negate_normals(fct_surface *f) {
    for (size_t i = 0; i < 3 * (size_t)f->mesh.vertex_count; ++i) f->normals[i] = -f->normals[i];
}

/* Vertex colours of one side by path tracing, on the surface without splits at shadow borders. *power: the
 * radiosity summed over area and channels. */
static fct_result trace_side(fct_bake *bake, uint32_t instance, bool back, fct_mesh *out, double *power) {
    fct_solution *s = &bake->solution;
    const fct_scene_view *view = &s->elements.view;
    const fct_material *m = &view->materials[view->instances[instance].material];
    fct_surface f;
    fct_result result = fct_output_surface(s, instance, back, &f);
    if (result != FCT_OK) return result;
    float *lost = fct_allocate(s->env, f.mesh.vertex_count, sizeof *lost);
    if (back) negate_normals(&f);
    if (lost)
        result = fct_reference_estimate(s->env, s->scene, f.mesh.vertex_count, f.sample_points, f.normals,
                                        f.offsets, choose_samples(bake), fct_hash2(s->def.seed, instance),
                                        s->def.indirect_only, f.mesh.colors, lost, &bake->stats.output_rays);
    else
        result = fct_fail_memory(s->env, "a reference");
    if (back) negate_normals(&f);
    *power = 0;
    if (result == FCT_OK) result = fct_attributes_add(s->env, s->def.outputs, NULL, f.mesh.colors, &f.mesh);
    for (size_t i = 0; result == FCT_OK && i < f.mesh.vertex_count; ++i) {
        float rho[3];
        fct_surface_reflectance(s->scene, instance, &f, i, rho);
        if (!s->def.indirect_only)
            count_power(&bake->stats, m, rho, f.areas[i], f.mesh.colors + 3 * i, lost[i]);
        for (int c = 0; c < 3; ++c) {
            float *x = &f.mesh.colors[3 * i + (size_t)c];
            *x = (s->def.indirect_only ? 0 : m->emission[c]) + rho[c] * *x;
            *power += f.areas[i] * *x;
        }
    }
    fct_release(s->env, lost);
    if (result == FCT_OK) fct_output_take(s, &f, back, out);
    fct_surface_release(s->env, &f);
    return result;
}

/* Of two lit sides, only the first one has a place on a mesh that is kept. */
static uint32_t count_places(fct_bake *bake, uint32_t sides) {
    if (sides < 2 || bake->solution.def.keep == FCT_KEEP_NONE) return sides;
    ++bake->stats.sides_left_out;
    return 1;
}

/* The sides of an instance by path tracing, the brighter one first. */
static fct_result trace_sides(fct_bake *bake, uint32_t instance, fct_mesh sides[2], bool back[2],
                              uint32_t *count) {
    const fct_scene_view *view = &bake->solution.elements.view;
    double power[2] = {0, 0};
    *count = view->materials[view->instances[instance].material].two_sided ? 2 : 1;
    back[0] = false, back[1] = true;
    for (uint32_t k = 0; k < *count; ++k) {
        fct_result result = trace_side(bake, instance, k == 1, &sides[k], &power[k]);
        if (result != FCT_OK) return result;
    }
    if (*count == 1) return FCT_OK;
    if (power[1] > power[0]) {
        fct_mesh swap = sides[0];
        sides[0] = sides[1], sides[1] = swap;
        back[0] = true, back[1] = false;
    }
    if (fct_min(power[0], power[1]) <= FCT_OUTPUT_DARK * fct_max(power[0], power[1])) *count = 1;
    *count = count_places(bake, *count);
    return FCT_OK;
}

static fct_result light_side(fct_bake *bake, uint32_t instance, bool back, fct_mesh *out) {
    const uint32_t object = bake->solution.elements.view.instances[instance].object;
    fct_output_rays rays = {0, 0};
    fct_result result = fct_output_side(&bake->solution, instance, back, out, &bake->checks[object], &rays);
    bake->stats.output_rays += rays.light;
    bake->stats.check_rays += rays.check;
    return result;
}

/* Before output: exact rays, and elements that refer to the models themselves. */
static fct_result complete_scene(fct_bake *bake) {
    fct_solution *s = &bake->solution;
    const bool coarse = fct_scene_coarse(s->scene) != s->scene;
    const fct_result result = coarse ? fct_scene_complete(s->scene) : FCT_OK;
    if (s->def.method == FCT_BAKE_FACE && result == FCT_OK) fct_elements_refer(&s->elements, s->scene);
    return result;
}

static fct_result light_sides(fct_bake *bake, uint32_t instance, fct_mesh sides[2], bool back[2],
                              uint32_t *count) {
    fct_result result = complete_scene(bake);
    if (result != FCT_OK) return result;
    if (bake->solution.def.method != FCT_BAKE_FACE) return trace_sides(bake, instance, sides, back, count);
    *count = count_places(bake, fct_output_sides(&bake->solution, instance, back));
    for (uint32_t k = 0; k < *count && result == FCT_OK; ++k)
        result = light_side(bake, instance, back[k], &sides[k]);
    return result;
}

const fct_solution *fct_bake_solution(const fct_bake *bake) {
    return &bake->solution;
}

fct_result fct_bake_sides(fct_bake *bake, uint32_t instance, fct_mesh sides[2], bool back[2],
                          uint32_t *count) {
    const fct_env *env = bake->solution.env;
    const uint32_t left_out = bake->stats.sides_left_out;
    sides[0] = sides[1] = (fct_mesh){0};
    double start = fct_seconds();
    bake->listening = can_stop(&bake->solution.def) && !bake->stopped;
    fct_result result = light_sides(bake, instance, sides, back, count);
    if (go_on_early(bake, result)) {
        for (int k = 0; k < 2; ++k) fct_mesh_release(env, &sides[k]);
        bake->stats.sides_left_out = left_out;
        result = light_sides(bake, instance, sides, back, count);
    }
    bake->stats.seconds_push += fct_seconds() - start;
    if (result == FCT_OK) {
        bake->lit_work += estimate_work(&bake->solution.elements.view, instance, bake->solution.max_edge);
        const double done = fct_min(bake->lit_work / bake->whole_work, 1);
        bake->listening = bake->listening && done < 1 - 1e-9; /* all instances have their light */
        result = fct_progress(env, "objects", done);
        if (go_on_early(bake, result)) result = FCT_OK;
    }
    bake->listening = false;
    for (uint32_t k = 0; k < 2; ++k) {
        if (result != FCT_OK || k >= *count) {
            fct_mesh_release(env, &sides[k]);
            continue;
        }
        memcpy(sides[k].origin, bake->solution.elements.view.origin, sizeof sides[k].origin);
        bake->stats.vertices += sides[k].vertex_count;
        bake->stats.faces += sides[k].face_count;
    }
    return result;
}

/* Probes by path tracing. */
static fct_result trace_probes(fct_bake *bake, size_t count, const float *points, const float *normals,
                               fct_probe *out) {
    fct_solution *s = &bake->solution;
    const fct_scene_view *view = &s->elements.view;
    float *irradiance, *offsets, *units, *sites, *reflectances;
    const fct_array arrays[] = {FCT_ARRAY(irradiance, 3 * count), FCT_ARRAY(offsets, count),
                                FCT_ARRAY(units, 3 * count), FCT_ARRAY(sites, 3 * count),
                                FCT_ARRAY_ZERO(reflectances, 3 * count)};
    fct_result result = fct_allocate_all(s->env, arrays, FCT_LENGTH(arrays), "the probes");
    if (result != FCT_OK) return result;
    for (size_t i = 0; i < count; ++i) {
        v3_store(units + 3 * i, v3_unit(v3_load(normals + 3 * i)));
        fct_site site = fct_probe_site(s->scene, points + 3 * i, units + 3 * i);
        fct_probe_lift(s, &site);
        out[i] = (fct_probe){.instance = site.instance, .face = site.face};
        offsets[i] = site.offset;
        memcpy(sites + 3 * i, site.point, sizeof site.point);
        if (site.instance != FCT_NONE)
            fct_scene_reflectance(s->scene, site.instance, site.place, site.u, site.v, 0,
                                  reflectances + 3 * i);
    }
    result =
        fct_reference_estimate(s->env, s->scene, count, sites, units, offsets, choose_samples(bake),
                               s->def.seed, s->def.indirect_only, irradiance, NULL, &bake->stats.output_rays);
    for (size_t i = 0; result == FCT_OK && i < count; ++i)
        for (int c = 0; c < 3; ++c) {
            out[i].irradiance[c] = irradiance[3 * i + (size_t)c];
            if (out[i].instance == FCT_NONE) continue;
            const fct_material *m = &view->materials[view->instances[out[i].instance].material];
            out[i].radiosity[c] = (s->def.indirect_only ? 0 : m->emission[c]) +
                                  reflectances[3 * i + (size_t)c] * out[i].irradiance[c];
        }
    fct_release_all(s->env, arrays, FCT_LENGTH(arrays));
    return result;
}

fct_result fct_bake_probe(fct_bake *bake, size_t count, const float *points, const float *normals,
                          fct_probe *out) {
    double start = fct_seconds();
    if (bake->stats.interrupted && !bake->solution.transport.stored)
        return fct_fail(bake->solution.env, FCT_ERROR_CANCELLED,
                        "the bake was stopped before it could light probes");
    fct_result result = complete_scene(bake);
    if (result != FCT_OK) return result;
    result = bake->solution.def.method == FCT_BAKE_FACE
                 ? fct_output_probe(&bake->solution, count, points, normals, out, &bake->stats.output_rays)
                 : trace_probes(bake, count, points, normals, out);
    bake->stats.seconds_push += fct_seconds() - start;
    return result;
}
