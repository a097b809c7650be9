/* mesh/ply/read.c: PLY files, text and binary of both byte orders.
 *
 * The reader takes the elements in the file's order:
 *   1. Compare the element's count with the bytes left in the file, before anything is allocated.
 *   2. If all binary records have the layout of the first (a pass over the list lengths checks this), convert
 *      them in parallel straight from the file.
 *   3. Else convert record by record. A text record first becomes a row of doubles. It is one line in layout
 *      0. In layout 1 line ends mean nothing.
 * Float colours without the prefix radiosity_ are linear, or sRGB from 0 to 255 (fct_color_range). Unknown
 * elements and properties are skipped. Triangle strips (-1 separates strips) become triangles with the same
 * winding.
 */
#include "mesh/ply/read.h"

#include <limits.h>
#include <stdatomic.h>
#include <string.h>

#include "base/parallel.h"
#include "mesh/color.h"
#include "mesh/ply/bind.h"
#include "mesh/ply/value.h"

typedef struct reader {
    fct_text t;
    fct_ply_header h;
    fct_soup *soup;
    const fct_ply_element *element;
    const fct_ply_property *properties; /* of the element */
    fct_ply_target target;
    const char *body; /* first byte after the header */
    bool swap, text;
    bool free;               /* line ends mean nothing */
    unsigned seen;           /* bit k: an element of kind k came before */
    float *vertex_texcoords; /* V x 2 or NULL */
    size_t
        *offsets; /* bytes from the record's start to each property's value; for lists, to the first item */
    uint32_t *lengths; /* of each list */
    size_t layout_capacity;
    double *row; /* of a text record */
    size_t row_capacity, corner_capacity, texcoord_capacity, start_capacity;
} reader;

static int shown_length(const reader *r) {
    return (int)(r->element->name_length < 40 ? r->element->name_length : 40);
}

static fct_result fail_record(const reader *r, uint64_t record, const char *what) {
    if (r->text)
        return fct_text_fail(&r->t, "%.*s %llu: %s", shown_length(r), r->element->name,
                             (unsigned long long)record, what);
    return fct_fail(r->t.env, FCT_ERROR_DATA, "%s: %.*s %llu: %s", r->t.name, shown_length(r),
                    r->element->name, (unsigned long long)record, what);
}

static size_t count_bytes_left(const reader *r) {
    return (size_t)(r->t.end - r->t.p);
}

/* The size in bytes of the shortest possible record. */
static size_t compute_least_size(const reader *r) {
    size_t size = 0;
    for (size_t i = 0; i < r->element->property_count; ++i) {
        const fct_ply_property *p = r->properties + i;
        size += r->text ? 2 : fct_ply_size(p->count_type != FCT_PLY_NONE ? p->count_type : p->type);
    }
    return size;
}

static fct_result check_count(const reader *r) {
    uint64_t count = r->element->count;
    size_t least = compute_least_size(r), left = count_bytes_left(r) + (r->text ? 1 : 0);
    if (r->target.kind == FCT_PLY_OTHER && !least) return FCT_OK;
    if (r->target.kind != FCT_PLY_OTHER && count > FCT_MESH_LIMIT)
        return fct_fail(r->t.env, FCT_ERROR_DATA, "%s: element %.*s %llu: at most %llu are allowed",
                        r->t.name, shown_length(r), r->element->name, (unsigned long long)count,
                        (unsigned long long)FCT_MESH_LIMIT);
    if (count && (!least || count > left / least))
        return fct_fail(
            r->t.env, FCT_ERROR_DATA,
            "%s: element %.*s: %llu records of at least %zu bytes are declared, but %zu bytes are left",
            r->t.name, shown_length(r), r->element->name, (unsigned long long)count, least,
            count_bytes_left(r));
    return FCT_OK;
}

/* Finds the offsets and list lengths of the binary record at p. Returns the record's size, or 0 if it does
 * not fit before `end` or a length is negative. No caller passes an element of empty records. */
