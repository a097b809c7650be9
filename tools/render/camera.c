/* tools/render/camera.c: see camera.h. The eye is where the user or the scene puts it, else the mesh fills
 * the picture.
 */
#include "tools/render/camera.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const char *const drawing_views[] = {"corner", "front", "back", "left", "right", "top", "bottom", NULL};

/* Directions towards the eye if y is up. The corner view is right of the front view and above it. */
static const double view_directions[][3] = {{.5, .38, .86}, {0, 0, 1}, {0, 0, -1}, {-1, 0, 0},
                                            {1, 0, 0},      {0, 1, 0}, {0, -1, 0}};

static const double degree = 3.14159265358979323846 / 180;

/* The room around a mesh that fills the picture, as a factor on the distance. */
#define MARGIN 1.06

static double dot3(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross3(const double a[3], const double b[3], double out[3]) {
    for (int k = 0; k < 3; ++k) out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static bool normalize3(double a[3]) {
    double length = sqrt(dot3(a, a));
    if (!(length > 0)) return false;
    for (int k = 0; k < 3; ++k) a[k] /= length;
    return true;
}

bool drawing_parse_camera(const char *text, drawing_frame *out) {
    double v[7] = {0, 0, 0, 0, 0, 0, out->fov};
    int count = 0;
    for (const char *p = text; count < 7;) {
        char *end;
        v[count] = strtod(p, &end);
        if (end == p || !isfinite(v[count])) return false;
        ++count;
        if (*end == 0) break;
        if (*end != ',') return false;
        p = end + 1;
        if (count == 7) return false;
    }
    if (count < 6 || v[6] < 1 || v[6] > 170 || (v[0] == v[3] && v[1] == v[4] && v[2] == v[5])) return false;
    memcpy(out->position, v, sizeof out->position);
    memcpy(out->target, v + 3, sizeof out->target);
    out->fov = v[6];
    out->given = true;
    return true;
}

bool drawing_parse_size(const char *text, uint32_t *width, uint32_t *height) {
    char *end;
    unsigned long w = strtoul(text, &end, 10), h = 0;
    bool good = *end == 'x' && end > text && *text != '-' && end[1] >= '0' && end[1] <= '9';
    if (good) h = strtoul(end + 1, &end, 10);
    if (!good || *end || w < 1 || h < 1 || w > RASTER_MAX_SIZE || h > RASTER_MAX_SIZE) return false;
    *width = (uint32_t)w, *height = (uint32_t)h;
    return true;
}

void drawing_from_scene(const fct_camera *camera, drawing_frame *out) {
    for (int k = 0; k < 3; ++k) {
        out->position[k] = camera->position[k];
        out->target[k] = camera->target[k];
        out->up_vector[k] = camera->up[k];
    }
    out->fov = camera->vertical_fov;
    out->given = true;
}

static void find_bounds(const fct_mesh *mesh, double lower[3], double upper[3]) {
    for (int k = 0; k < 3; ++k) lower[k] = INFINITY, upper[k] = -INFINITY;
    for (size_t c = 0; c < 3 * (size_t)mesh->face_count; ++c)
        for (int k = 0; k < 3; ++k) {
            double x = mesh->positions[3 * (size_t)mesh->triangles[c] + k];
            lower[k] = fmin(lower[k], x);
            upper[k] = fmax(upper[k], x);
        }
    if (mesh->face_count == 0)
        for (int k = 0; k < 3; ++k) lower[k] = upper[k] = 0;
}

/* axes: rows right, up and forward. */
static void look_along(const double direction[3], const double up[3], double axes[3][3]) {
    memcpy(axes[2], direction, sizeof axes[2]);
    cross3(axes[2], up, axes[0]);
    if (dot3(axes[0], axes[0]) < 1e-12 || !normalize3(axes[0])) {
        /* The eye looks straight up or down: any other direction can be the top of the picture. */
        double other[3] = {-up[1], -up[2], -up[0]};
        cross3(axes[2], other, axes[0]);
        normalize3(axes[0]);
    }
    cross3(axes[0], axes[2], axes[1]);
}

/* The nearest eye, with the given axes, that has every corner of a face in the picture. */
static void fit_eye(const fct_mesh *mesh, const double center[3], double extent, raster_camera *camera) {
    double slope[2] = {.5 * camera->width / camera->focal, .5 * camera->height / camera->focal};
    double low[2] = {INFINITY, INFINITY},
           high[2] = {-INFINITY, -INFINITY}; /* of x / slope + z and x / slope - z */
    for (size_t c = 0; c < 3 * (size_t)mesh->face_count; ++c) {
        const float *p = mesh->positions + 3 * (size_t)mesh->triangles[c];
        double d[3] = {p[0] - center[0], p[1] - center[1], p[2] - center[2]};
        double z = dot3(camera->axes[2], d);
        for (int i = 0; i < 2; ++i) {
            /* A corner is in the picture if |x - e| <= slope (z + distance), for an eye at e, moved back by
             * distance. */
            double x = dot3(camera->axes[i], d) / slope[i];
            low[i] = fmin(low[i], x + z);
            high[i] = fmax(high[i], x - z);
        }
    }
    double distance = 0, shift[2] = {0, 0};
    for (int i = 0; i < 2 && mesh->face_count; ++i) {
        distance = fmax(distance, .5 * (high[i] - low[i]));
        shift[i] = .5 * (high[i] + low[i]) * slope[i];
    }
    distance = fmax(MARGIN * distance, 1e-3 * extent);
    for (int k = 0; k < 3; ++k)
        camera->eye[k] = center[k] + shift[0] * camera->axes[0][k] + shift[1] * camera->axes[1][k] -
                         distance * camera->axes[2][k];
}

static void set_light(drawing *d, const raster_camera *camera) {
    static const double towards[3][3] = {{-.66, .7, -.55}, {.9, -.1, -.4}, {0, 1, -.1}};
    for (int i = 0; i < 3; ++i) {
        double world[3] = {0, 0, 0};
        for (int j = 0; j < 3; ++j)
            for (int k = 0; k < 3; ++k) world[k] += towards[i][j] * camera->axes[j][k];
        normalize3(world);
        for (int k = 0; k < 3; ++k) d->light[i][k] = (float)world[k];
    }
}

void drawing_aim(drawing *d, const drawing_frame *frame, raster_camera *out, bool *outside) {
    double lower[3], upper[3], center[3], size[3], direction[3];
    find_bounds(&d->mesh, lower, upper);
    for (int k = 0; k < 3; ++k) center[k] = .5 * (lower[k] + upper[k]), size[k] = upper[k] - lower[k];
    double extent = fmax(size[0], fmax(size[1], size[2]));
    if (!(extent > 0)) extent = 1;
    out->focal = .5 * out->height / tan(.5 * frame->fov * degree);
    out->unit = extent;
    const double *view = view_directions[frame->view < 0 ? 0 : frame->view];
    double from[3] = {view[0], frame->up == 2 ? -view[2] : view[1], frame->up == 2 ? view[1] : view[2]};
    for (int k = 0; k < 3; ++k)
        direction[k] = frame->given ? frame->target[k] - frame->position[k] : -from[k];
    normalize3(direction);
    look_along(direction, frame->up_vector, out->axes);
    if (frame->given)
        memcpy(out->eye, frame->position, sizeof out->eye);
    else
        fit_eye(&d->mesh, center, extent, out);
    *outside = false;
    for (int k = 0; k < 3; ++k) *outside |= out->eye[k] < lower[k] || out->eye[k] > upper[k];
    set_light(d, out);
    d->eye = out->eye;
}
