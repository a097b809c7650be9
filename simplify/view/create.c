/* simplify/view/create.c: see create.h. One walk to the finest level lists what each step needs; the
 * way back measures bounds (deviation.h).
 */
#include "simplify/view/create.h"

#include <string.h>

#include "simplify/view/deviation.h"

enum { PROGRESS_STEPS = 8192 }; /* between two reports of progress */

typedef struct tracer {
    fct_hierarchy *h;
    fct_walk *w;
    uint32_t step;
    uint32_t *face_steps; /* per face: the last step that made or changed it */
    uint32_t *node_steps; /* per node */
    uint32_t *marks;      /* per step: the last step that needs it */
    size_t needs_count, needs_room;
} tracer;

static fct_result add_need(tracer *t, uint32_t needed) {
    if (needed == 0 || t->marks[needed] == t->step) return FCT_OK;
    t->marks[needed] = t->step;
    fct_result result = fct_grow(t->w->m->env, (void **)&t->h->needs, &t->needs_room, t->needs_count + 1,
                                 sizeof *t->h->needs);
    if (result != FCT_OK) return result;
    if (t->needs_count + 1 >= FCT_NONE) return fct_fail_memory(t->w->m->env, "a vertex hierarchy");
    t->h->needs[t->needs_count++] = needed;
    return FCT_OK;
}

/* The nodes that the step replaces, or whose attributes begin those of a new one. */
static fct_result trace_nodes(tracer *t) {
    const fct_progressive *m = t->w->m;
    uint32_t step = t->step, last = 0;
    for (uint32_t n = m->step_nodes[step]; n < m->step_nodes[step + 1]; ++n) {
        t->node_steps[n] = step;
        if (m->parents[n] == FCT_NONE) continue;
        uint32_t made = t->node_steps[m->parents[n]];
        if (made > last) last = made;
        fct_result result = add_need(t, made);
        if (result != FCT_OK) return result;
    }
    t->h->parents[step] = last;
    t->h->siblings[step] = t->h->first_children[last];
    t->h->first_children[last] = step;
    return FCT_OK;
}

/* The corners of the new faces, once the step is done. */
static fct_result trace_new_faces(tracer *t) {
    const fct_progressive *m = t->w->m;
    uint32_t step = t->step;
    for (uint32_t f = m->step_faces[step]; f < m->step_faces[step + 1]; ++f) {
        t->face_steps[f] = step;
        for (uint32_t c = 3 * f; c < 3 * f + 3; ++c) {
            uint32_t made = t->node_steps[t->w->nodes[t->w->triangles[c]]];
            fct_result result = made < step ? add_need(t, made) : FCT_OK;
            if (result != FCT_OK) return result;
        }
    }
    return FCT_OK;
}

/* The faces of the ring, which was found before the step. */
static fct_result trace_ring(tracer *t) {
    fct_result result = FCT_OK;
    for (uint32_t i = 0; i < t->w->ring_count && result == FCT_OK; ++i) {
        uint32_t f = t->w->ring[i] / 3;
        result = add_need(t, t->face_steps[f]);
        t->face_steps[f] = t->step;
    }
    return result;
}

static fct_result trace_step(tracer *t) {
    fct_result result = trace_nodes(t);
    if (result == FCT_OK) result = fct_walk_find_ring(t->w);
    if (result != FCT_OK) return result;
    fct_walk_forward(t->w);
    result = trace_new_faces(t);
    t->h->first_strict[t->step] = (uint32_t)t->needs_count;
    if (result == FCT_OK) result = trace_ring(t);
    t->h->first_needs[t->step + 1] = (uint32_t)t->needs_count;
    return result;
}

static fct_result report_step(const fct_progressive *m, uint32_t done) {
    if (done % PROGRESS_STEPS) return FCT_OK;
    return fct_progress(m->env, "hierarchy", (double)done / (2. * m->step_count));
}

static fct_result trace_steps(tracer *t) {
    const fct_progressive *m = t->w->m;
    fct_result result = FCT_OK;
    memset(t->h->first_children, 0xff, m->step_count * sizeof *t->h->first_children);
    t->h->parents[0] = t->h->siblings[0] = FCT_NONE;
    t->h->first_needs[0] = t->h->first_needs[1] = 0;
    for (t->step = 1; t->step < m->step_count && result == FCT_OK; ++t->step) {
        result = trace_step(t);
        if (result == FCT_OK) result = report_step(m, t->step);
    }
    return result;
}

static fct_result measure_steps(fct_walk *w, fct_hierarchy *h) {
    fct_deviation *d;
    fct_result result = fct_deviation_begin(w, h, &d);
    while (result == FCT_OK && w->step > 1) {
        result = fct_deviation_contract(d);
        if (result == FCT_OK) result = report_step(w->m, 2 * w->m->step_count - w->step);
    }
    fct_deviation_end(d);
    return result;
}

static fct_result trace_hierarchy(fct_walk *w, fct_hierarchy *h) {
    const fct_progressive *m = w->m;
    tracer t = {.h = h, .w = w};
    const fct_array arrays[] = {FCT_ARRAY_ZERO(t.face_steps, m->face_count),
                                FCT_ARRAY_ZERO(t.node_steps, m->node_count),
                                FCT_ARRAY_ZERO(t.marks, m->step_count)};
    fct_result result = fct_allocate_all(m->env, arrays, FCT_LENGTH(arrays), "a vertex hierarchy");
    if (result == FCT_OK) result = trace_steps(&t);
    fct_release_all(m->env, arrays, FCT_LENGTH(arrays));
    return result;
}

fct_result fct_hierarchy_create(const fct_progressive *m, fct_hierarchy **out) {
    *out = NULL;
    size_t steps = m->step_count, words = steps / 64 + 1;
    fct_hierarchy *h = fct_allocate_zero(m->env, 1, sizeof *h);
    if (!h) return fct_fail_memory(m->env, "a vertex hierarchy");
    const fct_array arrays[] = {FCT_ARRAY(h->first_needs, steps + 1), FCT_ARRAY(h->first_strict, steps + 1),
                                FCT_ARRAY(h->parents, steps),         FCT_ARRAY(h->first_children, steps),
                                FCT_ARRAY(h->siblings, steps),        FCT_ARRAY_ZERO(h->bounds, steps),
                                FCT_ARRAY(h->turns, m->face_count),   FCT_ARRAY_ZERO(h->done, words),
                                FCT_ARRAY_ZERO(h->wanted, words),     FCT_ARRAY(h->strict, words),
                                FCT_ARRAY(h->forced, words),          FCT_ARRAY(h->stack, steps),
                                FCT_ARRAY(h->tested, steps)};
    fct_walk w = {0};
    h->step_count = m->step_count;
    fct_result result = fct_allocate_all(m->env, arrays, FCT_LENGTH(arrays), "a vertex hierarchy");
    if (result == FCT_OK) result = fct_walk_begin(m, &w);
    h->triangles = w.triangles, h->nodes = w.nodes;
    if (result == FCT_OK) result = trace_hierarchy(&w, h);
    if (result == FCT_OK) result = measure_steps(&w, h);
    fct_walk_end(&w);
    if (result == FCT_OK) {
        h->done[0] = 1;
        *out = h;
    } else
        fct_hierarchy_destroy(m->env, h);
    return result;
}
