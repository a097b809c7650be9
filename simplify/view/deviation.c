/* simplify/view/deviation.c: see deviation.h. */
#include "simplify/view/deviation.h"

#include <math.h>
#include <string.h>

#include "base/math/vec.h"
#include "simplify/view/nearest.h"

/* Bounds are stored as floats; this is more than their rounding. */
#define SLACK 1e-6

typedef struct box {
    v3 low, high;
} box;

/* A face of the ring after the contraction. */
typedef struct ring_face {
    uint32_t face;
    v3 corners[3], normal;  /* unit, or 0 */
    const float *colors[3]; /* NULL: absent */
} ring_face;

struct fct_deviation {
    fct_walk *w;
    fct_hierarchy *h;
    /* Per sample, which has the number of its point. */
    uint32_t *nodes;      /* FCT_NONE: no face uses the point */
    uint32_t *next;       /* the next sample of the same face */
    box *normals;         /* those of its faces at the finest level */
    const float **colors; /* NULL: absent, or several */
    uint32_t *first;      /* per face: a sample */
    box *places;          /* per step: of what is inside the sphere of its bound */
    /* The current step. */
    uint32_t *list, list_count; /* samples */
    size_t list_room;
    ring_face *ring;
    fct_octet *octets; /* of the ring; unused places repeat its first face */
    size_t ring_room, octet_room;
};

static const float *find_color(const fct_progressive *m, uint32_t node) {
    return m->color == FCT_NONE ? NULL : m->values + (size_t)m->value_count * node + m->color;
}

static v3 find_position(const fct_progressive *m, uint32_t node) {
    return v3_load(m->positions + 3 * (size_t)node);
}

/* Also an area that is too small for a double gives 0. */
static v3 find_cross(const fct_deviation *d, uint32_t f, uint32_t nodes[3]) {
    const fct_progressive *m = d->w->m;
    for (uint32_t k = 0; k < 3; ++k) nodes[k] = d->w->nodes[d->w->triangles[3 * (size_t)f + k]];
    v3 a = find_position(m, nodes[0]);
    return v3_cross(v3_sub(find_position(m, nodes[1]), a), v3_sub(find_position(m, nodes[2]), a));
}

static const box empty_box = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

static void add_to_box(box *b, v3 x) {
    b->low = v3_make(fct_min(b->low.x, x.x), fct_min(b->low.y, x.y), fct_min(b->low.z, x.z));
    b->high = v3_make(fct_max(b->high.x, x.x), fct_max(b->high.y, x.y), fct_max(b->high.z, x.z));
}

static void add_sample(fct_deviation *d, uint32_t node, uint32_t f) {
    const fct_progressive *m = d->w->m;
    uint32_t p = m->points[node];
    const float *color = find_color(m, node);
    if (d->nodes[p] == FCT_NONE) {
        d->nodes[p] = node;
        d->colors[p] = color;
        d->next[p] = d->first[f];
        d->first[f] = p;
    } else if (d->colors[p] && memcmp(d->colors[p], color, 3 * sizeof *color))
        d->colors[p] = NULL;
}

static void start_samples(fct_deviation *d) {
    const fct_progressive *m = d->w->m;
    uint32_t nodes[3];
    memset(d->nodes, 0xff, m->point_count * sizeof *d->nodes);
    memset(d->first, 0xff, m->face_count * sizeof *d->first);
    for (uint32_t p = 0; p < m->point_count; ++p) d->normals[p] = empty_box;
    for (uint32_t f = 0; f < m->face_count; ++f) {
        v3 unit = v3_unit(find_cross(d, f, nodes));
        d->h->turns[f].cosine = 1;
        v3_store(d->h->turns[f].normal, unit);
        for (int k = 0; k < 3; ++k) {
            add_sample(d, nodes[k], f);
            add_to_box(&d->normals[m->points[nodes[k]]], unit);
        }
    }
}

