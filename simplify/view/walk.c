/* simplify/view/walk.c: see walk.h. Cost of a step: linear in its ring and its faces. */
#include "simplify/view/walk.h"

#include <string.h>

static void add_corner(fct_walk *w, uint32_t c) {
    uint32_t h = w->triangles[c], first = w->first[h];
    w->next[c] = first, w->previous[c] = FCT_NONE;
    if (first != FCT_NONE) w->previous[first] = c;
    w->first[h] = c;
}

static void remove_corner(fct_walk *w, uint32_t c) {
    uint32_t next = w->next[c], previous = w->previous[c];
    if (next != FCT_NONE) w->previous[next] = previous;
    if (previous != FCT_NONE)
        w->next[previous] = next;
    else
        w->first[w->triangles[c]] = next;
}

/* Calls `change` for the corners that change their handle in a step. */
static void change_moved(fct_walk *w, uint32_t step, void (*change)(fct_walk *w, uint32_t c)) {
    const fct_progressive *m = w->m;
    uint32_t end = m->first_corners[m->step_nodes[step + 1]];
    for (uint32_t i = m->first_corners[m->step_nodes[step]]; i < end; ++i) change(w, m->corners[i]);
}

static void change_added(fct_walk *w, uint32_t step, void (*change)(fct_walk *w, uint32_t c)) {
    for (size_t c = 3 * (size_t)w->m->step_faces[step]; c < 3 * (size_t)w->m->step_faces[step + 1]; ++c)
        change(w, (uint32_t)c);
}

void fct_walk_forward(fct_walk *w) {
    uint32_t step = w->step++;
    change_moved(w, step, remove_corner);
    fct_progressive_split(w->m, step, w->triangles, w->nodes);
    change_moved(w, step, add_corner);
    change_added(w, step, add_corner);
}

void fct_walk_backward(fct_walk *w) {
    uint32_t step = --w->step;
    change_added(w, step, remove_corner);
    change_moved(w, step, remove_corner);
    fct_progressive_contract(w->m, step, w->triangles, w->nodes);
    change_moved(w, step, add_corner);
}

static fct_result add_to_ring(fct_walk *w, uint32_t c) {
    if (w->marks[c / 3] == w->ring_number) return FCT_OK;
    w->marks[c / 3] = w->ring_number;
    fct_result result =
        fct_grow(w->m->env, (void **)&w->ring, &w->ring_room, (size_t)w->ring_count + 1, sizeof *w->ring);
    if (result == FCT_OK) w->ring[w->ring_count++] = c;
    return result;
}

static bool is_same_node(const fct_progressive *m, size_t a, size_t b) {
    size_t n = m->value_count;
    return !memcmp(m->positions + 3 * a, m->positions + 3 * b, 3 * sizeof *m->positions) &&
           (n == 0 || !memcmp(m->values + n * a, m->values + n * b, n * sizeof *m->values));
}

static bool is_hub(const fct_walk *w, uint32_t handle) {
    uint32_t count = 0;
    for (uint32_t c = w->first[handle]; c != FCT_NONE && count <= WALK_HUB; c = w->next[c]) ++count;
    return count > WALK_HUB;
}

/* The faces at a hub beside those that the step adds. */
static fct_result add_hub_faces(fct_walk *w, uint32_t hub) {
    const fct_progressive *m = w->m;
    fct_result result = FCT_OK;
    for (size_t c = 3 * (size_t)m->step_faces[w->step]; c < 3 * (size_t)m->step_faces[w->step + 1]; ++c) {
        if (w->triangles[c] == hub) continue;
        for (uint32_t x = w->first[w->triangles[c]]; x != FCT_NONE && result == FCT_OK; x = w->next[x])
            for (uint32_t k = x - x % 3; k < x - x % 3 + 3 && result == FCT_OK; ++k)
                if (w->triangles[k] == hub) result = add_to_ring(w, k);
    }
    return result;
}

/* All corners of a handle change if another node of the step takes it over, else those that move. */
fct_result fct_walk_find_ring(fct_walk *w) {
    const fct_progressive *m = w->m;
    fct_result result = FCT_OK;
    w->ring_count = 0;
    ++w->ring_number;
    for (uint32_t n = m->step_nodes[w->step]; n < m->step_nodes[w->step + 1] && result == FCT_OK; ++n) {
        uint32_t parent = m->parents[n], handle = m->handles[n];
        for (uint32_t i = m->first_corners[n]; i < m->first_corners[n + 1] && result == FCT_OK; ++i)
            result = add_to_ring(w, m->corners[i]);
        if (result != FCT_OK || parent == FCT_NONE || m->handles[parent] != handle) continue;
        if (is_same_node(m, parent, n) && is_hub(w, handle)) {
            result = add_hub_faces(w, handle);
            continue;
        }
        for (uint32_t c = w->first[handle]; c != FCT_NONE && result == FCT_OK; c = w->next[c])
            result = add_to_ring(w, c);
    }
    return result;
}

/* Copies the level of m, and goes to the base mesh. */
static void copy_base(fct_walk *w) {
    const fct_progressive *m = w->m;
    memcpy(w->triangles, m->triangles, 3 * (size_t)m->face_count * sizeof *w->triangles);
    memcpy(w->nodes, m->nodes, m->handle_count * sizeof *w->nodes);
    for (uint32_t step = m->level; step-- > 1;) fct_progressive_contract(m, step, w->triangles, w->nodes);
    memset(w->first, 0xff, m->handle_count * sizeof *w->first);
    memset(w->marks, 0, m->face_count * sizeof *w->marks);
    w->step = 1;
    change_added(w, 0, add_corner);
}

fct_result fct_walk_begin(const fct_progressive *m, fct_walk *out) {
    fct_walk w = {.m = m};
    size_t corners = 3 * (size_t)m->face_count;
    const fct_array arrays[] = {FCT_ARRAY(w.triangles, corners),     FCT_ARRAY(w.nodes, m->handle_count),
                                FCT_ARRAY(w.next, corners),          FCT_ARRAY(w.previous, corners),
                                FCT_ARRAY(w.first, m->handle_count), FCT_ARRAY(w.marks, m->face_count)};
    *out = (fct_walk){0};
    fct_result result = fct_allocate_all(m->env, arrays, FCT_LENGTH(arrays), "a vertex hierarchy");
    if (result != FCT_OK) return result;
    copy_base(&w);
    *out = w;
    return FCT_OK;
}

void fct_walk_end(fct_walk *w) {
    if (!w->m) return;
    void *arrays[] = {w->next, w->previous, w->first, w->marks, w->ring};
    for (size_t i = 0; i < FCT_LENGTH(arrays); ++i) fct_release(w->m->env, arrays[i]);
}
