/* simplify/topology/weld.c: see weld.h.
 *
 * A side is open if no other face has it, in terms of input vertices. Vertices at one place become one point:
 * 1. if one face has both of them;
 * 2. if they are the ends of two open sides between the same two places: a doubled crease or a seam, which
 *    must not crack;
 * 3. if more than two open sides lie between the same places: each joins the others of its own body if every
 *    body there has at least two, else all are joined.
 * So bodies that only touch, at vertices or along closed edges, stay apart. Cost: linear, plus a sort of the
 * sides at places with several vertices. Points are numbered in the order of the input's vertices.
 */
#include "simplify/topology/weld.h"

#include "base/sort.h"

typedef struct weld {
    const fct_simplifier *s;
    uint32_t *vertices; /* per place: the number of its vertices */
    uint32_t *parents;  /* per vertex: union-find of the points; the lowest vertex is the root */
    uint32_t *bodies;   /* per vertex: union-find over faces and over pairs of open sides */
    uint32_t *order;    /* sides (as corners) that could be joined, sorted by the places of their ends */
    uint64_t *keys;     /* the sort keys of `order` */
    size_t count;       /* of `order` */
    uint32_t *open;     /* the open sides of the current run */
    uint32_t *crowd;    /* the runs of more than two open sides, each ended by FCT_NONE */
    size_t crowd_count;
} weld;

/* The vertices at the ends of side c; the one at the lower place comes first. */
static void find_side_ends(const weld *w, uint32_t c, uint32_t ends[2]) {
    const uint32_t *places = w->s->point_of, *t = w->s->mesh->triangles;
    uint32_t a = t[c], b = t[corner_next(c)];
    bool swap = places[a] > places[b];
    ends[0] = swap ? b : a, ends[1] = swap ? a : b;
}

static uint64_t side_key(const weld *w, uint32_t c) {
    uint32_t ends[2];
    find_side_ends(w, c, ends);
    return (uint64_t)w->s->point_of[ends[0]] << 32 | w->s->point_of[ends[1]];
}

static void join_sides(weld *w, uint32_t c, uint32_t d) {
    uint32_t first[2], second[2];
    find_side_ends(w, c, first);
    find_side_ends(w, d, second);
    for (int k = 0; k < 2; ++k) {
        fct_sets_join(w->parents, first[k], second[k]);
        fct_sets_join(w->bodies, first[k], second[k]);
    }
}

/* Lists the sides with a place that has several vertices, sorted by their places. A run is a range of sides
 * with the same two places. */
static fct_result list_sides(weld *w) {
    const fct_mesh *mesh = w->s->mesh;
    const uint32_t *places = w->s->point_of;
    size_t corners = 3 * (size_t)mesh->face_count;
    w->count = 0;
    for (int pass = 0; pass < 2; ++pass) {
        size_t count = 0;
        for (uint32_t c = 0; c < corners; ++c) {
            uint32_t a = mesh->triangles[c], b = mesh->triangles[corner_next(c)];
            if (places[a] == places[b] || (w->vertices[places[a]] == 1 && w->vertices[places[b]] == 1))
                continue;
            if (pass) w->keys[count] = side_key(w, c), w->order[count] = c;
            ++count;
        }
        if (pass) break;
        w->count = count;
        w->keys = fct_allocate(w->s->env, count, sizeof *w->keys);
        w->order = fct_allocate(w->s->env, count, sizeof *w->order);
        w->open = fct_allocate(w->s->env, count, sizeof *w->open);
        w->crowd = fct_allocate(w->s->env, count, 2 * sizeof *w->crowd);
        if (!w->keys || !w->order || !w->open || !w->crowd)
            return fct_fail_memory(w->s->env, "coincident sides");
    }
    return fct_sort_pairs(w->s->env, w->keys, w->order, w->count);
}

/* Finds the open sides of a run: those whose two vertices no other side of the run has. */
static fct_result find_open_sides(weld *w, size_t first, size_t count, size_t *open) {
    for (size_t i = first; i < first + count; ++i) {
        uint32_t ends[2];
        find_side_ends(w, w->order[i], ends);
        w->keys[i] = (uint64_t)ends[0] << 32 | ends[1];
    }
    fct_result result = fct_sort_pairs(w->s->env, w->keys + first, w->order + first, count);
    *open = 0;
    for (size_t i = first; i < first + count && result == FCT_OK; ++i) {
        bool met = (i > first && w->keys[i] == w->keys[i - 1]) ||
                   (i + 1 < first + count && w->keys[i] == w->keys[i + 1]);
        if (!met) w->open[(*open)++] = w->order[i];
    }
    return result;
}

