/* cluster/large/cut.c: cuts a mesh along a space-filling curve into parts of a given size.
 *
 * 1. Each vertex gets its number on a Hilbert curve through 1024^3 cells of the model's cube. A face has the
 *    number of its first vertex.
 * 2. A pass over the faces counts the faces in each of 2^20 stretches of the curve.
 * 3. Consecutive stretches with about part_faces faces become one part.
 * 4. A second pass writes each face to the spool, in runs of one part.
 *
 * If the faces of a group of stretches exceed a part by a quarter, further faces go to a new part, in the
 * order of the file. Memory: 6 bytes per vertex and buffers.
 */
#include <math.h>
#include <string.h>

#include "base/parallel.h"
#include "cluster/large/large.h"

enum {
    BITS = FCT_CURVE_BITS,
    STRETCH_BITS = 20,
    STRETCHES = 1 << STRETCH_BITS,
    PAGE = 256, /* stretches */
    PAGES = STRETCHES / PAGE,
    ROWS = 1 << 16
};

typedef struct cutter {
    fct_large *large;
    uint32_t *codes;  /* per vertex: number on the curve */
    uint16_t *owners; /* per vertex: part of its first face; UINT16_MAX: none yet */
    uint32_t *pages;  /* per page of stretches: 1 + its place in counts; 0: no face has its stretches */
    uint32_t *counts; /* per stretch of these pages: number of faces, later the stretch's group */
    size_t page_count, count_capacity;
    uint32_t *used; /* one bit per vertex: a face uses it */
    float *positions;
    uint32_t *triangles, *materials; /* room for ROWS faces */
    uint32_t *corners;               /* likewise: triangles of the input, if vertices are joined */
    double origin[3], scale;
    uint32_t first;                 /* vertex of the block that code_vertices works on */
    uint32_t *current, group_count; /* per group of stretches: the part that receives its faces */
    uint32_t run_rows, row_words;   /* faces per buffer, words per face */
    uint32_t *buffers, *fills;      /* per part: run_rows faces, faces in use */
    size_t buffer_capacity, fill_capacity;
} cutter;

/* 1. From the root of the octree down, exchange and invert the lower bits of the coordinates, as the curve is
 *    mirrored and turned in each octant.
 * 2. Undo the Gray code.
 * 3. Interleave the bits of the three coordinates. */
uint32_t fct_curve_code(uint32_t x[3]) {
    for (uint32_t q = 1u << (BITS - 1); q > 1; q >>= 1) {
        uint32_t p = q - 1;
        for (int i = 0; i < 3; ++i)
            if (x[i] & q) {
                x[0] ^= p;
            } else {
                uint32_t t = (x[0] ^ x[i]) & p;
                x[0] ^= t, x[i] ^= t;
            }
    }
    x[1] ^= x[0], x[2] ^= x[1];
    uint32_t flips = 0, code = 0;
    for (uint32_t q = 1u << (BITS - 1); q > 1; q >>= 1)
        if (x[2] & q) flips ^= q - 1;
    for (int i = 0; i < 3; ++i) x[i] ^= flips;
    for (int bit = BITS - 1; bit >= 0; --bit)
        for (int i = 0; i < 3; ++i) code = code << 1 | (x[i] >> bit & 1);
    return code;
}

static void code_vertices(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    cutter *c = user;
    for (size_t v = begin; v < end; ++v) {
        uint32_t cell[3];
        for (size_t k = 0; k < 3; ++k) {
            double x = ((double)c->positions[3 * v + k] - c->origin[k]) * c->scale;
            cell[k] = x < 0 ? 0 : x < (1 << BITS) ? (uint32_t)x : (1 << BITS) - 1;
        }
        c->codes[c->first + v] = fct_curve_code(cell);
    }
}

static void widen(fct_bounds *b, const float *p) {
    for (int k = 0; k < 3; ++k) {
        if (p[k] < b->lower[k]) b->lower[k] = p[k];
        if (p[k] > b->upper[k]) b->upper[k] = p[k];
    }
}