static size_t measure_record(const reader *r, const unsigned char *p, const unsigned char *end,
                             size_t *offsets, uint32_t *lengths) {
    const unsigned char *begin = p;
    for (size_t i = 0; i < r->element->property_count; ++i) {
        const fct_ply_property *property = r->properties + i;
        size_t size = fct_ply_size(property->type), count = 1;
        if (property->count_type != FCT_PLY_NONE) {
            size_t head = fct_ply_size(property->count_type);
            if ((size_t)(end - p) < head) return 0;
            double length = fct_ply_load(p, property->count_type, r->swap);
            if (length < 0) return 0;
            count = lengths[i] = (uint32_t)length;
            p += head;
        }
        if ((size_t)(end - p) / size < count) return 0;
        offsets[i] = (size_t)(p - begin);
        p += count * size;
    }
    return (size_t)(p - begin);
}

/* Grows the arrays by `corners` corners and `polygons` polygons. */
static fct_result make_room(reader *r, size_t corners, size_t polygons) {
    fct_soup *soup = r->soup;
    if (soup->corner_count + corners > UINT32_MAX || soup->polygon_count + polygons > FCT_MESH_LIMIT)
        return fct_fail(r->t.env, FCT_ERROR_DATA, "%s: too many corners of faces", r->t.name);
    size_t before = r->start_capacity;
    fct_result result = fct_grow(r->t.env, (void **)&soup->corners, &r->corner_capacity,
                                 soup->corner_count + corners, sizeof(uint32_t));
    if (result == FCT_OK && r->target.texcoords != FCT_PLY_NOWHERE)
        result = fct_grow(r->t.env, (void **)&soup->texcoords, &r->texcoord_capacity,
                          soup->corner_count + corners, 2 * sizeof(float));
    if (result == FCT_OK)
        result = fct_grow(r->t.env, (void **)&soup->starts, &r->start_capacity,
                          soup->polygon_count + polygons + 1, sizeof(uint32_t));
    if (result == FCT_OK && !before) /* all earlier polygons are triangles */
        for (size_t i = 0; i <= soup->polygon_count; ++i) soup->starts[i] = (uint32_t)(3 * i);
    return result;
}

static void load_ids(const reader *r, const unsigned char *p, fct_ply_type type, size_t count, uint32_t *to) {
    if ((type == FCT_PLY_INT32 || type == FCT_PLY_UINT32) && !r->text) {
        for (size_t i = 0; i < count; ++i) to[i] = fct_ply_32(p + 4 * i, r->swap);
        return;
    }
    if (r->text) type = FCT_PLY_DOUBLE;
    size_t size = fct_ply_size(type);
    for (size_t i = 0; i < count; ++i) to[i] = fct_ply_id(fct_ply_load(p + size * i, type, r->swap));
}

static void load_floats(const reader *r, const unsigned char *p, fct_ply_type type, size_t count, float *to) {
    if (r->text) type = FCT_PLY_DOUBLE;
    size_t size = fct_ply_size(type);
    for (size_t i = 0; i < count; ++i) to[i] = (float)fct_ply_load(p + size * i, type, r->swap);
}

/* Stores face record `i`, which is at p, in the soup. Its corners begin at corner `first`. */
static void store_face(const reader *r, const unsigned char *p, const size_t *offsets, size_t count, size_t i,
                       size_t first) {
    fct_soup *soup = r->soup;
    ptrdiff_t k = r->target.indices;
    if (count) load_ids(r, p + offsets[k], r->properties[k].type, count, soup->corners + first);
    k = r->target.texcoords;
    if (count && k != FCT_PLY_NOWHERE)
        load_floats(r, p + offsets[k], r->properties[k].type, 2 * count, soup->texcoords + 2 * first);
    k = r->target.material;
    if (k != FCT_PLY_NOWHERE) load_ids(r, p + offsets[k], r->properties[k].type, 1, soup->materials + i);
}

/* Whether the list of texture coordinates has the wrong length. It does not matter for a face without a
 * triangle. */
static bool has_wrong_texcoords(const reader *r, const uint32_t *lengths) {
    uint64_t corners = lengths[r->target.indices];
    return corners > 2 && r->target.texcoords != FCT_PLY_NOWHERE &&
           lengths[r->target.texcoords] != 2 * corners;
}

typedef struct uniform {
    const reader *r;
    const unsigned char *base;
    size_t size;
    atomic_bool broken;
} uniform;

static void check_uniform(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    uniform *u = user;
    const reader *r = u->r;
    for (size_t k = 0; k < r->element->property_count; ++k) {
        fct_ply_type type = r->properties[k].count_type;
        if (type == FCT_PLY_NONE) continue;
        const unsigned char *p = u->base + r->offsets[k] - fct_ply_size(type);
        for (size_t i = begin; i < end; ++i)
            if (fct_ply_load(p + i * u->size, type, r->swap) != r->lengths[k]) {
                atomic_store_explicit(&u->broken, true, memory_order_relaxed);
                return;
            }
    }
}

