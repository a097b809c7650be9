/* mesh/stream.c: see stream.h.
 *
 * A PLY is read in place if its header and its size determine the layout: it is binary, vertex records have
 * one size, and the file has the size for three corners per face. Reading checks each face, because a face of
 * two corners can hide one of four. The code that reads whole files converts the rows.
 */
#define _GNU_SOURCE
#include "mesh/stream.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include "mesh/color.h"
#include "mesh/mesh.h"
#include "mesh/ply/bind.h"
#include "mesh/ply/value.h"

enum { ROWS = 8192, HEADER_MOST = 1 << 24 };

/* An element of a PLY whose records lie at offset + i * size. */
typedef struct table {
    uint64_t offset;
    size_t size;
    const fct_ply_property *properties;
    size_t *offsets; /* of the properties' values in a record */
    fct_ply_target target;
} table;

struct fct_stream {
    const fct_env *env;
    char *name;
    fct_stream_info info;
    uint32_t material_limit;
    /* a PLY read in place */
    int descriptor; /* below zero: a spool */
    char *header_text;
    fct_ply_header header;
    table vertices, faces;
    fct_soup rows; /* values of ROWS records */
    unsigned char *buffer;
    bool swap;
    bool byte_colors; /* the colours are floats from 0 to 255 */
    /* or a spool: positions, triangles, colours, materials */
    fct_spool spool;
    uint64_t triangles_at, colors_at, materials_at;
    char **names; /* of materials */
};

static fct_result fail_read(const fct_stream *s) {
    return fct_fail(s->env, FCT_ERROR_INPUT, "%s: cannot be read: %s", s->name,
                    errno ? strerror(errno) : "it became shorter");
}

static fct_result read_bytes(const fct_stream *s, uint64_t offset, void *data, size_t size) {
    size_t got;
    errno = 0;
    return fct_read_at(s->descriptor, offset, data, size, &got) && got == size ? FCT_OK : fail_read(s);
}

/* --- Layout of a PLY --- */

/* The size of a record, and the offsets in it. Returns 0 if the sizes of records differ. */
static size_t record_size(const fct_ply_header *h, const fct_ply_element *element, size_t *offsets) {
    size_t size = 0;
    bool faces = fct_ply_kind_of(element) == FCT_PLY_FACES;
    for (size_t i = 0; i < element->property_count; ++i) {
        const fct_ply_property *p = &h->properties[element->first_property + i];
        size_t count = 1;
        if (p->count_type != FCT_PLY_NONE) {
            bool corners = fct_text_word_is(p->name, p->name_length, "vertex_indices") ||
                           fct_text_word_is(p->name, p->name_length, "vertex_index");
            bool places = fct_text_word_is(p->name, p->name_length, "texcoord");
            if (!faces || (!corners && !places)) return 0;
            size += fct_ply_size(p->count_type);
            count = corners ? 3 : 6;
        }
        if (offsets) offsets[i] = size;
        size += count * fct_ply_size(p->type);
    }
    return size;
}

static fct_result bind(fct_stream *s, const fct_text *t, const fct_ply_element *element, table *out) {
    fct_ply_element rows = *element; /* values of so many records at a time */
    float *texcoords = NULL;
    rows.count = ROWS;
    out->properties = s->header.properties + element->first_property;
    out->offsets = fct_allocate(s->env, element->property_count, sizeof *out->offsets);
    if (!out->offsets) return fct_fail_memory(s->env, "a PLY header");
    out->size = record_size(&s->header, element, out->offsets);
    fct_result result = fct_ply_bind(t, &s->header, &rows, &s->rows, &texcoords, &out->target);
    size_t kept = 0; /* columns of positions and of vertices' colours */
    for (size_t i = 0; i < out->target.column_count; ++i) {
        const fct_ply_column *c = &out->target.columns[i];
        bool position = s->rows.positions && c->to >= s->rows.positions && c->to < s->rows.positions + 3;
        bool color = s->rows.colors && c->to >= s->rows.colors && c->to < s->rows.colors + 3;
        if (position || color) out->target.columns[kept++] = *c;
    }
    out->target.column_count = kept;
    fct_release(s->env, texcoords);
    return result;
}

