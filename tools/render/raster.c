/* tools/render/raster.c: scan conversion with exact coverage.
 *
 * Corners are snapped to 1/4096 pixel and clipped against the near plane and a guard band; edge functions are
 * 64-bit integers, so every sample belongs to exactly one of two faces that share a side. The samples of a
 * pixel lie one on each of `samples` sub-rows, shifted by the van der Corput sequence: edges of any slope get
 * as many grey levels as there are samples, and a face still covers one span a sub-row. A sample keeps 1/z
 * and the number of its face; light is computed afterwards, once for each face that a pixel sees. Cost: O(V +
 * F) and the covered samples; memory 29 bytes a vertex and face, and one band of samples.
 */
#include "tools/render/raster.h"

#include <math.h>
#include <string.h>

enum { SUBPIXEL = 12, ONE = 1 << SUBPIXEL, BAND = 8, POLYGON = 3 + 5 };

static const double near_plane = 1e-4;

/* Which planes a corner lies outside of: the view's four, the guard band's four, near. */
enum { OUT_VIEW = 15, OUT_GUARD = 16, OUT_NEAR = 32 };

typedef struct corner {
    int32_t x, y;
    float depth; /* 1/z */
} corner;

/* A face, or a part of one that clipping has left. */
typedef struct piece {
    uint32_t corner[3], face;
} piece;

typedef struct raster {
    tool *t;
    const raster_camera *camera;
    const fct_mesh *mesh;
    double guard[2]; /* largest |slope| that is not clipped, in x and in y */
    int32_t shift[RASTER_MAX_SAMPLES], rise[RASTER_MAX_SAMPLES]; /* of the samples in their pixel */
    corner *corners;
    uint8_t *out;
    piece *pieces;
    size_t corner_count, corner_capacity, piece_count, piece_capacity;
    size_t *band_first;    /* band -> its first place in band_pieces; one more than there are bands */
    uint32_t *band_pieces; /* piece numbers, band after band */
    float *depth;          /* BAND * samples sub-rows of width */
    uint32_t *seen;        /* piece numbers, likewise */
} raster;

static void to_camera(const raster_camera *camera, const float *p, double out[3]) {
    double d[3];
    for (int k = 0; k < 3; ++k) d[k] = (p[k] - camera->eye[k]) / camera->unit;
    for (int i = 0; i < 3; ++i)
        out[i] = camera->axes[i][0] * d[0] + camera->axes[i][1] * d[1] + camera->axes[i][2] * d[2];
}

/* p in camera space, in front of the near plane and within the guard band. */
static corner project(const raster_camera *camera, const double p[3]) {
    double x = .5 * camera->width + camera->focal * p[0] / p[2];
    double y = .5 * camera->height - camera->focal * p[1] / p[2];
    return (corner){(int32_t)lrint(x * ONE), (int32_t)lrint(y * ONE), (float)(1 / p[2])};
}

static uint8_t outside(const raster *r, const double p[3]) {
    double x = .5 * r->camera->width / r->camera->focal * p[2];
    double y = .5 * r->camera->height / r->camera->focal * p[2];
    unsigned out = (p[0] > x) | (p[0] < -x) << 1 | (p[1] > y) << 2 | (p[1] < -y) << 3;
    if (fabs(p[0]) > r->guard[0] * p[2] || fabs(p[1]) > r->guard[1] * p[2]) out |= OUT_GUARD;
    if (p[2] < near_plane) out |= OUT_NEAR;
    return (uint8_t)out;
}

static int reserve(tool *t, void **array, size_t *capacity, size_t needed, size_t size) {
    if (needed <= *capacity) return TOOL_DONE;
    size_t larger = needed + *capacity / 2 + 64;
    void *memory = tool_allocate(t, larger, size);
    if (!memory) return TOOL_MEMORY;
    if (*array) memcpy(memory, *array, *capacity * size);
    tool_release(t, *array);
    *array = memory;
    *capacity = larger;
    return TOOL_DONE;
}

static int project_vertices(raster *r) {
    const fct_mesh *mesh = r->mesh;
    r->corner_capacity = mesh->vertex_count;
    r->corners = tool_allocate(r->t, r->corner_capacity, sizeof *r->corners);
    r->out = tool_allocate(r->t, mesh->vertex_count, 1);
    if (!r->corners || !r->out) return TOOL_MEMORY;
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) {
        double p[3];
        to_camera(r->camera, mesh->positions + 3 * (size_t)v, p);
        r->out[v] = outside(r, p);
        if (!(r->out[v] & (OUT_GUARD | OUT_NEAR))) r->corners[v] = project(r->camera, p);
    }
    r->corner_count = mesh->vertex_count;
    return TOOL_DONE;
}

