/* mesh/text/stl_read.c: STL, binary and text.
 *
 * Corners with equal coordinates become one vertex (-0 equals 0). Vertices are numbered in the order of their
 * first use. Face f of the file is face f of the mesh. The reader ignores facet normals, because the winding
 * gives them.
 */
#include "mesh/text/stl_read.h"

#include <math.h>
#include <string.h>

#include "mesh/text/text.h"

typedef struct welder {
    const fct_env *env;
    fct_soup *soup;
    size_t corner_capacity, vertex_capacity;
    uint32_t *slots; /* hash table of vertex numbers, FCT_NONE: free slot; at most half full */
    size_t slot_count;
} welder;

static size_t hash_position(const welder *w, const float *p) {
    uint32_t bits[3];
    memcpy(bits, p, sizeof bits);
    uint64_t h = 0;
    for (int k = 0; k < 3; ++k) h = (h ^ bits[k]) * UINT64_C(0x9e3779b97f4a7c15), h ^= h >> 29;
    return (size_t)h & (w->slot_count - 1);
}

static uint32_t *find_slot(const welder *w, const float *p) {
    for (size_t i = hash_position(w, p);; i = (i + 1) & (w->slot_count - 1)) {
        uint32_t v = w->slots[i];
        if (v == FCT_NONE || !memcmp(w->soup->positions + 3 * (size_t)v, p, 3 * sizeof(float)))
            return w->slots + i;
    }
}

static fct_result grow_slots(welder *w) {
    size_t count = w->slot_count ? 2 * w->slot_count : 1024;
    uint32_t *slots = fct_allocate(w->env, count, sizeof(uint32_t));
    if (!slots) return fct_fail_memory(w->env, "a mesh");
    memset(slots, 0xff, count * sizeof(uint32_t));
    fct_release(w->env, w->slots);
    w->slots = slots;
    w->slot_count = count;
    for (uint32_t v = 0; v < w->soup->vertex_count; ++v)
        *find_slot(w, w->soup->positions + 3 * (size_t)v) = v;
    return FCT_OK;
}

/* Appends a corner at p. p must be finite. */
static fct_result add_corner(welder *w, const float *p) {
    fct_soup *soup = w->soup;
    float q[3] = {p[0] + 0.f, p[1] + 0.f, p[2] + 0.f}; /* -0 becomes 0 */
    fct_result result = fct_grow(w->env, (void **)&soup->corners, &w->corner_capacity, soup->corner_count + 1,
                                 sizeof(uint32_t));
    if (result == FCT_OK && 2 * ((size_t)soup->vertex_count + 1) > w->slot_count) result = grow_slots(w);
    if (result != FCT_OK) return result;
    uint32_t *slot = find_slot(w, q);
    if (*slot == FCT_NONE) {
        result = fct_grow(w->env, (void **)&soup->positions, &w->vertex_capacity,
                          (size_t)soup->vertex_count + 1, 3 * sizeof(float));
        if (result != FCT_OK) return result;
        memcpy(soup->positions + 3 * (size_t)soup->vertex_count, q, sizeof q);
        *slot = soup->vertex_count++;
    }
    soup->corners[soup->corner_count++] = *slot;
    return FCT_OK;
}

