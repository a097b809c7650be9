/* tools/render/render.c: facetree render: a picture of a mesh, a scene, a bake, clusters or boxes. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tools/commands.h"
#include "tools/kit/command.h"
#include "tools/kit/options.h"
#include "tools/render/camera.h"
#include "tools/render/errors.h"
#include "tools/render/legend.h"
#include "tools/render/shade.h"

enum {
    KEY_BACKGROUND = TOOL_KEY,
    KEY_BOXES,
    KEY_CAMERA,
    KEY_CLUSTERS,
    KEY_CREASE,
    KEY_CULL,
    KEY_EXPOSURE,
    KEY_FOV,
    KEY_RANGE,
    KEY_SAMPLES,
    KEY_SCENE,
    KEY_SHADING,
    KEY_SHOW,
    KEY_SIZE,
    KEY_TONE,
    KEY_UP,
    KEY_VIEW,
    KEY_WIREFRAME
};

typedef enum cull { CULL_AUTO, CULL_BACK, CULL_NONE } cull;

typedef struct render_options {
    drawing_subject subject;
    uint32_t count, width, height, samples;
    double exposure, crease;
    drawing_frame frame;
    const char *scene, *camera;
    int shading, tone, cull;
    int show;     /* 1: the error of the light */
    double range; /* percent; 0: chosen */
    bool wireframe, has_background;
    picture_background background;
} render_options;

static const struct argp_option render_options_table[] = {
    {NULL, 0, NULL, 0, "Subject:", 1},
    {"clusters", KEY_CLUSTERS, "K", 0, "Draw the surface with a colour per cluster, in K clusters", 1},
    {"boxes", KEY_BOXES, "K", 0, "Draw the oriented boxes of K clusters", 1},
    {"show", KEY_SHOW, "WHAT", 0,
     "light (default), or error: the expected error of a bake with --light radiosity,error as false colours, "
     "in "
     "percent of the median light, with a legend. Half of the lit area is brighter than the median",
     1},
    {"range", KEY_RANGE, "PERCENT", 0,
     "With --show error: the end of the legend, .001 to 1000; larger errors have its colour (default: a "
     "round "
     "number that 2 % of the area exceeds)",
     1},
    {"wireframe", KEY_WIREFRAME, NULL, 0, "Also draw the sides of the triangles", 1},
    {NULL, 0, NULL, 0, "Camera:", 2},
    {"camera", KEY_CAMERA, "EX,EY,EZ,TX,TY,TZ[,FOV]", 0,
     "Position of the eye, target, and vertical field of view in degrees (default: the scene's camera, else "
     "--view "
     "corner)",
     2},
    {"scene", KEY_SCENE, "FILE", 0, "Use the camera of this scene", 2},
    {"view", KEY_VIEW, "NAME", 0,
     "Show everything, seen from corner, front, back, left, right, top or bottom", 2},
    {"up", KEY_UP, "AXIS", 0, "The axis that points up: y or z (default: that of the scene's camera, else y)",
     2},
    {"fov", KEY_FOV, "DEGREES", 0, "Vertical field of view, 1 to 170 degrees (default 35)", 2},
    {"cull", KEY_CULL, "WHICH", 0,
     "Leave out faces that are seen from behind: auto (default), back or none. auto does so for boxes, and "
     "for lit "
     "surfaces if the eye is outside, so that one sees into a room",
     2},
    {NULL, 0, NULL, 0, "Appearance:", 3},
    {"size", KEY_SIZE, "WxH", 0, "Width and height in pixels, each 1 to 16384 (default 1280x800)", 3},
    {"samples", KEY_SAMPLES, "N", 0, "Samples per pixel, 1 to 64 (default 16)", 3},
    {"exposure", KEY_EXPOSURE, "E", 0, "Factor on the light (default 1)", 3},
    {"tone", KEY_TONE, "CURVE", 0, "Curve for bright light: soft (default), filmic or clamp", 3},
    {"shading", KEY_SHADING, "HOW", 0,
     "auto (default), light, smooth or flat. light shows vertex colours as light; smooth and flat light the "
     "surface as "
     "in a studio. auto is light if the vertices have colours, else smooth",
     3},
    {"crease", KEY_CREASE, "DEGREES", 0,
     "With smooth shading: edges whose faces differ by more stay sharp, 0 to 180 (default 40)", 3},
    {"background", KEY_BACKGROUND, "COLOUR", 0,
     "#rrggbb, or none for a transparent background (default: grey behind surfaces, near black behind light)",
     3},
    {0}};

