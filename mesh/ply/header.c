/* mesh/ply/header.c: see header.h. */
#include "mesh/ply/header.h"

#include <string.h>

#include "mesh/soup.h"

#define WORD_IS(text) fct_text_word_is(word, length, text)

static fct_ply_type find_type(const char *word, size_t length) {
    static const struct {
        const char *name;
        fct_ply_type type;
    } names[] = {{"char", FCT_PLY_INT8},     {"int8", FCT_PLY_INT8},     {"uchar", FCT_PLY_UINT8},
                 {"uint8", FCT_PLY_UINT8},   {"short", FCT_PLY_INT16},   {"int16", FCT_PLY_INT16},
                 {"ushort", FCT_PLY_UINT16}, {"uint16", FCT_PLY_UINT16}, {"int", FCT_PLY_INT32},
                 {"int32", FCT_PLY_INT32},   {"uint", FCT_PLY_UINT32},   {"uint32", FCT_PLY_UINT32},
                 {"float", FCT_PLY_FLOAT},   {"float32", FCT_PLY_FLOAT}, {"double", FCT_PLY_DOUBLE},
                 {"float64", FCT_PLY_DOUBLE}};
    for (size_t i = 0; i < sizeof names / sizeof *names; ++i)
        if (fct_text_word_is(word, length, names[i].name)) return names[i].type;
    return FCT_PLY_NONE;
}

static fct_result read_type(fct_text *t, fct_ply_type *type) {
    const char *begin = t->p;
    size_t length;
    const char *word = fct_text_word(t, &length);
    *type = find_type(word, length);
    if (*type != FCT_PLY_NONE) return FCT_OK;
    t->p = begin;
    return fct_text_expected(t, "a PLY type such as float or uchar");
}

static fct_result read_format(fct_text *t, fct_ply_header *h) {
    const char *begin = t->p;
    size_t length;
    const char *word = fct_text_word(t, &length);
    if (WORD_IS("ascii"))
        h->format = FCT_PLY_ASCII;
    else if (WORD_IS("binary_little_endian"))
        h->format = FCT_PLY_LITTLE;
    else if (WORD_IS("binary_big_endian"))
        h->format = FCT_PLY_BIG;
    else {
        t->p = begin;
        return fct_text_expected(t, "ascii, binary_little_endian or binary_big_endian");
    }
    begin = t->p;
    word = fct_text_word(t, &length);
    if (WORD_IS("1.0")) return FCT_OK;
    t->p = begin;
    return fct_text_expected(t, "PLY version 1.0");
}

static fct_result read_element(fct_text *t, fct_ply_header *h) {
    fct_ply_element element = {.first_property = h->property_count};
    element.name = fct_text_word(t, &element.name_length);
    int64_t count;
    const char *begin = t->p;
    if (!element.name_length) return fct_text_expected(t, "an element's name");
    if (!fct_text_integer(t, &count) || count < 0) {
        t->p = begin;
        return fct_text_expected(t, "an element's count");
    }
    element.count = (uint64_t)count;
    fct_result result =
        fct_grow(t->env, (void **)&h->elements, &h->element_capacity, h->element_count + 1, sizeof element);
    if (result == FCT_OK) h->elements[h->element_count++] = element;
    return result;
}

static fct_result read_property(fct_text *t, fct_ply_header *h) {
    if (!h->element_count) return fct_text_fail(t, "a property before the first element");
    fct_ply_property property = {0};
    const char *begin = t->p;
    size_t length;
    const char *word = fct_text_word(t, &length);
    fct_result result = FCT_OK;
    if (WORD_IS("list")) {
        result = read_type(t, &property.count_type);
        if (result == FCT_OK && property.count_type >= FCT_PLY_FLOAT)
            return fct_text_fail(t, "a list's length has to be an integer");
    } else {
        t->p = begin;
    }
    if (result == FCT_OK) result = read_type(t, &property.type);
    if (result != FCT_OK) return result;
    property.name = fct_text_word(t, &property.name_length);
    if (!property.name_length) return fct_text_expected(t, "a property's name");
    result = fct_grow(t->env, (void **)&h->properties, &h->property_capacity, h->property_count + 1,
                      sizeof property);
    if (result != FCT_OK) return result;
    h->properties[h->property_count++] = property;
    ++h->elements[h->element_count - 1].property_count;
    return FCT_OK;
}

