/* tests/simplify/views.h: random views, and an oracle of what a cut may have: the states of all faces at all
 * levels, compared one by one. */
#ifndef FCT_TESTS_SIMPLIFY_VIEWS_H
#define FCT_TESTS_SIMPLIFY_VIEWS_H

#include "levels.h"
#include "oracle.h"
#include "simplify/view/cut.h"

/* A view of a mesh with the given middle and size (with its origin), from near or far. */
static inline fct_view random_view(uint64_t *state, v3 middle, double size) {
    fct_view view = fct_view_default();
    v3 from = v3_unit(random_vector(state)), to = random_vector(state), up = random_vector(state);
    from = v3_mad(middle, size * between(state, .3, 3), from), to = v3_mad(middle, .5 * size, to);
    view.position[0] = from.x, view.position[1] = from.y, view.position[2] = from.z;
    view.target[0] = to.x, view.target[1] = to.y, view.target[2] = to.z;
    view.up[0] = up.x, view.up[1] = up.y, view.up[2] = up.z;
    view.width = (uint32_t)between(state, 100, 2000), view.height = (uint32_t)between(state, 100, 2000);
    view.vertical_fov = between(state, 10, 100);
    view.tolerance = pow(10, between(state, -1, 2));
    view.silhouette_tolerance = view.tolerance * uniform(state);
    view.back_factor = between(state, 1, 30), view.outside_factor = between(state, 1, 30);
    return view;
}

static inline fct_mesh view_mesh(fct_progressive *m, const fct_view *view, fct_view_stats *stats) {
    fct_mesh mesh;
    assert_int_equal(fct_progressive_view(m, view, &mesh, stats), FCT_OK);
    return mesh;
}

static inline bool is_done(const fct_hierarchy *h, uint32_t step) {
    return h->done[step / 64] >> step % 64 & 1;
}

/* Per step s and face f, states[3 (s face_count + f)]: its nodes after the step; FCT_NONE: it is not there.
 */
static inline uint32_t *list_states(fct_progressive *m) {
    size_t row = 3 * (size_t)m->face_count;
    uint32_t *states = malloc((m->step_count * row + 1) * sizeof *states);
    memset(states, 0xff, m->step_count * row * sizeof *states);
    fct_progressive_go(m, 0);
    for (uint32_t s = 0; s < m->step_count; ++s) {
        while (m->level < s + 1) fct_progressive_forward(m);
        for (size_t c = 0; c < 3 * (size_t)m->step_faces[s + 1]; ++c)
            states[s * row + c] = m->nodes[m->triangles[c]];
    }
    return states;
}

static inline bool changes_face(const fct_progressive *m, const uint32_t *states, uint32_t step, uint32_t f) {
    size_t row = 3 * (size_t)m->face_count;
    const uint32_t *after = states + step * row + 3 * (size_t)f;
    return step == 0 || memcmp(after, after - row, 3 * sizeof *after) != 0;
}

static inline uint32_t step_of_node(const fct_progressive *m, uint32_t node) {
    uint32_t step = 0;
    while (m->step_nodes[step + 1] <= node) ++step;
    return step;
}

/* Whether step t uses what step s < t made: nodes that it replaces, and nodes of its new faces. Strictly also
 * faces that it changes. */
static inline bool uses_step(const fct_progressive *m, const uint32_t *states, uint32_t t, uint32_t s,
                             bool strictly) {
    size_t row = 3 * (size_t)m->face_count;
    for (uint32_t n = m->step_nodes[t]; n < m->step_nodes[t + 1]; ++n)
        if (m->parents[n] != FCT_NONE && step_of_node(m, m->parents[n]) == s) return true;
    for (uint32_t f = m->step_faces[t]; f < m->step_faces[t + 1]; ++f)
        for (uint32_t k = 0; k < 3; ++k)
            if (step_of_node(m, states[t * row + 3 * f + k]) == s) return true;
    for (uint32_t f = 0; strictly && f < m->step_faces[t]; ++f)
        if (changes_face(m, states, t, f) && changes_face(m, states, s, f)) {
            bool last = true;
            for (uint32_t between = s + 1; between < t; ++between)
                last &= !changes_face(m, states, between, f);
            if (last) return true;
        }
    return false;
}

#endif
