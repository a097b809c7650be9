/* mesh/text/stl_read.c: STL, binary and text.
 *
 * Corners with equal coordinates become one vertex (-0 equals 0). Vertices are numbered in the order of their
 * first use. Face f of the file is face f of the mesh. The reader ignores facet normals, because the winding
 * gives them.
 *
 * Keywords of text may be in any case, `endsolid`, `endloop` and `endfacet` may be two words, and the last
 * `endsolid` of a file with facets may be missing. In a binary file whose size does not fit the count of its
 * head, the size decides, unless triangles are missing.
 */
#include "mesh/text/stl_read.h"

#include <math.h>
#include <stdio.h>
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

static float read_coordinate(const unsigned char *record, int k) {
    uint32_t bits = little_32(record + 12 + 4 * k);
    float value;
    memcpy(&value, &bits, sizeof bits);
    return value;
}

enum { HEAD = 84, RECORD = 50 };

/* Whether the records could be triangles: finite coordinates, and the last is not only zeros. */
static bool are_triangles(const unsigned char *p, size_t count) {
    static const unsigned char zeros[RECORD];
    if (!count || !memcmp(p + RECORD * (count - 1), zeros, RECORD)) return false;
    for (; count; --count, p += RECORD)
        for (int k = 0; k < 9; ++k)
            if (!isfinite(read_coordinate(p, k))) return false;
    return true;
}

/* Decides how many triangles a binary file has.
 *   1. The count of the head fits the size.
 *   2. Programs that do not know the count in advance leave 0 or -1 in the head, and some count one triangle
 * too few: the size decides, if the bytes behind the counted triangles could be triangles.
 *   3. The file is longer: other bytes follow the triangles.
 *   4. The file is shorter: triangles are missing, an error. */
static fct_result count_triangles(const fct_source *source, uint32_t *count) {
    const unsigned char *data = source->data;
    uint32_t declared = little_32(data + 80);
    bool unknown = declared == 0 || declared == UINT32_MAX;
    size_t fit = (source->size - HEAD) / RECORD, rest = (source->size - HEAD) % RECORD;
    size_t known = unknown ? 0 : declared;
    if (known < fit && (unknown || !rest) && are_triangles(data + HEAD + RECORD * known, fit - known))
        known = fit;
    if (known > fit || fit > FCT_MESH_LIMIT || (unknown && known < fit))
        return fct_fail(source->env, FCT_ERROR_DATA, "%s: %u triangles take %llu bytes, but the file has %zu",
                        source->name, declared, (unsigned long long)(HEAD + RECORD * (uint64_t)declared),
                        source->size);
    if (declared != known)
        fct_note(source->env, FCT_MESSAGE_WARNING,
                 "%s: the head counts %u triangles, but the size of the file gives %zu", source->name,
                 declared, known);
    rest = source->size - HEAD - RECORD * known;
    if (rest)
        fct_note(source->env, FCT_MESSAGE_WARNING, "%s: %zu bytes behind the last triangle are left out",
                 source->name, rest);
    *count = (uint32_t)known;
    return FCT_OK;
}

static fct_result read_triangle(const fct_source *source, welder *w, uint32_t f, const unsigned char *p) {
    for (int c = 0; c < 3; ++c) {
        float q[3];
        for (int k = 0; k < 3; ++k) {
            q[k] = read_coordinate(p, 3 * c + k);
            if (!isfinite(q[k]))
                return fct_fail(w->env, FCT_ERROR_DATA, "%s: triangle %u: a coordinate is not finite (%g)",
                                source->name, f, (double)q[k]);
        }
        fct_result result = add_corner(w, q);
        if (result != FCT_OK) return result;
    }
    return FCT_OK;
}

static fct_result read_binary(const fct_source *source, welder *w) {
    const unsigned char *p = (const unsigned char *)source->data + HEAD;
    uint32_t count = 0, with_attribute = 0;
    fct_result result = count_triangles(source, &count);
    for (uint32_t f = 0; result == FCT_OK && f < count; ++f, p += RECORD) {
        if (f % 65536 == 0) result = fct_progress(w->env, "read", (double)f / count);
        if (result == FCT_OK) result = read_triangle(source, w, f, p);
        with_attribute += p[48] || p[49];
    }
    w->soup->polygon_count = count;
    if (result == FCT_OK && with_attribute)
        fct_note(w->env, FCT_MESSAGE_NOTE, "%s: the attribute bytes of %u triangles are left out",
                 source->name, with_attribute);
    return result;
}

/* Takes the next word of the file if it is `expected`. A word that begins with "end" may be two words. */
static bool take_word(fct_text *t, const char *expected) {
    if (!fct_text_skip_lines(t, 0)) return false;
    fct_text begin = *t;
    size_t length;
    const char *word = fct_text_word(t, &length);
    if (fct_text_word_is_any_case(word, length, expected)) return true;
    if (!strncmp(expected, "end", 3) && fct_text_word_is_any_case(word, length, "end")) {
        word = fct_text_word(t, &length);
        if (fct_text_word_is_any_case(word, length, expected + 3)) return true;
    }
    *t = begin;
    return false;
}

