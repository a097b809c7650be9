/* radiosity/output/output.c: see output.h.
 *
 * 1. Tessellate the instance, find the vertices that other surfaces cover (cover.h), cut surfaces along the
 * border of their cover, and place anchors.
 * 2. Light each other vertex at its sample point: direct light by shadow rays, more of them where neighbours
 * see different parts of a lamp; indirect light from the anchors. With FCT_FINAL_NONE, the links bring both.
 * 3. Split edges across which the light changes, cut new covers, add anchors where none is near enough to a
 * new vertex, and light the new vertices, up to BORDER_ROUNDS times. So the edges of the mesh follow shadow
 * borders.
 * 4. Smooth the light on flat surfaces (smooth.h). Covered vertices show their emission alone.
 * 5. Check the result at random points (check.h), and map the error if it is an output (error_map.h).
 */
#include "radiosity/output/output.h"

#include <string.h>

#include "mesh/mesh.h"
#include "radiosity/output/anchor.h"
#include "radiosity/output/attributes.h"
#include "radiosity/output/blend.h"
#include "radiosity/output/error_map.h"
#include "radiosity/output/keep.h"
#include "radiosity/output/smooth.h"
#include "radiosity/surface/cover.h"
#include "radiosity/surface/paint.h"
#include "radiosity/surface/refine.h"
#include "radiosity/surface/split.h"
#include "radiosity/surface/tessellate.h"

/* Rounds of splits at shadow borders: each halves the width of a border's blur. */
enum { BORDER_ROUNDS = 4 };
/* Edges below max_edge over this are not split again. */
#define SHORT_EDGES 24
/* Least differences across a border: of the two vertices' sum, and of the scene's mean radiosity. Smaller
 * values split edges because of noise. Long edges (above max_edge / LONG_EDGES) count LONG_SHARE of that: the
 * end of a penumbra on one of them shows as a dark tongue in the light. */
#define BORDER_SHARE .1
#define BORDER_LEVEL .04
#define LONG_EDGES   5
#define LONG_SHARE   .6
/* Rays per anchor, and first rays per lamp, at the default error. Two rays that agree often miss a penumbra,
 * but those of a vertex and its neighbours together seldom do. */
enum { ANCHOR_RAYS = 20, LAMP_RAYS = 2 };
/* Rounds of more rays to the lamps of which neighbours see different parts: each reaches one edge further. */
enum { DOUBT_ROUNDS = 2 };
/* Factors on the wanted error of the direct light: of flat vertices, and the largest one. With a larger one,
 * flecks show at the ends of penumbrae. */
#define FLAT_SLACK 1.5
#define MOST_SLACK 2
/* The accuracy of the border of a cover, and half the distance from before the border to behind it, over the
 * length of the edge that is cut. */
#define CUT_WIDTH (1. / 256)
/* How far from a wall the search for the border looks first: less than half of that. */
#define WALL_WIDTH (.4 * CUT_WIDTH)
/* Tolerance of the groups of vertices per anchor. Vertices of one group turn at most acos(1 - .4^2) = 33
 * degrees from their anchor with GATHER. A larger tolerance allows 79 degrees, but anchor.c also halves
 * groups that turn by more than the blend accepts. */
#define GATHER_TOLERANCE .4
#define DIRECT_TOLERANCE .9
enum { VERTEX_GRAIN = 64 }; /* vertices per chunk */

/* An edge that crosses the border of a cover. */
typedef struct cover_border {
    uint32_t ends[2]; /* ends[0] < ends[1] */
    double share;     /* of the way at which it is cut; 0: not at all */
} cover_border;

typedef struct lighting {
    const fct_solution *s;
    fct_surface *surface;
    const fct_anchors *anchors;
    uint32_t instance;
    bool back;
    double usual_area;        /* mean over the vertices before any split at a border */
    uint32_t usual_count;     /* their number */
    uint32_t first;           /* lower vertices have their light */
    float *direct, *indirect; /* irradiance, per vertex x 3; `indirect` holds all of it with FCT_FINAL_NONE */
    uint8_t *covered;         /* per vertex */
    uint8_t *cut;             /* per vertex: it was made to cut an edge at the border of a cover */
    fct_sight *sights;        /* per vertex */
    uint32_t *doubt;          /* per vertex: lamps of which it or a neighbour sees a part */
    uint32_t *again;          /* per vertex: those of them that need more rays now */
    float *nearest;           /* per vertex: see fct_point_is_covered */
    uint32_t known;           /* lower vertices have room in these arrays */
    uint32_t cut_first;       /* of the vertices before the border of a cover */
    cover_border *borders;    /* of the edges that cross the border of a cover; NULL: none */
    fct_edge_table edges;     /* -> place in `borders` */
    uint64_t *chunk_rays;
} lighting;