static error_t parse_subject(struct argp_state *state, const char *name, const char *text,
                             drawing_subject subject, render_options *o) {
    if (o->subject != DRAWING_SURFACE)
        return tool_usage(state, "%s: expected only one of --clusters and --boxes, once", name);
    o->subject = subject;
    return tool_parse_count32(state, name, text, 1, INT32_MAX, &o->count);
}

static error_t parse_camera_option(struct argp_state *state, int key, const char *text, render_options *o) {
    static const char *const ups[] = {"y", "z", NULL};
    int index;
    error_t error;
    switch (key) {
    case KEY_CAMERA:
        o->camera = text;
        return 0;
    case KEY_SCENE:
        o->scene = text;
        return 0;
    case KEY_VIEW:
        return tool_parse_choice(state, "--view", text, drawing_views, &o->frame.view);
    case KEY_UP:
        error = tool_parse_choice(state, "--up", text, ups, &index);
        if (!error) o->frame.up = 1 + index;
        return error;
    default:
        return tool_parse_real(state, "--fov", text, 1, 170, &o->frame.fov);
    }
}

static error_t parse_look_option(struct argp_state *state, int key, const char *text, render_options *o) {
    static const char *const tones[] = {"soft", "filmic", "clamp", NULL};
    static const char *const shadings[] = {"auto", "light", "smooth", "flat", NULL};
    static const char *const culls[] = {"auto", "back", "none", NULL};
    static const char *const shows[] = {"light", "error", NULL};
    switch (key) {
    case KEY_SAMPLES:
        return tool_parse_count32(state, "--samples", text, 1, RASTER_MAX_SAMPLES, &o->samples);
    case KEY_EXPOSURE:
        return tool_parse_real(state, "--exposure", text, 0, 1e30, &o->exposure);
    case KEY_TONE:
        return tool_parse_choice(state, "--tone", text, tones, &o->tone);
    case KEY_SHOW:
        return tool_parse_choice(state, "--show", text, shows, &o->show);
    case KEY_RANGE:
        return tool_parse_real(state, "--range", text, .001, 1000, &o->range);
    case KEY_SHADING:
        return tool_parse_choice(state, "--shading", text, shadings, &o->shading);
    case KEY_CULL:
        return tool_parse_choice(state, "--cull", text, culls, &o->cull);
    case KEY_CREASE:
        return tool_parse_real(state, "--crease", text, 0, 180, &o->crease);
    default:
        o->has_background = picture_parse_background(text, &o->background);
        return o->has_background
                   ? 0
                   : tool_usage(state, "--background: expected #rrggbb or none, found '%s'", text);
    }
}