/* Whether the file can be read in place; finds where its elements lie. */
static bool lay_out(fct_stream *s, uint64_t body, uint64_t file_size) {
    const fct_ply_header *h = &s->header;
    bool vertices = false, faces = false;
    uint64_t at = body;
    if (h->format == FCT_PLY_ASCII) return false;
    for (size_t i = 0; i < h->element_count; ++i) {
        const fct_ply_element *element = &h->elements[i];
        fct_ply_kind kind = fct_ply_kind_of(element);
        size_t size = record_size(h, element, NULL);
        if (kind == FCT_PLY_STRIPS || !size || element->count > FCT_MESH_LIMIT) return false;
        if (element->count > (file_size - at) / size) return false;
        if ((kind == FCT_PLY_VERTICES && vertices) || (kind == FCT_PLY_FACES && faces)) return false;
        if (kind == FCT_PLY_VERTICES)
            vertices = true, s->vertices.offset = at, s->info.vertex_count = (uint32_t)element->count;
        if (kind == FCT_PLY_FACES)
            faces = true, s->faces.offset = at, s->info.face_count = (uint32_t)element->count;
        at += element->count * size;
    }
    return vertices && faces && at == file_size;
}

static fct_result open_tables(fct_stream *s, const fct_text *t) {
    fct_result result = FCT_OK;
    for (size_t i = 0; result == FCT_OK && i < s->header.element_count; ++i) {
        fct_ply_kind kind = fct_ply_kind_of(&s->header.elements[i]);
        if (kind == FCT_PLY_VERTICES) result = bind(s, t, &s->header.elements[i], &s->vertices);
        if (kind == FCT_PLY_FACES) result = bind(s, t, &s->header.elements[i], &s->faces);
    }
    if (result != FCT_OK) return result;
    size_t row = s->vertices.size > s->faces.size ? s->vertices.size : s->faces.size;
    s->buffer = fct_allocate(s->env, ROWS, row);
    if (!s->buffer) return fct_fail_memory(s->env, "a buffer");
    s->info.colors = s->rows.colors != NULL;
    s->info.materials = s->rows.materials != NULL;
    s->info.material_names = s->header.material_names;
    s->info.material_count = (uint32_t)s->header.material_count;
    return FCT_OK;
}

/* Reads vertex rows [first, first + count) into s->buffer. count <= ROWS. */
static fct_result read_vertices(fct_stream *s, uint32_t first, uint32_t count) {
    const table *v = &s->vertices;
    return read_bytes(s, v->offset + (uint64_t)first * v->size, s->buffer, count * v->size);
}

/* The origin that the reader of whole files finds. Reads vertices until they show that there is none. */
static fct_result choose_origin(fct_stream *s) {
    table *v = &s->vertices;
    fct_extent extent = {0};
    fct_result result = FCT_OK;
    bool any = true;
    for (uint32_t at = 0; any && at < s->info.vertex_count && !extent.near && result == FCT_OK; at += ROWS) {
        uint32_t left = s->info.vertex_count - at, rows = left < ROWS ? left : ROWS;
        result = read_vertices(s, at, rows);
        if (result == FCT_OK)
            fct_ply_extend(&v->target, v->properties, s->buffer, v->size, v->offsets, s->swap, false, rows,
                           &extent);
        any = extent.any; /* false: the coordinates are floats */
    }
    if (result != FCT_OK || !fct_extent_origin(&extent, s->info.origin)) return result;
    for (size_t i = 0; i < v->target.column_count; ++i)
        for (int k = 0; k < 3; ++k)
            if ((ptrdiff_t)v->target.columns[i].property == v->target.positions[k])
                v->target.columns[i].origin = s->info.origin[k];
    return FCT_OK;
}

/* Whether colours have a type that can hold a wrong value. */
static bool has_uncertain_colors(const table *v) {
    for (size_t i = 0; i < v->target.column_count; ++i) {
        fct_ply_type type = v->properties[v->target.columns[i].property].type;
        if (v->target.columns[i].color && type != FCT_PLY_UINT8 && type != FCT_PLY_UINT16) return true;
    }
    return false;
}

/* Reads all colours that are no bytes: finds the scale of floats, and drops them if one is not finite, as the
 * reader of whole files does. */
