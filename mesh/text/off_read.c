/* mesh/text/off_read.c: Geomview OFF, text, with the prefixes ST, C and N in any combination.
 *
 * A vertex has x y z, then a normal (N), a colour of 3 or 4 components (C), texture coordinates (ST). A face
 * has n, n indices, and optionally 3 or 4 colour components or one index into a colour map. The reader
 * ignores the index, because the file does not contain the map. The head may be missing, and the counts may
 * follow it at once. In layout 0 each vertex and each face is one line, and 3 or 4 values behind a vertex
 * without a prefix are a colour, or a normal. In the other layouts line ends mean nothing. Then a line does
 * not say how many values a colour has, so each layout tries one number for vertices and one for faces. The
 * scale of the colours follows from all of them (fct_color_range). A comment `# facetree linear` says that
 * they are linear.
 */
#define _GNU_SOURCE
#include "mesh/text/off_read.h"

#include <float.h>
#include <math.h>
#include <string.h>
#include <strings.h>

#include "mesh/color.h"
#include "mesh/text/text.h"

typedef struct reader {
    fct_text t;
    fct_soup *soup;
    bool free;           /* line ends mean nothing */
    size_t color_values; /* free: of each vertex, with C */
    size_t face_values;  /* free: behind the indices of each face */
    bool has_texcoords, has_colors, has_normals;
    bool extra;       /* the head has neither C nor N, but vertices have 3 or 4 more values */
    bool linear;      /* the file says that its colours are linear */
    float *texcoords; /* V x 2 or NULL */
    size_t corner_capacity;
    uint32_t faces_without_color;
    fct_color_range vertex_range, face_range;
} reader;

/* The red component of a face without a colour. */
static const float NO_COLOR = -FLT_MAX;

/* --- Tokens --- */

static bool at_line_end(fct_text *t) {
    return fct_text_at_line_end(t) || *t->p == '#';
}

/* Moves to the next value of a vertex or face, over line ends if they mean nothing. */
static void skip_to_value(reader *r) {
    if (r->free) fct_text_skip_lines(&r->t, '#');
}

/* The end of a vertex or face. */
static fct_result end_record(reader *r) {
    if (r->free) return FCT_OK;
    if (!at_line_end(&r->t)) return fct_text_expected(&r->t, "the end of the line");
    fct_text_next_line(&r->t);
    return FCT_OK;
}

/* A value of an attribute. One that is not finite, or does not fit a float, becomes NaN. */
static fct_result read_attribute(reader *r, const char *what, float *value) {
    double number;
    skip_to_value(r);
    fct_result result = fct_text_any_double(&r->t, what, &number);
    *value = (float)number;
    if (!isfinite(*value)) *value = NAN;
    return result;
}

static fct_result read_attributes(reader *r, const char *what, float *values, size_t count) {
    fct_result result = FCT_OK;
    for (size_t k = 0; result == FCT_OK && k < count; ++k) result = read_attribute(r, what, values + k);
    return result;
}

/* --- Head --- */

/* In any case, but `n` is no N: nOFF has points of n dimensions. */
static bool take_prefix(const char **word, size_t *length, const char *prefix) {
    size_t count = strlen(prefix);
    if (*length < count || **word == 'n' || strncasecmp(*word, prefix, count)) return false;
    *word += count, *length -= count;
    return true;
}

/* Reads the keyword, if there is one. t->p is then behind it: at the counts, or at a blank. */
static fct_result read_head(reader *r) {
    const char *begin = r->t.p;
    int64_t number;
    bool counts = fct_text_integer(&r->t, &number);
    r->t.p = begin;
    if (counts) return FCT_OK;
    size_t length;
    const char *word = fct_text_word(&r->t, &length);
    r->has_texcoords = take_prefix(&word, &length, "ST");
    r->has_colors = take_prefix(&word, &length, "C");
    r->has_normals = take_prefix(&word, &length, "N");
    bool off = length >= 3 && !strncasecmp(word, "OFF", 3);
    if (!off || (length > 3 && (word[3] < '0' || word[3] > '9') && word[3] != '#')) {
        r->t.p = begin;
        return fct_text_expected(&r->t, "OFF, or OFF with the prefixes ST, C and N");
    }
    r->t.p = begin = word + 3;
    word = fct_text_word(&r->t, &length);
    r->t.p = begin;
    if (fct_text_word_is(word, length, "BINARY"))
        return fct_text_expected(&r->t, "a text file; binary OFF is not read");
    return FCT_OK;
}

/* Reads E, which is not used. It may be missing: it is there if it is on the line of F, or alone on the next.
 */
