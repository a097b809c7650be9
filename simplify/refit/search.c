/* simplify/refit/search.c: see search.h.
 *
 * The faces of a ring are measured in octets, relative to their common point and scaled by
 * the ring's size, so that floats suffice. Samples that follow each other on the curve land on the same
 * rings, so a small cache holds the octets.
 */
#include "simplify/refit/search.h"

#include "base/math/nearest8.h"
#include "base/math/simd.h"

/* A barycentric weight above this counts as positive. */
#define RIM 1e-6

enum { CACHE = 64 /* octets */, MAX_WALK = 4 /* steps from ring to ring */ };

/* Up to eight faces of a ring. Unused places repeat the first face. */
typedef struct octet {
    uint32_t point, first; /* the ring's point, and the corner from which the list was read */
    uint32_t rest;         /* the corner that follows in the list */
    uint32_t corners[8], wedges[8];
    v3 center;
    double scale;           /* 1 / the largest coordinate of x and y */
    float x[3][8], y[3][8]; /* the next two points of each face, relative to the centre, scaled */
} octet;

typedef struct search {
    const fct_simplifier *s;
    octet cache[CACHE];
    v3 p; /* the sample */
    double distance2;
    fct_landing *out;
} search;

/* Reads up to eight live corners of the list from `first`. */
static void fill_octet(const fct_simplifier *s, uint32_t point, uint32_t first, octet *o) {
    uint32_t count = 0, c = first;
    v3 x[8], y[8];
    double size = 0;
    o->point = point, o->first = first, o->center = point_position(s, point);
    for (; c != FCT_NONE && count < 8; c = s->next_corners[c]) {
        if (corner_dead(s, c)) continue;
        o->corners[count] = c;
        o->wedges[count] = s->corner_wedges ? s->wedge_parents[s->corner_wedges[c]] : FCT_NONE;
        x[count] = v3_sub(point_position(s, s->triangles[corner_next(c)]), o->center);
        y[count] = v3_sub(point_position(s, s->triangles[corner_previous(c)]), o->center);
        size = fct_max(size, fct_max(v3_norm2(x[count]), v3_norm2(y[count])));
        ++count;
    }
    o->rest = c;
    o->scale = size > 0 ? 1 / sqrt(size) : 1;
    for (uint32_t i = 0; i < 8; ++i) {
        uint32_t k = i < count ? i : 0;
        if (count == 0) {
            o->corners[i] = FCT_NONE;
            continue;
        }
        o->corners[i] = o->corners[k], o->wedges[i] = o->wedges[k];
        v3 a = v3_scale(x[k], o->scale), b = v3_scale(y[k], o->scale);
        o->x[0][i] = (float)a.x, o->x[1][i] = (float)a.y, o->x[2][i] = (float)a.z;
        o->y[0][i] = (float)b.x, o->y[1][i] = (float)b.y, o->y[2][i] = (float)b.z;
    }
}

static const octet *find_octet(search *w, uint32_t point, uint32_t first) {
    octet *o = &w->cache[(point + first) % CACHE];
    if (o->point != point || o->first != first) fill_octet(w->s, point, first, o);
    return o;
}

static inline f8x3 load_points(const float rows[3][8], f8x3 from) {
    return (f8x3){f8_add(from.x, f8_load(rows[0])), f8_add(from.y, f8_load(rows[1])),
                  f8_add(from.z, f8_load(rows[2]))};
}