static uint32_t little_32(const unsigned char *p) {
    return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

static fct_result read_binary(const fct_source *source, welder *w) {
    const unsigned char *p = source->data;
    uint32_t count = little_32(p + 80);
    if (84 + 50 * (uint64_t)count != source->size)
        return fct_fail(w->env, FCT_ERROR_DATA, "%s: %u triangles take %llu bytes, but the file has %zu",
                        source->name, count, (unsigned long long)(84 + 50 * (uint64_t)count), source->size);
    uint32_t with_attribute = 0;
    p += 84;
    for (uint32_t f = 0; f < count; ++f, p += 50) {
        if (f % 65536 == 0) {
            fct_result result = fct_progress(w->env, "read", (double)f / count);
            if (result != FCT_OK) return result;
        }
        for (int c = 0; c < 3; ++c) {
            float q[3];
            for (int k = 0; k < 3; ++k) {
                uint32_t bits = little_32(p + 12 + 12 * c + 4 * k);
                memcpy(q + k, &bits, sizeof bits);
                if (!isfinite(q[k]))
                    return fct_fail(w->env, FCT_ERROR_DATA,
                                    "%s: triangle %u: a coordinate is not finite (%g)", source->name, f,
                                    (double)q[k]);
            }
            fct_result result = add_corner(w, q);
            if (result != FCT_OK) return result;
        }
        with_attribute += p[48] || p[49];
    }
    w->soup->polygon_count = count;
    if (with_attribute)
        fct_note(w->env, FCT_MESSAGE_NOTE, "%s: the attribute bytes of %u triangles are left out",
                 source->name, with_attribute);
    return FCT_OK;
}

/* Fails unless the next word of the file is `expected`. */
static fct_result expect_word(fct_text *t, const char *expected) {
    char what[32] = "'";
    if (fct_text_skip_lines(t, 0)) {
        const char *begin = t->p;
        size_t length;
        const char *word = fct_text_word(t, &length);
        if (fct_text_word_is(word, length, expected)) return FCT_OK;
        t->p = begin;
    }
    strcat(strcat(what, expected), "'");
    return fct_text_expected(t, what);
}

static fct_result read_facet(fct_text *t, welder *w) {
    double ignored;
    float p[3];
    fct_result result = expect_word(t, "normal");
    for (int k = 0; result == FCT_OK && k < 3; ++k) { /* because some programs write nan here */
        size_t length;
        if (!fct_text_double(t, &ignored)) fct_text_word(t, &length);
    }
    if (result == FCT_OK) result = expect_word(t, "outer");
    if (result == FCT_OK) result = expect_word(t, "loop");
    for (int c = 0; result == FCT_OK && c < 3; ++c) {
        result = expect_word(t, "vertex");
        for (int k = 0; result == FCT_OK && k < 3; ++k) result = fct_text_float(t, "a coordinate", p + k);
        if (result == FCT_OK) result = add_corner(w, p);
    }
    if (result == FCT_OK) result = expect_word(t, "endloop");
    if (result == FCT_OK) result = expect_word(t, "endfacet");
    ++w->soup->polygon_count;
    return result;
}

/* A text file may hold several solids. */
static fct_result read_text(const fct_source *source, welder *w) {
    const char *begin = source->data;
    fct_text t = {begin, begin + source->size, w->env, source->name, 1};
    while (fct_text_skip_lines(&t, 0)) {
        fct_result result = expect_word(&t, "solid");
        if (result != FCT_OK) return result;
        fct_text_next_line(&t);
        for (;;) {
            if (!fct_text_skip_lines(&t, 0)) return fct_text_expected(&t, "'facet' or 'endsolid'");
            if (w->soup->polygon_count % 65536 == 0)
                result = fct_progress(w->env, "read", (double)(t.p - begin) / (double)source->size);
            if (result != FCT_OK) return result;
            const char *place = t.p;
            size_t length;
            const char *word = fct_text_word(&t, &length);
            if (fct_text_word_is(word, length, "endsolid")) break;
            if (!fct_text_word_is(word, length, "facet")) {
                t.p = place;
                return fct_text_expected(&t, "'facet' or 'endsolid'");
            }
            result = read_facet(&t, w);
            if (result != FCT_OK) return result;
        }
        fct_text_next_line(&t);
    }
    return FCT_OK;
}

/* Binary files may also begin with "solid", so the size decides first. */
static bool is_binary(const fct_source *source) {
    const unsigned char *p = source->data;
    if (source->size >= 84 && 84 + 50 * (uint64_t)little_32(p + 80) == source->size) return true;
    size_t i = 0;
    while (i < source->size && (p[i] == ' ' || p[i] == '\t' || p[i] == '\r' || p[i] == '\n')) ++i;
    return source->size - i < 5 || memcmp(p + i, "solid", 5) != 0;
}

fct_result fct_read_stl(const fct_source *source, fct_soup *out) {
    welder w = {.env = source->env, .soup = out};
    bool binary = is_binary(source);
    if (binary && source->size < 84)
        return fct_fail(source->env, FCT_ERROR_DATA,
                        "%s: neither text that begins with 'solid' nor as long as a binary STL's head",
                        source->name);
    fct_result result = fct_grow(w.env, (void **)&out->corners, &w.corner_capacity, 3, sizeof(uint32_t));
    if (result == FCT_OK)
        result = fct_grow(w.env, (void **)&out->positions, &w.vertex_capacity, 3, 3 * sizeof(float));
    if (result == FCT_OK) result = binary ? read_binary(source, &w) : read_text(source, &w);
    fct_release(w.env, w.slots);
    return result;
}