/* Fails unless the next word of the file is `expected`. */
static fct_result expect_word(fct_text *t, const char *expected) {
    char what[32];
    if (take_word(t, expected)) return FCT_OK;
    snprintf(what, sizeof what, "'%s'", expected);
    return fct_text_expected(t, what);
}

/* Reads what follows the word `facet`. */
static fct_result read_facet(fct_text *t, welder *w) {
    double ignored, point[3];
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
        for (int k = 0; result == FCT_OK && k < 3; ++k)
            result = fct_text_coordinate(t, "a coordinate", point + k);
        if (result != FCT_OK) break;
        fct_soup_place(w->soup, point, p);
        result = add_corner(w, p);
    }
    if (result == FCT_OK) result = expect_word(t, "endloop");
    if (result == FCT_OK) result = expect_word(t, "endfacet");
    ++w->soup->polygon_count;
    return result;
}

/* Takes the word behind which a solid or the space between two solids goes on. *inside: in a solid. */
static fct_result read_solid_line(fct_text *t, bool *inside, uint32_t *unended) {
    if (*inside && take_word(t, "endsolid")) {
        *inside = false;
    } else if (take_word(t, "solid")) {
        *unended += *inside;
        *inside = true;
    } else {
        return fct_text_expected(t, *inside ? "'facet' or 'endsolid'" : "'solid'");
    }
    fct_text_next_line(t);
    return FCT_OK;
}

/* A text file may hold several solids. Some programs end it with zeros or Ctrl-Z. */
static fct_result read_text(const fct_source *source, welder *w) {
    fct_text t = fct_text_begin(w->env, source->name, source->data, source->size);
    const char *begin = t.p;
    while (t.end > begin && (t.end[-1] == 0 || t.end[-1] == 0x1a)) --t.end;
    fct_result result = FCT_OK;
    bool inside = false;
    uint32_t unended = 0;
    while (result == FCT_OK && fct_text_skip_lines(&t, 0)) {
        if (!inside || !take_word(&t, "facet")) {
            result = read_solid_line(&t, &inside, &unended);
            continue;
        }
        if (w->soup->polygon_count % 65536 == 0)
            result = fct_progress(w->env, "read", (double)(t.p - begin) / (double)source->size);
        if (result == FCT_OK) result = read_facet(&t, w);
    }
    if (result != FCT_OK) return result;
    if (inside && !w->soup->polygon_count) return fct_text_expected(&t, "'facet' or 'endsolid'");
    unended += inside;
    if (unended)
        fct_note(w->env, FCT_MESSAGE_WARNING, "%s: %u solids have no endsolid", source->name, unended);
    return FCT_OK;
}

/* Whether `facet` or `endsolid` stands in the text. */
static bool has_keyword(fct_text t) {
    while (fct_text_skip_lines(&t, 0)) {
        size_t length;
        if (take_word(&t, "facet") || take_word(&t, "endsolid")) return true;
        fct_text_word(&t, &length);
    }
    return false;
}

/* The head of a binary file may also begin with "solid". Such a file has a zero byte, at the latest in the
 * count, before any keyword of text. */
static bool is_text(const fct_source *source) {
    const unsigned char *p = source->data;
    if (source->size >= HEAD && HEAD + RECORD * (uint64_t)little_32(p + 80) == source->size) return false;
    fct_text t = fct_text_begin(source->env, source->name, source->data, source->size);
    if (!fct_text_skip_lines(&t, 0) || !fct_text_begins_any_case(t.p, (size_t)(t.end - t.p), "solid"))
        return false;
    const char *zero = memchr(t.p, 0, (size_t)(t.end - t.p) < 4096 ? (size_t)(t.end - t.p) : 4096);
    if (!zero) return true;
    t.end = zero;
    return has_keyword(t);
}

fct_result fct_read_stl(const fct_source *source, fct_soup *out) {
    welder w = {.env = source->env, .soup = out};
    bool text = is_text(source);
    if (!text && source->size < HEAD)
        return fct_fail(source->env, FCT_ERROR_DATA,
                        "%s: neither text that begins with 'solid' nor as long as a binary STL's head",
                        source->name);
    fct_result result = fct_grow(w.env, (void **)&out->corners, &w.corner_capacity, 3, sizeof(uint32_t));
    if (result == FCT_OK)
        result = fct_grow(w.env, (void **)&out->positions, &w.vertex_capacity, 3, 3 * sizeof(float));
    if (result == FCT_OK) result = text ? read_text(source, &w) : read_binary(source, &w);
    fct_release(w.env, w.slots);
    return result;
}