/* Updates the landing by one octet. */
static void search_octet(search *w, const octet *o, uint32_t wedge) {
    fct_landing *out = w->out;
    bool same = false;
    uint32_t lanes = 0xff;
    if (w->s->corner_wedges) {
        uint32_t own = i8_eq(i8_load(o->wedges), i8_set(wedge));
        same = own != 0;
        if (!same && out->attributes) return;
        if (same) lanes = own;
    }
    v3 to = v3_scale(v3_sub(o->center, w->p), o->scale);
    f8x3 a = {f8_set((float)to.x), f8_set((float)to.y), f8_set((float)to.z)};
    fct_nearest8 near = fct_nearest8_find(a, load_points(o->x, a), load_points(o->y, a));
    float distance2[8], v[8], u[8];
    f8_store(distance2, f8x3_dot(near.point, near.point));
    uint32_t best = 8;
    for (uint32_t i = 0; i < 8; ++i)
        if ((lanes >> i & 1) && (best == 8 || distance2[i] < distance2[best])) best = i;
    double found2 = (double)distance2[best] / (o->scale * o->scale);
    if (same == out->attributes && !(found2 < w->distance2)) return;
    f8_store(u, near.v), f8_store(v, near.w);
    /* The weights belong to the corners after the point's own corner. */
    uint32_t c = o->corners[best], k = c % 3;
    float b[3];
    b[k] = 1 - u[best] - v[best], b[(k + 1) % 3] = u[best], b[(k + 2) % 3] = v[best];
    w->distance2 = found2;
    *out = (fct_landing){.face = c / 3, .u = b[1], .v = b[2], .attributes = same};
}

static void search_ring(search *w, uint32_t point, uint32_t wedge) {
    const fct_point *at = point_at(w->s, point);
    if (at->valence == 0 || at->valence > SIMPLIFY_HUB) return;
    for (uint32_t first = at->first_corner; first != FCT_NONE;) {
        const octet *o = find_octet(w, point, first);
        if (o->corners[0] != FCT_NONE) search_octet(w, o, wedge);
        first = o->rest;
    }
}

/* If the nearest point lies on the rim of the searched rings, searches the rings of the points of that rim,
 * and so on while the distance decreases. */
static void walk_rings(search *w, const uint32_t *points, uint32_t count) {
    const fct_simplifier *s = w->s;
    uint32_t searched[3 + 2 * MAX_WALK], number = count;
    memcpy(searched, points, count * sizeof *points);
    for (uint32_t step = 0; step < MAX_WALK && w->out->face != FCT_NONE; ++step) {
        uint32_t from = w->out->face, first = 3 * from, fresh = number;
        float b[3] = {1 - w->out->u - w->out->v, w->out->u, w->out->v};
        for (uint32_t k = 0; k < 3; ++k) {
            bool met = false;
            for (uint32_t j = 0; j < number; ++j) met |= searched[j] == s->triangles[first + k];
            if (met && b[k] > RIM) return;
            if (!met && b[k] > RIM) searched[fresh++] = s->triangles[first + k];
        }
        if (fresh == number + 3) return; /* inside the face: no rim */
        for (; number < fresh; ++number) {
            uint32_t wedge = FCT_NONE;
            for (uint32_t k = 0; k < 3 && s->corner_wedges; ++k)
                if (s->triangles[first + k] == searched[number])
                    wedge = s->wedge_parents[s->corner_wedges[first + k]];
            search_ring(w, searched[number], wedge);
        }
        if (w->out->face == from) return;
    }
}

void fct_refit_search(const fct_refit *r, size_t begin, size_t end) {
    const fct_simplifier *s = r->s;
    search w = {.s = s};
    for (uint32_t i = 0; i < CACHE; ++i) w.cache[i].point = FCT_NONE;
    for (size_t i = begin; i < end; ++i) {
        w.out = &r->landings[i];
        *w.out = (fct_landing){.face = FCT_NONE};
        if (r->samples[i].weight == 0) continue;
        uint32_t corners[3] = {0}, points[3], count = find_sample_corners(r, i, corners), number = 0;
        w.p = r->samples[i].at, w.distance2 = INFINITY;
        for (uint32_t k = 0; k < count; ++k) {
            uint32_t point = s->point_parents[s->point_of[s->mesh->triangles[corners[k]]]];
            if ((number > 0 && point == points[0]) || (number > 1 && point == points[1])) continue;
            points[number++] = point;
            uint32_t input = find_input_wedge(s, corners[k]);
            search_ring(&w, point, s->corner_wedges ? s->wedge_parents[input] : FCT_NONE);
        }
        walk_rings(&w, points, number);
    }
}
