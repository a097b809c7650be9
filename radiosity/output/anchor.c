/* radiosity/output/anchor.c: see anchor.h. */
#include "radiosity/output/anchor.h"

#include <string.h>

#include "radiosity/solve/transport.h"

/* Least cosine in the gradient's weight 1 / cosine. Without it, single grazing rays dominate the gradient. */
#define LEAST_COSINE .15
/* Clamp of an anchor's reach: at least this many root areas of its vertex, because anchors cannot be denser
 * than vertices. */
#define SHORTEST_REACH 1.5
/* Extent of a group's normals along an axis from which the group is halved by normals and not by space. */
#define WIDE_TURN .8
/* World units per |n - n'| in the search for anchors, over the anchors' harmonic mean reach: as in the blend.
 */
#define TURN_REACH .7
/* An anchor sends rays * (1 + k / 2) rays, with k = log2 of its group's size, at most MOST_DOUBLINGS. */
#define MOST_DOUBLINGS 8
/* On bent surfaces an anchor sends at least this times `rays`. A blend has fewer anchors there, because
 * others turn away, and the light of a porous statue differs from pit to pit. */
#define BENT_FACTOR 2
/* Relative difference of distances up to which a ray has hit the point at which it aims. */
#define SAME_POINT 1e-3
enum { GROUP_GRAIN = 4, VERTEX_GRAIN = 64 }; /* groups, and vertices, per chunk */

typedef struct group {
    uint32_t begin, end;
    uint32_t middle; /* its middle vertex */
    bool gathers;    /* the middle vertex is not an anchor yet */
    bool halve;      /* a vertex is too far from the anchor */
} group;

typedef struct grouping {
    const fct_source *source;
    const fct_surface *surface;
    const fct_anchors_def *def;
    uint32_t *vertices; /* each group has a range of these */
    group *groups, *next;
    uint32_t *scratch;
    const fct_anchors *known; /* of lower vertices than def->first */
    uint32_t *numbers;        /* per vertex: of its anchor; FCT_NONE: it is not an anchor */
    fct_anchor *anchors;
    fct_guide *guides; /* per thread; NULL: none */
    uint64_t *chunk_rays;
} grouping;

/* The sums of one gather. */
typedef struct gather_sums {
    double weight, inverse, light[3];
    v3 vector[3];
    uint64_t rays;
} gather_sums;

static void add_ray(const fct_source *source, v3 n, const float origin[3], const float direction[3],
                    const fct_found *found, double weight, uint64_t seed, gather_sums *sums) {
    const v3 d = v3_load(direction);
    double radiosity[3];
    fct_near_light(source, found, origin, direction, seed, radiosity, &sums->rays);
    const double lift = weight / fct_max(v3_dot(d, n), LEAST_COSINE);
    sums->weight += weight;
    if (found->distance > 0) sums->inverse += weight / fct_min(found->distance, source->longest);
    for (int c = 0; c < 3; ++c) {
        sums->light[c] += weight * radiosity[c];
        sums->vector[c] = v3_mad(sums->vector[c], lift * radiosity[c], d);
    }
}

static double weigh_ray(const fct_guide *guide, const fct_found *found, double cosine, uint32_t cosines,
                        uint32_t aimed) {
    const double density = aimed && found->leaf != FCT_NONE ? fct_guide_density(guide, found->leaf) : 0;
    if (density <= 0) return 1. / cosines;
    /* p_c and p_g times pi r^2. */
    const double p = cosine * found->cosine, q = FCT_PI * found->distance * found->distance * density;
    return p > 0 ? p / (cosines * p + aimed * q) : 0;
}