static void fill_uniform(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    uniform *u = user;
    const reader *r = u->r;
    fct_ply_fill_columns(&r->target, r->properties, u->base, u->size, r->offsets, r->swap, false, begin, end);
    if (r->target.kind != FCT_PLY_FACES) return;
    size_t corners = r->lengths[r->target.indices];
    for (size_t i = begin; i < end; ++i)
        store_face(r, u->base + i * u->size, r->offsets, corners, i, i * corners);
    if (r->soup->starts)
        for (size_t i = begin; i < end; ++i) r->soup->starts[i + 1] = (uint32_t)((i + 1) * corners);
}

static fct_result make_uniform_room(reader *r) {
    fct_soup *soup = r->soup;
    size_t corners = r->lengths[r->target.indices], count = (size_t)r->element->count;
    fct_result result = FCT_OK;
    if (corners > 3) {
        result = make_room(r, corners * count, count);
    } else {
        soup->corners = fct_allocate(r->t.env, count, 3 * sizeof(uint32_t));
        r->corner_capacity = 3 * count;
        if (r->target.texcoords != FCT_PLY_NOWHERE) {
            soup->texcoords = fct_allocate(r->t.env, count, 6 * sizeof(float));
            r->texcoord_capacity = 3 * count;
        }
        if (!soup->corners || (r->target.texcoords != FCT_PLY_NOWHERE && !soup->texcoords))
            result = fct_fail_memory(r->t.env, "a mesh");
    }
    if (result == FCT_OK) {
        soup->corner_count = corners * count;
        soup->polygon_count = (uint32_t)count;
    }
    return result;
}

/* Reads the element if all its records have the layout of the first. *done: they have, and it is read. */
static fct_result read_uniform(reader *r, bool *done) {
    size_t count = (size_t)r->element->count;
    const unsigned char *base = (const unsigned char *)r->t.p, *end = (const unsigned char *)r->t.end;
    *done = false;
    size_t size = measure_record(r, base, end, r->offsets, r->lengths);
    if (!size || (size_t)(end - base) / size < count) return FCT_OK;
    if (r->target.kind == FCT_PLY_STRIPS) return FCT_OK;
    if (r->target.kind == FCT_PLY_FACES &&
        (r->soup->polygon_count || r->lengths[r->target.indices] < 3 || has_wrong_texcoords(r, r->lengths)))
        return FCT_OK;
    uniform u = {.r = r, .base = base, .size = size};
    fct_parallel_for(r->t.env, count, 16384, check_uniform, &u);
    if (atomic_load(&u.broken)) return FCT_OK;
    if (r->target.kind == FCT_PLY_FACES) {
        fct_result result = make_uniform_room(r);
        if (result != FCT_OK) return result;
    }
    fct_ply_extend(&r->target, r->properties, base, size, r->offsets, r->swap, false, count,
                   &r->soup->extent);
    if (r->target.kind != FCT_PLY_OTHER) fct_parallel_for(r->t.env, count, 16384, fill_uniform, &u);
    r->t.p += count * size;
    *done = true;
    return FCT_OK;
}

static bool fits_type(double value, fct_ply_type type) {
    static const double lower[] = {0, -128, 0, -32768, 0, -2147483648.0, 0};
    static const double upper[] = {0, 127, 255, 32767, 65535, 2147483647.0, 4294967295.0};
    return type >= FCT_PLY_FLOAT || (value >= lower[type] && value <= upper[type]);
}

/* Moves to the next value, over line ends if they mean nothing. */
static void skip_to_value(reader *r) {
    if (r->free) fct_text_skip_lines(&r->t, 0);
}

/* Reads one value of a text file. A float that an array uses may be nan, and the mesh is checked later.
 * Another float may be any word. */