/* Irradiance over the links alone (FCT_FINAL_NONE). */
static void gather_links(const lighting *l, size_t v, const float normal[3], double irradiance[3]) {
    const fct_solution *s = l->s;
    const float *point = l->surface->sample_points + 3 * v;
    const uint32_t leaf =
        fct_elements_locate_point(&s->elements, l->instance, l->back, l->surface->places[v], v3_load(point));
    fct_links_irradiance(&s->elements, &s->links, leaf, v3_load(point), v3_load(normal), irradiance);
}

/* The factor on the error of the direct light that a vertex may have. Flat vertices are smoothed. The noise
 * of a vertex shows over its area, so vertices of splits at a border may have more of it if they are denser
 * than those before. */
static double find_slack(const lighting *l, size_t v) {
    const double area = l->surface->areas[v], slack = l->surface->flat[v] ? FLAT_SLACK : 1;
    if (v < l->usual_count) return slack;
    return area > 0 ? fct_min(slack * fct_max(sqrt(l->usual_area / area), 1), MOST_SLACK) : MOST_SLACK;
}

/* Once the indirect light is known. doubt: as in fct_lamp_goal; irradiance: as in fct_lamps_direct. */
static void gather_lamps(const lighting *l, size_t v, const float normal[3], uint32_t doubt,
                         double irradiance[3], uint64_t *rays) {
    const fct_solution *s = l->s;
    const fct_surface *f = l->surface;
    uint32_t rays_each = fct_solution_lamp_rays(s, LAMP_RAYS);
    fct_lamp_goal goal = {.slack = find_slack(l, v), .doubt = doubt};
    for (size_t c = 0; c < 3; ++c) goal.other += (double)l->indirect[3 * v + c];
    fct_solution_direct(s, f->sample_points + 3 * v, normal, f->offsets[v],
                        fct_hash3(s->def.seed + 1, l->instance, v), rays_each, &goal, &l->sights[v],
                        irradiance, rays);
}

static void cover_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    lighting *l = user;
    const fct_surface *f = l->surface;
    (void)thread;
    for (size_t v = l->first + begin; v < l->first + end; ++v) {
        float normal[3];
        fct_surface_normal(l->surface, v, l->back, normal);
        l->covered[v] = fct_surface_is_solid(l->surface, v) &&
                        fct_point_is_covered(l->s->scene, f->sample_points + 3 * v, normal, f->offsets[v],
                                             fct_hash3(l->s->def.seed + 3, l->instance, v), &l->nearest[v],
                                             &l->chunk_rays[chunk]);
    }
}

static void light_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    lighting *l = user;
    const fct_surface *f = l->surface;
    (void)thread;
    for (size_t v = l->first + begin; v < l->first + end; ++v) {
        float normal[3];
        double direct[3] = {0, 0, 0}, indirect[3] = {0, 0, 0};
        fct_surface_normal(l->surface, v, l->back, normal);
        const bool lit = fct_surface_is_solid(l->surface, v) && !l->covered[v];
        if (lit) {
            if (l->s->def.final == FCT_FINAL_NONE) {
                gather_links(l, v, normal, indirect);
            } else {
                fct_anchors_irradiance(l->anchors, &l->s->elements, f->sample_points + 3 * v, normal,
                                       f->offsets[v], f->flat[v], indirect, &l->chunk_rays[chunk]);
            }
        }
        for (size_t c = 0; c < 3; ++c) l->indirect[3 * v + c] = (float)indirect[c];
        if (lit && l->s->def.final != FCT_FINAL_NONE)
            gather_lamps(l, v, normal, 0, direct, &l->chunk_rays[chunk]);
        for (size_t c = 0; c < 3; ++c) l->direct[3 * v + c] = (float)direct[c];
    }
}