static bool is_set(const uint32_t *bits, uint32_t i) {
    return bits[i / 32] >> i % 32 & 1;
}

/* Bounds of all vertices, or only of those that faces use. */
static fct_result find_bounds(cutter *c, bool used, fct_bounds *out) {
    fct_large *l = c->large;
    fct_bounds bounds = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    for (uint32_t v = 0; v < l->info.vertex_count; v += ROWS) {
        uint32_t rows = l->info.vertex_count - v < ROWS ? l->info.vertex_count - v : ROWS;
        fct_result result = fct_stream_vertices(l->stream, v, rows, c->positions, NULL);
        if (result != FCT_OK) return result;
        for (uint32_t i = 0; i < rows; ++i)
            if (!used || is_set(c->used, v + i)) widen(&bounds, c->positions + 3 * (size_t)i);
    }
    *out = bounds;
    return FCT_OK;
}

static fct_result find_codes(cutter *c) {
    fct_large *l = c->large;
    double extent = 0;
    for (int k = 0; k < 3; ++k) {
        c->origin[k] = (double)l->all_bounds.lower[k];
        extent = fmax(extent, (double)l->all_bounds.upper[k] - c->origin[k]);
    }
    c->scale = extent > 0 ? (1 << BITS) / extent : 0;
    for (uint32_t v = 0; v < l->info.vertex_count; v += ROWS) {
        uint32_t rows = l->info.vertex_count - v < ROWS ? l->info.vertex_count - v : ROWS;
        fct_result result = fct_stream_vertices(l->stream, v, rows, c->positions, NULL);
        if (result == FCT_OK) result = fct_progress(l->env, "cut", 0.2 * v / l->info.vertex_count);
        if (result != FCT_OK) return result;
        c->first = v;
        fct_parallel_for(l->env, rows, 4096, code_vertices, c);
    }
    return FCT_OK;
}

static uint32_t stretch_of(const cutter *c, uint32_t vertex) {
    return c->codes[vertex] >> (3 * BITS - STRETCH_BITS);
}

/* The entry of counts of the stretch of a vertex whose page exists. */
static uint32_t *count_of(const cutter *c, uint32_t vertex) {
    uint32_t stretch = stretch_of(c, vertex);
    return &c->counts[(size_t)(c->pages[stretch / PAGE] - 1) * PAGE + stretch % PAGE];
}

static fct_result add_page(cutter *c, uint32_t page) {
    if (c->pages[page]) return FCT_OK;
    fct_result result = fct_grow(c->large->env, (void **)&c->counts, &c->count_capacity,
                                 (c->page_count + 1) * PAGE, sizeof *c->counts);
    if (result != FCT_OK) return result;
    memset(c->counts + c->page_count * PAGE, 0, PAGE * sizeof *c->counts);
    c->pages[page] = (uint32_t)++c->page_count;
    return FCT_OK;
}

/* Reads faces [first, first + count). */
static fct_result read_faces(cutter *c, uint32_t first, uint32_t count) {
    fct_large *l = c->large;
    uint32_t *input = l->joined ? c->corners : c->triangles;
    fct_result result = fct_stream_faces(l->stream, first, count, input, c->materials);
    if (result != FCT_OK || !l->joined) return result;
    return fct_spool_read(&l->welded, 12 * (uint64_t)first, c->triangles, 12 * (size_t)count);
}

/* Counts the faces of each stretch, marks used vertices, and raises material_count to the highest id + 1. */
static fct_result count_faces(cutter *c) {
    fct_large *l = c->large;
    for (uint32_t f = 0; f < l->info.face_count; f += ROWS) {
        uint32_t rows = l->info.face_count - f < ROWS ? l->info.face_count - f : ROWS;
        fct_result result = read_faces(c, f, rows);
        if (result == FCT_OK) result = fct_progress(l->env, "cut", 0.2 + 0.3 * f / l->info.face_count);
        if (result != FCT_OK) return result;
        for (size_t i = 0; i < 3 * (size_t)rows; ++i)
            c->used[c->triangles[i] / 32] |= 1u << c->triangles[i] % 32;
        for (size_t i = 0; i < rows; ++i) {
            result = add_page(c, stretch_of(c, c->triangles[3 * i]) / PAGE);
            if (result != FCT_OK) return result;
            ++*count_of(c, c->triangles[3 * i]);
            if (c->materials && c->materials[i] >= l->info.material_count)
                l->info.material_count = c->materials[i] + 1;
        }
    }
    return FCT_OK;
}

