/* tools/render/raster.c: see raster.h. Scan conversion with integer coverage.
 *
 * 1. Project the vertices, snap them to 1/4096 pixel, and clip faces against the near plane and a guard band.
 * 2. Edge functions are 64-bit integers, so each sample belongs to exactly one of two faces that share a
 *    side. A pixel has one sample per sub-row, shifted by the van der Corput sequence: sides of any slope get
 *    as many grey levels as there are samples, and a face still covers one span per sub-row.
 * 3. A sample keeps 1/z and its face. Light is computed afterwards, once per face that a pixel sees.
 * Cost: O(V + F + covered samples). Memory: 29 bytes per vertex and face, and one band of samples.
 */
#include "tools/render/raster.h"

#include <math.h>
#include <string.h>

enum {
    SUBPIXEL = 12, /* bits of a pixel's fraction */
    ONE = 1 << SUBPIXEL,
    BAND = 8,       /* rows of pixels that are drawn at a time */
    POLYGON = 3 + 5 /* corners of a triangle after five clips */
};

/* In units of the camera. */
static const double near_plane = 1e-4;

/* The planes that a corner is outside of: the four of the view, any of the guard band's four, the near plane.
 */
enum { OUT_VIEW = 15, OUT_GUARD = 16, OUT_NEAR = 32 };

typedef struct corner {
    int32_t x, y;
    float depth; /* 1/z */
} corner;

/* A face, or a triangle of a clipped face. */
typedef struct piece {
    uint32_t corner[3], face;
} piece;

typedef struct raster {
    tool *t;
    const raster_camera *camera;
    const fct_mesh *mesh;
    double guard[2]; /* slopes beyond these are clipped, in x and in y */
    int32_t shift[RASTER_MAX_SAMPLES],
        rise[RASTER_MAX_SAMPLES]; /* position of each sample in its pixel, in ONE */
    corner *corners;
    uint8_t *out;
    piece *pieces;
    size_t corner_count, corner_capacity, piece_count, piece_capacity;
    size_t *band_first;    /* per band: its first entry in band_pieces; one more at the end */
    uint32_t *band_pieces; /* piece numbers, band after band */
    float *depth;          /* BAND * samples sub-rows of width */
    uint32_t *seen;        /* piece numbers, likewise */
} raster;

/* p: in camera space, in front of the near plane and inside the guard band. */
static corner project_corner(const raster_camera *camera, const double p[3]) {
    double x = .5 * camera->width + camera->focal * p[0] / p[2];
    double y = .5 * camera->height - camera->focal * p[1] / p[2];
    return (corner){(int32_t)lrint(x * ONE), (int32_t)lrint(y * ONE), (float)(1 / p[2])};
}

static uint8_t find_outside(const raster *r, const double p[3]) {
    double x = .5 * r->camera->width / r->camera->focal * p[2];
    double y = .5 * r->camera->height / r->camera->focal * p[2];
    unsigned out = (p[0] > x) | (p[0] < -x) << 1 | (p[1] > y) << 2 | (p[1] < -y) << 3;
    if (fabs(p[0]) > r->guard[0] * p[2] || fabs(p[1]) > r->guard[1] * p[2]) out |= OUT_GUARD;
    if (p[2] < near_plane) out |= OUT_NEAR;
    return (uint8_t)out;
}

static int reserve_array(tool *t, void **array, size_t *capacity, size_t needed, size_t size) {
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
        raster_to_camera(r->camera, mesh->positions + 3 * (size_t)v, p);
        r->out[v] = find_outside(r, p);
        if (!(r->out[v] & (OUT_GUARD | OUT_NEAR))) r->corners[v] = project_corner(r->camera, p);
    }
    r->corner_count = mesh->vertex_count;
    return TOOL_DONE;
}

static int64_t find_twice_area(corner a, corner b, corner c) {
    return (int64_t)(b.x - a.x) * (c.y - a.y) - (int64_t)(c.x - a.x) * (b.y - a.y);
}

/* Sub-rows are numbered through the picture from its top. */
static int64_t find_row_y(const raster *r, int64_t row) {
    return (row / r->camera->samples) * ONE + r->rise[row % r->camera->samples];
}

/* The first sub-row at or below y, within the picture. */
static int64_t find_first_row(const raster *r, int64_t y) {
    int64_t end = (int64_t)r->camera->height * r->camera->samples;
    int64_t row = y <= 0 ? 0 : (y >> SUBPIXEL) * r->camera->samples;
    while (row < end && find_row_y(r, row) < y) ++row;
    return row < end ? row : end;
}

static void find_piece_rows(const raster *r, const piece *p, int64_t *begin, int64_t *end) {
    int32_t low = INT32_MAX, high = INT32_MIN;
    for (int i = 0; i < 3; ++i) {
        int32_t y = r->corners[p->corner[i]].y;
        if (y < low) low = y;
        if (y > high) high = y;
    }
    *begin = find_first_row(r, low);
    *end = find_first_row(r, (int64_t)high + 1);
}

/* Adds the piece unless it covers no sample row or is culled. */
static int add_piece(raster *r, piece p) {
    int64_t area = find_twice_area(r->corners[p.corner[0]], r->corners[p.corner[1]], r->corners[p.corner[2]]);
    /* y points down in the picture, so a counter-clockwise face has a negative area. */
    if (area == 0 || (r->camera->cull && area > 0)) return TOOL_DONE;
    int64_t begin, end;
    find_piece_rows(r, &p, &begin, &end);
    if (begin >= end) return TOOL_DONE;
    int result = reserve_array(r->t, (void **)&r->pieces, &r->piece_capacity, r->piece_count + 1, sizeof p);
    if (result == TOOL_DONE) r->pieces[r->piece_count++] = p;
    return result;
}