static fct_result examine_colors(fct_stream *s) {
    const table *v = &s->vertices;
    fct_color_range range = {0};
    if (!has_uncertain_colors(v)) return FCT_OK;
    for (uint32_t at = 0; at < s->info.vertex_count; at += ROWS) {
        uint32_t left = s->info.vertex_count - at, rows = left < ROWS ? left : ROWS;
        fct_result result = read_vertices(s, at, rows);
        if (result != FCT_OK) return result;
        fct_ply_fill_columns(&v->target, v->properties, s->buffer, v->size, v->offsets, s->swap, false, 0,
                             rows);
        size_t bad = fct_first_not_finite(s->rows.colors, 3 * (size_t)rows);
        if (bad < 3 * (size_t)rows) {
            fct_note(s->env, FCT_MESSAGE_WARNING,
                     "%s: the colours are left out, because that of vertex %zu is wrong", s->name,
                     at + bad / 3);
            s->info.colors = false;
            return FCT_OK;
        }
        for (size_t i = 0; i < 3 * (size_t)rows; ++i) fct_color_range_add(&range, s->rows.colors[i]);
    }
    s->byte_colors = v->target.any_scale && fct_color_range_is_bytes(&range);
    return FCT_OK;
}

/* Reads the text of the header. *body is NULL if the first part of the file has no end of a header. */
static fct_result read_header(fct_stream *s, const char **body) {
    *body = NULL;
    for (size_t look = 4096; !*body && look <= HEADER_MOST; look *= 16) {
        size_t got;
        fct_release(s->env, s->header_text);
        s->header_text = fct_allocate(s->env, look, 1);
        if (!s->header_text) return fct_fail_memory(s->env, "a PLY header");
        errno = 0;
        if (!fct_read_at(s->descriptor, 0, s->header_text, look, &got)) return fail_read(s);
        *body = fct_ply_find_body(s->header_text, got);
        if (got < look) break;
    }
    return FCT_OK;
}

/* Opens a regular PLY file. *done: it can be read in place. */
static fct_result open_ply(fct_stream *s, bool *done) {
    struct stat status;
    const char *body;
    *done = false;
    s->descriptor = open(s->name, O_RDONLY | O_CLOEXEC);
    if (s->descriptor < 0) return fail_read(s);
    if (fstat(s->descriptor, &status) || !S_ISREG(status.st_mode)) return FCT_OK;
    if (s->env->opened) s->env->opened(s->env->opened_user, s->name, (uint64_t)status.st_size);
    fct_result result = read_header(s, &body);
    if (result != FCT_OK || !body) return result;
    fct_text t = {s->header_text, body, s->env, s->name, 1};
    result = fct_ply_read_header(&t, &s->header);
    if (result != FCT_OK) return result;
    s->swap = s->header.format == FCT_PLY_BIG;
    *done = lay_out(s, (uint64_t)(t.p - s->header_text), (uint64_t)status.st_size);
    if (*done) result = open_tables(s, &t);
    if (result == FCT_OK && *done) result = choose_origin(s);
    if (result == FCT_OK && s->info.colors) result = examine_colors(s);
    return result;
}

/* --- Other files --- */

static fct_result spool_mesh(fct_stream *s, const fct_mesh *mesh) {
    size_t vertices = mesh->vertex_count, faces = mesh->face_count;
    fct_result result = fct_spool_append(&s->spool, mesh->positions, vertices * 12);
    s->triangles_at = s->spool.size;
    if (result == FCT_OK) result = fct_spool_append(&s->spool, mesh->triangles, faces * 12);
    s->colors_at = s->spool.size;
    if (result == FCT_OK && mesh->colors) result = fct_spool_append(&s->spool, mesh->colors, vertices * 12);
    s->materials_at = s->spool.size;
    if (result == FCT_OK && mesh->materials) result = fct_spool_append(&s->spool, mesh->materials, faces * 4);
    return result;
}

static fct_result open_other(fct_stream *s, const char *folder, const char *beside) {
    fct_mesh mesh;
    fct_result result = fct_mesh_load(s->env, s->name, &mesh);
    if (result == FCT_ERROR_MEMORY)
        fct_fail(s->env, result,
                 "%s: this file is loaded as a whole; only a binary PLY of triangles is read in parts",
                 s->name);
    if (result != FCT_OK) return result;
    result = fct_spool_open(s->env, folder, beside, &s->spool);
    if (result == FCT_OK) result = spool_mesh(s, &mesh);
    s->info = (fct_stream_info){mesh.vertex_count,
                                mesh.face_count,
                                mesh.colors != NULL,
                                mesh.materials != NULL,
                                mesh.material_count,
                                mesh.material_names,
                                {mesh.origin[0], mesh.origin[1], mesh.origin[2]}};
    s->names = mesh.material_names;
    mesh.material_names = NULL;
    fct_mesh_release(s->env, &mesh);
    return result;
}