/* Sends a ray to a point of a source. */
static void aim_ray(const fct_source *source, const fct_guide *guide, v3 n, const float origin[3], double t,
                    const double place[2], uint32_t cosines, uint32_t aimed, uint64_t seed,
                    gather_sums *sums) {
    const uint32_t leaf = fct_guide_pick(guide, &t);
    fct_element_point point;
    float direction[3];
    fct_element_sample(source->set, leaf, t, place[0], place[1], &point);
    const v3 way = v3_sub(v3_load(point.position), v3_load(origin));
    const double distance = v3_norm(way);
    const v3 d = v3_scale(way, 1 / distance);
    const double cosine = v3_dot(d, n);
    if (!(distance > 0 && cosine > 0 && v3_dot(d, v3_load(point.normal)) < 0)) return;
    v3_store(direction, d);
    const fct_found found = fct_transport_look(source->set, source->stored, origin, direction);
    if (found.leaf != leaf || fabs(found.distance - distance) > SAME_POINT * distance) return;
    add_ray(source, n, origin, direction, &found, weigh_ray(guide, &found, cosine, cosines, aimed), seed,
            sums);
}

uint64_t fct_anchor_gather(const fct_source *source, const fct_guide *guide, uint32_t rays, uint64_t seed,
                           fct_anchor *a) {
    const v3 n = v3_load(a->normal);
    const uint32_t aimed = guide ? rays / 3 : 0, cosines = rays - aimed;
    gather_sums sums = {0};
    float origin[3], direction[3];
    v3_store(origin, v3_mad(v3_load(a->position), a->offset, n));
    for (uint32_t k = 0; k < cosines; ++k) {
        double plane[2];
        fct_plane_point(k, seed, plane);
        const v3 d = fct_cosine_direction(n, plane[0], plane[1]);
        v3_store(direction, d);
        const fct_found found = fct_transport_look(source->set, source->stored, origin, direction);
        add_ray(source, n, origin, direction, &found, weigh_ray(guide, &found, v3_dot(d, n), cosines, aimed),
                fct_hash3(seed, k, 1), &sums);
    }
    for (uint32_t k = 0; k < aimed; ++k) {
        double plane[2];
        fct_plane_point(k, fct_hash(seed), plane);
        const double t = (k + fct_uniform(fct_hash2(seed, k))) / aimed;
        aim_ray(source, guide, n, origin, t, plane, cosines, aimed, fct_hash3(seed, k, 2), &sums);
    }
    a->reach = sums.inverse > 0 ? (float)(sums.weight / sums.inverse) : INFINITY;
    for (int c = 0; c < 3; ++c) {
        a->irradiance[c] = (float)(sums.light[c] / sums.weight);
        const v3 along = v3_mad(sums.vector[c], -v3_dot(sums.vector[c], n), n);
        v3_store(a->gradient[c], v3_scale(along, 1 / sums.weight));
    }
    return rays + sums.rays;
}

/* The vertex nearest to the group's mean: least |p - mean p|^2 (2 - n . mean n). */
static uint32_t find_middle_vertex(const grouping *g, const group *k) {
    const fct_surface *s = g->surface;
    v3 p = {0, 0, 0}, n = {0, 0, 0};
    for (uint32_t i = k->begin; i < k->end; ++i) {
        p = v3_add(p, v3_load(s->sample_points + 3 * (size_t)g->vertices[i]));
        n = v3_add(n, v3_load(s->normals + 3 * (size_t)g->vertices[i]));
    }
    p = v3_scale(p, 1. / (k->end - k->begin));
    n = v3_unit(n);
    double least = HUGE_VAL;
    uint32_t best = g->vertices[k->begin];
    for (uint32_t i = k->begin; i < k->end; ++i) {
        uint32_t v = g->vertices[i];
        double d = v3_norm2(v3_sub(v3_load(s->sample_points + 3 * (size_t)v), p));
        d *= 2 - v3_dot(v3_load(s->normals + 3 * (size_t)v), n);
        if (d < least) least = d, best = v;
    }
    return best;
}

/* True if a vertex is farther from an anchor, in units of `reach`, than the tolerance allows, turned too far
 * to use it, or if a surface in front of it is nearer, which the anchor may not see. */
static bool anchor_is_too_far(const grouping *g, size_t vertex, double distance, double reach,
                              double cosine) {
    const bool hidden = g->def->nearest && g->surface->flat[vertex] && distance > g->def->nearest[vertex];
    const bool turned = 2 - 2 * cosine > .9 * FCT_MOST_TURN2; /* the search rounds normals to floats */
    return hidden || turned || distance / reach + sqrt(fct_max(1 - cosine, 0)) > g->def->tolerance;
}