static int64_t area2(corner a, corner b, corner c) {
    return (int64_t)(b.x - a.x) * (c.y - a.y) - (int64_t)(c.x - a.x) * (b.y - a.y);
}

/* Sub-rows are numbered through the picture from its top. */
static int64_t row_y(const raster *r, int64_t row) {
    return (row / r->camera->samples) * ONE + r->rise[row % r->camera->samples];
}

/* The first sub-row at or below y, within the picture. */
static int64_t first_row(const raster *r, int64_t y) {
    int64_t end = (int64_t)r->camera->height * r->camera->samples;
    int64_t row = y <= 0 ? 0 : (y >> SUBPIXEL) * r->camera->samples;
    while (row < end && row_y(r, row) < y) ++row;
    return row < end ? row : end;
}

static void piece_rows(const raster *r, const piece *p, int64_t *begin, int64_t *end) {
    int32_t low = INT32_MAX, high = INT32_MIN;
    for (int i = 0; i < 3; ++i) {
        int32_t y = r->corners[p->corner[i]].y;
        if (y < low) low = y;
        if (y > high) high = y;
    }
    *begin = first_row(r, low);
    *end = first_row(r, (int64_t)high + 1);
}

/* Keeps the piece unless it covers nothing or is to be culled. */
static int add_piece(raster *r, piece p) {
    int64_t area = area2(r->corners[p.corner[0]], r->corners[p.corner[1]], r->corners[p.corner[2]]);
    /* y grows downwards in the picture: a face that runs counter-clockwise has a negative area. */
    if (area == 0 || (r->camera->cull && area > 0)) return TOOL_DONE;
    int64_t begin, end;
    piece_rows(r, &p, &begin, &end);
    if (begin >= end) return TOOL_DONE;
    int result = reserve(r->t, (void **)&r->pieces, &r->piece_capacity, r->piece_count + 1, sizeof p);
    if (result == TOOL_DONE) r->pieces[r->piece_count++] = p;
    return result;
}

/* Clips a convex polygon of *count points against a.x >= 0; the cut of a side depends on its ends alone. */
static void clip(double polygon[POLYGON][3], int *count, const double a[3], double offset) {
    double in[POLYGON][3];
    int n = *count, m = 0;
    memcpy(in, polygon, sizeof in);
    for (int i = 0; i < n; ++i) {
        const double *p = in[i], *q = in[(i + 1) % n];
        double dp = a[0] * p[0] + a[1] * p[1] + a[2] * p[2] - offset;
        double dq = a[0] * q[0] + a[1] * q[1] + a[2] * q[2] - offset;
        if (dp >= 0) memcpy(polygon[m++], p, sizeof in[0]);
        if ((dp >= 0) == (dq >= 0)) continue;
        bool leaving = dp >= 0;
        const double *from = leaving ? p : q, *to = leaving ? q : p;
        double t = leaving ? dp / (dp - dq) : dq / (dq - dp);
        for (int k = 0; k < 3; ++k) polygon[m][k] = from[k] + t * (to[k] - from[k]);
        ++m;
    }
    *count = m;
}

static int add_clipped(raster *r, uint32_t face) {
    double polygon[POLYGON][3];
    int count = 3;
    for (int i = 0; i < 3; ++i)
        to_camera(r->camera, r->mesh->positions + 3 * (size_t)r->mesh->triangles[3 * (size_t)face + i],
                  polygon[i]);
    double gx = r->guard[0], gy = r->guard[1];
    clip(polygon, &count, (double[3]){0, 0, 1}, near_plane);
    clip(polygon, &count, (double[3]){-1, 0, gx}, 0);
    clip(polygon, &count, (double[3]){1, 0, gx}, 0);
    clip(polygon, &count, (double[3]){0, -1, gy}, 0);
    clip(polygon, &count, (double[3]){0, 1, gy}, 0);
    if (count < 3) return TOOL_DONE;
    size_t first = r->corner_count;
    int result =
        reserve(r->t, (void **)&r->corners, &r->corner_capacity, first + (size_t)count, sizeof *r->corners);
    for (int i = 0; i < count && result == TOOL_DONE; ++i)
        r->corners[r->corner_count++] = project(r->camera, polygon[i]);
    for (int i = 2; i < count && result == TOOL_DONE; ++i)
        result = add_piece(
            r, (piece){{(uint32_t)first, (uint32_t)first + (uint32_t)i - 1, (uint32_t)first + (uint32_t)i},
                       face});
    return result;
}