static void doubt_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    lighting *l = user;
    (void)thread;
    for (size_t v = begin; v < end; ++v) {
        if (!l->again[v]) continue;
        float normal[3];
        double direct[3];
        fct_surface_normal(l->surface, v, l->back, normal);
        for (size_t c = 0; c < 3; ++c) direct[c] = l->direct[3 * v + c];
        gather_lamps(l, v, normal, l->again[v], direct, &l->chunk_rays[chunk]);
        for (size_t c = 0; c < 3; ++c) l->direct[3 * v + c] = (float)direct[c];
    }
}

/* The mean over an instance. */
static void load_mean_reflectance(const fct_solution *s, uint32_t instance, float out[3]) {
    const fct_elements *set = &s->elements;
    const fct_element *root = set->items + set->roots[instance];
    double sum[3] = {0, 0, 0}, area = 0;
    memcpy(out, root->reflectance, sizeof root->reflectance);
    if (set->root_counts[instance] == 1) return;
    for (uint32_t k = 0; k < set->root_counts[instance]; ++k) {
        for (size_t c = 0; c < 3; ++c) sum[c] += root[k].area * root[k].reflectance[c];
        area += root[k].area;
    }
    for (size_t c = 0; c < 3 && area > 0; ++c) out[c] = (float)(sum[c] / area);
}

/* A vertex without a surface is black. */
static void color_vertex(const lighting *l, size_t v, const float reflectance[3], float color[3]) {
    double irradiance[3];
    color[0] = color[1] = color[2] = 0;
    if (!fct_surface_is_solid(l->surface, v)) return;
    for (size_t c = 0; c < 3; ++c)
        irradiance[c] = (double)l->direct[3 * v + c] + (double)l->indirect[3 * v + c];
    fct_solution_radiosity(l->s, l->instance, reflectance, irradiance, color);
}

/* `painted`: with the reflectance of each vertex; otherwise with the mean of the instance, so that the detail
 * of a texture splits no edges. */
static void color_vertices(const lighting *l, bool painted) {
    const fct_mesh *m = &l->surface->mesh;
    float rho[3];
    load_mean_reflectance(l->s, l->instance, rho);
    for (size_t v = 0; v < m->vertex_count; ++v) {
        if (painted) fct_surface_reflectance(l->s->scene, l->instance, l->surface, v, rho);
        color_vertex(l, v, rho, m->colors + 3 * v);
    }
}

typedef void run_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread);

/* Runs the function for [0, count). Errors: MEMORY, CANCELLED. */
static fct_result run_chunks(lighting *l, const char *phase, size_t count, run_chunk *run, uint64_t *rays) {
    const fct_env *env = l->s->env;
    const size_t chunks = fct_chunk_count(count, VERTEX_GRAIN);
    l->chunk_rays = fct_allocate_zero(env, chunks + 1, sizeof *l->chunk_rays);
    if (!l->chunk_rays) return fct_fail_memory(env, "the output");
    fct_result result = fct_parallel_for_progress(env, phase, count, VERTEX_GRAIN, run, l);
    for (size_t c = 0; c < chunks; ++c) *rays += l->chunk_rays[c];
    fct_release(env, l->chunk_rays);
    return result;
}

/* Runs the function for vertices [first, vertex_count), less `first`. Errors: MEMORY, CANCELLED. */
static fct_result run_vertices(lighting *l, const char *phase, uint32_t first, run_chunk *run,
                               uint64_t *rays) {
    return run_chunks(l, phase, l->surface->mesh.vertex_count - first, run, rays);
}

/* Makes room for the light of all vertices. The new ones are covered or not, and made by a cut or not. */
static fct_result grow_light(lighting *l, bool covered, bool cut) {
    const fct_env *env = l->s->env;
    const size_t count = l->surface->mesh.vertex_count;
    const struct {
        void **array;
        size_t size;
    } arrays[] = {{(void **)&l->direct, 3 * sizeof *l->direct},
                  {(void **)&l->indirect, 3 * sizeof *l->indirect},
                  {(void **)&l->nearest, sizeof *l->nearest},
                  {(void **)&l->covered, 1},
                  {(void **)&l->cut, 1},
                  {(void **)&l->again, sizeof *l->again},
                  {(void **)&l->doubt, sizeof *l->doubt},
                  {(void **)&l->sights, sizeof *l->sights}};
    fct_result result = FCT_OK;
    for (size_t i = 0; i < FCT_LENGTH(arrays) && result == FCT_OK; ++i) {
        size_t capacity = l->known;
        result = fct_grow(env, arrays[i].array, &capacity, count, arrays[i].size);
    }
    for (size_t v = l->known; result == FCT_OK && v < count; ++v) {
        l->covered[v] = covered, l->cut[v] = cut, l->nearest[v] = INFINITY;
        l->again[v] = 0, l->doubt[v] = 0, l->sights[v] = (fct_sight){0};
    }
    l->known = (uint32_t)count;
    return result;
}

