/* tools/render/render.c: `facetree render`: a picture of a mesh, a scene, a bake, clusters or boxes. */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tools/render/drawing.h"

enum {
    KEY_BACKGROUND = TOOL_KEY,
    KEY_BOXES,
    KEY_CAMERA,
    KEY_CLUSTERS,
    KEY_CREASE,
    KEY_CULL,
    KEY_EXPOSURE,
    KEY_FOV,
    KEY_SAMPLES,
    KEY_SCENE,
    KEY_SHADING,
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
    bool wireframe, has_background;
    picture_background background;
} render_options;

static const struct argp_option options[] = {
    {NULL, 0, NULL, 0, "What is drawn:", 1},
    {"clusters", KEY_CLUSTERS, "K", 0, "The surface in K clusters, each in a colour of its own", 1},
    {"boxes", KEY_BOXES, "K", 0, "The oriented boxes of K clusters", 1},
    {"wireframe", KEY_WIREFRAME, NULL, 0, "The sides of the triangles too", 1},
    {NULL, 0, NULL, 0, "From where:", 2},
    {"camera", KEY_CAMERA, "EX,EY,EZ,TX,TY,TZ[,FOV]", 0,
     "Eye, target and, in degrees, the vertical field of view (default: the scene's camera, else --view "
     "corner)",
     2},
    {"scene", KEY_SCENE, "FILE", 0, "Take the camera from this scene", 2},
    {"view", KEY_VIEW, "NAME", 0, "The whole from corner, front, back, left, right, top or bottom", 2},
    {"up", KEY_UP, "AXIS", 0, "y or z points up (default: as the scene's camera has it, else y)", 2},
    {"fov", KEY_FOV, "DEGREES", 0, "Vertical field of view (default 35)", 2},
    {"cull", KEY_CULL, "WHICH", 0,
     "Leave out faces seen from behind: back or none (default: back for boxes, and for lit surfaces seen "
     "from "
     "outside, so that one looks into a room)",
     2},
    {NULL, 0, NULL, 0, "How it looks:", 3},
    {"size", KEY_SIZE, "WxH", 0, "Pixels (default 1280x800)", 3},
    {"samples", KEY_SAMPLES, "N", 0, "Samples a pixel, 1 to 64 (default 16)", 3},
    {"exposure", KEY_EXPOSURE, "E", 0, "Factor on light (default 1)", 3},
    {"tone", KEY_TONE, "CURVE", 0, "How bright light is bent: soft, filmic or clamp (default soft)", 3},
    {"shading", KEY_SHADING, "HOW", 0,
     "light: colours are light already (default where vertices have colours); smooth or flat: lit as in a "
     "studio",
     3},
    {"crease", KEY_CREASE, "DEGREES", 0, "Edges sharper than this stay sharp in smooth shading (default 40)",
     3},
    {"background", KEY_BACKGROUND, "COLOUR", 0, "#rrggbb, or none for a transparent one", 3},
    {0}};

static error_t parse_size(struct argp_state *state, const char *text, render_options *o) {
    char *end;
    unsigned long width = strtoul(text, &end, 10), height = 0;
    bool good = *end == 'x' && end > text && *text != '-' && end[1] >= '0' && end[1] <= '9';
    if (good) height = strtoul(end + 1, &end, 10);
    if (!good || *end || width < 1 || height < 1 || width > RASTER_MAX_SIZE || height > RASTER_MAX_SIZE)
        return tool_usage(state, "--size: expected WIDTHxHEIGHT, each 1 to %d, found '%s'", RASTER_MAX_SIZE,
                          text);
    o->width = (uint32_t)width, o->height = (uint32_t)height;
    return 0;
}

static error_t parse_subject(struct argp_state *state, const char *name, const char *text,
                             drawing_subject subject, render_options *o) {
    if (o->subject != DRAWING_SURFACE)
        return tool_usage(state, "%s: a picture shows clusters or boxes, once", name);
    o->subject = subject;
    return tool_parse_count32(state, name, text, 1, INT32_MAX, &o->count);
}