/* Groups consecutive stretches so that all groups have about the same number of faces. */
static fct_result cut_curve(cutter *c) {
    fct_large *l = c->large;
    uint64_t faces = l->info.face_count, groups = (faces + l->part_faces - 1) / l->part_faces, before = 0;
    if (groups > STRETCHES) groups = STRETCHES;
    for (uint32_t p = 0; p < PAGES; ++p)
        for (uint32_t s = 0; s < PAGE && c->pages[p]; ++s) {
            uint32_t *entry = &c->counts[(size_t)(c->pages[p] - 1) * PAGE + s], count = *entry;
            *entry = (uint32_t)((before + count / 2) * groups / faces);
            before += count;
        }
    c->group_count = (uint32_t)groups;
    c->current = fct_allocate(l->env, c->group_count, sizeof *c->current);
    if (!c->current) return fct_fail_memory(l->env, "the parts of a mesh");
    memset(c->current, 0xFF, groups * sizeof *c->current);
    c->row_words = fct_large_row_words(l);
    uint64_t buffers = l->budget / 8 < 32 << 20 ? l->budget / 8 : 32 << 20;
    uint64_t rows = buffers / (groups * c->row_words * 4);
    c->run_rows = (uint32_t)(rows < 16 ? 16 : rows > 8192 ? 8192 : rows);
    return FCT_OK;
}

static fct_result flush(cutter *c, uint32_t part) {
    fct_large *l = c->large;
    if (!c->fills[part]) return FCT_OK;
    fct_result result =
        fct_grow(l->env, (void **)&l->runs, &l->run_capacity, l->run_count + 1, sizeof *l->runs);
    if (result != FCT_OK) return result;
    l->runs[l->run_count++] = (fct_face_run){l->faces.size, part, c->fills[part]};
    size_t words = (size_t)c->row_words * c->run_rows;
    result =
        fct_spool_append(&l->faces, c->buffers + part * words, 4 * (size_t)c->fills[part] * c->row_words);
    c->fills[part] = 0;
    return result;
}

static fct_result add_part(cutter *c) {
    fct_large *l = c->large;
    if (l->part_count >= UINT16_MAX)
        return fct_fail(l->env, FCT_ERROR_MEMORY, "parts of %u faces are too small for this mesh",
                        l->part_faces);
    fct_result result =
        fct_grow(l->env, (void **)&l->parts, &l->part_capacity, l->part_count + 1, sizeof *l->parts);
    if (result == FCT_OK)
        result = fct_grow(l->env, (void **)&c->buffers, &c->buffer_capacity, l->part_count + 1,
                          (size_t)c->row_words * c->run_rows * 4);
    if (result == FCT_OK)
        result = fct_grow(l->env, (void **)&c->fills, &c->fill_capacity, l->part_count + 1, sizeof *c->fills);
    if (result != FCT_OK) return result;
    c->fills[l->part_count] = 0;
    l->parts[l->part_count++] = (fct_part){0};
    return FCT_OK;
}