/* "comment facetree material NAME". The name begins after one blank and ends with the line. */
static fct_result read_comment(fct_text *t, fct_ply_header *h) {
    size_t length;
    const char *word = fct_text_word(t, &length);
    if (!WORD_IS("facetree")) return FCT_OK;
    word = fct_text_word(t, &length);
    if (!WORD_IS("material")) return FCT_OK;
    const char *begin = t->p, *end = begin;
    while (end < t->end && *end != '\n' && *end != '\r') ++end;
    if (begin < end) ++begin;
    fct_result result = fct_grow(t->env, (void **)&h->material_names, &h->material_capacity,
                                 h->material_count + 1, sizeof(char *));
    if (result != FCT_OK) return result;
    char *name = fct_copy_text(t->env, begin, (size_t)(end - begin));
    if (!name) return fct_fail_memory(t->env, "material names");
    h->material_names[h->material_count++] = name;
    t->p = end;
    return FCT_OK;
}

static fct_result read_line(fct_text *t, fct_ply_header *h, bool *format_seen, bool *ended) {
    const char *begin = t->p;
    size_t length;
    const char *word = fct_text_word(t, &length);
    if (WORD_IS("comment")) return read_comment(t, h);
    if (WORD_IS("obj_info") || !length) return FCT_OK;
    fct_result result;
    if (WORD_IS("format")) {
        *format_seen = true;
        result = read_format(t, h);
    } else if (WORD_IS("element")) {
        result = read_element(t, h);
    } else if (WORD_IS("property")) {
        result = read_property(t, h);
    } else if (WORD_IS("end_header")) {
        *ended = true;
        result = FCT_OK;
    } else {
        t->p = begin;
        return fct_text_expected(t, "a PLY header line");
    }
    if (result == FCT_OK && !fct_text_at_line_end(t)) return fct_text_expected(t, "the end of the line");
    return result;
}

/* Finds bytes in a text, or returns NULL. */
static const char *find_text(const char *text, const char *end, const char *wanted, size_t length) {
    for (; end - text >= (ptrdiff_t)length; ++text) {
        text = memchr(text, *wanted, (size_t)(end - text) - length + 1);
        if (!text || !memcmp(text, wanted, length)) return text;
    }
    return NULL;
}

const char *fct_ply_find_body(const char *text, size_t size) {
    static const char word[] = "end_header";
    const char *end = text + size, *first = text;
    while (first < end && *first != '\n' && *first != '\r') ++first;
    if (first == end) return NULL;
    bool returns = *first == '\r' && (first + 1 == end || first[1] != '\n');
    char line_end = returns ? '\r' : '\n';
    const char *p = first;
    do {
        p = find_text(p + 1, end, word, strlen(word));
        if (!p) return NULL;
    } while (p[-1] != line_end); /* the words of a comment */
    const char *found = memchr(p, line_end, (size_t)(end - p));
    return found ? found + 1 : NULL;
}

fct_result fct_ply_read_header(fct_text *t, fct_ply_header *h) {
    *h = (fct_ply_header){0};
    size_t length;
    const char *begin = t->p, *word = fct_text_word(t, &length);
    if (!WORD_IS("ply")) {
        t->p = begin;
        return fct_text_expected(t, "'ply'");
    }
    fct_text_next_line(t);
    const char *body = fct_ply_find_body(begin, (size_t)(t->end - begin));
    bool format_seen = false, ended = false;
    while (!ended) {
        if (t->p == t->end) return fct_text_expected(t, "'end_header'");
        fct_result result = read_line(t, h, &format_seen, &ended);
        if (result != FCT_OK) return result;
        fct_text_next_line(t);
    }
    if (body) t->p = body; /* a body of bytes may begin with LF after the CR */
    return format_seen ? FCT_OK : fct_text_fail(t, "the header has no format line");
}

void fct_ply_release_header(const fct_env *env, fct_ply_header *h) {
    for (size_t i = 0; i < h->material_count; ++i) fct_release(env, h->material_names[i]);
    fct_release(env, h->material_names);
    fct_release(env, h->elements);
    fct_release(env, h->properties);
    *h = (fct_ply_header){0};
}