static bool group_is_too_wide(const grouping *g, const group *k, const fct_anchor *a) {
    const fct_surface *s = g->surface;
    const v3 p = v3_load(a->position), n = v3_load(s->normals + 3 * (size_t)k->middle);
    bool wide = false;
    for (uint32_t m = k->begin; m < k->end && !wide; ++m) {
        const size_t w = g->vertices[m];
        const double distance = v3_norm(v3_sub(v3_load(s->sample_points + 3 * w), p));
        wide = anchor_is_too_far(g, w, distance, a->reach, v3_dot(n, v3_load(s->normals + 3 * w)));
    }
    return wide && k->end - k->begin > 1;
}

/* Gathers at the middle vertex of a group. Returns the number of rays. */
static uint64_t gather_group(const grouping *g, fct_guide *guide, const group *k, fct_anchor *a) {
    const fct_surface *s = g->surface;
    uint32_t size = k->end - k->begin, v = k->middle, doublings = 0;
    memcpy(a->position, s->sample_points + 3 * (size_t)v, sizeof a->position);
    for (int c = 0; c < 3; ++c) a->normal[c] = (float)g->def->side * s->normals[3 * (size_t)v + (size_t)c];
    a->offset = s->offsets[v];
    while (doublings < MOST_DOUBLINGS && size >> doublings > 1) ++doublings;
    uint32_t count = g->def->rays + g->def->rays * doublings / 2;
    if (!s->flat[v] && count < BENT_FACTOR * g->def->rays) count = BENT_FACTOR * g->def->rays;
    if (guide) {
        const v3 p = v3_load(a->position);
        const uint32_t leaf =
            fct_elements_locate_point(g->source->set, g->def->instance, g->def->side < 0, s->places[v], p);
        if (!fct_guide_aim(guide, leaf, p, v3_load(a->normal))) guide = NULL;
    }
    const uint64_t seed = fct_hash3(g->def->seed, v, (uint64_t)s->mesh.vertex_count);
    const uint64_t rays = fct_anchor_gather(g->source, guide, count, seed, a);
    double least = SHORTEST_REACH * sqrt(s->areas[v]);
    a->reach = (float)fct_min(fct_max(a->reach, least), g->source->longest);
    return rays;
}

static void find_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    const grouping *g = user;
    (void)chunk, (void)thread;
    for (size_t i = begin; i < end; ++i) g->groups[i].middle = find_middle_vertex(g, &g->groups[i]);
}

static void gather_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    grouping *g = user;
    fct_guide *guide = g->guides ? &g->guides[thread] : NULL;
    for (size_t i = begin; i < end; ++i) {
        group *k = &g->groups[i];
        fct_anchor *a = &g->anchors[g->numbers[k->middle]];
        if (k->gathers) g->chunk_rays[chunk] += gather_group(g, guide, k, a);
        k->halve = group_is_too_wide(g, k, a);
    }
}

/* Coordinate 0..2 of the sample point, or 3..5 of the normal. */
static double read_coordinate(const grouping *g, uint32_t vertex, int axis) {
    return axis < 3 ? g->surface->sample_points[3 * (size_t)vertex + (size_t)axis]
                    : g->surface->normals[3 * (size_t)vertex + (size_t)axis - 3];
}

/* Moves vertices below `value` to the front, in stable order. Returns the begin of the others. */
static uint32_t divide_group(const grouping *g, uint32_t begin, uint32_t end, int axis, double value) {
    uint32_t low = begin, high = 0;
    for (uint32_t i = begin; i < end; ++i) {
        uint32_t v = g->vertices[i];
        if (read_coordinate(g, v, axis) < value)
            g->vertices[low++] = v;
        else
            g->scratch[high++] = v;
    }
    memcpy(g->vertices + low, g->scratch, high * sizeof *g->scratch);
    return low;
}