static int make_pieces(raster *r) {
    const fct_mesh *mesh = r->mesh;
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        const uint32_t *t = mesh->triangles + 3 * (size_t)f;
        unsigned all = r->out[t[0]] & r->out[t[1]] & r->out[t[2]];
        unsigned any = r->out[t[0]] | r->out[t[1]] | r->out[t[2]];
        if (all & (OUT_VIEW | OUT_NEAR)) continue;
        int result =
            any & (OUT_GUARD | OUT_NEAR) ? add_clipped(r, f) : add_piece(r, (piece){{t[0], t[1], t[2]}, f});
        if (result != TOOL_DONE) return result;
    }
    return TOOL_DONE;
}

/* Lists each band's pieces in ascending order. */
static int sort_into_bands(raster *r) {
    int64_t band_rows = (int64_t)BAND * r->camera->samples;
    size_t bands = (r->camera->height + BAND - 1) / BAND;
    r->band_first = tool_allocate(r->t, bands + 2, sizeof *r->band_first);
    if (!r->band_first) return TOOL_MEMORY;
    memset(r->band_first, 0, (bands + 2) * sizeof *r->band_first);
    for (int fill = 0; fill < 2; ++fill) {
        for (size_t i = 0; i < r->piece_count; ++i) {
            int64_t begin, end;
            piece_rows(r, r->pieces + i, &begin, &end);
            for (int64_t band = begin / band_rows; band <= (end - 1) / band_rows; ++band) {
                size_t place = r->band_first[band + (fill ? 1 : 2)]++;
                if (fill) r->band_pieces[place] = (uint32_t)i;
            }
        }
        if (fill) break;
        for (size_t band = 2; band < bands + 2; ++band) r->band_first[band] += r->band_first[band - 1];
        r->band_pieces = tool_allocate(r->t, r->band_first[bands + 1], sizeof *r->band_pieces);
        if (!r->band_pieces) return TOOL_MEMORY;
    }
    return TOOL_DONE;
}

static int64_t floor_div(int64_t a, int64_t b) {
    return a / b - (a % b < 0);
}

/* Edge functions a x + b y + c >= 0 inside. */
typedef struct edges {
    int64_t a[3], b[3], c[3];
    double z0, zx, zy; /* 1/z = z0 + zx x + zy y, x and y from corner `origin` */
    corner origin;
    float low, high; /* of 1/z at the corners */
} edges;

static edges make_edges(const raster *r, const piece *p) {
    corner v[3] = {r->corners[p->corner[0]], r->corners[p->corner[1]], r->corners[p->corner[2]]};
    if (area2(v[0], v[1], v[2]) < 0) {
        corner swap = v[1];
        v[1] = v[2], v[2] = swap;
    }
    edges e = {.origin = v[0], .z0 = v[0].depth};
    double area = (double)area2(v[0], v[1], v[2]);
    double z1 = (double)v[1].depth - v[0].depth, z2 = (double)v[2].depth - v[0].depth;
    e.zx = (z1 * (v[2].y - v[0].y) - z2 * (v[1].y - v[0].y)) / area;
    e.zy = (z2 * (v[1].x - v[0].x) - z1 * (v[2].x - v[0].x)) / area;
    e.low = fminf(v[0].depth, fminf(v[1].depth, v[2].depth));
    e.high = fmaxf(v[0].depth, fmaxf(v[1].depth, v[2].depth));
    for (int i = 0; i < 3; ++i) {
        corner s = v[i], t = v[(i + 1) % 3];
        e.a[i] = (int64_t)s.y - t.y;
        e.b[i] = (int64_t)t.x - s.x;
        e.c[i] = -(e.a[i] * s.x + e.b[i] * s.y);
        /* A sample on a side belongs to the face on one side of it, told by the side's direction. */
        bool owner = e.a[i] > 0 || (e.a[i] == 0 && e.b[i] > 0);
        if (!owner) --e.c[i];
    }
    return e;
}

