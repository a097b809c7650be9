/* radiosity/output/anchor.c: see anchor.h. */
#include "radiosity/output/anchor.h"

#include <string.h>

#include "radiosity/solve/transport.h"

enum { NEAREST = 10, STACK = 64 };
/* Squared difference of normals beyond which an anchor says nothing of a vertex: a group's own are nearer
 * than that. */
#define MOST_TURN2 .4

typedef struct group {
    uint32_t begin, end;
    uint32_t anchor; /* in the list of anchors */
    bool halve;
} group;

typedef struct grouping {
    const fct_elements *set;
    const float *stored;
    const fct_surface *surface;
    const fct_anchors_def *def;
    double longest; /* clamp of reach */
    uint32_t *vertices;
    group *groups;
    fct_anchor *anchors;
    uint64_t *chunk_rays;
} grouping;

void fct_anchor_gather(const fct_elements *set, const float *stored, uint32_t rays, uint64_t seed,
                       fct_anchor *a) {
    v3 n = v3_load(a->normal), p = v3_mad(v3_load(a->position), a->offset, n);
    double sum[3] = {0, 0, 0}, inverse = 0;
    v3 vector[3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
    float origin[3], direction[3];
    v3_store(origin, p);
    for (uint32_t k = 0; k < rays; ++k) {
        double plane[2];
        fct_plane_point(k, seed, plane);
        v3 d = fct_cosine_direction(n, plane[0], plane[1]);
        v3_store(direction, d);
        fct_found found = fct_transport_look(set, stored, origin, direction);
        if (found.distance > 0) inverse += 1 / found.distance;
        double weight = 1 / fmax(v3_dot(d, n), .15);
        for (int c = 0; c < 3; ++c) {
            sum[c] += found.radiosity[c];
            vector[c] = v3_mad(vector[c], found.radiosity[c] * weight, d);
        }
    }
    a->reach = inverse > 0 ? (float)(rays / inverse) : INFINITY;
    for (int c = 0; c < 3; ++c) {
        a->irradiance[c] = (float)(sum[c] / rays);
        v3_store(a->gradient[c], v3_scale(vector[c], 1. / rays));
    }
}

/* The vertex nearest to the group's middle, in place and direction. */
static uint32_t middle(const grouping *g, const group *k) {
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

static void group_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    grouping *g = user;
    const fct_surface *s = g->surface;
    (void)thread;
    uint64_t rays = 0;
    for (size_t i = begin; i < end; ++i) {
        group *k = &g->groups[i];
        fct_anchor *a = &g->anchors[k->anchor];
        uint32_t size = k->end - k->begin, v = middle(g, k);
        memcpy(a->position, s->sample_points + 3 * (size_t)v, sizeof a->position);
        for (int c = 0; c < 3; ++c)
            a->normal[c] = (float)g->def->side * s->normals[3 * (size_t)v + (size_t)c];
        a->offset = s->offsets[v];
        uint32_t more = 0;
        while (more < 8 && size >> more > 1) ++more;
        uint32_t count = g->def->rays + g->def->rays * more / 4;
        fct_anchor_gather(g->set, g->stored, count,
                          fct_hash3(g->def->seed, v, (uint64_t)s->mesh.vertex_count), a);
        rays += count;
        /* no finer than the vertices: an edge is about 1e4 offsets */
        double least = 1.5 * sqrt(s->areas[v]);
        a->reach = (float)fmin(fmax(a->reach, least), g->longest);
        double worst = 0;
        v3 p = v3_load(a->position), n = v3_load(s->normals + 3 * (size_t)v);
        for (uint32_t m = k->begin; m < k->end; ++m) {
            const size_t w = g->vertices[m];
            double apart = v3_norm(v3_sub(v3_load(s->sample_points + 3 * w), p)) / a->reach;
            double turn = sqrt(fmax(0, 1 - v3_dot(n, v3_load(s->normals + 3 * w))));
            worst = fmax(worst, apart + turn);
        }
        k->halve = size > 1 && worst > g->def->tolerance;
    }
    g->chunk_rays[chunk] += rays;
}

static double coordinate(const grouping *g, uint32_t vertex, int axis) {
    return axis < 3 ? g->surface->sample_points[3 * (size_t)vertex + (size_t)axis]
                    : g->surface->normals[3 * (size_t)vertex + (size_t)axis - 3];
}

/* Moves vertices below `value` to the front; returns where the others begin. Order within both stays. */
static uint32_t divide(const grouping *g, uint32_t begin, uint32_t end, int axis, double value,
                       uint32_t *scratch) {
    uint32_t low = begin, high = 0;
    for (uint32_t i = begin; i < end; ++i) {
        uint32_t v = g->vertices[i];
        if (coordinate(g, v, axis) < value)
            g->vertices[low++] = v;
        else
            scratch[high++] = v;
    }
    memcpy(g->vertices + low, scratch, high * sizeof *scratch);
    return low;
}

/* Halves by the mean along the axis of largest extent: of the normals when they turn by more than half a
 * right angle, else of space. */
static uint32_t halve(const grouping *g, const group *k, uint32_t *scratch) {
    double lower[6], upper[6], mean[6] = {0};
    for (int a = 0; a < 6; ++a) lower[a] = HUGE_VAL, upper[a] = -HUGE_VAL;
    for (uint32_t i = k->begin; i < k->end; ++i)
        for (int a = 0; a < 6; ++a) {
            double x = coordinate(g, g->vertices[i], a);
            lower[a] = fmin(lower[a], x), upper[a] = fmax(upper[a], x);
            mean[a] += x / (k->end - k->begin);
        }
    int axis = 0, turn = 3;
    for (int a = 1; a < 3; ++a) {
        if (upper[a] - lower[a] > upper[axis] - lower[axis]) axis = a;
        if (upper[a + 3] - lower[a + 3] > upper[turn] - lower[turn]) turn = a + 3;
    }
    if (upper[turn] - lower[turn] > .8) axis = turn;
    uint32_t middle_index = divide(g, k->begin, k->end, axis, .5 * (lower[axis] + upper[axis]), scratch);
    if (middle_index == k->begin || middle_index == k->end) return k->begin + (k->end - k->begin) / 2;
    return middle_index;
}

/* Orders anchors [begin, end) as an implicit balanced kd-tree: the middle item splits. */
static void build_tree(fct_anchors *t) {
    struct range {
        uint32_t begin, end;
    } stack[STACK];
    int top = 0;
    stack[top++] = (struct range){0, t->count};
    while (top > 0) {
        struct range r = stack[--top];
        if (r.end - r.begin < 2) continue;
        float lower[3], upper[3];
        for (int a = 0; a < 3; ++a) lower[a] = INFINITY, upper[a] = -INFINITY;
        for (uint32_t i = r.begin; i < r.end; ++i)
            for (int a = 0; a < 3; ++a) {
                lower[a] = fminf(lower[a], t->items[i].position[a]);
                upper[a] = fmaxf(upper[a], t->items[i].position[a]);
            }
        int axis = 0;
        for (int a = 1; a < 3; ++a)
            if (upper[a] - lower[a] > upper[axis] - lower[axis]) axis = a;
        uint32_t mid = r.begin + (r.end - r.begin) / 2, low = r.begin, high = r.end - 1;
        while (low < high) { /* Hoare's selection of the middle */
            float pivot = t->items[low + (high - low) / 2].position[axis];
            uint32_t i = low, j = high;
            for (;;) {
                while (t->items[i].position[axis] < pivot) ++i;
                while (t->items[j].position[axis] > pivot) --j;
                if (i >= j) break;
                fct_anchor swap = t->items[i];
                t->items[i] = t->items[j];
                t->items[j] = swap;
                ++i, --j;
            }
            if (mid <= j)
                high = j;
            else
                low = j + 1;
        }
        t->axes[mid] = (uint8_t)axis;
        stack[top++] = (struct range){r.begin, mid};
        stack[top++] = (struct range){mid + 1, r.end};
    }
}

/* Vertices that can carry light. */
static uint32_t list_vertices(const fct_surface *s, uint32_t *vertices) {
    uint32_t n = 0;
    for (uint32_t v = 0; v < s->mesh.vertex_count; ++v) {
        const float *d = s->normals + 3 * (size_t)v;
        if (s->places[v] != FCT_NONE && (d[0] != 0 || d[1] != 0 || d[2] != 0)) vertices[n++] = v;
    }
    return n;
}

fct_result fct_anchors_create(const fct_env *env, const fct_elements *set, const float *stored,
                              const fct_surface *surface, const fct_anchors_def *def, fct_anchors *out) {
    *out = (fct_anchors){0};
    uint32_t most = surface->mesh.vertex_count;
    v3 extent = v3_sub(v3_load(set->view.bounds.upper), v3_load(set->view.bounds.lower));
    grouping g = {
        .set = set, .stored = stored, .surface = surface, .def = def, .longest = v3_norm(extent) / 8};
    uint32_t *scratch = fct_allocate(env, most, sizeof *scratch);
    group *next = fct_allocate(env, most, sizeof *next);
    size_t capacity = 0;
    fct_result result = FCT_OK;
    g.vertices = fct_allocate(env, most, sizeof *g.vertices);
    g.groups = fct_allocate(env, most, sizeof *g.groups);
    g.chunk_rays = fct_allocate_zero(env, fct_chunk_count(most, 4) + 1, sizeof *g.chunk_rays);
    if (!scratch || !next || !g.vertices || !g.groups || !g.chunk_rays) {
        result = fct_fail_memory(env, "anchors");
        goto done;
    }
    uint32_t pending = 1, anchors = 0, total = list_vertices(surface, g.vertices);
    g.groups[0] = (group){.begin = 0, .end = total};
    if (total == 0) pending = 0;
    while (pending > 0) {
        if ((result = fct_grow(env, (void **)&out->items, &capacity, anchors + pending,
                               sizeof *out->items)) != FCT_OK)
            goto done;
        g.anchors = out->items;
        for (uint32_t i = 0; i < pending; ++i) g.groups[i].anchor = anchors++;
        result = fct_parallel_for_progress(env, "anchors", pending, 4, group_chunk, &g);
        if (result != FCT_OK) goto done;
        uint32_t count = 0;
        for (uint32_t i = 0; i < pending; ++i) {
            if (!g.groups[i].halve) continue;
            uint32_t mid = halve(&g, &g.groups[i], scratch);
            next[count++] = (group){.begin = g.groups[i].begin, .end = mid};
            next[count++] = (group){.begin = mid, .end = g.groups[i].end};
        }
        group *swap = g.groups;
        g.groups = next, next = swap;
        pending = count;
    }
    for (size_t c = 0; c < fct_chunk_count(most, 4) + 1; ++c) out->rays += g.chunk_rays[c];
    out->count = anchors;
    out->axes = fct_allocate_zero(env, anchors, 1);
    if (!out->axes) {
        result = fct_fail_memory(env, "anchors");
        goto done;
    }
    double inverse = 0;
    for (uint32_t i = 0; i < anchors; ++i) inverse += 1 / out->items[i].reach;
    out->turn = inverse > 0 ? .7 * anchors / inverse : 1;
    build_tree(out);
done:
    fct_release(env, scratch);
    fct_release(env, next);
    fct_release(env, g.vertices);
    fct_release(env, g.groups);
    fct_release(env, g.chunk_rays);
    if (result != FCT_OK) fct_anchors_release(env, out);
    return result;
}

void fct_anchors_release(const fct_env *env, fct_anchors *anchors) {
    fct_release(env, anchors->items);
    fct_release(env, anchors->axes);
    *anchors = (fct_anchors){0};
}

/* The nearest anchors, nearest first. */
typedef struct nearest {
    uint32_t ids[NEAREST];
    double distances2[NEAREST];
    int count;
} nearest;

static void consider(nearest *n, uint32_t id, double d2) {
    if (n->count == NEAREST && d2 >= n->distances2[NEAREST - 1]) return;
    int i = n->count < NEAREST ? n->count++ : NEAREST - 1;
    for (; i > 0 && n->distances2[i - 1] > d2; --i)
        n->ids[i] = n->ids[i - 1], n->distances2[i] = n->distances2[i - 1];
    n->ids[i] = id, n->distances2[i] = d2;
}

static void find_nearest(const fct_anchors *t, const float p[3], const float n[3], nearest *found) {
    struct visit {
        uint32_t begin, end;
        double least2;
    } stack[STACK];
    int top = 0;
    found->count = 0;
    stack[top++] = (struct visit){0, t->count, 0};
    while (top > 0) {
        struct visit r = stack[--top];
        if (r.begin >= r.end || (found->count == NEAREST && r.least2 >= found->distances2[NEAREST - 1]))
            continue;
        uint32_t mid = r.begin + (r.end - r.begin) / 2;
        const fct_anchor *a = &t->items[mid];
        double d2 = 0, turn2 = 0;
        for (int k = 0; k < 3; ++k) {
            double dp = (double)p[k] - a->position[k], dn = (double)n[k] - a->normal[k];
            d2 += dp * dp, turn2 += dn * dn;
        }
        if (turn2 < MOST_TURN2) consider(found, mid, d2 + t->turn * t->turn * turn2);
        double side = (double)p[t->axes[mid]] - a->position[t->axes[mid]];
        struct visit low = {r.begin, mid, r.least2}, high = {mid + 1, r.end, r.least2};
        if (side < 0)
            high.least2 = fmax(r.least2, side * side);
        else
            low.least2 = fmax(r.least2, side * side);
        stack[top++] = side < 0 ? high : low;
        stack[top++] = side < 0 ? low : high;
    }
}

static bool sees(const fct_elements *set, const float p[3], const float n[3], float offset,
                 const fct_anchor *a) {
    fct_ray ray = {.t_min = 0, .t_max = 1};
    for (int k = 0; k < 3; ++k) {
        double from = (double)p[k] + 4 * (double)offset * n[k];
        ray.origin[k] = (float)from;
        ray.direction[k] = (float)((double)a->position[k] + 4 * (double)a->offset * a->normal[k] - from);
    }
    return !fct_scene_any_hit(set->scene, &ray, NULL);
}

void fct_anchors_irradiance(const fct_anchors *t, const fct_elements *set, const float point[3],
                            const float normal[3], float offset, bool near_wall, double irradiance[3],
                            uint64_t *rays) {
    nearest near;
    double x[NEAREST], values[NEAREST][3], weights[NEAREST], farthest = 0, total = 0, mean = 0;
    irradiance[0] = irradiance[1] = irradiance[2] = 0;
    find_nearest(t, point, normal, &near);
    if (near.count == 0) return;
    v3 p = v3_load(point), n = v3_load(normal);
    for (int i = 0; i < near.count; ++i) {
        const fct_anchor *a = &t->items[near.ids[i]];
        v3 turn = v3_sub(n, v3_load(a->normal));
        x[i] = v3_norm(v3_sub(p, v3_load(a->position))) / a->reach + v3_norm(turn) * .7 + 1e-4;
        farthest = fmax(farthest, x[i]);
        for (int c = 0; c < 3; ++c) {
            double e = a->irradiance[c], changed = e + v3_dot(v3_load(a->gradient[c]), turn);
            values[i][c] = fmin(fmax(changed, .5 * e), 1.6 * e);
        }
    }
    for (int i = 0; i < near.count; ++i) {
        double w = near.count == 1 ? 1 : 1 / x[i] - .98 / farthest;
        weights[i] = w * w;
        total += weights[i];
        mean += weights[i] * (values[i][0] + values[i][1] + values[i][2]);
    }
    mean /= total;
    for (int i = 0; i < near.count && near_wall && near.count > 1; ++i) {
        double value = values[i][0] + values[i][1] + values[i][2];
        if (weights[i] < .01 * total || fabs(value - mean) < .15 * mean) continue;
        ++*rays;
        if (!sees(set, point, normal, offset, &t->items[near.ids[i]])) weights[i] = 0;
    }
    total = 0;
    for (int i = 0; i < near.count; ++i) total += weights[i];
    if (total <= 0) weights[0] = total = 1;
    for (int i = 0; i < near.count; ++i)
        for (int c = 0; c < 3; ++c) irradiance[c] += weights[i] / total * values[i][c];
}