static void forget_ply(fct_stream *s) {
    if (s->descriptor >= 0) close(s->descriptor);
    s->descriptor = -1;
    fct_ply_release_header(s->env, &s->header);
    s->info = (fct_stream_info){0};
}

static fct_result new_stream(const fct_env *env, const char *path, fct_stream **out) {
    fct_stream *s = *out = fct_allocate_zero(env, 1, sizeof *s);
    if (!s) return fct_fail_memory(env, "a mesh file");
    s->env = env, s->descriptor = -1;
    s->name = fct_copy_text(env, path, strlen(path));
    return s->name ? FCT_OK : fct_fail_memory(env, "a mesh file");
}

static bool is_ply(const char *path) {
    size_t length = strlen(path);
    return length > 4 && !strcasecmp(path + length - 4, ".ply");
}

fct_result fct_mesh_file_counts(const fct_env *env, const char *path, bool *known, uint32_t *face_count,
                                uint32_t *vertex_count) {
    fct_stream *s;
    fct_result result = new_stream(env, path, &s);
    *known = false;
    if (result == FCT_OK && is_ply(path)) result = open_ply(s, known);
    if (result != FCT_OK) *known = false;
    if (*known) *face_count = s->info.face_count, *vertex_count = s->info.vertex_count;
    fct_stream_close(s);
    return result;
}

fct_result fct_stream_open(const fct_env *env, const char *path, const char *folder, const char *beside,
                           fct_stream **out) {
    fct_stream *s;
    fct_result result = new_stream(env, path, &s);
    bool done = false;
    *out = NULL;
    if (result == FCT_OK && is_ply(path)) result = open_ply(s, &done);
    if (result == FCT_OK && !done) {
        forget_ply(s);
        result = open_other(s, folder, beside);
    }
    if (result != FCT_OK) {
        fct_stream_close(s);
        return result;
    }
    s->material_limit = s->info.material_names ? s->info.material_count : s->info.face_count + 65536;
    *out = s;
    return FCT_OK;
}

void fct_stream_close(fct_stream *s) {
    if (!s) return;
    const fct_env *env = s->env;
    if (s->names) fct_names_release(env, s->names, s->info.material_count);
    forget_ply(s);
    fct_spool_close(&s->spool);
    fct_soup_release(env, &s->rows);
    fct_release(env, s->vertices.offsets);
    fct_release(env, s->faces.offsets);
    fct_release(env, s->buffer);
    fct_release(env, s->header_text);
    fct_release(env, s->name);
    fct_release(env, s);
}

fct_stream_info fct_stream_get(const fct_stream *stream) {
    return stream->info;
}

/* --- Ranges --- */

static fct_result check_floats(const fct_stream *s, const char *what, uint32_t first, uint32_t count,
                               const float *values) {
    bool finite = true;
    for (size_t i = 0; i < 3 * (size_t)count; ++i) finite &= isfinite(values[i]) != 0;
    if (finite) return FCT_OK;
    size_t i = 0;
    while (isfinite(values[i])) ++i;
    return fct_fail(s->env, FCT_ERROR_DATA, "%s: vertex %zu: its %s is not finite (%g)", s->name,
                    first + i / 3, what, (double)values[i]);
}

static fct_result vertex_rows(fct_stream *s, uint32_t first, uint32_t count, float *positions,
                              float *colors) {
    const table *v = &s->vertices;
    fct_result result = read_vertices(s, first, count);
    if (result != FCT_OK) return result;
    fct_ply_fill_columns(&v->target, v->properties, s->buffer, v->size, v->offsets, s->swap, false, 0, count);
    memcpy(positions, s->rows.positions, 12 * (size_t)count);
    for (size_t i = 0; s->byte_colors && i < 3 * (size_t)count; ++i)
        s->rows.colors[i] = fct_linear_from_srgb(s->rows.colors[i] / 255.0);
    if (colors) memcpy(colors, s->rows.colors, 12 * (size_t)count);
    return FCT_OK;
}

