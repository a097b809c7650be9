/* mesh/text/off_read.c: Geomview OFF, text, with the prefixes ST, C and N in any combination.
 *
 * A vertex line holds x y z, then a normal (N), a colour of 3 or 4 components (C), texture coordinates (ST).
 * A face line holds n, n indices, and optionally 3 or 4 colour components or one index into a colour map. The
 * reader ignores the index, because the file does not contain the map. Colour components with a point or an
 * exponent are linear floats; components without are sRGB bytes.
 */
#include "mesh/text/off_read.h"

#include <math.h>
#include <string.h>

#include "mesh/color.h"
#include "mesh/text/text.h"

typedef struct reader {
    fct_text t;
    fct_soup *soup;
    bool has_texcoords, has_colors, has_normals;
    float *texcoords; /* V x 2 or NULL */
    size_t corner_capacity;
    uint32_t faces_without_color;
} reader;

static bool take_prefix(const char **word, size_t *length, const char *prefix) {
    size_t count = strlen(prefix);
    if (*length < count || memcmp(*word, prefix, count)) return false;
    *word += count, *length -= count;
    return true;
}

static fct_result read_head(reader *r) {
    const char *begin = r->t.p;
    size_t length;
    const char *word = fct_text_word(&r->t, &length);
    r->has_texcoords = take_prefix(&word, &length, "ST");
    r->has_colors = take_prefix(&word, &length, "C");
    r->has_normals = take_prefix(&word, &length, "N");
    if (!fct_text_word_is(word, length, "OFF")) {
        r->t.p = begin;
        return fct_text_expected(&r->t, "OFF, or OFF with the prefixes ST, C and N");
    }
    begin = r->t.p;
    word = fct_text_word(&r->t, &length);
    r->t.p = begin;
    if (fct_text_word_is(word, length, "BINARY"))
        return fct_text_expected(&r->t, "a text file; binary OFF is not read");
    return FCT_OK;
}

/* "V F E" on one line. E is not used, so it may be missing or wrong. */
static fct_result read_counts(reader *r, int64_t *vertices, int64_t *faces) {
    int64_t edges;
    fct_text *t = &r->t;
    if (!fct_text_skip_lines(t, '#') || !fct_text_integer(t, vertices) || *vertices < 0)
        return fct_text_expected(t, "the number of vertices");
    if (!fct_text_integer(t, faces) || *faces < 0) return fct_text_expected(t, "the number of faces");
    if (!fct_text_at_line_end(t) && *t->p != '#' && !fct_text_integer(t, &edges))
        return fct_text_expected(t, "the number of edges");
    size_t left = (size_t)(t->end - t->p);
    /* "0 0 0" is the shortest vertex and "3 0 0 0" the shortest face. */
    if ((uint64_t)*vertices > left / 6 || (uint64_t)*faces > left / 8)
        return fct_text_fail(t, "%lld vertices and %lld faces are declared, but %zu bytes are left",
                             (long long)*vertices, (long long)*faces, left);
    return FCT_OK;
}

static bool at_line_end(fct_text *t) {
    return fct_text_at_line_end(t) || *t->p == '#';
}

static fct_result end_line(reader *r) {
    if (!at_line_end(&r->t)) return fct_text_expected(&r->t, "the end of the line");
    fct_text_next_line(&r->t);
    return FCT_OK;
}

/* Reads one colour component. *whole: it is written as an integer. */
static fct_result read_component(reader *r, float *value, bool *whole) {
    const char *begin = r->t.p;
    fct_result result = fct_text_float(&r->t, "a colour component", value);
    *whole = true;
    for (const char *p = begin; p < r->t.p; ++p)
        if (*p == '.' || *p == 'e' || *p == 'E') *whole = false;
    return result;
}

/* Reads the rest of the line: a colour, then `behind` (0 or 2) texture coordinates. The colour goes to
 * color[0..2], the texture coordinates to color[3..4]. *count receives the number of colour components. */
static fct_result read_color(reader *r, size_t behind, float *color, size_t *count) {
    float values[8];
    bool whole = true, one;
    for (*count = 0; *count < 4 + behind && !at_line_end(&r->t); ++*count) {
        fct_result result = read_component(r, values + *count, &one);
        if (result != FCT_OK) return result;
        if (*count < 3) whole = whole && one;
    }
    if (*count < behind) return fct_text_expected(&r->t, "a number");
    *count -= behind;
    if (behind == 2) memcpy(color + 3, values + *count, 2 * sizeof(float));
    if (*count < 3) return FCT_OK;
    for (int k = 0; k < 3; ++k) {
        if (whole && (values[k] < 0 || values[k] > 255))
            return fct_text_fail(&r->t, "a colour component of %g, expected 0 to 255", (double)values[k]);
        color[k] = whole ? fct_linear_from_srgb(values[k] / 255.0) : values[k];
    }
    return FCT_OK;
}

static fct_result read_vertex(reader *r, size_t v) {
    fct_text *t = &r->t;
    if (!fct_text_skip_lines(t, '#')) return fct_text_expected(t, "another vertex");
    fct_result result = FCT_OK;
    for (int k = 0; result == FCT_OK && k < 3; ++k)
        result = fct_text_float(t, "a coordinate", r->soup->positions + 3 * v + k);
    for (int k = 0; result == FCT_OK && r->has_normals && k < 3; ++k)
        result = fct_text_float(t, "a normal's coordinate", r->soup->normals + 3 * v + k);
    if (result == FCT_OK && r->has_colors) {
        float values[5];
        size_t count;
        result = read_color(r, r->has_texcoords ? 2 : 0, values, &count);
        if (result == FCT_OK && count < 3) return fct_text_expected(t, "a colour of 3 or 4 components");
        if (result != FCT_OK) return result;
        memcpy(r->soup->colors + 3 * v, values, 3 * sizeof(float));
        if (r->has_texcoords) memcpy(r->texcoords + 2 * v, values + 3, 2 * sizeof(float));
    } else {
        for (int k = 0; result == FCT_OK && r->has_texcoords && k < 2; ++k)
            result = fct_text_float(t, "a texture coordinate", r->texcoords + 2 * v + k);
    }
    return result == FCT_OK ? end_line(r) : result;
}