/* Joins the runs with exactly two open sides and collects the larger ones in `crowd`. */
static fct_result join_runs(weld *w) {
    for (size_t first = 0, count; first < w->count; first += count) {
        uint64_t key = w->keys[first];
        for (count = 1; first + count < w->count && w->keys[first + count] == key;) ++count;
        size_t open;
        fct_result result = find_open_sides(w, first, count, &open);
        if (result != FCT_OK) return result;
        if (open == 2) join_sides(w, w->open[0], w->open[1]);
        if (open <= 2) continue;
        memcpy(w->crowd + w->crowd_count, w->open, open * sizeof *w->open);
        w->crowd_count += open;
        w->crowd[w->crowd_count++] = FCT_NONE;
    }
    return FCT_OK;
}

/* Joins the open sides of one run body by body, if each body there has at least two; else joins all of them.
 */
static fct_result join_crowd(weld *w, const uint32_t *sides, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        w->keys[i] = fct_sets_find(w->bodies, w->s->mesh->triangles[sides[i]]);
        w->order[i] = sides[i];
    }
    fct_result result = fct_sort_pairs(w->s->env, w->keys, w->order, count);
    if (result != FCT_OK) return result;
    bool single = false;
    for (size_t i = 0; i < count; ++i)
        single |=
            !((i > 0 && w->keys[i] == w->keys[i - 1]) || (i + 1 < count && w->keys[i] == w->keys[i + 1]));
    for (size_t i = 1; i < count; ++i) {
        if (!single && w->keys[i] != w->keys[i - 1]) continue;
        uint32_t first[2], second[2];
        find_side_ends(w, w->order[i - 1], first);
        find_side_ends(w, w->order[i], second);
        for (int k = 0; k < 2; ++k) fct_sets_join(w->parents, first[k], second[k]);
    }
    return FCT_OK;
}

static fct_result join_crowds(weld *w) {
    fct_result result = FCT_OK;
    for (size_t first = 0, count; first < w->crowd_count && result == FCT_OK; first += count + 1) {
        for (count = 0; w->crowd[first + count] != FCT_NONE;) ++count;
        result = join_crowd(w, w->crowd + first, count);
    }
    return result;
}

/* Joins the vertices of one face that share a place, and the bodies that faces connect. */
static void join_faces(weld *w) {
    const fct_mesh *mesh = w->s->mesh;
    for (uint32_t c = 0; c < 3 * mesh->face_count; ++c) {
        uint32_t a = mesh->triangles[c], b = mesh->triangles[corner_next(c)];
        fct_sets_join(w->bodies, a, b);
        if (w->s->point_of[a] == w->s->point_of[b]) fct_sets_join(w->parents, a, b);
    }
}

/* *needed: whether a place has several vertices. If not, places are points already. */
static fct_result prepare_weld(weld *w, uint32_t place_count, bool *needed) {
    uint32_t count = w->s->mesh->vertex_count;
    *needed = false;
    w->vertices = fct_allocate_zero(w->s->env, place_count, sizeof *w->vertices);
    if (!w->vertices) return fct_fail_memory(w->s->env, "places");
    for (uint32_t v = 0; v < count; ++v)
        if (w->s->point_of[v] != FCT_NONE) *needed |= ++w->vertices[w->s->point_of[v]] > 1;
    if (!*needed) return FCT_OK;
    w->parents = fct_allocate(w->s->env, count, sizeof *w->parents);
    w->bodies = fct_allocate(w->s->env, count, sizeof *w->bodies);
    if (!w->parents || !w->bodies) return fct_fail_memory(w->s->env, "places");
    for (uint32_t v = 0; v < count; ++v) w->parents[v] = w->bodies[v] = v;
    return FCT_OK;
}

fct_result fct_simplify_weld(fct_simplifier *s) {
    weld w = {.s = s};
    bool needed;
    fct_result result = prepare_weld(&w, s->point_count, &needed);
    if (result != FCT_OK || !needed) goto done;
    join_faces(&w);
    result = list_sides(&w);
    if (result == FCT_OK) result = join_runs(&w);
    if (result == FCT_OK) result = join_crowds(&w);
    if (result != FCT_OK) goto done;
    s->point_count = 0;
    for (uint32_t v = 0; v < s->mesh->vertex_count; ++v) {
        if (s->point_of[v] == FCT_NONE) continue;
        uint32_t root = fct_sets_find(w.parents, v);
        s->point_of[v] = root == v ? s->point_count++ : s->point_of[root];
    }
done:
    fct_release(s->env, w.vertices);
    fct_release(s->env, w.parents);
    fct_release(s->env, w.bodies);
    fct_release(s->env, w.keys);
    fct_release(s->env, w.order);
    fct_release(s->env, w.open);
    fct_release(s->env, w.crowd);
    return result;
}
