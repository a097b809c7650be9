/* tools/render/shade.c: see shade.h.
 *
 * Baked colours are shown as they are. Other surfaces look like plaster in a studio, with a key light, a fill
 * light and a sky. Shading is smooth across edges whose faces differ by less than the crease angle. The width
 * of lines is measured in pixels, so near and far lines are equally wide.
 */
#include "tools/render/shade.h"

#include <math.h>
#include <string.h>

#include "tools/render/palette.h"

/* The faces around each vertex. */
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

static float dot_floats(const float a[3], const float b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void normalize_floats(float a[3]) {
    float length = sqrtf(dot_floats(a, a));
    for (int k = 0; k < 3 && length > 0; ++k) a[k] /= length;
}

/* out: the unit normal, zero for a face without area. Returns twice the area. */
static double find_face_normal(const fct_mesh *mesh, uint32_t face, float out[3]) {
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

static void find_corner_normal(const fans *around, const float *normals, const double *areas, uint32_t face,
                               uint32_t vertex, double crease, float out[3]) {
    enum { MANY = 64 }; /* a vertex with more faces takes the normal of the face */
    const float *own = normals + 3 * (size_t)face;
    uint32_t begin = around->first[vertex], end = around->first[vertex + 1];
    double sum[3] = {0, 0, 0};
    if (end - begin > MANY) begin = end;
    for (uint32_t i = begin; i < end; ++i) {
        const float *n = normals + 3 * (size_t)around->faces[i];
        if ((double)dot_floats(own, n) < crease) continue;
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
        areas[f] = find_face_normal(&d->mesh, f, normals + 3 * (size_t)f);
    for (size_t c = 0; c < 3 * (size_t)faces && code == TOOL_DONE; ++c)
        find_corner_normal(around, normals, areas, (uint32_t)(c / 3), d->mesh.triangles[c], crease,
                           d->normals + 3 * c);
    tool_release(t, normals);
    tool_release(t, areas);
    return code;
}

typedef void visit_label(void *user, uint32_t label);

/* Calls visit(user, label) for each face of another cluster across the side. */
static void visit_across(const drawing *d, const fans *around, uint32_t face, int side, visit_label *visit,
                         void *user) {
    const uint32_t *v = d->mesh.triangles + 3 * (size_t)face;
    uint32_t a = v[(side + 1) % 3], b = v[(side + 2) % 3];
    uint32_t few = around->first[a + 1] - around->first[a] < around->first[b + 1] - around->first[b] ? a : b;
    uint32_t other = few == a ? b : a;
    for (uint32_t i = around->first[few]; i < around->first[few + 1]; ++i) {
        uint32_t f = around->faces[i];
        const uint32_t *t = d->mesh.triangles + 3 * (size_t)f;
        if (d->labels[f] != d->labels[face] && (t[0] == other || t[1] == other || t[2] == other))
            visit(user, d->labels[f]);
    }
}

static void note_border(void *user, uint32_t label) {
    (void)label;
    *(bool *)user = true;
}

static int make_lines(tool *t, drawing *d, const fans *around, bool all) {
    d->lines = tool_allocate(t, d->mesh.face_count, 1);
    if (!d->lines) return TOOL_MEMORY;
    for (uint32_t f = 0; f < d->mesh.face_count; ++f) {
        unsigned bits = all ? 7 : 0;
        for (int i = 0; i < 3 && !all; ++i) {
            bool border = false;
            visit_across(d, around, f, i, note_border, &border);
            bits |= (unsigned)border << i;
        }
        d->lines[f] = (uint8_t)bits;
    }
    return TOOL_DONE;
}

typedef struct coloring {
    uint8_t *colors; /* per label; PALETTE: none yet */
    unsigned used[PALETTE];
} coloring;

static void note_color(void *user, uint32_t label) {
    coloring *c = user;
    if (c->colors[label] < PALETTE) ++c->used[c->colors[label]];
}

/* Gives each cluster, in order, the colour that occurs least along its borders. The faces of a cluster are
 * consecutive. */
static int paint_labels(tool *t, drawing *d, const fans *around) {
    uint32_t faces = d->mesh.face_count, labels = faces ? d->labels[faces - 1] + 1 : 0;
    coloring c = {.colors = tool_allocate(t, labels, 1)};
    if (!c.colors) return TOOL_MEMORY;
    memset(c.colors, PALETTE, labels);
    for (uint32_t begin = 0, end; begin < faces; begin = end) {
        uint32_t label = d->labels[begin], best = label % PALETTE;
        memset(c.used, 0, sizeof c.used);
        for (end = begin; end < faces && d->labels[end] == label; ++end)
            for (int side = 0; side < 3; ++side) visit_across(d, around, end, side, note_color, &c);
        for (uint32_t k = 1; k < PALETTE; ++k)
            if (c.used[(label + k) % PALETTE] < c.used[best]) best = (label + k) % PALETTE;
        c.colors[label] = (uint8_t)best;
        float rgb[3];
        drawing_color(best, rgb);
        for (size_t f = begin; f < end; ++f) memcpy(d->paint + 3 * f, rgb, sizeof rgb);
    }
    tool_release(t, c.colors);
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
    if (code == TOOL_DONE && d->labels) code = paint_labels(t, d, &around);
    if (code == TOOL_DONE && borders) code = make_lines(t, d, &around, wireframe);
    free_fans(t, &around);
    return code;
}

/* The light that falls on a unit normal: a cool sky, a warm key light, a fill light, and a little light from
 * the ground. gloss: the highlight of the key light. */
static void light_studio(const drawing *d, const float n[3], const float to_eye[3], float rgb[3],
                         float *gloss) {
    static const float sky[3] = {.30F, .335F, .40F}, ground[3] = {.20F, .175F, .155F},
                       key[3] = {.92F, .85F, .75F}, fill[3] = {.07F, .09F, .13F};
    float up = .5F + .5F * dot_floats(n, d->light[2]), f = fmaxf(dot_floats(n, d->light[1]), 0);
    /* The key light is not a point, so it also lights surfaces that turn slightly away from it. */
    float k = fmaxf(dot_floats(n, d->light[0]) + .12F, 0) / 1.12F;
    float rim = 1 - fmaxf(dot_floats(n, to_eye), 0);
    rim = .12F * rim * rim * rim * up;
    for (int i = 0; i < 3; ++i)
        rgb[i] = ground[i] + (sky[i] - ground[i]) * up + key[i] * k + fill[i] * f + rim;
    float half[3];
    for (int i = 0; i < 3; ++i) half[i] = d->light[0][i] + to_eye[i];
    normalize_floats(half);
    *gloss = .06F * powf(fmaxf(dot_floats(n, half), 0), 30);
}

static void blend_corners(const float *a, const float *b, const float *c, const double w[3], float out[3]) {
    for (int k = 0; k < 3; ++k) out[k] = (float)(w[0] * a[k] + w[1] * b[k] + w[2] * c[k]);
}

static void find_normal(const drawing *d, const raster_point *point, float n[3]) {
    const float *corners = d->normals ? d->normals + 9 * (size_t)point->face : NULL;
    if (corners)
        blend_corners(corners, corners + 3, corners + 6, point->weight, n);
    else
        find_face_normal(&d->mesh, point->face, n);
    normalize_floats(n);
    for (int k = 0; k < 3 && point->back; ++k) n[k] = -n[k];
}

/* The reflectance of a point of a painted scene. */
static void find_scene_paint(const drawing *d, const raster_point *point, float rgb[3]) {
    const fct_scene_view view = fct_scene_get(d->scene);
    uint32_t low = 0, high = view.instance_count - 1;
    while (low < high) {
        uint32_t middle = low + (high - low + 1) / 2;
        if (d->starts[middle] <= point->face)
            low = middle;
        else
            high = middle - 1;
    }
    /* The corners of mirrored instances are in reverse order. */
    const float v = point->weight[view.instances[low].mirrored ? 0 : 2];
    fct_scene_reflectance(d->scene, low, point->face - d->starts[low], (float)point->weight[1], v, 0, rgb);
}

static void find_paint(const drawing *d, const raster_point *point, float rgb[3]) {
    const uint32_t *v = d->mesh.triangles + 3 * (size_t)point->face;
    static const float plaster[3] = {.62F, .59F, .55F};
    const float *face = d->paint              ? d->paint + 3 * (size_t)point->face
                        : d->mesh.face_colors ? d->mesh.face_colors + 3 * (size_t)point->face
                                              : plaster;
    if (d->scene)
        find_scene_paint(d, point, rgb);
    else if (d->mesh.colors && !d->paint)
        blend_corners(d->mesh.colors + 3 * (size_t)v[0], d->mesh.colors + 3 * (size_t)v[1],
                      d->mesh.colors + 3 * (size_t)v[2], point->weight, rgb);
    else
        memcpy(rgb, face, 3 * sizeof *rgb);
}

static void add_studio_light(const drawing *d, const raster_point *point, float rgb[3]) {
    const uint32_t *v = d->mesh.triangles + 3 * (size_t)point->face;
    float n[3], to_eye[3], light[3], gloss;
    find_normal(d, point, n);
    blend_corners(d->mesh.positions + 3 * (size_t)v[0], d->mesh.positions + 3 * (size_t)v[1],
                  d->mesh.positions + 3 * (size_t)v[2], point->weight, to_eye);
    for (int k = 0; k < 3; ++k) to_eye[k] = (float)d->eye[k] - to_eye[k];
    normalize_floats(to_eye);
    light_studio(d, n, to_eye, light, &gloss);
    /* A darker, warmer tone distinguishes the inside of an open surface. */
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

static void shade_value(const drawing *d, const raster_point *point, float rgb[3]) {
    const uint32_t *t = d->mesh.triangles + 3 * (size_t)point->face;
    double value = 0;
    for (int k = 0; k < 3; ++k) value += point->weight[k] * d->values[t[k]];
    drawing_false_color(value, rgb);
}

static void shade_light(const drawing *d, const raster_point *point, float rgb[3]) {
    find_paint(d, point, rgb);
    if (d->shading != DRAWING_LIGHT) add_studio_light(d, point, rgb);
    for (int k = 0; k < 3; ++k) {
        if (d->glow) rgb[k] += d->glow[3 * (size_t)point->face + k];
        rgb[k] *= d->exposure;
    }
    picture_apply_tone(d->tone, rgb);
}

void drawing_shade(void *user, const raster_point *point, float rgb[3]) {
    const drawing *d = user;
    (d->values ? shade_value : shade_light)(d, point, rgb);
    if (d->lines) add_lines(d, point, rgb);
}
