/* tools/render_shade.c: how a face looks: as lit by the bake, or by a key light, a fill and the sky.
 *
 * Surfaces without light of their own are shown like plaster in a studio: smooth across edges whose faces
 * differ by less than the crease angle, sharp across others. Lines are drawn by their distance in pixels, so
 * they are as wide near as far.
 */
#include <math.h>
#include <string.h>

#include "tools/render_drawing.h"

/* Faces around each vertex. */
typedef struct fans {
    uint32_t *first; /* vertex_count + 1 */
    uint32_t *faces;
} fans;

static int make_fans(tool *t, const fct_mesh *mesh, fans *out) {
    size_t corners = 3 * (size_t)mesh->face_count;
    out->first = tool_allocate(t, (size_t)mesh->vertex_count + 2, sizeof *out->first);
    out->faces = tool_allocate(t, corners, sizeof *out->faces);
    if (!out->first || !out->faces) return TOOL_MEMORY;
    memset(out->first, 0, ((size_t)mesh->vertex_count + 2) * sizeof *out->first);
    for (size_t c = 0; c < corners; ++c) ++out->first[mesh->triangles[c] + 2];
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) out->first[v + 2] += out->first[v + 1];
    for (size_t c = 0; c < corners; ++c) out->faces[out->first[mesh->triangles[c] + 1]++] = (uint32_t)(c / 3);
    return TOOL_DONE;
}

static void free_fans(tool *t, fans *f) {
    tool_release(t, f->first);
    tool_release(t, f->faces);
}