static fct_result skip_edges(reader *r) {
    fct_text *t = &r->t;
    int64_t edges;
    if (!at_line_end(t))
        return fct_text_integer(t, &edges) ? FCT_OK : fct_text_expected(t, "the number of edges");
    fct_text before = *t;
    if (!r->free || !fct_text_skip_lines(t, '#')) return FCT_OK;
    if (!fct_text_integer(t, &edges) || !at_line_end(t)) *t = before;
    return FCT_OK;
}

/* "V F E". */
static fct_result read_counts(reader *r, int64_t *vertices, int64_t *faces) {
    fct_text *t = &r->t;
    if (!fct_text_skip_lines(t, '#') || !fct_text_integer(t, vertices) || *vertices < 0)
        return fct_text_expected(t, "the number of vertices");
    skip_to_value(r);
    if (!fct_text_integer(t, faces) || *faces < 0) return fct_text_expected(t, "the number of faces");
    fct_result result = skip_edges(r);
    if (result != FCT_OK) return result;
    size_t left = (size_t)(t->end - t->p);
    /* "0 0 0" is the shortest vertex and "0" the shortest face. */
    if ((uint64_t)*vertices > left / 6 || (uint64_t)*faces > left / 2)
        return fct_text_fail(t, "%lld vertices and %lld faces are declared, but %zu bytes are left",
                             (long long)*vertices, (long long)*faces, left);
    return end_record(r);
}

/* --- Vertices --- */

static fct_result read_position(reader *r, float *position) {
    fct_soup *soup = r->soup;
    double point[3];
    for (int k = 0; k < 3; ++k) {
        skip_to_value(r);
        fct_result result = fct_text_coordinate(&r->t, "a coordinate", point + k);
        if (result != FCT_OK) return result;
    }
    fct_soup_place(soup, point, position);
    return FCT_OK;
}

/* Reads the rest of the line, or `wanted` values and `behind` more if line ends mean nothing: a colour, then
 * texture coordinates. values[0, 4) receives the colour, values[4, 6) the coordinates, and *count the number
 * of colour components. */
static fct_result read_color(reader *r, size_t wanted, size_t behind, float *values, size_t *count) {
    size_t all = 0, most = (r->free ? wanted : 4) + behind;
    for (; all < most && (r->free || !at_line_end(&r->t)); ++all) {
        fct_result result = read_attribute(r, "a colour component", values + all);
        if (result != FCT_OK) return result;
    }
    if (all < behind) return fct_text_expected(&r->t, "a number");
    *count = all - behind;
    float coordinates[2];
    memcpy(coordinates, values + *count, behind * sizeof(float));
    memcpy(values + 4, coordinates, behind * sizeof(float));
    return FCT_OK;
}

static void add_to_range(fct_color_range *range, const float *values, size_t count) {
    for (size_t k = 0; k < count; ++k) fct_color_range_add(range, values[k]);
}

static fct_result read_vertex_color(reader *r, size_t v) {
    float values[6];
    size_t count;
    fct_result result = read_color(r, r->color_values, r->has_texcoords ? 2 : 0, values, &count);
    if (result == FCT_OK && count < 3) return fct_text_expected(&r->t, "a colour of 3 or 4 components");
    if (result != FCT_OK) return result;
    add_to_range(&r->vertex_range, values, count);
    memcpy(r->soup->colors + 3 * v, values, 3 * sizeof(float));
    if (r->has_texcoords) memcpy(r->texcoords + 2 * v, values + 4, 2 * sizeof(float));
    return FCT_OK;
}

static fct_result read_vertex(reader *r, size_t v) {
    fct_text *t = &r->t;
    fct_soup *soup = r->soup;
    if (!fct_text_skip_lines(t, '#')) return fct_text_expected(t, "another vertex");
    fct_result result = read_position(r, soup->positions + 3 * v);
    if (result == FCT_OK && r->has_normals)
        result = read_attributes(r, "a normal's coordinate", soup->normals + 3 * v, 3);
    if (result == FCT_OK && r->has_colors)
        result = read_vertex_color(r, v);
    else if (result == FCT_OK && r->has_texcoords)
        result = read_attributes(r, "a texture coordinate", r->texcoords + 2 * v, 2);
    return result == FCT_OK ? end_record(r) : result;
}

/* --- Faces --- */

