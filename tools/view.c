/* tools/view.c: see view.h. */
#include "tools/view.h"

#include <math.h>
#include <string.h>

#include "tools/kit/options.h"
#include "tools/render/camera.h"

view_options view_options_default(void) {
    return (view_options){.view = fct_view_default()};
}

static error_t parse_up(struct argp_state *state, const char *text, fct_view *view) {
    static const char *const ups[] = {"y", "z", NULL};
    int index;
    error_t error = tool_parse_choice(state, "--up", text, ups, &index);
    for (int k = 0; k < 3 && !error; ++k) view->up[k] = k == 1 + index;
    return error;
}

static error_t parse_camera(struct argp_state *state, view_options *o) {
    drawing_frame frame = {.fov = o->view.vertical_fov};
    if (!drawing_parse_camera(o->camera, &frame))
        return tool_usage(
            state, "--view: expected EX,EY,EZ,TX,TY,TZ[,FOV] with an eye away from its target, found '%s'",
            o->camera);
    memcpy(o->view.position, frame.position, sizeof o->view.position);
    memcpy(o->view.target, frame.target, sizeof o->view.target);
    o->view.vertical_fov = frame.fov;
    return 0;
}

static error_t check_options(struct argp_state *state, view_options *o) {
    if (!o->camera)
        return o->other ? tool_usage(state, "%s: expected --view with it, found none", o->other) : 0;
    if (!o->has_silhouette) o->view.silhouette_tolerance = .5 * o->view.tolerance;
    if (o->view.silhouette_tolerance > o->view.tolerance)
        return tool_usage(state, "--silhouette: expected at most the tolerance of %g, found %g",
                          o->view.tolerance, o->view.silhouette_tolerance);
    return parse_camera(state, o);
}

error_t view_parse(int key, const char *text, struct argp_state *state, view_options *o) {
    static const struct {
        int key;
        const char *name;
    } names[] = {{KEY_BACK, "--back"},
                 {KEY_COLOR_TOLERANCE, "--color-tolerance"},
                 {KEY_OUTSIDE, "--outside"},
                 {KEY_SILHOUETTE, "--silhouette"},
                 {KEY_SIZE, "--size"},
                 {KEY_TOLERANCE, "--tolerance"},
                 {KEY_UP, "--up"}};
    for (size_t i = 0; i < sizeof names / sizeof *names; ++i)
        if (key == names[i].key) o->other = names[i].name;
    switch (key) {
    case KEY_VIEW:
        o->camera = text;
        return 0;
    case KEY_SIZE:
        return drawing_parse_size(text, &o->view.width, &o->view.height)
                   ? 0
                   : tool_usage(state, "--size: expected WIDTHxHEIGHT, each 1 to %d, found '%s'",
                                RASTER_MAX_SIZE, text);
    case KEY_UP:
        return parse_up(state, text, &o->view);
    case KEY_TOLERANCE:
        return tool_parse_real(state, o->other, text, 0, INFINITY, &o->view.tolerance);
    case KEY_SILHOUETTE:
        o->has_silhouette = true;
        return tool_parse_real(state, o->other, text, 0, INFINITY, &o->view.silhouette_tolerance);
    case KEY_BACK:
        return tool_parse_real(state, o->other, text, 1, INFINITY, &o->view.back_factor);
    case KEY_OUTSIDE:
        return tool_parse_real(state, o->other, text, 1, INFINITY, &o->view.outside_factor);
    case KEY_COLOR_TOLERANCE:
        return tool_parse_real(state, o->other, text, 0, INFINITY, &o->view.color_tolerance);
    case ARGP_KEY_END:
        return check_options(state, o);
    default:
        return ARGP_ERR_UNKNOWN;
    }
}