/* Clips a convex polygon of *count corners to a.x >= offset. The cut of a side depends only on its ends, so
 * that neighbours stay watertight. */
static void clip_polygon(double polygon[POLYGON][3], int *count, const double a[3], double offset) {
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
        raster_to_camera(r->camera, r->mesh->positions + 3 * (size_t)r->mesh->triangles[3 * (size_t)face + i],
                         polygon[i]);
    double gx = r->guard[0], gy = r->guard[1];
    clip_polygon(polygon, &count, (double[3]){0, 0, 1}, near_plane);
    clip_polygon(polygon, &count, (double[3]){-1, 0, gx}, 0);
    clip_polygon(polygon, &count, (double[3]){1, 0, gx}, 0);
    clip_polygon(polygon, &count, (double[3]){0, -1, gy}, 0);
    clip_polygon(polygon, &count, (double[3]){0, 1, gy}, 0);
    if (count < 3) return TOOL_DONE;
    size_t first = r->corner_count;
    int result = reserve_array(r->t, (void **)&r->corners, &r->corner_capacity, first + (size_t)count,
                               sizeof *r->corners);
    for (int i = 0; i < count && result == TOOL_DONE; ++i)
        r->corners[r->corner_count++] = project_corner(r->camera, polygon[i]);
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

/* Lists the pieces of each band in ascending order. */
static int sort_into_bands(raster *r) {
    int64_t band_rows = (int64_t)BAND * r->camera->samples;
    size_t bands = (r->camera->height + BAND - 1) / BAND;
    r->band_first = tool_allocate(r->t, bands + 2, sizeof *r->band_first);
    if (!r->band_first) return TOOL_MEMORY;
    memset(r->band_first, 0, (bands + 2) * sizeof *r->band_first);
    for (int fill = 0; fill < 2; ++fill) {
        for (size_t i = 0; i < r->piece_count; ++i) {
            int64_t begin, end;
            find_piece_rows(r, r->pieces + i, &begin, &end);
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

/* Factor on 1/z of faces that show their back. Where the two sides of a surface are separate faces in one
 * place, the front covers the back. */
#define BACK_DEPTH (1 - 4e-6f)

static edges make_edges(const raster *r, const piece *p) {
    corner v[3] = {r->corners[p->corner[0]], r->corners[p->corner[1]], r->corners[p->corner[2]]};
    if (find_twice_area(v[0], v[1], v[2]) < 0) {
        corner swap = v[1];
        v[1] = v[2], v[2] = swap;
    } else {
        for (int i = 0; i < 3; ++i) v[i].depth *= BACK_DEPTH;
    }
    edges e = {.origin = v[0], .z0 = v[0].depth};
    double area = (double)find_twice_area(v[0], v[1], v[2]);
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
        /* A sample exactly on a side belongs to one of its two faces, chosen by the direction of the side. */
        bool owner = e.a[i] > 0 || (e.a[i] == 0 && e.b[i] > 0);
        if (!owner) --e.c[i];
    }
    return e;
}

/* Sets [*begin, *end) to the pixels whose sample on the sub-row at y is covered. shift is the x of the
 * sample within its pixel. */
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
    find_piece_rows(r, p, &begin, &end);
    if (begin < band_begin) begin = band_begin;
    if (end > band_end) end = band_end;
    edges e = make_edges(r, p);
    for (int64_t row = begin; row < end; ++row) {
        int64_t y = find_row_y(r, row), shift = r->shift[row % r->camera->samples], x0, x1;
        find_span(&e, y, shift, width, &x0, &x1);
        if (x0 >= x1) continue;
        double z = e.z0 + e.zx * (double)(x0 * ONE + shift - e.origin.x) + e.zy * (double)(y - e.origin.y);
        size_t at = (size_t)((row - band_begin) * width + x0);
        fill_span(r->depth + at, r->seen + at, x1 - x0, (float)z, (float)(e.zx * ONE), e.low, e.high, number);
    }
}

typedef struct share {
    uint32_t piece, count;
    double x, y; /* sums over the samples, in the pixel */
} share;

/* Lists the pieces that the samples of one pixel see. */
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
    raster_plane cached = {.face = FCT_NONE};
    for (uint32_t y = y0; y < y1; ++y)
        for (uint32_t x = 0; x < width; ++x) {
            share shares[RASTER_MAX_SAMPLES];
            int count = find_shares(r, r->seen + (size_t)(y - y0) * samples * width + x, shares);
            float *pixel = image + 4 * ((size_t)y * width + x);
            memset(pixel, 0, 4 * sizeof *pixel);
            for (int i = 0; i < count; ++i) {
                uint32_t face = r->pieces[shares[i].piece].face;
                if (cached.face != face) cached = raster_make_plane(r->camera, r->mesh, face);
                double scale = 1. / ((double)ONE * shares[i].count);
                raster_point point =
                    raster_find_point(r->camera, &cached, x + shares[i].x * scale, y + shares[i].y * scale);
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

/* Sample j lies on sub-row j, at the j-th number of the van der Corput sequence in x. */
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
