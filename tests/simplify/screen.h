/* tests/simplify/screen.h: the picture that a view shows, and how far a cut is from the finest level there.
 */
#ifndef FCT_TESTS_SIMPLIFY_SCREEN_H
#define FCT_TESTS_SIMPLIFY_SCREEN_H

#include "facetree/bvh.h"
#include "views.h"

/* Pixels from the middle of the picture, by the definition of the camera; false behind the eye. */
static inline bool project(const fct_view *view, v3 x, double out[2]) {
    v3 eye = {view->position[0], view->position[1], view->position[2]},
       to = v3_sub(v3_make(view->target[0], view->target[1], view->target[2]), eye),
       up = {view->up[0], view->up[1], view->up[2]}, forward = v3_scale(to, 1 / v3_norm(to)),
       right = v3_cross(forward, up), d = v3_sub(x, eye);
    right = v3_scale(right, 1 / v3_norm(right));
    double z = v3_dot(d, forward), half = tan(view->vertical_fov * 3.14159265358979 / 360);
    out[0] = .5 * view->height / half * v3_dot(d, right) / z;
    out[1] = .5 * view->height / half * v3_dot(d, v3_cross(right, forward)) / z;
    return z > 0;
}

static inline bool in_picture(const fct_view *view, v3 x) {
    double p[2];
    return project(view, x, p) && fabs(p[0]) <= .5 * view->width && fabs(p[1]) <= .5 * view->height;
}

/* A surface for nearest points. */
typedef struct surface {
    fct_tree *tree;
    fct_bvh *bvh;
} surface;

static inline surface make_surface(const fct_env *env, const fct_mesh *mesh) {
    surface s;
    fct_tree_def def = fct_tree_def_default();
    assert_int_equal(fct_tree_build(env, mesh, &def, NULL, &s.tree), FCT_OK);
    assert_int_equal(fct_bvh_create(env, s.tree, FCT_BACKEND_OBB, &s.bvh), FCT_OK);
    return s;
}

/* Whether the faces around each vertex show the eye their front (1), back (2) or both (3). */
static inline unsigned char *list_sides(const fct_mesh *mesh, v3 eye) {
    unsigned char *sides = calloc(mesh->vertex_count, 1);
    for (uint32_t f = 0; f < mesh->face_count; ++f)
        for (int k = 0; k < 3; ++k) {
            uint32_t v = mesh->triangles[3 * (size_t)f + k];
            sides[v] |= v3_dot(face_cross(mesh, f), v3_sub(vertex(mesh, v), eye)) < 0 ? 1 : 2;
        }
    return sides;
}

/* The largest distances between vertices of the finest level and their nearest places of a cut, for vertices
 * in the picture whose faces show the eye their front, or front and back. */
typedef struct screen {
    double front, silhouette; /* pixels over the tolerance that holds there */
    double distance;          /* in space, anywhere */
} screen;

static inline screen measure_screen(const fct_env *env, const fct_mesh *finest, const fct_mesh *cut,
                                    const fct_view *view) {
    v3 eye = {view->position[0], view->position[1], view->position[2]};
    unsigned char *sides = list_sides(finest, eye);
    surface s = make_surface(env, cut);
    screen most = {0, 0, 0};
    for (uint32_t v = 0; v < finest->vertex_count; ++v) {
        fct_closest near;
        double p[2], q[2];
        v3 x = vertex(finest, v);
        assert_true(fct_bvh_closest_point(s.bvh, finest->positions + 3 * (size_t)v, INFINITY, &near, NULL));
        most.distance = fmax(most.distance, (double)near.distance);
        if (!in_picture(view, x) || sides[v] == 2) continue;
        assert_true(project(view, x, p) && project(view, v3_load(near.point), q));
        double pixels = hypot(p[0] - q[0], p[1] - q[1]);
        if (sides[v] == 1)
            most.front = fmax(most.front, pixels / view->tolerance);
        else
            most.silhouette = fmax(most.silhouette, pixels / view->silhouette_tolerance);
    }
    fct_bvh_destroy(s.bvh);
    fct_tree_destroy(s.tree);
    free(sides);
    return most;
}

#endif
