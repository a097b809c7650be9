/* radiosity/output/output.c: see output.h.
 *
 * 1. Tessellate the instance, and place its anchors.
 * 2. Light each vertex at its sample point: direct light by shadow rays, indirect light from the anchors.
 * With FCT_FINAL_NONE, the links bring both.
 * 3. Split flat edges across which the light changes, and light the new vertices, up to BORDER_ROUNDS times.
 * So the edges of the mesh follow shadow borders.
 * 4. Smooth the colours on flat surfaces (smooth.h).
 */
#include "radiosity/output/output.h"

#include "mesh/mesh.h"

#include "radiosity/output/anchor.h"
#include "radiosity/output/blend.h"
#include "radiosity/output/smooth.h"
#include "radiosity/surface/refine.h"
#include "radiosity/surface/tessellate.h"
#include "scene/transform.h"

/* Rounds of splits at shadow borders: each halves the width of a border's blur. */
enum { BORDER_ROUNDS = 2 };
/* Edges below max_edge over this are not split again. */
#define SHORT_EDGES 7
/* Least differences across a border: of the two vertices' sum, and of the scene's mean radiosity. Smaller
 * values split edges because of noise. */
#define BORDER_SHARE .1
#define BORDER_LEVEL .04
/* Rays per anchor and per lamp at the default error in large scenes. */
enum { ANCHOR_RAYS = 64, LAMP_RAYS = 4 };
/* Tolerance of the groups of vertices per anchor. Vertices of one group turn at most acos(1 - .4^2) = 33
 * degrees from their anchor with GATHER, so the blend uses it; up to 79 degrees with DIRECT, where some
 * vertices of strongly bent models find no anchor and stay dark. */
#define GATHER_TOLERANCE .4
#define DIRECT_TOLERANCE .9
/* Scenes below this number of faces take more rays per vertex, at most MOST_RAY_FACTOR times as many. */
#define SMALL_SCENE     2e5
#define MOST_RAY_FACTOR 4

typedef struct lighting {
    const fct_solution *s;
    fct_surface *surface;
    const fct_anchors *anchors;
    uint32_t instance;
    bool back;
    uint32_t first; /* lower vertices have their light */
    uint64_t *chunk_rays;
} lighting;

double fct_output_ray_factor(const fct_solution *s) {
    double faces = fct_max((double)s->elements.view.face_count, 1);
    return fct_min(fct_max(sqrt(SMALL_SCENE / faces), 1), MOST_RAY_FACTOR);
}

/* Barycentrics of a point's projection onto the face at `place`. Sample points lie on faces with an area. */
static void project_to_face(const fct_solution *s, uint32_t instance, uint32_t place, const float point[3],
                            float uv[2]) {
    const fct_instance *in = &s->elements.view.instances[instance];
    fct_tree_view t = fct_tree_get(s->elements.view.models[in->model].tree);
    v3 p[3];
    for (size_t k = 0; k < 3; ++k) {
        size_t vertex = t.triangles[3 * (size_t)place + k];
        p[k] = fct_transform_point(in->to_world, v3_load(t.positions + 3 * vertex));
    }
    v3 e = v3_sub(p[1], p[0]), f = v3_sub(p[2], p[0]), d = v3_sub(v3_load(point), p[0]), n = v3_cross(e, f);
    double scale = v3_norm2(n), u = v3_dot(v3_cross(d, f), n) / scale, v = v3_dot(v3_cross(e, d), n) / scale;
    uv[0] = (float)u, uv[1] = (float)v;
}

/* Irradiance over the links alone (FCT_FINAL_NONE). */
static void gather_links(const lighting *l, size_t v, const float normal[3], double irradiance[3]) {
    const fct_solution *s = l->s;
    const float *point = l->surface->sample_points + 3 * v;
    uint32_t place = l->surface->places[v];
    float uv[2];
    project_to_face(s, l->instance, place, point, uv);
    uint32_t leaf = fct_elements_locate(&s->elements, l->instance, l->back, place, uv[0], uv[1]);
    fct_links_irradiance(&s->elements, &s->links, leaf, v3_load(point), v3_load(normal), irradiance);
}

/* Direct light by shadow rays plus the anchors' indirect light. */
static void gather_lamps_and_anchors(const lighting *l, size_t v, const float normal[3], double irradiance[3],
                                     uint64_t *rays) {
    const fct_solution *s = l->s;
    const fct_surface *f = l->surface;
    const float *point = f->sample_points + 3 * v;
    double indirect[3];
    uint64_t seed = fct_hash3(s->def.seed + 1, l->instance, v);
    uint32_t rays_each = fct_solution_lamp_rays(s, (uint32_t)(LAMP_RAYS * fct_output_ray_factor(s)));
    fct_solution_direct(s, point, normal, f->offsets[v], seed, rays_each, irradiance, rays);
    fct_anchors_irradiance(l->anchors, &s->elements, point, normal, f->offsets[v], f->flat[v], indirect,
                           rays);
    for (int c = 0; c < 3; ++c) irradiance[c] += indirect[c];
}

