/* simplify/view/view.c: view-dependent meshes: checks a view, moves the cut, and writes its mesh. */
#include <inttypes.h>
#include <math.h>

#include "simplify/view/create.h"
#include "simplify/view/cut.h"

static const double degree = 3.14159265358979323846 / 180;

fct_view fct_view_default(void) {
    return (fct_view){.size = sizeof(fct_view),
                      .width = 1280,
                      .height = 800,
                      .position = {0, 0, 1},
                      .up = {0, 1, 0},
                      .vertical_fov = 35,
                      .tolerance = 1,
                      .silhouette_tolerance = .5,
                      .back_factor = 8,
                      .outside_factor = 8,
                      .color_tolerance = .03};
}

static const char *find_fault(const fct_view *view) {
    double sum = 0;
    for (int k = 0; k < 3; ++k) sum += fabs(view->position[k]) + fabs(view->target[k]) + fabs(view->up[k]);
    if (!isfinite(sum)) return "position, target and up must be finite";
    if (view->width < 1 || view->height < 1) return "width and height must be at least 1";
    if (!(view->vertical_fov >= 1 && view->vertical_fov <= 170)) return "vertical_fov must be from 1 to 170";
    if (!(view->silhouette_tolerance >= 0 && view->silhouette_tolerance <= view->tolerance))
        return "silhouette_tolerance must be from 0 to tolerance";
    if (!(view->back_factor >= 1 && view->outside_factor >= 1))
        return "back_factor and outside_factor must be at least 1";
    if (!(view->color_tolerance >= 0)) return "color_tolerance must be at least 0";
    return NULL;
}

/* Directions: if the eye looks along `up`, or has none, any other direction can be the top of the picture. */
static bool aim_view(const fct_view *view, v3 *right, v3 *up, v3 *forward) {
    const double *p = view->position, *t = view->target, *u = view->up;
    *forward = v3_unit(v3_make(t[0] - p[0], t[1] - p[1], t[2] - p[2]));
    v3 unit = v3_unit(v3_make(u[0], u[1], u[2])), cross = v3_cross(*forward, unit);
    if (v3_norm2(cross) < 1e-12)
        v3_frame(*forward, right, up);
    else
        *right = v3_unit(cross);
    *up = v3_cross(*right, *forward);
    return v3_norm2(*forward) > 0;
}

fct_result fct_cut_read_view(const fct_env *env, const fct_view *view, const double origin[3],
                             fct_cut_view *out) {
    if (view->size != sizeof *view)
        return fct_fail(env, FCT_ERROR_DATA,
                        "fct_view has size %" PRIu32 ", expected %zu: fill it with fct_view_default",
                        view->size, sizeof *view);
    const char *fault = find_fault(view);
    if (fault) return fct_fail(env, FCT_ERROR_DATA, "a view: %s", fault);
    *out = (fct_cut_view){.tolerance = view->tolerance,
                          .silhouette_tolerance = view->silhouette_tolerance,
                          .back_factor = view->back_factor,
                          .outside_factor = view->outside_factor,
                          .color_tolerance = view->color_tolerance};
    if (!aim_view(view, &out->right, &out->up, &out->forward))
        return fct_fail(env, FCT_ERROR_DATA, "a view: position and target are the same");
    const double *p = view->position;
    out->eye = v3_make(p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]);
    double slope = tan(.5 * view->vertical_fov * degree);
    out->slopes[0] = slope * view->width / view->height, out->slopes[1] = slope;
    out->secant = sqrt(1 + out->slopes[0] * out->slopes[0] + slope * slope);
    out->focal = .5 * view->height / slope;
    return FCT_OK;
}

static fct_result write_cut(fct_progressive *m, fct_mesh *out) {
    const fct_hierarchy *h = m->hierarchy;
    uint32_t count = 0, words = h->step_count / 64 + 1, *faces;
    const fct_array arrays[] = {FCT_ARRAY(faces, m->face_count)};
    fct_result result = fct_allocate_all(m->env, arrays, FCT_LENGTH(arrays), "a view");
    if (result != FCT_OK) return result;
    for (uint32_t i = 0; i < words; ++i)
        for (uint64_t left = h->done[i]; left; left &= left - 1) {
            uint32_t step = 64 * i + (uint32_t)__builtin_ctzll(left);
            for (uint32_t f = m->step_faces[step]; f < m->step_faces[step + 1]; ++f) faces[count++] = f;
        }
    const fct_progressive_faces from = {h->triangles, h->nodes, faces, count};
    result = fct_progressive_write_faces(m, &from, out);
    fct_release_all(m->env, arrays, FCT_LENGTH(arrays));
    return result;
}

fct_result fct_progressive_view(fct_progressive *m, const fct_view *view, fct_mesh *out,
                                fct_view_stats *stats) {
    fct_cut_view frame;
    fct_view_stats own;
    double start = fct_seconds();
    if (!stats) stats = &own;
    *stats = (fct_view_stats){0};
    *out = (fct_mesh){0};
    fct_result result = fct_cut_read_view(m->env, view, m->origin, &frame);
    if (result == FCT_OK && !m->hierarchy) result = fct_hierarchy_create(m, &m->hierarchy);
    if (result != FCT_OK) return result;
    double built = fct_seconds();
    fct_cut_move(m, m->hierarchy, &frame, stats);
    double moved = fct_seconds();
    result = write_cut(m, out);
    stats->faces = out->face_count;
    stats->seconds_hierarchy = built - start;
    stats->seconds_cut = moved - built;
    stats->seconds_mesh = fct_seconds() - moved;
    return result;
}