/* Finds which of the new vertices are covered. */
static fct_result cover_vertices(lighting *l, uint64_t *rays) {
    fct_result result = grow_light(l, false, false);
    return result == FCT_OK ? run_vertices(l, "covers", l->first, cover_chunk, rays) : result;
}

/* Finds the vertices that need more rays: all rays of such a vertex to a lamp agree, but those of a neighbour
 * do not agree with them. Returns their number. */
static fct_result find_doubt(lighting *l, uint32_t *count) {
    const fct_mesh *m = &l->surface->mesh;
    *count = 0;
    fct_sight *around = fct_allocate_zero(l->s->env, m->vertex_count, sizeof *around);
    if (!around) return fct_fail_memory(l->s->env, "the output");
    for (size_t c = 0; c < 3 * (size_t)m->face_count; ++c) {
        const uint32_t a = m->triangles[c], b = m->triangles[c % 3 == 2 ? c - 2 : c + 1];
        around[a].open |= l->sights[b].open, around[a].blocked |= l->sights[b].blocked;
        around[b].open |= l->sights[a].open, around[b].blocked |= l->sights[a].blocked;
    }
    for (size_t v = 0; v < m->vertex_count; ++v) {
        const fct_sight own = l->sights[v];
        const uint32_t mixed = (own.open | around[v].open) & (own.blocked | around[v].blocked);
        const uint32_t more = mixed & (own.open | own.blocked) & ~fct_sight_mixed(own) & ~l->doubt[v];
        l->doubt[v] |= more;
        l->again[v] = more;
        *count += more != 0;
    }
    fct_release(l->s->env, around);
    return FCT_OK;
}

/* Lights the vertices from l->first on, and those at borders of shadows once more. */
static fct_result light_vertices(lighting *l, uint64_t *rays) {
    fct_result result = run_vertices(l, "vertices", l->first, light_chunk, rays);
    uint32_t count = 1;
    for (int round = 0; round < DOUBT_ROUNDS && count > 0 && result == FCT_OK; ++round) {
        result = find_doubt(l, &count);
        if (result == FCT_OK && count > 0) result = run_vertices(l, "vertices", 0, doubt_chunk, rays);
    }
    if (result == FCT_OK) color_vertices(l, false);
    l->first = l->surface->mesh.vertex_count;
    return result;
}

/* True if the edge goes from an uncovered to a covered vertex. An edge of old vertices has been looked at in
 * an earlier round, and one that ends at a cut is behind the border. */
static bool crosses_cover(const lighting *l, uint32_t a, uint32_t b) {
    const uint32_t to = l->covered[a] ? a : b;
    if (l->covered[a] == l->covered[b] || l->cut[to] || (a < l->first && b < l->first)) return false;
    return fct_surface_is_solid(l->surface, a) && fct_surface_is_solid(l->surface, b);
}

/* An edge, and how far above it rays start. */
typedef struct edge_ends {
    v3 positions[2], normals[2];
    float offset;
} edge_ends;

static edge_ends load_ends(const lighting *l, uint32_t from, uint32_t to) {
    const fct_surface *f = l->surface;
    edge_ends e = {.offset = fmaxf(f->offsets[from], f->offsets[to])};
    for (int k = 0; k < 2; ++k) {
        float normal[3];
        fct_surface_normal(f, k ? to : from, l->back, normal);
        e.normals[k] = v3_load(normal);
        e.positions[k] = v3_load(f->mesh.positions + 3 * (size_t)(k ? to : from));
    }
    return e;
}

/* The share of the way along the edge at which a ray just above it meets something; NAN if nothing is there.
 */