static fct_result read_value(reader *r, fct_ply_type type, bool used, double *value) {
    skip_to_value(r);
    const char *begin = r->t.p;
    if (type < FCT_PLY_FLOAT) {
        int64_t integer;
        if (fct_text_integer(&r->t, &integer) && fits_type((double)integer, type)) {
            *value = (double)integer;
            return FCT_OK;
        }
        r->t.p = begin;
        return fct_text_expected(&r->t, "an integer in the range of its type");
    }
    if (used) return fct_text_any_double(&r->t, "a number", value);
    size_t length;
    fct_text_word(&r->t, &length);
    *value = 0;
    return length ? FCT_OK : fct_text_expected(&r->t, "a value");
}

static bool is_used(const reader *r, size_t property) {
    if ((ptrdiff_t)property == r->target.indices || (ptrdiff_t)property == r->target.texcoords ||
        (ptrdiff_t)property == r->target.material)
        return true;
    for (size_t c = 0; c < r->target.column_count; ++c)
        if (r->target.columns[c].property == property) return true;
    return false;
}

/* Reads a record of text into r->row, r->offsets and r->lengths. */
static fct_result read_row(reader *r) {
    if (!fct_text_skip_lines(&r->t, 0)) return fct_text_expected(&r->t, "another record");
    size_t used = 0;
    for (size_t i = 0; i < r->element->property_count; ++i) {
        const fct_ply_property *property = r->properties + i;
        double length = 1;
        fct_result result = FCT_OK;
        if (property->count_type != FCT_PLY_NONE) {
            result = read_value(r, property->count_type, true, &length);
            if (result == FCT_OK && (length < 0 || length > (double)count_bytes_left(r)))
                result =
                    fct_text_fail(&r->t, "a list of %.0f values on a line that has no room for them", length);
        }
        if (result == FCT_OK)
            result =
                fct_grow(r->t.env, (void **)&r->row, &r->row_capacity, used + (size_t)length, sizeof(double));
        if (result != FCT_OK) return result;
        r->offsets[i] = used * sizeof(double);
        r->lengths[i] = (uint32_t)length;
        bool meant = is_used(r, i);
        for (size_t k = 0; k < (size_t)length; ++k) {
            result = read_value(r, property->type, meant, r->row + used++);
            if (result != FCT_OK) return result;
        }
    }
    if (!r->free && !fct_text_at_line_end(&r->t)) return fct_text_expected(&r->t, "the end of the line");
    return FCT_OK;
}

/* Strip a b c d e ... becomes triangles abc, cbd, cde, ... An id of -1 ends a strip. */
static fct_result append_strip(reader *r, const unsigned char *p) {
    uint32_t length = r->lengths[r->target.indices];
    fct_ply_type type = r->properties[r->target.indices].type;
    size_t size = r->text ? sizeof(double) : fct_ply_size(type);
    fct_soup *soup = r->soup;
    uint32_t strip[3] = {0}, have = 0;
    for (size_t i = 0; i < length; ++i) {
        double value = fct_ply_load(p + i * size, r->text ? FCT_PLY_DOUBLE : type, r->swap);
        if (value == -1) {
            have = 0;
            continue;
        }
        strip[0] = strip[1], strip[1] = strip[2], strip[2] = fct_ply_id(value);
        if (++have < 3) continue;
        fct_result result = make_room(r, 3, 1);
        if (result != FCT_OK) return result;
        uint32_t odd = (have - 3) & 1;
        uint32_t *corner = soup->corners + soup->corner_count;
        corner[0] = strip[odd], corner[1] = strip[1 - odd], corner[2] = strip[2];
        soup->corner_count += 3;
        soup->starts[++soup->polygon_count] = (uint32_t)soup->corner_count;
    }
    return FCT_OK;
}

static fct_result store_record(reader *r, const unsigned char *p, uint64_t record) {
    fct_soup *soup = r->soup;
    fct_ply_target target = r->target;
    for (size_t c = 0; c < target.column_count; ++c)
        target.columns[c].to += (size_t)record * target.columns[c].stride;
    fct_ply_fill_columns(&target, r->properties, p, 0, r->offsets, r->swap, r->text, 0, 1);
    fct_ply_extend(&target, r->properties, p, 0, r->offsets, r->swap, r->text, 1, &soup->extent);
    if (target.kind == FCT_PLY_STRIPS) return append_strip(r, p + r->offsets[target.indices]);
    if (target.kind != FCT_PLY_FACES) return FCT_OK;
    if (has_wrong_texcoords(r, r->lengths))
        return fail_record(r, record, "texture coordinates do not match its corners");
    size_t corners = r->lengths[target.indices] > 2 ? r->lengths[target.indices] : 0;
    fct_result result = make_room(r, corners, 1);
    if (result != FCT_OK) return result;
    store_face(r, p, r->offsets, corners, (size_t)record, soup->corner_count);
    soup->corner_count += corners;
    soup->starts[++soup->polygon_count] = (uint32_t)soup->corner_count;
    return FCT_OK;
}