static fct_result read_indices(reader *r, int64_t count) {
    fct_soup *soup = r->soup;
    fct_result result = fct_grow(r->t.env, (void **)&soup->corners, &r->corner_capacity,
                                 soup->corner_count + (size_t)count, sizeof(uint32_t));
    for (int64_t k = 0; result == FCT_OK && k < count; ++k) {
        int64_t index;
        skip_to_value(r);
        fct_text_skip_blanks(&r->t);
        const char *begin = r->t.p;
        if (!fct_text_integer(&r->t, &index)) return fct_text_expected(&r->t, "a vertex index");
        if (index < 0 || index >= soup->vertex_count) {
            r->t.p = begin;
            return fct_text_fail(&r->t, "vertex index %lld is out of range, of %u vertices", (long long)index,
                                 soup->vertex_count);
        }
        soup->corners[soup->corner_count++] = (uint32_t)index;
    }
    return result;
}

/* The colour of the face, or NO_COLOR. The array is allocated at the first colour. */
static fct_result store_face_color(reader *r, uint32_t face, const float *values, size_t count) {
    fct_soup *soup = r->soup;
    r->faces_without_color += count < 3;
    if (!soup->polygon_colors && count < 3) return FCT_OK;
    if (!soup->polygon_colors) {
        soup->polygon_colors = fct_allocate(r->t.env, soup->polygon_count, 3 * sizeof(float));
        if (!soup->polygon_colors) return fct_fail_memory(r->t.env, "face colours");
        for (size_t i = 0; i < face; ++i) soup->polygon_colors[3 * i] = NO_COLOR;
    }
    float *color = soup->polygon_colors + 3 * (size_t)face;
    *color = NO_COLOR;
    if (count < 3) return FCT_OK;
    add_to_range(&r->face_range, values, count);
    memcpy(color, values, 3 * sizeof(float));
    return FCT_OK;
}

static fct_result read_face(reader *r, uint32_t face) {
    fct_text *t = &r->t;
    fct_soup *soup = r->soup;
    int64_t count;
    if (!fct_text_skip_lines(t, '#')) return fct_text_expected(t, "another face");
    const char *begin = t->p;
    if (!fct_text_integer(t, &count) || count < 0) {
        t->p = begin;
        return fct_text_expected(t, "a face's number of corners");
    }
    if (count > (t->end - t->p) / 2 + 1 || soup->corner_count + (size_t)count > UINT32_MAX)
        return fct_text_fail(t, "a face of %lld corners on a line that has no room for them",
                             (long long)count);
    if (count < 3 && r->face_values) return FCT_ERROR_DATA; /* a colour without a face is no fit */
    fct_result result = read_indices(r, count);
    if (result != FCT_OK) return result;
    soup->starts[face + 1] = (uint32_t)soup->corner_count;
    float values[4];
    size_t components;
    result = read_color(r, r->face_values, 0, values, &components);
    if (result == FCT_OK && components == 2) return fct_text_expected(t, "a colour of 3 or 4 components");
    if (result == FCT_OK) result = store_face_color(r, face, values, components);
    return result == FCT_OK ? end_record(r) : result;
}

/* --- The whole file --- */

static size_t count_line_values(fct_text t) {
    size_t length, count = 0;
    if (!fct_text_skip_lines(&t, '#')) return 0;
    for (; !at_line_end(&t); ++count) fct_text_word(&t, &length);
    return count;
}

/* Finds how many values a vertex has. Returns false if the layout is none of this file. */
static bool choose_layout(reader *r, unsigned layout) {
    static const unsigned char vertex_values[] = {4, 3}, face_values[] = {0, 3, 4, 1};
    if (layout) {
        r->color_values = vertex_values[(layout - 1) / 4];
        r->face_values = face_values[(layout - 1) % 4];
        return r->has_colors || r->color_values == 4;
    }
    size_t more = count_line_values(r->t) - (r->has_texcoords ? 5 : 3);
    r->extra = !r->has_colors && !r->has_normals && (more == 3 || more == 4);
    r->has_colors = r->has_colors || r->extra;
    return true;
}

static fct_result allocate_mesh(reader *r, size_t vertices, size_t faces) {
    fct_soup *soup = r->soup;
    size_t left = (size_t)(r->t.end - r->t.p) / 2;
    soup->vertex_count = (uint32_t)vertices;
    soup->polygon_count = (uint32_t)faces;
    r->corner_capacity = 3 * faces < left ? 3 * faces : left;
    const fct_array arrays[] = {
        FCT_ARRAY(soup->positions, 3 * vertices),
        FCT_ARRAY(soup->corners, r->corner_capacity),
        FCT_ARRAY_ZERO(soup->starts, faces + 1),
        FCT_ARRAY_IF(r->has_colors, soup->colors, 3 * vertices),
        FCT_ARRAY_IF(r->has_normals, soup->normals, 3 * vertices),
        FCT_ARRAY_IF(r->has_texcoords, r->texcoords, 2 * vertices),
    };
    return fct_allocate_all(r->t.env, arrays, FCT_LENGTH(arrays), "a mesh");
}