static double find_wall(const fct_scene *scene, const edge_ends *e, uint64_t *rays) {
    const v3 origin = v3_mad(e->positions[0], e->offset, e->normals[0]);
    const v3 goal = v3_mad(e->positions[1], e->offset, e->normals[1]);
    fct_ray ray = {.t_min = 0, .t_max = 1};
    fct_scene_hit hit;
    v3_store(ray.origin, origin);
    v3_store(ray.direction, v3_sub(goal, origin));
    ++*rays;
    return fct_scene_closest_hit(scene, &ray, &hit, NULL) ? (double)hit.t : (double)NAN;
}

static bool edge_is_covered(const lighting *l, const edge_ends *e, double share, uint64_t seed,
                            uint64_t *rays) {
    float point[3], normal[3];
    v3_store(normal, v3_unit(v3_mad(v3_scale(e->normals[0], 1 - share), share, e->normals[1])));
    v3_store(point, v3_mad(e->positions[0], share, v3_sub(e->positions[1], e->positions[0])));
    return fct_point_is_covered(l->s->scene, point, normal, e->offset, seed, NULL, rays);
}

/* On an edge from an uncovered vertex to a covered one: the share of the way to a point just before that
 * where the cover begins, which is mostly at a wall; 0 if this is at the start. */
static double find_cover(const lighting *l, uint32_t from, uint32_t to, uint64_t *rays) {
    const uint64_t seed = fct_hash3(l->s->def.seed + 4, l->instance, from);
    const edge_ends e = load_ends(l, from, to);
    const double wall = find_wall(l->s->scene, &e, rays);
    double bare = 0, covered = 1;
    for (int k = 0; covered - bare > CUT_WIDTH; ++k) {
        double share = wall + (k == 0 ? WALL_WIDTH : -WALL_WIDTH);
        if (k > 1 || !(share > bare && share < covered)) share = .5 * (bare + covered);
        *(edge_is_covered(l, &e, share, seed, rays) ? &covered : &bare) = share;
    }
    return bare < CUT_WIDTH ? 0 : bare;
}

static void border_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    lighting *l = user;
    (void)thread;
    for (size_t i = begin; i < end; ++i) {
        const uint32_t a = l->borders[i].ends[0], b = l->borders[i].ends[1];
        const bool turned = l->covered[a];
        const double share = find_cover(l, turned ? b : a, turned ? a : b, &l->chunk_rays[chunk]);
        l->borders[i].share = turned && share > 0 ? 1 - share : share;
    }
}

static double cut_before_cover(void *user, uint32_t a, uint32_t b) {
    const lighting *l = user;
    const uint32_t *place = crosses_cover(l, a, b) ? fct_edge_table_find(&l->edges, a, b) : NULL;
    return place ? l->borders[*place].share : 0;
}

/* On the rest of such an edge: just behind it. */
static double cut_behind_cover(void *user, uint32_t a, uint32_t b) {
    const lighting *l = user;
    if (a >= l->cut_first || b < l->cut_first || !l->covered[a] || l->covered[b]) return 0;
    const float *p = l->surface->mesh.positions + 3 * (size_t)a,
                *q = l->surface->mesh.positions + 3 * (size_t)b;
    bool wide = v3_norm(v3_sub(v3_load(p), v3_load(q))) > l->s->max_edge * CUT_WIDTH;
    return wide ? 1 - 2 * CUT_WIDTH : 0;
}

/* Lists the edges that cross the border of a cover, and finds it on each. */
static fct_result find_borders(lighting *l, uint64_t *rays) {
    const fct_mesh *m = &l->surface->mesh;
    const size_t corners = 3 * (size_t)m->face_count;
    size_t most = 0, count = 0;
    for (size_t c = 0; c < corners; ++c)
        most += crosses_cover(l, m->triangles[c], m->triangles[c % 3 == 2 ? c - 2 : c + 1]);
    if (most == 0) return FCT_OK;
    fct_result result = fct_edge_table_init(l->s->env, most, &l->edges);
    if (result != FCT_OK) return result;
    l->borders = fct_allocate(l->s->env, most, sizeof *l->borders);
    if (!l->borders) return fct_fail_memory(l->s->env, "the output");
    for (size_t c = 0; c < corners; ++c) {
        const uint32_t a = m->triangles[c], b = m->triangles[c % 3 == 2 ? c - 2 : c + 1];
        bool fresh = false;
        if (!crosses_cover(l, a, b)) continue;
        uint32_t *place = fct_edge_table_insert(&l->edges, a, b, &fresh);
        if (!fresh) continue;
        *place = (uint32_t)count;
        l->borders[count++] = (cover_border){.ends = {a < b ? a : b, a < b ? b : a}};
    }
    return run_chunks(l, "covers", count, border_chunk, rays);
}