/* Halves the group at the middle of its longest axis: of the normals if they extend over WIDE_TURN, else of
 * space. Returns the begin of the second half. */
static uint32_t halve_group(const grouping *g, const group *k) {
    double lower[6], upper[6];
    for (int a = 0; a < 6; ++a) lower[a] = HUGE_VAL, upper[a] = -HUGE_VAL;
    for (uint32_t i = k->begin; i < k->end; ++i)
        for (int a = 0; a < 6; ++a) {
            double x = read_coordinate(g, g->vertices[i], a);
            lower[a] = fct_min(lower[a], x), upper[a] = fct_max(upper[a], x);
        }
    int axis = 0, turn = 3;
    for (int a = 1; a < 3; ++a) {
        if (upper[a] - lower[a] > upper[axis] - lower[axis]) axis = a;
        if (upper[a + 3] - lower[a + 3] > upper[turn] - lower[turn]) turn = a + 3;
    }
    if (upper[turn] - lower[turn] > WIDE_TURN) axis = turn;
    uint32_t mid = divide_group(g, k->begin, k->end, axis, .5 * (lower[axis] + upper[axis]));
    return mid == k->begin || mid == k->end ? k->begin + (k->end - k->begin) / 2 : mid;
}

/* Whether some anchor is near enough to a vertex. No reach counts as more than that of another anchor plus
 * the distance to it: an anchor in the open says little about a pit beside it. */
static bool vertex_has_anchor(const grouping *g, size_t vertex) {
    const float *p = g->surface->sample_points + 3 * vertex;
    double apart[FCT_NEAREST_ANCHORS], reach = HUGE_VAL;
    float n[3];
    fct_nearest near;
    fct_surface_normal(g->surface, vertex, g->def->side < 0, n);
    fct_anchors_nearest(g->known, p, n, &near);
    for (int i = 0; i < near.count; ++i) {
        const fct_anchor *a = &g->known->items[near.ids[i]];
        apart[i] = v3_norm(v3_sub(v3_load(p), v3_load(a->position)));
        reach = fct_min(reach, a->reach + apart[i]);
    }
    for (int i = 0; i < near.count; ++i) {
        const double cosine = v3_dot(v3_load(n), v3_load(g->known->items[near.ids[i]].normal));
        if (!anchor_is_too_far(g, vertex, apart[i], reach, cosine)) return true;
    }
    return false;
}

static void need_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    const grouping *g = user;
    (void)chunk, (void)thread;
    for (size_t v = g->def->first + begin; v < g->def->first + end; ++v) {
        const bool lit = !(g->def->covered && g->def->covered[v]) && fct_surface_is_solid(g->surface, v);
        g->scratch[v] = lit && !(g->known->count > 0 && vertex_has_anchor(g, v));
    }
}

/* Lists the vertices from def->first on that need an anchor: those with a face and a normal that are not
 * covered and have no anchor near enough. Returns their number. */
static uint32_t list_vertices(const fct_env *env, grouping *g) {
    const uint32_t first = g->def->first, count = g->surface->mesh.vertex_count;
    uint32_t n = 0;
    fct_parallel_for(env, count - first, VERTEX_GRAIN, need_chunk, g);
    for (uint32_t v = first; v < count; ++v)
        if (g->scratch[v]) g->vertices[n++] = v;
    return n;
}

/* Makes the middle vertices of the `pending` groups anchors, those that are not anchors yet. A vertex that is
 * the middle of a group is often the middle of its half again. */
static fct_result number_anchors(const fct_env *env, grouping *g, uint32_t pending, size_t *capacity,
                                 fct_anchors *out) {
    fct_parallel_for(env, pending, GROUP_GRAIN, find_chunk, g);
    for (uint32_t i = 0; i < pending; ++i) {
        group *k = &g->groups[i];
        k->gathers = g->numbers[k->middle] == FCT_NONE;
        if (k->gathers) g->numbers[k->middle] = out->count++;
    }
    fct_result result = fct_grow(env, (void **)&out->items, capacity, out->count, sizeof *out->items);
    g->anchors = out->items;
    return result;
}