/* Converts colours to linear ones. */
static fct_result convert_colors(reader *r, const char *element, const fct_color_range *range, float *colors,
                                 size_t count) {
    bool bytes = !r->linear && fct_color_range_is_bytes(range);
    bool wrong = range->highest > 255 || (range->highest >= 2 && range->lowest < 0);
    if (!r->linear && wrong)
        return fct_fail(r->t.env, FCT_ERROR_DATA,
                        "%s: a colour component of %g at a %s, expected 0 to 1 or 0 to 255", r->t.name,
                        (double)(range->highest > 255 ? range->highest : range->lowest), element);
    for (size_t i = 0; i < count; ++i) {
        float *color = colors + 3 * i;
        if (*color == NO_COLOR) color[0] = color[1] = color[2] = bytes ? 255 : 1;
        for (int k = 0; bytes && k < 3; ++k) color[k] = fct_linear_from_srgb(color[k] / 255.0);
    }
    return FCT_OK;
}

/* Three more values per vertex, some below zero and none beyond 1, are normals. */
static void take_normals(reader *r) {
    fct_color_range range = r->vertex_range;
    if (!r->extra || range.lowest >= 0 || range.lowest < -1.001F || range.highest > 1.001F) return;
    r->soup->normals = r->soup->colors;
    r->soup->colors = NULL;
}

static fct_result spread_texcoords(reader *r) {
    fct_soup *soup = r->soup;
    if (!r->texcoords || !soup->corner_count) return FCT_OK;
    soup->texcoords = fct_allocate(r->t.env, soup->corner_count, 2 * sizeof(float));
    if (!soup->texcoords) return fct_fail_memory(r->t.env, "texture coordinates");
    for (size_t i = 0; i < soup->corner_count; ++i)
        memcpy(soup->texcoords + 2 * i, r->texcoords + 2 * (size_t)soup->corners[i], 2 * sizeof(float));
    return FCT_OK;
}

static fct_result complete_mesh(reader *r) {
    fct_soup *soup = r->soup;
    fct_result result = FCT_OK;
    if (fct_text_skip_lines(&r->t, '#')) return fct_text_expected(&r->t, "the end of the file");
    take_normals(r);
    if (soup->colors)
        result = convert_colors(r, "vertex", &r->vertex_range, soup->colors, soup->vertex_count);
    if (result == FCT_OK && soup->polygon_colors)
        result = convert_colors(r, "face", &r->face_range, soup->polygon_colors, soup->polygon_count);
    if (result != FCT_OK) return result;
    if (soup->polygon_colors && r->faces_without_color)
        fct_note(r->t.env, FCT_MESSAGE_WARNING, "%s: %u faces have no colour and get white", r->t.name,
                 r->faces_without_color);
    return spread_texcoords(r);
}

static fct_result read_records(reader *r, const char *begin, int64_t vertices, int64_t faces) {
    fct_result result = FCT_OK;
    double size = (double)(r->t.end - begin);
    for (int64_t i = 0; result == FCT_OK && i < vertices; ++i) {
        if (i % 65536 == 0) result = fct_progress(r->t.env, "read", (double)(r->t.p - begin) / size);
        if (result == FCT_OK) result = read_vertex(r, (size_t)i);
    }
    for (int64_t i = 0; result == FCT_OK && i < faces; ++i) {
        if (i % 65536 == 0) result = fct_progress(r->t.env, "read", (double)(r->t.p - begin) / size);
        if (result == FCT_OK) result = read_face(r, (uint32_t)i);
    }
    return result;
}

fct_result fct_read_off(const fct_source *source, fct_soup *out) {
    static const char mark[] = "# facetree linear";
    const char *begin = source->data;
    reader r = {.t = fct_text_begin(source->env, source->name, source->data, source->size), .soup = out};
    r.free = out->layout > 0;
    if (!fct_text_skip_lines(&r.t, '#')) return fct_text_expected(&r.t, "OFF");
    int64_t vertices = 0, faces = 0;
    fct_result result = read_head(&r);
    if (result == FCT_OK) result = read_counts(&r, &vertices, &faces);
    if (result != FCT_OK) return result;
    r.linear = memmem(begin, (size_t)(r.t.p - begin), mark, strlen(mark));
    if (!choose_layout(&r, out->layout)) return FCT_ERROR_DATA;
    result = allocate_mesh(&r, (size_t)vertices, (size_t)faces);
    if (result == FCT_OK) result = read_records(&r, begin, vertices, faces);
    if (result == FCT_OK) result = complete_mesh(&r);
    fct_release(source->env, r.texcoords);
    return result;
}