static fct_result read_records(reader *r) {
    for (uint64_t i = 0; i < r->element->count; ++i) {
        if (i % 65536 == 0) {
            double done = (double)(r->t.p - r->body) / (double)(r->t.end - r->body + 1);
            fct_result result = fct_progress(r->t.env, "read", done);
            if (result != FCT_OK) return result;
        }
        const unsigned char *p = (const unsigned char *)r->t.p;
        fct_result result = FCT_OK;
        if (r->text) {
            result = read_row(r);
            p = (const unsigned char *)r->row;
        } else {
            size_t size = measure_record(r, p, (const unsigned char *)r->t.end, r->offsets, r->lengths);
            if (!size) return fail_record(r, i, "the file ends within it, or a list's length is wrong");
            r->t.p += size;
        }
        if (result == FCT_OK) result = store_record(r, p, i);
        if (result != FCT_OK) return result;
    }
    return FCT_OK;
}

/* Converts the element's float colours if they are sRGB from 0 to 255. */
static void scale_colors(reader *r) {
    bool vertices = r->target.kind == FCT_PLY_VERTICES;
    float *colors = vertices ? r->soup->colors : r->soup->polygon_colors;
    size_t count = 3 * (size_t)r->element->count;
    fct_color_range range = {0};
    for (size_t i = 0; i < count; ++i) fct_color_range_add(&range, colors[i]);
    if (!fct_color_range_is_bytes(&range)) return;
    fct_note(r->t.env, FCT_MESSAGE_NOTE, "%s: float colours of %s are taken as 0 to 255", r->t.name,
             vertices ? "vertices" : "faces");
    for (size_t i = 0; i < count; ++i) colors[i] = fct_linear_from_srgb(colors[i] / 255.0);
}

static fct_result read_element(reader *r, const fct_ply_element *element) {
    r->element = element;
    r->properties = r->h.properties ? r->h.properties + element->first_property : NULL;
    r->target.kind = fct_ply_kind_of(element);
    if (r->target.kind != FCT_PLY_OTHER && (r->seen >> r->target.kind & 1))
        return fct_fail(r->t.env, FCT_ERROR_DATA, "%s: element %.*s is declared twice", r->t.name,
                        shown_length(r), element->name);
    r->seen |= 1u << r->target.kind;
    fct_result result = check_count(r);
    if (result == FCT_OK)
        result = fct_ply_bind(&r->t, &r->h, element, r->soup, &r->vertex_texcoords, &r->target);
    if (result != FCT_OK) return result;
    if (r->target.kind == FCT_PLY_VERTICES) r->soup->vertex_count = (uint32_t)element->count;
    if (!element->count || !element->property_count) return FCT_OK;
    if (element->property_count > r->layout_capacity) {
        fct_release(r->t.env, r->offsets);
        fct_release(r->t.env, r->lengths);
        r->offsets = fct_allocate_zero(r->t.env, element->property_count, sizeof(size_t));
        r->lengths = fct_allocate_zero(r->t.env, element->property_count, sizeof(uint32_t));
        r->layout_capacity = element->property_count;
        if (!r->offsets || !r->lengths) return fct_fail_memory(r->t.env, "a PLY header");
    }
    if (r->target.kind == FCT_PLY_OTHER)
        fct_note(r->t.env, FCT_MESSAGE_NOTE, "%s: element '%.*s' is left out", r->t.name, shown_length(r),
                 element->name);
    bool done = false;
    if (!r->text) result = read_uniform(r, &done);
    if (result == FCT_OK && !done) result = read_records(r);
    if (result == FCT_OK && r->target.any_scale) scale_colors(r);
    return result;
}

/* Moves the names to the soup. A file without names keeps its material numbers. A number far above the count
 * of faces is an error, because callers allocate memory per material. */