/* Gathers for the `pending` groups, and replaces too wide groups by their halves. *count: the number of
 * halves. */
static fct_result anchor_groups(const fct_env *env, grouping *g, uint32_t pending, uint32_t *count) {
    *count = 0;
    fct_result result = fct_parallel_for_progress(env, "anchors", pending, GROUP_GRAIN, gather_chunk, g);
    if (result != FCT_OK) return result;
    for (uint32_t i = 0; i < pending; ++i) {
        const group *k = &g->groups[i];
        if (!k->halve) continue;
        uint32_t mid = halve_group(g, k);
        g->next[(*count)++] = (group){.begin = k->begin, .end = mid};
        g->next[(*count)++] = (group){.begin = mid, .end = k->end};
    }
    group *swap = g->groups;
    g->groups = g->next, g->next = swap;
    return FCT_OK;
}

/* Adds anchors for the first `total` of g->vertices. */
static fct_result place_anchors(const fct_env *env, grouping *g, uint32_t total, fct_anchors *out) {
    uint32_t pending = 1;
    size_t capacity = out->count;
    g->groups[0] = (group){.begin = 0, .end = total};
    while (pending > 0) {
        fct_result result = number_anchors(env, g, pending, &capacity, out);
        if (result == FCT_OK) result = anchor_groups(env, g, pending, &pending);
        if (result != FCT_OK) return result;
    }
    fct_release(env, out->axes);
    out->axes = fct_allocate_zero(env, out->count, 1);
    return out->axes ? FCT_OK : fct_fail_memory(env, "anchors");
}

/* One guide per thread, if the source has guides. */
static fct_result make_guides(const fct_env *env, grouping *g) {
    const uint32_t threads = fct_env_threads(env);
    if (!g->source->guides) return FCT_OK;
    g->guides = fct_allocate_zero(env, threads, sizeof *g->guides);
    fct_result result = g->guides ? FCT_OK : fct_fail_memory(env, "anchors");
    for (uint32_t t = 0; t < threads && result == FCT_OK; ++t)
        result = fct_guide_create(g->source->guides, &g->guides[t]);
    return result;
}

fct_result fct_anchors_extend(const fct_env *env, const fct_source *source, const fct_surface *surface,
                              const fct_anchors_def *def, fct_anchors *out) {
    uint32_t most = surface->mesh.vertex_count;
    size_t chunks = fct_chunk_count(most, GROUP_GRAIN) + 1;
    grouping g = {.source = source, .surface = surface, .def = def, .known = out};
    const fct_array lists[] = {FCT_ARRAY(g.scratch, most), FCT_ARRAY(g.vertices, most)};
    const fct_array arrays[] = {FCT_ARRAY(g.next, most), FCT_ARRAY(g.groups, most),
                                FCT_ARRAY(g.numbers, most), FCT_ARRAY_ZERO(g.chunk_rays, chunks)};
    fct_result result = fct_allocate_all(env, lists, FCT_LENGTH(lists), "anchors");
    uint32_t total = result == FCT_OK ? list_vertices(env, &g) : 0;
    if (total > 0) result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "anchors");
    if (result != FCT_OK || total == 0) goto done;
    for (uint32_t v = 0; v < most; ++v) g.numbers[v] = FCT_NONE;
    result = make_guides(env, &g);
    if (result == FCT_OK) result = place_anchors(env, &g, total, out);
    for (uint32_t t = 0; g.guides && t < fct_env_threads(env); ++t) fct_guide_release(env, &g.guides[t]);
    fct_release(env, g.guides);
    if (result == FCT_OK) {
        double inverse = 0;
        for (size_t c = 0; c < chunks; ++c) out->rays += g.chunk_rays[c];
        for (uint32_t i = 0; i < out->count; ++i) inverse += 1 / out->items[i].reach;
        out->turn = TURN_REACH * out->count / inverse;
        fct_anchors_order(out);
    }
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
done:
    fct_release_all(env, lists, FCT_LENGTH(lists));
    if (result != FCT_OK) fct_anchors_release(env, out);
    return result;
}