fct_result fct_deviation_begin(fct_walk *w, fct_hierarchy *h, fct_deviation **out) {
    const fct_progressive *m = w->m;
    fct_deviation *d = *out = fct_allocate_zero(m->env, 1, sizeof *d);
    if (!d) return fct_fail_memory(m->env, "a vertex hierarchy");
    d->w = w, d->h = h;
    const fct_array arrays[] = {
        FCT_ARRAY(d->nodes, m->point_count),   FCT_ARRAY(d->next, m->point_count),
        FCT_ARRAY(d->normals, m->point_count), FCT_ARRAY_ZERO(d->colors, m->point_count),
        FCT_ARRAY(d->first, m->face_count),    FCT_ARRAY(d->places, m->step_count)};
    fct_result result = fct_allocate_all(m->env, arrays, FCT_LENGTH(arrays), "a vertex hierarchy");
    if (result == FCT_OK) start_samples(d);
    return result;
}

void fct_deviation_end(fct_deviation *d) {
    if (!d) return;
    const fct_env *env = d->w->m->env;
    void *arrays[] = {d->nodes, d->next, d->normals, d->colors, d->places,
                      d->first, d->list, d->ring,    d->octets};
    for (size_t i = 0; i < FCT_LENGTH(arrays); ++i) fct_release(env, arrays[i]);
    fct_release(env, d);
}

/* Moves the samples of a face to the list. */
static fct_result take_samples(fct_deviation *d, uint32_t f) {
    fct_result result = FCT_OK;
    for (uint32_t p = d->first[f]; p != FCT_NONE && result == FCT_OK; p = d->next[p]) {
        result = fct_grow(d->w->m->env, (void **)&d->list, &d->list_room, (size_t)d->list_count + 1,
                          sizeof *d->list);
        if (result == FCT_OK) d->list[d->list_count++] = p;
    }
    d->first[f] = FCT_NONE;
    return result;
}

static void load_face(const fct_deviation *d, uint32_t f, ring_face *out) {
    const fct_progressive *m = d->w->m;
    uint32_t nodes[3];
    fct_face_turn *turn = &d->h->turns[f];
    out->face = f;
    out->normal = v3_unit(find_cross(d, f, nodes));
    turn->cosine = (float)fct_min((double)turn->cosine, v3_dot(out->normal, v3_load(turn->normal)));
    for (int k = 0; k < 3; ++k) {
        out->corners[k] = find_position(m, nodes[k]);
        out->colors[k] = find_color(m, nodes[k]);
    }
}

/* The ring of step w->step, and the samples of its faces and of those that the step adds. */
static fct_result load_ring(fct_deviation *d) {
    const fct_progressive *m = d->w->m;
    uint32_t step = d->w->step;
    d->list_count = 0;
    fct_result result = fct_walk_find_ring(d->w);
    size_t count = d->w->ring_count;
    if (result == FCT_OK) result = fct_grow(m->env, (void **)&d->ring, &d->ring_room, count, sizeof *d->ring);
    if (result == FCT_OK)
        result = fct_grow(m->env, (void **)&d->octets, &d->octet_room, (count + 7) / 8, sizeof *d->octets);
    for (uint32_t i = 0; i < d->w->ring_count && result == FCT_OK; ++i) {
        load_face(d, d->w->ring[i] / 3, &d->ring[i]);
        result = take_samples(d, d->ring[i].face);
    }
    for (uint32_t f = m->step_faces[step]; f < m->step_faces[step + 1] && result == FCT_OK; ++f)
        result = take_samples(d, f);
    return result;
}

/* The squared distance from the origin to the side from a to b, and *t, where it is nearest. */
static double measure_side(v3 a, v3 b, double *t) {
    v3 ab = v3_sub(b, a);
    double length2 = v3_norm2(ab), along = -v3_dot(a, ab);
    *t = along <= 0 ? 0 : along >= length2 ? 1 : along / length2;
    return v3_norm2(v3_mad(a, *t, ab));
}