static fct_result put_face(cutter *c, uint32_t face, size_t row) {
    fct_large *l = c->large;
    const uint32_t *t = c->triangles + 3 * row;
    uint32_t *current = &c->current[*count_of(c, t[0])];
    if (*current == FCT_NONE || l->parts[*current].face_count >= l->part_faces + l->part_faces / 4) {
        fct_result result = *current == FCT_NONE ? FCT_OK : flush(c, *current);
        if (result == FCT_OK) result = add_part(c);
        if (result != FCT_OK) return result;
        *current = (uint32_t)l->part_count - 1;
    }
    uint32_t part = *current;
    uint32_t *to = c->buffers + (size_t)c->row_words * ((size_t)part * c->run_rows + c->fills[part]);
    to[0] = face, to[1] = t[0], to[2] = t[1], to[3] = t[2];
    if (l->joined) memcpy(to + 4, c->corners + 3 * row, 12);
    if (c->materials) to[c->row_words - 1] = c->materials[row];
    for (int k = 0; k < 3; ++k) {
        uint16_t *owner = &c->owners[t[k]];
        if (*owner == UINT16_MAX)
            *owner = (uint16_t)part;
        else if (*owner != part)
            l->shared[t[k] / 32] |= 1u << t[k] % 32;
    }
    ++l->parts[part].face_count;
    return ++c->fills[part] == c->run_rows ? flush(c, part) : FCT_OK;
}

static fct_result spool_faces(cutter *c) {
    fct_large *l = c->large;
    fct_result result = FCT_OK;
    for (uint32_t f = 0; f < l->info.face_count && result == FCT_OK; f += ROWS) {
        uint32_t rows = l->info.face_count - f < ROWS ? l->info.face_count - f : ROWS;
        result = read_faces(c, f, rows);
        if (result == FCT_OK) result = fct_progress(l->env, "cut", 0.5 + 0.5 * f / l->info.face_count);
        for (uint32_t i = 0; i < rows && result == FCT_OK; ++i) result = put_face(c, f + i, i);
    }
    for (uint32_t p = 0; p < l->part_count && result == FCT_OK; ++p) result = flush(c, p);
    return result;
}

static fct_result cut(cutter *c) {
    fct_large *l = c->large;
    fct_result result = find_bounds(c, false, &l->all_bounds);
    if (result == FCT_OK) result = find_codes(c);
    if (result == FCT_OK) result = count_faces(c);
    if (result == FCT_OK) result = find_bounds(c, true, &l->bounds);
    if (result == FCT_OK) result = cut_curve(c);
    if (result == FCT_OK) result = fct_spool_open(l->env, l->folder, l->path, &l->faces);
    return result == FCT_OK ? spool_faces(c) : result;
}

fct_result fct_large_cut(fct_large *large) {
    const fct_env *env = large->env;
    size_t vertices = large->info.vertex_count, words = vertices / 32 + 1;
    cutter c = {.large = large};
    c.codes = fct_allocate(env, vertices, sizeof *c.codes);
    c.owners = fct_allocate(env, vertices, sizeof *c.owners);
    c.pages = fct_allocate_zero(env, PAGES, sizeof *c.pages);
    c.used = fct_allocate_zero(env, words, sizeof *c.used);
    large->shared = fct_allocate_zero(env, words, sizeof *large->shared);
    c.positions = fct_allocate(env, ROWS, 3 * sizeof *c.positions);
    c.triangles = fct_allocate(env, ROWS, 3 * sizeof *c.triangles);
    if (large->info.materials) c.materials = fct_allocate(env, ROWS, sizeof *c.materials);
    if (large->joined) c.corners = fct_allocate(env, ROWS, 3 * sizeof *c.corners);
    fct_result result;
    if (!c.codes || !c.owners || !c.pages || !c.used || !large->shared || !c.positions || !c.triangles ||
        (large->info.materials && !c.materials) || (large->joined && !c.corners)) {
        result = fct_fail_memory(env, "the parts of a mesh");
    } else {
        memset(c.owners, 0xFF, vertices * sizeof *c.owners);
        result = cut(&c);
    }
    fct_release(env, c.codes);
    fct_release(env, c.owners);
    fct_release(env, c.pages);
    fct_release(env, c.counts);
    fct_release(env, c.used);
    fct_release(env, c.positions);
    fct_release(env, c.triangles);
    fct_release(env, c.materials);
    fct_release(env, c.corners);
    fct_spool_close(&large->welded);
    fct_release(env, c.current);
    fct_release(env, c.buffers);
    fct_release(env, c.fills);
    return result;
}