static fct_result name_materials(reader *r) {
    fct_soup *soup = r->soup;
    soup->material_names = r->h.material_names;
    soup->material_count = (uint32_t)r->h.material_count;
    r->h.material_names = NULL;
    r->h.material_count = 0;
    if (!soup->materials || soup->material_names) return FCT_OK;
    uint64_t limit = soup->polygon_count + UINT64_C(65536);
    for (uint32_t i = 0; i < soup->polygon_count; ++i) {
        if (soup->materials[i] >= limit)
            return fct_fail(r->t.env, FCT_ERROR_DATA, "%s: face %u: material %d is out of range", r->t.name,
                            i, (int)soup->materials[i]);
        if (soup->materials[i] >= soup->material_count) soup->material_count = soup->materials[i] + 1;
    }
    return FCT_OK;
}

/* Strips have no values per triangle. If the file has strips, the values of its faces are dropped. */
static void drop_partial(reader *r) {
    fct_soup *soup = r->soup;
    if (!(r->seen >> FCT_PLY_STRIPS & 1) || (!soup->materials && !soup->polygon_colors && !soup->texcoords))
        return;
    fct_note(r->t.env, FCT_MESSAGE_WARNING, "%s: values of faces are left out, because strips have none",
             r->t.name);
    fct_release(r->t.env, soup->materials);
    fct_release(r->t.env, soup->polygon_colors);
    fct_release(r->t.env, soup->texcoords);
    soup->materials = NULL;
    soup->polygon_colors = soup->texcoords = NULL;
}

/* Copies the vertices' texture coordinates to the corners, unless the corners have their own. */
static fct_result spread_texcoords(reader *r) {
    fct_soup *soup = r->soup;
    if (!r->vertex_texcoords || soup->texcoords || !soup->corner_count) return FCT_OK;
    soup->texcoords = fct_allocate(r->t.env, soup->corner_count, 2 * sizeof(float));
    if (!soup->texcoords) return fct_fail_memory(r->t.env, "texture coordinates");
    for (size_t i = 0; i < soup->corner_count; ++i) {
        uint32_t v = soup->corners[i] < soup->vertex_count ? soup->corners[i] : 0;
        memcpy(soup->texcoords + 2 * i, r->vertex_texcoords + 2 * (size_t)v, 2 * sizeof(float));
    }
    return FCT_OK;
}

static bool has_valid_corners(const fct_soup *soup) {
    for (size_t i = 0; i < soup->corner_count; ++i)
        if (soup->corners[i] >= soup->vertex_count) return false;
    return true;
}

static fct_result complete_mesh(reader *r) {
    fct_soup *soup = r->soup;
    if (!(r->seen >> FCT_PLY_VERTICES & 1))
        return fct_fail(r->t.env, FCT_ERROR_DATA, "%s: the header declares no vertices", r->t.name);
    bool more = r->text ? fct_text_skip_lines(&r->t, 0) : r->t.p < r->t.end;
    if (r->free && (more || !has_valid_corners(soup))) return FCT_ERROR_DATA;
    if (more)
        fct_note(r->t.env, FCT_MESSAGE_WARNING, "%s: %zu bytes behind the last element are left out",
                 r->t.name, count_bytes_left(r));
    drop_partial(r);
    fct_result result = name_materials(r);
    if (result == FCT_OK) result = spread_texcoords(r);
    if (!soup->corners) soup->corners = fct_allocate(r->t.env, 0, sizeof(uint32_t));
    if (result == FCT_OK && !soup->corners) result = fct_fail_memory(r->t.env, "a mesh");
    return result;
}

fct_result fct_read_ply(const fct_source *source, fct_soup *out) {
    reader r = {.t = fct_text_begin(source->env, source->name, source->data, source->size), .soup = out};
    fct_result result = fct_ply_read_header(&r.t, &r.h);
    r.text = r.h.format == FCT_PLY_ASCII;
    r.free = out->layout > 0;
    if (result == FCT_OK && r.free && !r.text) result = FCT_ERROR_DATA; /* binary files have one layout */
    r.swap = r.h.format == FCT_PLY_BIG;
    r.body = r.t.p;
    for (size_t i = 0; result == FCT_OK && i < r.h.element_count; ++i)
        result = read_element(&r, r.h.elements + i);
    if (result == FCT_OK) result = complete_mesh(&r);
    fct_ply_release_header(source->env, &r.h);
    fct_release(source->env, r.vertex_texcoords);
    fct_release(source->env, r.offsets);
    fct_release(source->env, r.lengths);
    fct_release(source->env, r.row);
    return result;
}