static void light_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    lighting *l = user;
    const fct_surface *f = l->surface;
    (void)thread;
    for (size_t v = l->first + begin; v < l->first + end; ++v) {
        float *color = f->mesh.colors + 3 * v, normal[3];
        for (size_t c = 0; c < 3; ++c) normal[c] = l->back ? -f->normals[3 * v + c] : f->normals[3 * v + c];
        if (f->places[v] == FCT_NONE || (normal[0] == 0 && normal[1] == 0 && normal[2] == 0)) {
            color[0] = color[1] = color[2] = 0;
            continue;
        }
        double irradiance[3];
        if (l->s->def.final == FCT_FINAL_NONE)
            gather_links(l, v, normal, irradiance);
        else
            gather_lamps_and_anchors(l, v, normal, irradiance, &l->chunk_rays[chunk]);
        fct_solution_radiosity(l->s, l->instance, irradiance, color);
    }
}

/* Lights the vertices from l->first on. */
static fct_result light_vertices(lighting *l, uint64_t *rays) {
    const fct_env *env = l->s->env;
    size_t count = l->surface->mesh.vertex_count - l->first, chunks = fct_chunk_count(count, 64);
    l->chunk_rays = fct_allocate_zero(env, chunks + 1, sizeof *l->chunk_rays);
    if (!l->chunk_rays) return fct_fail_memory(env, "the output");
    fct_result result = fct_parallel_for_progress(env, "vertices", count, 64, light_chunk, l);
    for (size_t c = 0; c < chunks; ++c) *rays += l->chunk_rays[c];
    fct_release(env, l->chunk_rays);
    l->first = l->surface->mesh.vertex_count;
    return result;
}

bool fct_output_crosses_border(const float a[3], const float b[3], double mean_radiosity) {
    double difference = 0, level = 0;
    for (int c = 0; c < 3; ++c) {
        double x = a[c], y = b[c];
        difference += fabs(x - y);
        level += x + y;
    }
    return difference > BORDER_SHARE * level + BORDER_LEVEL * mean_radiosity;
}

static bool edge_crosses_border(void *user, uint32_t a, uint32_t b) {
    const lighting *l = user;
    const fct_mesh *m = &l->surface->mesh;
    const size_t i = 3 * (size_t)a, j = 3 * (size_t)b;
    double length = v3_norm(v3_sub(v3_load(m->positions + i), v3_load(m->positions + j)));
    return length >= l->s->max_edge / SHORT_EDGES &&
           fct_output_crosses_border(m->colors + i, m->colors + j, l->s->mean_radiosity);
}

uint32_t fct_output_sides(const fct_solution *s, uint32_t instance, bool back[2]) {
    const fct_elements *set = &s->elements;
    const fct_scene_view *view = &set->view;
    back[0] = false, back[1] = true;
    if (!view->materials[view->instances[instance].material].two_sided) return 1;
    double power[2] = {0, 0};
    uint32_t root = set->roots[instance], n = set->root_counts[instance];
    for (uint32_t i = 0; i < 2 * n; ++i)
        for (int c = 0; c < 3; ++c)
            power[i >= n] += set->items[root + i].area * set->items[root + i].radiosity[c];
    if (power[1] > power[0] * (1 + 1e-6)) back[0] = true, back[1] = false; /* equal but for rounding: front */
    return power[back[1]] > FCT_OUTPUT_DARK * power[back[0]] ? 2 : 1;
}

static fct_result make_anchors(const lighting *l, fct_anchors *anchors) {
    const fct_solution *s = l->s;
    bool dense = s->def.final == FCT_FINAL_GATHER;
    uint32_t rays = (uint32_t)(ANCHOR_RAYS * s->fineness * fct_output_ray_factor(s));
    double tolerance = dense ? GATHER_TOLERANCE : DIRECT_TOLERANCE;
    fct_anchors_def def = {.rays = s->def.samples ? s->def.samples : rays,
                           .tolerance = tolerance / sqrt(fct_max(s->fineness, .5)),
                           .side = l->back ? -1 : 1,
                           .seed = fct_hash2(s->def.seed, l->instance)};
    return fct_anchors_create(s->env, &s->elements, s->transport.stored, l->surface, &def, anchors);
}

fct_result fct_output_side(const fct_solution *s, uint32_t instance, bool back, fct_mesh *out,
                           uint64_t *rays) {
    const fct_env *env = s->env;
    bool gathers = s->def.final != FCT_FINAL_NONE;
    fct_surface surface = {0};
    fct_anchors anchors = {0};
    fct_result result = fct_surface_build(env, s->scene, instance, s->max_edge, &surface);
    if (result != FCT_OK) return result;
    lighting l = {.s = s, .surface = &surface, .anchors = &anchors, .instance = instance, .back = back};
    if (gathers) result = make_anchors(&l, &anchors);
    *rays += anchors.rays;
    for (int round = 0; result == FCT_OK; ++round) {
        uint32_t added = 0;
        if ((result = light_vertices(&l, rays)) != FCT_OK || round == BORDER_ROUNDS) break;
        result = fct_surface_refine(env, &surface, edge_crosses_border, &l, &added);
        if (added == 0) break;
    }
    if (result == FCT_OK && gathers) result = fct_colors_smooth(env, &surface);
    if (result == FCT_OK) {
        *out = surface.mesh;
        surface.mesh = (fct_mesh){0};
        if (back) fct_mesh_turn_over(out);
    }
    fct_anchors_release(env, &anchors);
    fct_surface_release(env, &surface);
    return result;
}