/* Cuts surfaces along the border of their cover: first a row of vertices before the border, then one
 * behind it. So neither light nor darkness shows beyond the border. */
static fct_result cut_covers(lighting *l, uint64_t *rays) {
    uint32_t added = 0;
    l->cut_first = l->surface->mesh.vertex_count;
    fct_result result = find_borders(l, rays);
    if (result == FCT_OK && l->borders)
        result = fct_surface_refine(l->s->env, l->surface, cut_before_cover, l, &added);
    fct_release(l->s->env, l->borders), l->borders = NULL;
    fct_edge_table_release(l->s->env, &l->edges);
    if (result == FCT_OK && added > 0) result = grow_light(l, false, true);
    if (result == FCT_OK && added > 0)
        result = fct_surface_refine(l->s->env, l->surface, cut_behind_cover, l, &added);
    if (result == FCT_OK && added > 0) result = grow_light(l, true, true);
    return result;
}

/* Final colours, from smoothed indirect light. */
static fct_result finish_colors(const lighting *l) {
    const fct_env *env = l->s->env;
    fct_result result = FCT_OK;
    if (l->s->def.final != FCT_FINAL_NONE) {
        result = fct_light_smooth(env, l->surface, l->covered, l->indirect);
        if (result == FCT_OK) result = fct_direct_smooth(env, l->surface, l->covered, l->sights, l->direct);
    }
    if (result == FCT_OK) color_vertices(l, true);
    return result;
}

/* Measures the error of the final light, and maps it if it is an output. */
static fct_result check_light(lighting *l, fct_check *check, uint64_t *rays) {
    fct_mesh *mesh = &l->surface->mesh;
    fct_check own = {0};
    for (size_t i = 0; i < 3 * (size_t)mesh->vertex_count; ++i) l->direct[i] += l->indirect[i];
    fct_result result =
        fct_check_surface(l->s, l->surface, l->instance, l->back, l->direct, l->covered, &own, rays);
    if (result == FCT_OK && l->s->def.outputs & FCT_MESH_ERROR) {
        const fct_error_map_def def = {.solution = l->s,
                                       .surface = l->surface,
                                       .instance = l->instance,
                                       .back = l->back,
                                       .anchors = l->anchors,
                                       .light = l->direct,
                                       .covered = l->covered,
                                       .check = &own};
        result = fct_error_map_add(&def, mesh, rays);
    }
    check->area += own.area, check->light += own.light;
    check->square += own.square, check->bias += own.bias;
    check->points += own.points;
    return result;
}

bool fct_output_crosses_border(const float a[3], const float b[3], double mean_radiosity, bool is_long) {
    double difference = 0, level = 0;
    for (int c = 0; c < 3; ++c) {
        double x = a[c], y = b[c];
        difference += fabs(x - y);
        level += x + y;
    }
    return difference > (is_long ? LONG_SHARE : 1) * (BORDER_SHARE * level + BORDER_LEVEL * mean_radiosity);
}