fct_result fct_stream_vertices(fct_stream *s, uint32_t first, uint32_t count, float *positions,
                               float *colors) {
    fct_result result = FCT_OK;
    for (uint32_t at = 0; s->descriptor >= 0 && at < count && result == FCT_OK; at += ROWS) {
        uint32_t rows = count - at < ROWS ? count - at : ROWS;
        result = vertex_rows(s, first + at, rows, positions + 3 * (size_t)at,
                             colors ? colors + 3 * (size_t)at : NULL);
    }
    if (s->descriptor < 0) {
        uint64_t from = 12 * (uint64_t)first;
        result = fct_spool_read(&s->spool, from, positions, 12 * (size_t)count);
        if (result == FCT_OK && colors)
            result = fct_spool_read(&s->spool, s->colors_at + from, colors, 12 * (size_t)count);
    }
    if (result == FCT_OK) result = check_floats(s, "position", first, count, positions);
    if (result == FCT_OK && colors) result = check_floats(s, "colour", first, count, colors);
    return result;
}

static void load_corners(const fct_stream *s, const unsigned char *p, fct_ply_type type, uint32_t *to) {
    size_t size = fct_ply_size(type);
    bool whole = type == FCT_PLY_INT32 || type == FCT_PLY_UINT32;
    for (size_t k = 0; k < 3; ++k)
        to[k] =
            whole ? fct_ply_32(p + 4 * k, s->swap) : fct_ply_id(fct_ply_load(p + k * size, type, s->swap));
}

static fct_result face_rows(fct_stream *s, uint32_t first, uint32_t count, uint32_t *triangles,
                            uint32_t *materials) {
    const table *f = &s->faces;
    const fct_ply_property *corners = &f->properties[f->target.indices];
    size_t at = f->offsets[f->target.indices], head = fct_ply_size(corners->count_type);
    fct_result result = read_bytes(s, f->offset + (uint64_t)first * f->size, s->buffer, count * f->size);
    if (result != FCT_OK) return result;
    for (size_t i = 0; i < count; ++i) {
        const unsigned char *p = s->buffer + i * f->size + at;
        if (fct_ply_load(p - head, corners->count_type, s->swap) != 3)
            return fct_fail(s->env, FCT_ERROR_DATA, "%s: face %zu: expected three corners", s->name,
                            first + i);
        load_corners(s, p, corners->type, triangles + 3 * i);
    }
    if (!materials) return FCT_OK;
    fct_ply_type type = f->properties[f->target.material].type;
    const unsigned char *from = s->buffer + f->offsets[f->target.material];
    for (size_t i = 0; i < count; ++i)
        materials[i] = fct_ply_id(fct_ply_load(from + i * f->size, type, s->swap));
    return FCT_OK;
}

static fct_result check_faces(const fct_stream *s, uint32_t first, uint32_t count, const uint32_t *triangles,
                              const uint32_t *materials) {
    uint32_t largest = 0;
    for (size_t i = 0; i < 3 * (size_t)count; ++i) largest = triangles[i] > largest ? triangles[i] : largest;
    if (count && largest >= s->info.vertex_count) {
        size_t i = 0;
        while (triangles[i] < s->info.vertex_count) ++i;
        return fct_fail(s->env, FCT_ERROR_DATA,
                        "%s: face %zu: vertex index %d is out of range, of %u vertices", s->name,
                        first + i / 3, (int)triangles[i], s->info.vertex_count);
    }
    for (size_t i = 0; materials && i < count; ++i)
        if (materials[i] >= s->material_limit)
            return fct_fail(s->env, FCT_ERROR_DATA, "%s: face %zu: material %d is out of range", s->name,
                            first + i, (int)materials[i]);
    return FCT_OK;
}

fct_result fct_stream_faces(fct_stream *s, uint32_t first, uint32_t count, uint32_t *triangles,
                            uint32_t *materials) {
    fct_result result = FCT_OK;
    for (uint32_t at = 0; s->descriptor >= 0 && at < count && result == FCT_OK; at += ROWS) {
        uint32_t rows = count - at < ROWS ? count - at : ROWS;
        result =
            face_rows(s, first + at, rows, triangles + 3 * (size_t)at, materials ? materials + at : NULL);
    }
    if (s->descriptor < 0) {
        uint64_t from = s->triangles_at + 12 * (uint64_t)first;
        result = fct_spool_read(&s->spool, from, triangles, 12 * (size_t)count);
        from = s->materials_at + 4 * (uint64_t)first;
        if (result == FCT_OK && materials)
            result = fct_spool_read(&s->spool, from, materials, 4 * (size_t)count);
    }
    return result == FCT_OK ? check_faces(s, first, count, triangles, materials) : result;
}