static fct_result read_indices(reader *r, int64_t count) {
    fct_soup *soup = r->soup;
    fct_result result = fct_grow(r->t.env, (void **)&soup->corners, &r->corner_capacity,
                                 soup->corner_count + (size_t)count, sizeof(uint32_t));
    for (int64_t k = 0; result == FCT_OK && k < count; ++k) {
        int64_t index;
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

static fct_result read_face(reader *r, uint32_t face) {
    fct_text *t = &r->t;
    fct_soup *soup = r->soup;
    int64_t count;
    if (!fct_text_skip_lines(t, '#')) return fct_text_expected(t, "another face");
    if (!fct_text_integer(t, &count)) return fct_text_expected(t, "a face's number of corners");
    if (count < 3) return fct_text_fail(t, "a face has at least 3 corners, not %lld", (long long)count);
    if (count > (t->end - t->p) / 2 + 1 || soup->corner_count + (size_t)count > UINT32_MAX)
        return fct_text_fail(t, "a face of %lld corners on a line that has no room for them",
                             (long long)count);
    fct_result result = read_indices(r, count);
    if (result != FCT_OK) return result;
    soup->starts[face + 1] = (uint32_t)soup->corner_count;
    float color[3];
    size_t components;
    result = read_color(r, 0, color, &components);
    if (result != FCT_OK) return result;
    if (components == 2) return fct_text_expected(t, "a colour of 3 or 4 components");
    if (components < 3) {
        ++r->faces_without_color;
        if (!soup->polygon_colors) return end_line(r);
        color[0] = color[1] = color[2] = 1;
    } else if (!soup->polygon_colors) {
        soup->polygon_colors = fct_allocate(t->env, soup->polygon_count, 3 * sizeof(float));
        if (!soup->polygon_colors) return fct_fail_memory(t->env, "face colours");
        for (size_t i = 0; i < 3 * (size_t)face; ++i) soup->polygon_colors[i] = 1;
    }
    memcpy(soup->polygon_colors + 3 * (size_t)face, color, sizeof color);
    return end_line(r);
}

static fct_result allocate_mesh(reader *r, size_t vertices, size_t faces) {
    const fct_env *env = r->t.env;
    fct_soup *soup = r->soup;
    soup->vertex_count = (uint32_t)vertices;
    soup->polygon_count = (uint32_t)faces;
    r->corner_capacity = 3 * faces;
    const fct_array arrays[] = {
        FCT_ARRAY(soup->positions, 3 * vertices),
        FCT_ARRAY(soup->corners, r->corner_capacity),
        FCT_ARRAY_ZERO(soup->starts, faces + 1),
        FCT_ARRAY_IF(r->has_colors, soup->colors, 3 * vertices),
        FCT_ARRAY_IF(r->has_normals, soup->normals, 3 * vertices),
        FCT_ARRAY_IF(r->has_texcoords, r->texcoords, 2 * vertices),
    };
    return fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "a mesh");
}

static fct_result complete_mesh(reader *r) {
    fct_soup *soup = r->soup;
    if (fct_text_skip_lines(&r->t, '#')) return fct_text_expected(&r->t, "the end of the file");
    if (soup->polygon_colors && r->faces_without_color)
        fct_note(r->t.env, FCT_MESSAGE_WARNING, "%s: %u faces have no colour and get white", r->t.name,
                 r->faces_without_color);
    if (!r->texcoords || !soup->corner_count) return FCT_OK;
    soup->texcoords = fct_allocate(r->t.env, soup->corner_count, 2 * sizeof(float));
    if (!soup->texcoords) return fct_fail_memory(r->t.env, "texture coordinates");
    for (size_t i = 0; i < soup->corner_count; ++i)
        memcpy(soup->texcoords + 2 * i, r->texcoords + 2 * (size_t)soup->corners[i], 2 * sizeof(float));
    return FCT_OK;
}

fct_result fct_read_off(const fct_source *source, fct_soup *out) {
    const char *begin = source->data;
    reader r = {.t = {begin, begin + source->size, source->env, source->name, 1}, .soup = out};
    if (!fct_text_skip_lines(&r.t, '#')) return fct_text_expected(&r.t, "OFF");
    int64_t vertices = 0, faces = 0;
    fct_result result = read_head(&r);
    if (result == FCT_OK) result = read_counts(&r, &vertices, &faces);
    if (result == FCT_OK) result = end_line(&r);
    if (result == FCT_OK) result = allocate_mesh(&r, (size_t)vertices, (size_t)faces);
    for (int64_t i = 0; result == FCT_OK && i < vertices; ++i) {
        if (i % 65536 == 0)
            result = fct_progress(source->env, "read", (double)(r.t.p - begin) / (double)source->size);
        if (result == FCT_OK) result = read_vertex(&r, (size_t)i);
    }
    for (int64_t i = 0; result == FCT_OK && i < faces; ++i) {
        if (i % 65536 == 0)
            result = fct_progress(source->env, "read", (double)(r.t.p - begin) / (double)source->size);
        if (result == FCT_OK) result = read_face(&r, (uint32_t)i);
    }
    if (result == FCT_OK) result = complete_mesh(&r);
    fct_release(source->env, r.texcoords);
    return result;
}