static float dot(const float a[3], const float b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void normalize(float a[3]) {
    float length = sqrtf(dot(a, a));
    for (int k = 0; k < 3 && length > 0; ++k) a[k] /= length;
}

/* Unit normal, zero for a face without area; returns twice the area. */
static double face_normal(const fct_mesh *mesh, uint32_t face, float out[3]) {
    const uint32_t *t = mesh->triangles + 3 * (size_t)face;
    const float *p = mesh->positions + 3 * (size_t)t[0], *q = mesh->positions + 3 * (size_t)t[1],
                *r = mesh->positions + 3 * (size_t)t[2];
    double a[3], b[3], n[3], length = 0;
    for (int k = 0; k < 3; ++k) a[k] = (double)q[k] - p[k], b[k] = (double)r[k] - p[k];
    for (int k = 0; k < 3; ++k) {
        n[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
        length += n[k] * n[k];
    }
    length = sqrt(length);
    for (int k = 0; k < 3; ++k) out[k] = length > 0 ? (float)(n[k] / length) : 0;
    return length;
}

static void corner_normal(const fans *around, const float *normals, const double *areas, uint32_t face,
                          uint32_t vertex, double crease, float out[3]) {
    enum { MANY = 64 }; /* faces around a vertex above which the face's own normal must do */
    const float *own = normals + 3 * (size_t)face;
    uint32_t begin = around->first[vertex], end = around->first[vertex + 1];
    double sum[3] = {0, 0, 0};
    if (end - begin > MANY) begin = end;
    for (uint32_t i = begin; i < end; ++i) {
        const float *n = normals + 3 * (size_t)around->faces[i];
        if ((double)dot(own, n) < crease) continue;
        for (int k = 0; k < 3; ++k) sum[k] += areas[around->faces[i]] * n[k];
    }
    double length = sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    for (int k = 0; k < 3; ++k) out[k] = length > 0 ? (float)(sum[k] / length) : own[k];
}

static int make_normals(tool *t, drawing *d, const fans *around, double crease) {
    uint32_t faces = d->mesh.face_count;
    float *normals = tool_allocate(t, faces, 3 * sizeof *normals);
    double *areas = tool_allocate(t, faces, sizeof *areas);
    d->normals = tool_allocate(t, faces, 9 * sizeof *d->normals);
    int code = normals && areas && d->normals ? TOOL_DONE : TOOL_MEMORY;
    for (uint32_t f = 0; f < faces && code == TOOL_DONE; ++f)
        areas[f] = face_normal(&d->mesh, f, normals + 3 * (size_t)f);
    for (size_t c = 0; c < 3 * (size_t)faces && code == TOOL_DONE; ++c)
        corner_normal(around, normals, areas, (uint32_t)(c / 3), d->mesh.triangles[c], crease,
                      d->normals + 3 * c);
    tool_release(t, normals);
    tool_release(t, areas);
    return code;
}

/* Whether another face with the side (a, b) belongs to another cluster. */
static bool is_border(const drawing *d, const fans *around, uint32_t face, uint32_t a, uint32_t b) {
    uint32_t few = around->first[a + 1] - around->first[a] < around->first[b + 1] - around->first[b] ? a : b;
    uint32_t other = few == a ? b : a;
    for (uint32_t i = around->first[few]; i < around->first[few + 1]; ++i) {
        uint32_t f = around->faces[i];
        const uint32_t *t = d->mesh.triangles + 3 * (size_t)f;
        if (d->labels[f] != d->labels[face] && (t[0] == other || t[1] == other || t[2] == other)) return true;
    }
    return false;
}

static int make_lines(tool *t, drawing *d, const fans *around, bool all) {
    d->lines = tool_allocate(t, d->mesh.face_count, 1);
    if (!d->lines) return TOOL_MEMORY;
    for (uint32_t f = 0; f < d->mesh.face_count; ++f) {
        const uint32_t *v = d->mesh.triangles + 3 * (size_t)f;
        unsigned bits = all ? 7 : 0;
        for (int i = 0; i < 3 && !all; ++i)
            if (is_border(d, around, f, v[(i + 1) % 3], v[(i + 2) % 3])) bits |= 1U << i;
        d->lines[f] = (uint8_t)bits;
    }
    return TOOL_DONE;
}

int drawing_prepare(tool *t, drawing *d, double crease, bool wireframe) {
    bool light = d->mesh.colors && !d->paint;
    if (d->shading == DRAWING_AUTO) d->shading = light ? DRAWING_LIGHT : DRAWING_SMOOTH;
    bool smooth = d->shading == DRAWING_SMOOTH, borders = wireframe || (d->labels && !d->lines);
    if (!smooth && !borders) return TOOL_DONE;
    fans around = {0};
    int code = make_fans(t, &d->mesh, &around);
    if (code == TOOL_DONE && smooth) code = make_normals(t, d, &around, crease);
    if (code == TOOL_DONE && wireframe) {
        tool_release(t, d->lines);
        d->lines = NULL;
    }
    if (code == TOOL_DONE && borders) code = make_lines(t, d, &around, wireframe);
    free_fans(t, &around);
    return code;
}

/* OKLCH to linear sRGB (Ottosson 2020): equal steps look equal, whatever the hue. */
static void from_oklch(double lightness, double chroma, double hue, float rgb[3]) {
    double a = chroma * cos(hue), b = chroma * sin(hue);
    double l = lightness + .3963377774 * a + .2158037573 * b,
           m = lightness - .1055613458 * a - .0638541728 * b,
           s = lightness - .0894841775 * a - 1.2914855480 * b;
    l = l * l * l, m = m * m * m, s = s * s * s;
    rgb[0] = (float)fmax(0, 4.0767416621 * l - 3.3077115913 * m + .2309699292 * s);
    rgb[1] = (float)fmax(0, -1.2684380046 * l + 2.6097574011 * m - .3413193965 * s);
    rgb[2] = (float)fmax(0, -.0041960863 * l - .7034186147 * m + 1.7076147010 * s);
}

void drawing_color(uint32_t i, float rgb[3]) {
    const double turn = 2 * 3.14159265358979323846, golden = .61803398874989484820;
    double hue = fmod(i * golden, 1) * turn;
    double step = fmod(i * golden * golden * 5, 1);
    from_oklch(.70 + .16 * (step - .4), .115, hue, rgb);
}

/* Light that falls on a unit normal; the sky is cool, the key warm, the floor gives a little back. */
static void studio(const drawing *d, const float n[3], const float to_eye[3], float rgb[3], float *gloss) {
    static const float sky[3] = {.43F, .47F, .54F}, floor_[3] = {.20F, .17F, .15F},
                       key[3] = {.78F, .73F, .66F}, fill[3] = {.14F, .17F, .22F};
    float up = .5F + .5F * dot(n, d->light[2]), k = fmaxf(dot(n, d->light[0]), 0),
          f = fmaxf(dot(n, d->light[1]), 0);
    float rim = 1 - fmaxf(dot(n, to_eye), 0);
    rim = .12F * rim * rim * rim * up;
    for (int i = 0; i < 3; ++i)
        rgb[i] = floor_[i] + (sky[i] - floor_[i]) * up + key[i] * k + fill[i] * f + rim;
    float half[3];
    for (int i = 0; i < 3; ++i) half[i] = d->light[0][i] + to_eye[i];
    normalize(half);
    *gloss = .06F * powf(fmaxf(dot(n, half), 0), 30);
}

static void interpolate(const float *a, const float *b, const float *c, const double w[3], float out[3]) {
    for (int k = 0; k < 3; ++k) out[k] = (float)(w[0] * a[k] + w[1] * b[k] + w[2] * c[k]);
}

static void find_normal(const drawing *d, const raster_point *point, float n[3]) {
    const float *corners = d->normals ? d->normals + 9 * (size_t)point->face : NULL;
    if (corners)
        interpolate(corners, corners + 3, corners + 6, point->weight, n);
    else
        face_normal(&d->mesh, point->face, n);
    normalize(n);
    for (int k = 0; k < 3 && point->back; ++k) n[k] = -n[k];
}

static void find_paint(const drawing *d, const raster_point *point, float rgb[3]) {
    const uint32_t *v = d->mesh.triangles + 3 * (size_t)point->face;
    static const float plaster[3] = {.76F, .73F, .69F};
    const float *face = d->paint              ? d->paint + 3 * (size_t)point->face
                        : d->mesh.face_colors ? d->mesh.face_colors + 3 * (size_t)point->face
                                              : plaster;
    if (d->mesh.colors && !d->paint)
        interpolate(d->mesh.colors + 3 * (size_t)v[0], d->mesh.colors + 3 * (size_t)v[1],
                    d->mesh.colors + 3 * (size_t)v[2], point->weight, rgb);
    else
        memcpy(rgb, face, 3 * sizeof *rgb);
}

static void add_studio_light(const drawing *d, const raster_point *point, float rgb[3]) {
    const uint32_t *v = d->mesh.triangles + 3 * (size_t)point->face;
    float n[3], to_eye[3], light[3], gloss;
    find_normal(d, point, n);
    interpolate(d->mesh.positions + 3 * (size_t)v[0], d->mesh.positions + 3 * (size_t)v[1],
                d->mesh.positions + 3 * (size_t)v[2], point->weight, to_eye);
    for (int k = 0; k < 3; ++k) to_eye[k] = (float)d->eye[k] - to_eye[k];
    normalize(to_eye);
    studio(d, n, to_eye, light, &gloss);
    /* The inside of an open surface is told from its outside by a darker, warmer tone. */
    static const float inside[3] = {.62F, .52F, .46F};
    for (int k = 0; k < 3; ++k) rgb[k] = rgb[k] * light[k] * (point->back ? inside[k] : 1) + gloss;
}

static void add_lines(const drawing *d, const raster_point *point, float rgb[3]) {
    unsigned bits = d->lines[point->face];
    float cover = 0;
    for (int i = 0; i < 3; ++i)
        if (bits >> i & 1) cover = fmaxf(cover, d->line_width + .5F - (float)point->side[i]);
    cover = fminf(fmaxf(cover, 0), 1);
    for (int k = 0; k < 3; ++k) rgb[k] *= 1 - .8F * cover;
}

void drawing_shade(void *user, const raster_point *point, float rgb[3]) {
    const drawing *d = user;
    find_paint(d, point, rgb);
    if (d->shading != DRAWING_LIGHT) add_studio_light(d, point, rgb);
    for (int k = 0; k < 3; ++k) {
        if (d->glow) rgb[k] += d->glow[3 * (size_t)point->face + k];
        rgb[k] *= d->exposure;
    }
    picture_apply_tone(d->tone, rgb);
    if (d->lines) add_lines(d, point, rgb);
}
