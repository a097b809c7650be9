/* tests/radiosity/soup.h: all triangles of a scene in world space, and visibility by brute force. */
#ifndef FCT_TESTS_RADIOSITY_SOUP_H
#define FCT_TESTS_RADIOSITY_SOUP_H

#include <math.h>
#include <stdlib.h>

#include "base/math/vec.h"
#include "facetree/scene.h"

/* The corners of all triangles in world space. */
typedef struct soup {
    v3 *corners;
    size_t count;
} soup;

static inline soup list_triangles(const fct_scene *scene) {
    fct_scene_view view = fct_scene_get(scene);
    soup s = {malloc(3 * (size_t)view.face_count * sizeof(v3)), 0};
    for (uint32_t i = 0; i < view.instance_count; ++i) {
        const float *m = view.instances[i].to_world;
        fct_tree_view t = fct_tree_get(view.models[view.instances[i].model].tree);
        for (size_t c = 0; c < 3 * (size_t)t.face_count; ++c) {
            const float *p = t.positions + 3 * (size_t)t.triangles[c];
            double w[3];
            for (int r = 0; r < 3; ++r)
                w[r] = (double)m[4 * r] * p[0] + (double)m[4 * r + 1] * p[1] + (double)m[4 * r + 2] * p[2] +
                       m[4 * r + 3];
            s.corners[s.count++] = v3_make(w[0], w[1], w[2]);
        }
    }
    s.count /= 3;
    return s;
}

/* Whether the line o + t d meets triangle i. *t: where. *back: it meets the back. */
static inline bool meets_triangle(const soup *s, size_t i, v3 o, v3 d, double *t, bool *back) {
    const v3 *c = s->corners + 3 * i;
    v3 e = v3_sub(c[1], c[0]), f = v3_sub(c[2], c[0]), n = v3_cross(e, f), p = v3_sub(o, c[0]);
    double det = -v3_dot(n, d);
    if (det == 0) return false;
    v3 q = v3_cross(p, d);
    double u = v3_dot(f, q) / det, v = -v3_dot(e, q) / det;
    *t = v3_dot(n, p) / det, *back = det < 0;
    return u >= 0 && v >= 0 && u + v <= 1;
}

/* The nearest triangle along o + t d, t > 0; FCT_NONE: none. *t: where, or infinity. *back: its back is met.
 */
static inline uint32_t find_nearest(const soup *s, v3 o, v3 d, double *t, bool *back) {
    uint32_t best = FCT_NONE;
    *t = INFINITY, *back = false;
    for (uint32_t i = 0; i < s->count; ++i) {
        double at;
        bool behind;
        if (meets_triangle(s, i, o, d, &at, &behind) && at > 0 && at < *t) *t = at, *back = behind, best = i;
    }
    return best;
}

/* True if no triangle lies between a and b. */
static inline bool is_free(const soup *s, v3 a, v3 b) {
    for (size_t i = 0; i < s->count; ++i) {
        double t;
        bool back;
        if (meets_triangle(s, i, a, v3_sub(b, a), &t, &back) && t > 0 && t < 1) return false;
    }
    return true;
}

#endif