/* The squared distance from x to a face; weights: those of the corners at the nearest point. */
static double measure_face(v3 x, const ring_face *f, double weights[3]) {
    v3 a = v3_sub(f->corners[0], x), b = v3_sub(f->corners[1], x), c = v3_sub(f->corners[2], x);
    double u = v3_dot(f->normal, v3_cross(b, c)), v = v3_dot(f->normal, v3_cross(c, a)),
           w = v3_dot(f->normal, v3_cross(a, b)), t[3], least = INFINITY;
    if (u >= 0 && v >= 0 && w >= 0 && u + v + w > 0) {
        double all = u + v + w, height = v3_dot(f->normal, a);
        weights[0] = u / all, weights[1] = v / all, weights[2] = w / all;
        return height * height;
    }
    const v3 corners[3] = {a, b, c};
    for (int k = 0; k < 3; ++k) {
        int next = (k + 1) % 3;
        double distance2 = measure_side(corners[k], corners[next], &t[k]);
        if (distance2 >= least) continue;
        least = distance2;
        weights[k] = 1 - t[k], weights[next] = t[k], weights[3 - k - next] = 0;
    }
    return least;
}

/* The largest difference of a component. */
static double measure_color(const float *color, const ring_face *f, const double weights[3]) {
    double most = 0;
    for (int i = 0; i < 3 && color; ++i) {
        double at = 0;
        for (int k = 0; k < 3; ++k) at += weights[k] * (double)f->colors[k][i];
        most = fct_max(most, fabs(at - (double)color[i]));
    }
    return most;
}

/* x relative to the bound, so that floats suffice to choose a face. */
static void scale_point(const fct_bound *bound, v3 x, float out[3]) {
    double scale = bound->radius > 0 ? 1 / (double)bound->radius : 1;
    v3_store(out, v3_scale(v3_sub(x, v3_load(bound->center)), scale));
}

static void fill_octets(fct_deviation *d, const fct_bound *bound) {
    uint32_t count = d->w->ring_count;
    for (uint32_t i = 0; i < (count + 7) / 8 * 8; ++i)
        for (int k = 0; k < 3; ++k) {
            float at[3];
            scale_point(bound, d->ring[i < count ? i : 0].corners[k], at);
            for (int axis = 0; axis < 3; ++axis) d->octets[i / 8].corners[k][axis][i % 8] = at[axis];
        }
}

/* Gives the listed samples to the nearest faces of the ring; the error and the colour of the bound. */
static void place_samples(fct_deviation *d, fct_bound *bound) {
    double error2 = 0, color = 0, weights[3] = {1, 0, 0};
    uint32_t count = d->w->ring_count;
    fill_octets(d, bound);
    for (uint32_t i = 0; i < d->list_count && count; ++i) {
        uint32_t p = d->list[i];
        v3 x = find_position(d->w->m, d->nodes[p]);
        float at[3];
        scale_point(bound, x, at);
        uint32_t nearest = fct_view_nearest(d->octets, (count + 7) / 8, at);
        const ring_face *face = &d->ring[nearest < count ? nearest : 0];
        error2 = fct_max(error2, measure_face(x, face, weights));
        color = fct_max(color, measure_color(d->colors[p], face, weights));
        d->next[p] = d->first[face->face];
        d->first[face->face] = p;
    }
    bound->error = (float)(sqrt(error2) * (1 + SLACK));
    bound->color = (float)(color * (1 + SLACK));
}

/* Calls add_to_box, or finds the farthest point from the center, for samples, ring and the nodes of the step.
 */
static double visit_points(const fct_deviation *d, box *b, v3 center) {
    const fct_progressive *m = d->w->m;
    uint32_t first = m->step_nodes[d->w->step], nodes = m->step_nodes[d->w->step + 1] - first;
    uint32_t count = d->list_count + nodes + 3 * d->w->ring_count;
    double farthest2 = 0;
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t k = i - d->list_count, r = k - nodes;
        v3 x = i < d->list_count           ? find_position(m, d->nodes[d->list[i]])
               : i < d->list_count + nodes ? find_position(m, first + k)
                                           : d->ring[r / 3].corners[r % 3];
        if (b)
            add_to_box(b, x);
        else
            farthest2 = fct_max(farthest2, v3_norm2(v3_sub(x, center)));
    }
    return sqrt(farthest2);
}