static error_t parse_view(struct argp_state *state, int key, const char *text, render_options *o) {
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

static error_t parse_look(struct argp_state *state, int key, const char *text, render_options *o) {
    static const char *const tones[] = {"soft", "filmic", "clamp", NULL};
    static const char *const shadings[] = {"auto", "light", "smooth", "flat", NULL};
    static const char *const culls[] = {"auto", "back", "none", NULL};
    switch (key) {
    case KEY_SAMPLES:
        return tool_parse_count32(state, "--samples", text, 1, RASTER_MAX_SAMPLES, &o->samples);
    case KEY_EXPOSURE:
        return tool_parse_real(state, "--exposure", text, 0, 1e30, &o->exposure);
    case KEY_TONE:
        return tool_parse_choice(state, "--tone", text, tones, &o->tone);
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

static error_t parse(int key, char *text, struct argp_state *state) {
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
        return parse_size(state, text, o);
    case KEY_CAMERA:
    case KEY_SCENE:
    case KEY_VIEW:
    case KEY_UP:
    case KEY_FOV:
        return parse_view(state, key, text, o);
    case KEY_BACKGROUND:
    case KEY_CREASE:
    case KEY_CULL:
    case KEY_EXPOSURE:
    case KEY_SAMPLES:
    case KEY_SHADING:
    case KEY_TONE:
        return parse_look(state, key, text, o);
    case ARGP_KEY_END:
        if (o->camera && !drawing_parse_camera(o->camera, &o->frame))
            return tool_usage(
                state, "--camera: expected EX,EY,EZ,TX,TY,TZ[,FOV] with an eye off its target, found '%s'",
                o->camera);
        if ((o->camera != NULL) + (o->scene != NULL) + (o->frame.view >= 0) > 1)
            return tool_usage(state,
                              "--camera, --scene and --view are three ways to say one thing: give one");
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* The camera of --scene. */
static int read_camera(tool *t, const char *path, drawing_frame *frame) {
    fct_scene *scene;
    int code = tool_result(t, fct_scene_load(&t->env, path, FCT_BACKEND_OBB, &scene));
    if (code != TOOL_DONE) return code;
    fct_camera camera = fct_scene_get(scene).camera;
    if (camera.given)
        drawing_from_scene(&camera, frame);
    else
        code = tool_fail(t, TOOL_DATA, "%s: expected a scene with a camera, found none", path);
    fct_scene_destroy(scene);
    return code;
}

static int choose_frame(tool *t, const render_options *o, const drawing *d, drawing_frame *frame) {
    *frame = o->frame;
    int up = frame->up ? frame->up : 1;
    if (!frame->up && d->camera.given && fabsf(d->camera.up[2]) > fabsf(d->camera.up[1])) up = 2;
    frame->up = up;
    frame->up_vector[0] = 0, frame->up_vector[1] = up == 1, frame->up_vector[2] = up == 2;
    if (o->scene) return read_camera(t, o->scene, frame);
    if (d->camera.given && !o->camera && frame->view < 0) drawing_from_scene(&d->camera, frame);
    return TOOL_DONE;
}

/* Light grey behind surfaces, near black behind lit ones. */
static picture_background default_background(const drawing *d) {
    picture_background light = {{.42F, .46F, .51F}, {.76F, .77F, .78F}, false};
    picture_background dark = {{.008F, .009F, .011F}, {.022F, .023F, .026F}, false};
    return d->shading == DRAWING_LIGHT ? dark : light;
}

static int report(tool *t, const render_options *o, const drawing *d, const double seconds[4]) {
    tool_say(t, "%s: %u x %u pixels of %u triangles in %.2f s", t->output, o->width, o->height,
             d->mesh.face_count, seconds[3]);
    return tool_json(t, json_pack("{s:i, s:i, s:I, s:{s:f, s:f, s:f, s:f}, s:I}", "width", (int)o->width,
                                  "height", (int)o->height, "faces", (json_int_t)d->mesh.face_count,
                                  "seconds", "read", seconds[0], "draw", seconds[1], "write", seconds[2],
                                  "total", seconds[3], "peak_bytes", (json_int_t)tool_peak_bytes()));
}

static int draw(tool *t, const render_options *o, drawing *d, float *image) {
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

static int run(tool *t, void *input) {
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
    if (code == TOOL_DONE) code = draw(t, o, &d, image);
    seconds[1] = tool_seconds() - start - seconds[0];
    picture_background background = o->has_background ? o->background : default_background(&d);
    if (code == TOOL_DONE) code = picture_save(t, t->output, o->width, o->height, image, &background);
    seconds[3] = tool_seconds() - start;
    seconds[2] = seconds[3] - seconds[0] - seconds[1];
    if (code == TOOL_DONE) code = report(t, o, &d, seconds);
    drawing_release(t, &d);
    tool_release(t, image);
    return code;
}

int tool_render(int argc, char **argv) {
    static const tool_command command = {
        .name = "render",
        .synopsis = "IN -o OUT.png",
        .summary = "Draw a mesh, a scene, a baked scene, its clusters or its boxes.",
        .text =
            "IN is a mesh, a .fct hierarchy or a scene. Vertex colours are shown as light, as a bake leaves "
            "them; "
            "surfaces without are shown like plaster in a studio, in the colours of their materials where a "
            "scene "
            "gives some. In a scene, clusters and boxes are shared out among the models by how much their "
            "surfaces turn.",
        .options = options,
        .parse = parse,
        .run = run,
        .inputs_min = 1,
        .inputs_max = 1,
        .output = TOOL_OUTPUT_REQUIRED};
    render_options o = {.width = 1280, .height = 800, .samples = 16, .exposure = 1, .crease = 40};
    o.frame.view = -1;
    o.frame.fov = 35;
    return tool_main(&command, argc, argv, &o);
}