/* Pixels [*begin, *end) whose sample on the sub-row at y, shifted by `shift`, is covered. */
static void find_span(const edges *e, int64_t y, int64_t shift, int64_t width, int64_t *begin, int64_t *end) {
    *begin = 0, *end = width;
    for (int i = 0; i < 3; ++i) {
        int64_t a = e->a[i], k = a * shift + e->b[i] * y + e->c[i];
        if (a > 0) {
            int64_t low = -floor_div(k, a * ONE);
            if (low > *begin) *begin = low;
        } else if (a < 0) {
            int64_t high = floor_div(k, -a * ONE) + 1;
            if (high < *end) *end = high;
        } else if (k < 0) {
            *end = 0;
        }
    }
}

static void fill_span(float *restrict depth, uint32_t *restrict seen, int64_t count, float z, float step,
                      float low, float high, uint32_t number) {
    for (int64_t i = 0; i < count; ++i) {
        float here = z + (float)(int32_t)i * step;
        here = here < low ? low : here > high ? high : here;
        bool nearer = here > depth[i];
        depth[i] = nearer ? here : depth[i];
        seen[i] = nearer ? number : seen[i];
    }
}

static void draw_piece(raster *r, uint32_t number, int64_t band_begin, int64_t band_end) {
    const piece *p = r->pieces + number;
    int64_t begin, end, width = r->camera->width;
    piece_rows(r, p, &begin, &end);
    if (begin < band_begin) begin = band_begin;
    if (end > band_end) end = band_end;
    edges e = make_edges(r, p);
    for (int64_t row = begin; row < end; ++row) {
        int64_t y = row_y(r, row), shift = r->shift[row % r->camera->samples], x0, x1;
        find_span(&e, y, shift, width, &x0, &x1);
        if (x0 >= x1) continue;
        double z = e.z0 + e.zx * (double)(x0 * ONE + shift - e.origin.x) + e.zy * (double)(y - e.origin.y);
        size_t at = (size_t)((row - band_begin) * width + x0);
        fill_span(r->depth + at, r->seen + at, x1 - x0, (float)z, (float)(e.zx * ONE), e.low, e.high, number);
    }
}

/* Barycentric coordinates along a ray r of camera space are n_i . r over their sum, n_i = v_j x v_k. */
typedef struct plane {
    uint32_t face;
    double n[3][3], sum[3];
    bool back;
} plane;

static plane make_plane(const raster *r, uint32_t face) {
    plane out = {.face = face};
    double v[3][3];
    for (int i = 0; i < 3; ++i)
        to_camera(r->camera, r->mesh->positions + 3 * (size_t)r->mesh->triangles[3 * (size_t)face + i], v[i]);
    for (int i = 0; i < 3; ++i) {
        const double *a = v[(i + 1) % 3], *b = v[(i + 2) % 3];
        for (int k = 0; k < 3; ++k) {
            int k1 = (k + 1) % 3, k2 = (k + 2) % 3;
            out.n[i][k] = a[k1] * b[k2] - a[k2] * b[k1];
            out.sum[k] += out.n[i][k];
        }
    }
    /* x right, y up, z forward is left-handed: the front is where the volume v0 . (v1 x v2) is positive. */
    out.back = v[0][0] * out.n[0][0] + v[0][1] * out.n[0][1] + v[0][2] * out.n[0][2] < 0;
    return out;
}

/* The point of a plane under the picture's (x, y), pulled into the face where rounding has left it. */
static raster_point find_point(const raster_camera *camera, const plane *p, double x, double y) {
    double ray[3] = {(x - .5 * camera->width) / camera->focal, (.5 * camera->height - y) / camera->focal, 1};
    double sum = p->sum[0] * ray[0] + p->sum[1] * ray[1] + p->sum[2] * ray[2];
    raster_point point = {.face = p->face, .back = p->back};
    double total = 0;
    for (int i = 0; i < 3; ++i) {
        const double *n = p->n[i];
        double along = n[0] * ray[0] + n[1] * ray[1] + n[2] * ray[2], slope = hypot(n[0], n[1]),
               w = along / sum;
        point.side[i] = w > 0 && slope > 0 ? camera->focal * fabs(along) / slope : 0;
        w = w > 0 ? w < 1 ? w : 1 : 0; /* a NaN becomes 0 too */
        point.weight[i] = w;
        total += w;
    }
    for (int i = 0; i < 3; ++i) point.weight[i] = total > 0 ? point.weight[i] / total : 1. / 3;
    return point;
}

typedef struct share {
    uint32_t piece, count;
    double x, y; /* sums over the samples, in the pixel */
} share;