static error_t parse_render(int key, char *text, struct argp_state *state) {
    render_options *o = state->input;
    switch (key) {
    case KEY_CLUSTERS:
        return parse_subject(state, "--clusters", text, DRAWING_CLUSTERS, o);
    case KEY_BOXES:
        return parse_subject(state, "--boxes", text, DRAWING_BOXES, o);
    case KEY_WIREFRAME:
        o->wireframe = true;
        return 0;
    case KEY_SIZE:
        return drawing_parse_size(text, &o->width, &o->height)
                   ? 0
                   : tool_usage(state, "--size: expected WIDTHxHEIGHT, each 1 to %d, found '%s'",
                                RASTER_MAX_SIZE, text);
    case KEY_CAMERA:
    case KEY_SCENE:
    case KEY_VIEW:
    case KEY_UP:
    case KEY_FOV:
        return parse_camera_option(state, key, text, o);
    case KEY_BACKGROUND:
    case KEY_CREASE:
    case KEY_CULL:
    case KEY_EXPOSURE:
    case KEY_RANGE:
    case KEY_SAMPLES:
    case KEY_SHADING:
    case KEY_SHOW:
    case KEY_TONE:
        return parse_look_option(state, key, text, o);
    case ARGP_KEY_END:
        if (o->camera && !drawing_parse_camera(o->camera, &o->frame))
            return tool_usage(
                state,
                "--camera: expected EX,EY,EZ,TX,TY,TZ[,FOV] with an eye away from its target, found '%s'",
                o->camera);
        if ((o->camera != NULL) + (o->scene != NULL) + (o->frame.view >= 0) > 1)
            return tool_usage(state, "expected only one of --camera, --scene and --view");
        if (o->show && (o->subject != DRAWING_SURFACE || o->shading != DRAWING_AUTO))
            return tool_usage(state, "--show error: expected none of --clusters, --boxes and --shading");
        if (o->range > 0 && !o->show) return tool_usage(state, "--range: expected --show error");
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* Reads the camera of --scene. */
static int read_camera(tool *t, const char *path, drawing_frame *frame) {
    fct_scene *scene;
    int code = tool_result(t, fct_scene_load(&t->env, path, FCT_BACKEND_OBB, &scene));
    if (code != TOOL_DONE) return code;
    fct_scene_view view = fct_scene_get(scene);
    if (view.camera.given) {
        drawing_from_scene(&view.camera, frame);
        for (int k = 0; k < 3; ++k) frame->position[k] += view.origin[k], frame->target[k] += view.origin[k];
    } else {
        code = tool_fail(t, TOOL_DATA, "%s: expected a scene with a camera, found none", path);
    }
    fct_scene_destroy(scene);
    return code;
}

static int choose_frame(tool *t, const render_options *o, const drawing *d, drawing_frame *frame) {
    *frame = o->frame;
    int up = frame->up ? frame->up : 1;
    if (!frame->up && d->camera.given && fabsf(d->camera.up[2]) > fabsf(d->camera.up[1])) up = 2;
    frame->up = up;
    frame->up_vector[0] = 0, frame->up_vector[1] = up == 1, frame->up_vector[2] = up == 2;
    int code = o->scene ? read_camera(t, o->scene, frame) : TOOL_DONE;
    for (int k = 0; frame->given && k < 3; ++k) { /* relative to the drawing */
        frame->position[k] -= d->mesh.origin[k];
        frame->target[k] -= d->mesh.origin[k];
    }
    if (!o->scene && d->camera.given && !o->camera && frame->view < 0) drawing_from_scene(&d->camera, frame);
    return code;
}

/* Light grey behind surfaces, near black behind light. */
static picture_background choose_background(const drawing *d) {
    picture_background light = {{.42F, .46F, .51F}, {.76F, .77F, .78F}, false};
    picture_background dark = {{.008F, .009F, .011F}, {.022F, .023F, .026F}, false};
    return d->shading == DRAWING_LIGHT ? dark : light;
}

static int report_render(tool *t, const render_options *o, const drawing *d, const double seconds[4]) {
    tool_say(t, "%s: %u x %u pixels of %u triangles in %.2f s", t->output, o->width, o->height,
             d->mesh.face_count, seconds[3]);
    json_t *object = json_pack("{s:i, s:i, s:I, s:{s:f, s:f, s:f, s:f}, s:I}", "width", (int)o->width,
                               "height", (int)o->height, "faces", (json_int_t)d->mesh.face_count, "seconds",
                               "read", seconds[0], "draw", seconds[1], "write", seconds[2], "total",
                               seconds[3], "peak_bytes", (json_int_t)tool_peak_bytes());
    if (object && o->show) json_object_set_new(object, "range", json_real(o->range));
    return tool_json(t, object);
}

static int draw_image(tool *t, const render_options *o, drawing *d, float *image) {
    raster_camera camera = {.width = o->width, .height = o->height, .samples = o->samples};
    drawing_frame frame;
    int code = choose_frame(t, o, d, &frame);
    if (code != TOOL_DONE) return code;
    bool outside;
    drawing_aim(d, &frame, &camera, &outside);
    code = drawing_prepare(t, d, cos(o->crease * 3.14159265358979323846 / 180), o->wireframe);
    if (code != TOOL_DONE) return code;
    bool lit = d->shading == DRAWING_LIGHT || d->glow;
    bool solid = o->subject == DRAWING_BOXES;
    camera.cull = o->cull == CULL_BACK || (o->cull == CULL_AUTO && (solid || (lit && outside)));
    return raster_draw(t, &camera, &d->mesh, drawing_shade, d, image);
}

static int run_render(tool *t, void *input) {
    render_options *o = input;
    drawing d = {.shading = (drawing_shading)o->shading,
                 .tone = (picture_tone)o->tone,
                 .exposure = (float)o->exposure,
                 .line_width = o->wireframe ? .25F : .6F};
    drawing_source source = {t->inputs[0], o->subject, o->count, fct_tree_def_default()};
    double start = tool_seconds(), seconds[4];
    float *image = tool_allocate(t, (size_t)o->width * o->height, 4 * sizeof *image);
    int code = image ? drawing_load(t, &source, &d) : TOOL_MEMORY;
    seconds[0] = tool_seconds() - start;
    if (code == TOOL_DONE && o->show) code = drawing_show_errors(t, t->inputs[0], &d, &o->range);
    if (code == TOOL_DONE) code = draw_image(t, o, &d, image);
    if (code == TOOL_DONE && o->show)
        picture_draw_legend("error, % of the median light", o->range, o->width, o->height, image);
    seconds[1] = tool_seconds() - start - seconds[0];
    picture_background background = o->has_background ? o->background : choose_background(&d);
    if (code == TOOL_DONE) code = picture_save(t, t->output, o->width, o->height, image, &background);
    seconds[3] = tool_seconds() - start;
    seconds[2] = seconds[3] - seconds[0] - seconds[1];
    if (code == TOOL_DONE) code = report_render(t, o, &d, seconds);
    drawing_release(t, &d);
    tool_release(t, image);
    return code;
}

int tool_render(int argc, char **argv) {
    static const tool_stage stages[] = {
        {"read|models|dual graph|clusters|order|boxes|boxes of large clusters", 30}, {"draw", 60}, {0}};
    static const tool_command command = {
        .name = "render",
        .synopsis = "IN -o OUT.png",
        .summary = "draw a mesh, a scene, a baked scene, its clusters or its boxes",
        .text = "IN is a mesh, a hierarchy file (.fct) or a scene. Vertex colours are shown as light, as a "
                "bake writes them. Other "
                "surfaces look like plaster in a studio, in the colours of their materials if a scene has "
                "some. In a scene, the "
                "models share the K clusters or boxes by how much their surfaces turn.\n\n"
                "JSON keys: width, height, faces, range (with --show error: the end of the legend, percent), "
                "seconds{read, draw, write, total}, peak_bytes.",
        .examples = "  facetree render bunny.obj -o bunny.png\n"
                    "  facetree render bunny.fct --clusters 200 -o clusters.png\n"
                    "  facetree render lit.glb --scene scene.json -o lit.png\n"
                    "  facetree render lit.glb --scene scene.json --show error -o error.png",
        .options = render_options_table,
        .parse = parse_render,
        .run = run_render,
        .stages = stages,
        .builds_tree = true,
        .inputs_min = 1,
        .inputs_max = 1,
        .output = TOOL_OUTPUT_REQUIRED,
        .endings = "png"};
    render_options o = {.width = 1280, .height = 800, .samples = 16, .exposure = 1, .crease = 40};
    o.frame.view = -1;
    o.frame.fov = 35;
    return tool_main(&command, argc, argv, &o);
}