static void bound_places(const fct_deviation *d, fct_bound *bound) {
    box *b = &d->places[d->w->step];
    *b = empty_box;
    visit_points(d, b, v3_make(0, 0, 0));
    if (!(b->low.x <= b->high.x)) *b = (box){{0, 0, 0}, {0, 0, 0}};
    v3_store(bound->center, v3_scale(v3_add(b->low, b->high), .5));
    bound->radius = (float)(visit_points(d, NULL, v3_load(bound->center)) * (1 + SLACK));
}

/* Whether the faces around the point leave a gap: then its neighbours do not each come once before a side and
 * once behind one. Sums and sums of squares stand for the two sets of neighbours. */
static bool has_gap(const fct_deviation *d) {
    const fct_walk *w = d->w;
    uint64_t sum = 0, squares = 0;
    for (uint32_t i = 0; i < w->ring_count; ++i) {
        uint32_t f = w->ring[i] / 3, k = w->ring[i] % 3;
        uint64_t a = w->m->points[w->nodes[w->triangles[3 * f + (k + 1) % 3]]],
                 b = w->m->points[w->nodes[w->triangles[3 * f + (k + 2) % 3]]];
        sum += a - b, squares += a * a - b * b;
    }
    return sum || squares;
}

static void bound_normals(const fct_deviation *d, fct_bound *bound) {
    box b = empty_box;
    const v3 slack = {SLACK, SLACK, SLACK};
    bool any = d->w->ring_count == 0 || has_gap(d);
    for (uint32_t i = 0; i < d->list_count; ++i) {
        add_to_box(&b, d->normals[d->list[i]].low);
        add_to_box(&b, d->normals[d->list[i]].high);
    }
    for (uint32_t i = 0; i < d->w->ring_count; ++i) add_to_box(&b, d->ring[i].normal);
    if (any) b = (box){{-1, -1, -1}, {1, 1, 1}};
    v3_store(bound->low, v3_sub(b.low, slack));
    v3_store(bound->high, v3_add(b.high, slack));
}

/* Includes the bound of a child. */
static void include_bound(fct_bound *bound, const fct_bound *child) {
    v3 offset = v3_sub(v3_load(child->center), v3_load(bound->center));
    double reach = (v3_norm(offset) + (double)child->radius) * (1 + SLACK);
    bound->radius = (float)fct_max((double)bound->radius, reach);
    bound->error = child->error > bound->error ? child->error : bound->error;
    bound->color = child->color > bound->color ? child->color : bound->color;
    for (int k = 0; k < 3; ++k) {
        bound->low[k] = child->low[k] < bound->low[k] ? child->low[k] : bound->low[k];
        bound->high[k] = child->high[k] > bound->high[k] ? child->high[k] : bound->high[k];
    }
}

/* Spheres around spheres grow from level to level, boxes around boxes do not: the sphere goes at most to the
 * farthest corner of the box. */
static void limit_sphere(const box *b, fct_bound *bound) {
    v3 center = v3_load(bound->center), low = v3_sub(center, b->low), high = v3_sub(b->high, center);
    v3 corner = {fct_max(low.x, high.x), fct_max(low.y, high.y), fct_max(low.z, high.z)};
    bound->radius = (float)fct_min((double)bound->radius, v3_norm(corner) * (1 + SLACK));
}

fct_result fct_deviation_contract(fct_deviation *d) {
    fct_hierarchy *h = d->h;
    fct_walk_backward(d->w);
    fct_result result = load_ring(d);
    if (result != FCT_OK) return result;
    uint32_t step = d->w->step;
    fct_bound *bound = &h->bounds[step];
    bound_places(d, bound);
    bound_normals(d, bound);
    place_samples(d, bound);
    /* Nothing is left of what the step adds. */
    if (d->w->ring_count == 0) bound->error = 2 * bound->radius;
    for (uint32_t c = h->first_children[step]; c != FCT_NONE; c = h->siblings[c]) {
        include_bound(bound, &h->bounds[c]);
        add_to_box(&d->places[step], d->places[c].low);
        add_to_box(&d->places[step], d->places[c].high);
    }
    limit_sphere(&d->places[step], bound);
    return FCT_OK;
}