static double cut_at_border(void *user, uint32_t a, uint32_t b) {
    const lighting *l = user;
    const fct_mesh *m = &l->surface->mesh;
    const size_t i = 3 * (size_t)a, j = 3 * (size_t)b;
    if (l->covered[a] || l->covered[b]) return 0;
    double length = v3_norm(v3_sub(v3_load(m->positions + i), v3_load(m->positions + j)));
    const bool is_long = length > l->s->max_edge / LONG_EDGES;
    bool crosses = length >= l->s->max_edge / SHORT_EDGES &&
                   fct_output_crosses_border(m->colors + i, m->colors + j, l->s->mean_radiosity, is_long);
    return crosses ? .5 : 0;
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

/* Anchors for the vertices from l->first on. */
static fct_result add_anchors(const lighting *l, fct_anchors *anchors) {
    const fct_solution *s = l->s;
    bool dense = s->def.final == FCT_FINAL_GATHER;
    uint32_t rays = (uint32_t)(ANCHOR_RAYS * s->fineness);
    double tolerance = dense ? GATHER_TOLERANCE : DIRECT_TOLERANCE;
    fct_anchors_def def = {.rays = s->def.samples ? s->def.samples : rays,
                           .tolerance = tolerance / sqrt(fct_max(s->fineness, .5)),
                           .side = l->back ? -1 : 1,
                           .instance = l->instance,
                           .first = l->first,
                           .covered = l->covered,
                           .nearest = l->nearest,
                           .seed = fct_hash2(s->def.seed, l->instance)};
    const fct_source source = fct_solution_source(s);
    return fct_anchors_extend(s->env, &source, l->surface, &def, anchors);
}

fct_result fct_output_surface(const fct_solution *s, uint32_t instance, bool back, fct_surface *out) {
    const bool kept = s->def.keep != FCT_KEEP_NONE;
    const fct_shading shading = fct_solution_shading(s, instance, back);
    fct_result result = fct_surface_build(s->env, &shading, kept ? (double)INFINITY : s->max_edge, out);
    if (result != FCT_OK || s->def.keep != FCT_KEEP_FACE) return result;
    result = fct_keep_centres(s->env, out);
    if (result != FCT_OK) fct_surface_release(s->env, out);
    return result;
}

void fct_output_take(const fct_solution *s, fct_surface *surface, bool back, fct_mesh *out) {
    *out = surface->mesh;
    out->normals = surface->normals;
    surface->mesh = (fct_mesh){0};
    surface->normals = NULL;
    if (!back || s->def.keep != FCT_KEEP_NONE) return;
    fct_mesh_turn_over(out);
    for (size_t i = 0; i < 3 * (size_t)out->vertex_count; ++i) out->normals[i] = -out->normals[i];
}

fct_result fct_output_side(const fct_solution *s, uint32_t instance, bool back, fct_mesh *out,
                           fct_check *check, fct_output_rays *counts) {
    const fct_env *env = s->env;
    uint64_t *rays = &counts->light;
    const bool gathers = s->def.final != FCT_FINAL_NONE, kept = s->def.keep != FCT_KEEP_NONE;
    const int rounds = kept ? 0 : BORDER_ROUNDS;
    fct_surface surface = {0};
    fct_anchors anchors = {0};
    fct_result result = fct_output_surface(s, instance, back, &surface);
    if (result != FCT_OK) return result;
    lighting l = {.s = s,
                  .surface = &surface,
                  .anchors = &anchors,
                  .instance = instance,
                  .back = back,
                  .usual_count = surface.mesh.vertex_count};
    for (size_t v = 0; v < surface.mesh.vertex_count; ++v)
        l.usual_area += (double)surface.areas[v] / surface.mesh.vertex_count;
    result = cover_vertices(&l, rays);
    if (result == FCT_OK && !kept) result = cut_covers(&l, rays);
    if (result == FCT_OK && gathers) result = add_anchors(&l, &anchors);
    for (int round = 0; result == FCT_OK; ++round) {
        uint32_t added = 0;
        if ((result = light_vertices(&l, rays)) != FCT_OK || round == rounds) break;
        result = fct_surface_refine(env, &surface, cut_at_border, &l, &added);
        if (result == FCT_OK && added > 0) result = cover_vertices(&l, rays);
        if (result == FCT_OK && added > 0) result = cut_covers(&l, rays);
        if (result == FCT_OK && added > 0 && gathers) result = add_anchors(&l, &anchors);
        if (added == 0) break;
    }
    *rays += anchors.rays;
    if (result == FCT_OK) result = finish_colors(&l);
    if (result == FCT_OK)
        result = fct_attributes_add(env, s->def.outputs, l.direct, l.indirect, &surface.mesh);
    if (result == FCT_OK && !s->unchecked) result = check_light(&l, check, &counts->check);
    if (result == FCT_OK) fct_output_take(s, &surface, back, out);
    fct_release(env, l.direct), fct_release(env, l.indirect), fct_release(env, l.nearest);
    fct_release(env, l.covered), fct_release(env, l.cut), fct_release(env, l.again);
    fct_release(env, l.doubt), fct_release(env, l.sights);
    fct_anchors_release(env, &anchors);
    fct_surface_release(env, &surface);
    return result;
}