/* Which pieces the samples of one pixel see. */
static int find_shares(const raster *r, const uint32_t *seen, share *shares) {
    uint32_t samples = r->camera->samples;
    int count = 0;
    for (uint32_t j = 0; j < samples; ++j) {
        uint32_t number = seen[(size_t)j * r->camera->width];
        if (number == FCT_NONE) continue;
        int i = count - 1;
        while (i >= 0 && shares[i].piece != number) --i;
        if (i < 0) shares[i = count++] = (share){.piece = number};
        ++shares[i].count;
        shares[i].x += r->shift[j];
        shares[i].y += r->rise[j];
    }
    return count;
}

static void resolve_band(const raster *r, uint32_t y0, uint32_t y1, raster_shade *shade, void *user,
                         float *image) {
    uint32_t width = r->camera->width, samples = r->camera->samples;
    plane cached = {.face = FCT_NONE};
    for (uint32_t y = y0; y < y1; ++y)
        for (uint32_t x = 0; x < width; ++x) {
            share shares[RASTER_MAX_SAMPLES];
            int count = find_shares(r, r->seen + (size_t)(y - y0) * samples * width + x, shares);
            float *pixel = image + 4 * ((size_t)y * width + x);
            memset(pixel, 0, 4 * sizeof *pixel);
            for (int i = 0; i < count; ++i) {
                uint32_t face = r->pieces[shares[i].piece].face;
                if (cached.face != face) cached = make_plane(r, face);
                double scale = 1. / ((double)ONE * shares[i].count);
                raster_point point =
                    find_point(r->camera, &cached, x + shares[i].x * scale, y + shares[i].y * scale);
                float rgb[3], part = (float)shares[i].count / (float)samples;
                shade(user, &point, rgb);
                for (int k = 0; k < 3; ++k) pixel[k] += part * rgb[k];
                pixel[3] += part;
            }
        }
}

static int draw_bands(raster *r, raster_shade *shade, void *user, float *image) {
    uint32_t width = r->camera->width, height = r->camera->height, samples = r->camera->samples;
    size_t count = (size_t)BAND * samples * width;
    r->depth = tool_allocate(r->t, count, sizeof *r->depth);
    r->seen = tool_allocate(r->t, count, sizeof *r->seen);
    if (!r->depth || !r->seen) return TOOL_MEMORY;
    for (uint32_t y0 = 0, band = 0; y0 < height; y0 += BAND, ++band) {
        const fct_env *env = &r->t->env;
        if (env->progress && !env->progress(env->progress_user, "draw", (double)y0 / height))
            return TOOL_CANCELLED;
        memset(r->depth, 0, count * sizeof *r->depth);
        memset(r->seen, 0xff, count * sizeof *r->seen);
        int64_t begin = (int64_t)y0 * samples, end = begin + (int64_t)BAND * samples;
        if (end > (int64_t)height * samples) end = (int64_t)height * samples;
        for (size_t i = r->band_first[band]; i < r->band_first[band + 1]; ++i)
            draw_piece(r, r->band_pieces[i], begin, end);
        resolve_band(r, y0, (uint32_t)(end / samples), shade, user, image);
    }
    return TOOL_DONE;
}

static void place_samples(raster *r) {
    uint32_t n = r->camera->samples;
    for (uint32_t j = 0; j < n; ++j) {
        double x = 0, half = .5;
        for (uint32_t bits = j; bits; bits >>= 1, half *= .5) x += (bits & 1) * half;
        r->shift[j] = (int32_t)(ONE * (x + .5 / n)) & (ONE - 1);
        r->rise[j] = (int32_t)((2 * j + 1) * ONE / (2 * n));
    }
}

int raster_draw(tool *t, const raster_camera *camera, const fct_mesh *mesh, raster_shade *shade, void *user,
                float *image) {
    raster r = {.t = t, .camera = camera, .mesh = mesh};
    r.guard[0] = r.guard[1] = RASTER_MAX_SIZE / camera->focal;
    place_samples(&r);
    int result = project_vertices(&r);
    if (result == TOOL_DONE) result = make_pieces(&r);
    if (result == TOOL_DONE) result = sort_into_bands(&r);
    if (result == TOOL_DONE) result = draw_bands(&r, shade, user, image);
    tool_release(t, r.corners);
    tool_release(t, r.out);
    tool_release(t, r.pieces);
    tool_release(t, r.band_first);
    tool_release(t, r.band_pieces);
    tool_release(t, r.depth);
    tool_release(t, r.seen);
    return result;
}
