/* mesh/text/obj_read.c: Wavefront OBJ.
 *
 * The first pass counts statements and corners, so that each array is allocated once. The second pass reads.
 * Faces keep their order and all their corners, repeated ones too. A `v` line may carry a weight, which the
 * reader ignores, and a colour (three linear floats). Texture coordinates are stored per corner. Materials
 * are numbered in the order of their first use. Normals are kept only if every corner has one and all
 * corners of a vertex have the same one. The reader skips lines, points and free-form surfaces with a
 * message, and groups and smoothing without one.
 */
#include "mesh/text/obj_read.h"

#include <math.h>
#include <string.h>

#include "mesh/text/text.h"

typedef struct counts {
    size_t vertices, texcoords, normals, faces, corners;
} counts;

typedef struct reader {
    fct_text t;
    fct_soup *soup;
    counts total; /* of the file */
    counts seen;  /* so far */
    float *texcoords, *normals;
    uint32_t *corner_normals; /* per corner, FCT_NONE: the corner has none; NULL: the file has no vn */
    size_t corners_without_texcoord, corners_without_normal, vertices_without_color;
    size_t unknown, elements_left_out;
    uint32_t material; /* FCT_NONE before the first usemtl */
    uint32_t *slots;   /* hash table of material numbers, FCT_NONE: free slot */
    size_t slot_count;
    size_t name_capacity, material_capacity;
    bool known; /* the reader has understood a statement */
} reader;

/* In OBJ, a backslash at the end of a line continues it. It counts as a blank. */
static void skip_blanks(fct_text *t) {
    for (;;) {
        fct_text_skip_blanks(t);
        const char *p = t->p;
        if (p == t->end || *p != '\\') return;
        ++p;
        if (p < t->end && *p == '\r') ++p;
        if (p == t->end || *p != '\n') return;
        t->p = p + 1;
        ++t->line;
    }
}

static bool at_line_end(fct_text *t) {
    skip_blanks(t);
    return t->p == t->end || *t->p == '\n' || *t->p == '#';
}

/* Moves to the end of the word. A backslash that continues the line ends the word. */
static void skip_word(fct_text *t) {
    while (t->p < t->end && *t->p != '\n' && !fct_text_is_blank(*t->p)) {
        if (*t->p == '\\') {
            fct_text ahead = *t;
            skip_blanks(&ahead);
            if (ahead.p != t->p) return;
        }
        ++t->p;
    }
}

static void count_face(fct_text *t, counts *c) {
    size_t corners = 0;
    for (; !at_line_end(t); ++corners) skip_word(t);
    ++c->faces;
    c->corners += corners;
}

/* Sizes the arrays, so both passes must split the text into the same statements and corners. */
static void count_statements(fct_text t, counts *c) {
    while (fct_text_skip_lines(&t, '#')) {
        const char *p = t.p;
        size_t left = (size_t)(t.end - p);
        char first = *p, second = left > 1 ? p[1] : '\n', third = left > 2 ? p[2] : '\n';
        if (first == 'v') {
            c->vertices += fct_text_is_blank(second);
            c->texcoords += second == 't' && fct_text_is_blank(third);
            c->normals += second == 'n' && fct_text_is_blank(third);
        } else if (first == 'f' && fct_text_is_blank(second)) {
            ++t.p;
            count_face(&t, c);
        }
        bool name = left > 6 && !memcmp(p, "usemtl", 6) && fct_text_is_blank(p[6]);
        if (!name)
            while (!at_line_end(&t)) skip_word(&t);
        fct_text_next_line(&t);
    }
}

/* Reads `least` to `most` floats of the line. *count receives their number. */
static fct_result read_floats(reader *r, size_t least, size_t most, float *values, size_t *count) {
    *count = 0;
    while (*count < most && (*count < least || !at_line_end(&r->t))) {
        skip_blanks(&r->t);
        fct_result result = fct_text_float(&r->t, "a number", values + *count);
        if (result != FCT_OK) return result;
        ++*count;
    }
    return FCT_OK;
}

static fct_result read_vertex(reader *r) {
    float values[8];
    size_t count;
    fct_result result = read_floats(r, 3, 7, values, &count);
    if (result != FCT_OK) return result;
    if (count == 5) return fct_text_fail(&r->t, "a vertex has 3, 4, 6 or 7 numbers, not 5");
    size_t v = r->seen.vertices++;
    memcpy(r->soup->positions + 3 * v, values, 3 * sizeof(float));
    if (count < 6) {
        ++r->vertices_without_color;
        if (!r->soup->colors) return FCT_OK;
    } else if (!r->soup->colors) {
        r->soup->colors = fct_allocate(r->t.env, r->total.vertices, 3 * sizeof(float));
        if (!r->soup->colors) return fct_fail_memory(r->t.env, "vertex colours");
        for (size_t i = 0; i < 3 * v; ++i) r->soup->colors[i] = 1;
    }
    static const float white[3] = {1, 1, 1};
    memcpy(r->soup->colors + 3 * v, count < 6 ? white : values + (count == 6 ? 3 : 4), 3 * sizeof(float));
    return FCT_OK;
}

/* Converts an OBJ number to an index from 0. OBJ counts from 1 forwards, and from -1 backwards from the last
 * element read so far. A positive number may refer to an element that follows later in the file. */
static fct_result read_index(reader *r, const char *what, size_t seen, size_t total, uint32_t *index) {
    fct_text *t = &r->t;
    const char *p = t->p, *digits;
    bool negative = p < t->end && *p == '-';
    p += negative;
    uint64_t number = 0;
    for (digits = p; p < t->end && (unsigned char)(*p - '0') < 10; ++p)
        if (number < UINT64_MAX / 100) number = 10 * number + (uint64_t)(*p - '0');
    if (p == digits || (p < t->end && *p != '/' && *p != '\n' && *p != '\\' && !fct_text_is_blank(*p)))
        return fct_text_expected(t, "an index such as 1, 1/2, 1//3 or 1/2/3");
    uint64_t limit = negative ? seen : total;
    if (!number || number > limit)
        return fct_text_fail(t, "%s index %s%llu is out of range, of %zu", what, negative ? "-" : "",
                             (unsigned long long)number, negative ? seen : total);
    *index = (uint32_t)(negative ? seen - number : number - 1);
    t->p = p;
    return FCT_OK;
}

static bool skip_char(fct_text *t, char c) {
    if (t->p == t->end || *t->p != c) return false;
    ++t->p;
    return true;
}

static fct_result read_corner(reader *r) {
    fct_text *t = &r->t;
    if (r->seen.corners >= r->total.corners) return fct_text_expected(t, "a corner");
    size_t corner = r->seen.corners++;
    uint32_t texcoord = FCT_NONE, normal = FCT_NONE;
    fct_result result =
        read_index(r, "vertex", r->seen.vertices, r->total.vertices, r->soup->corners + corner);
    if (result == FCT_OK && skip_char(t, '/')) {
        if (t->p < t->end && *t->p != '/' && !fct_text_is_blank(*t->p) && *t->p != '\n')
            result = read_index(r, "texture coordinate", r->seen.texcoords, r->total.texcoords, &texcoord);
        if (result == FCT_OK && skip_char(t, '/'))
            result = read_index(r, "normal", r->seen.normals, r->total.normals, &normal);
    }
    if (result != FCT_OK) return result;
    if (t->p < t->end && *t->p == '/') return fct_text_expected(t, "the end of a corner");
    r->corners_without_texcoord += texcoord == FCT_NONE;
    r->corners_without_normal += normal == FCT_NONE;
    if (r->corner_normals) r->corner_normals[corner] = normal;
    /* vt lines may follow the faces, so this array holds their numbers until look_up_texcoords. */
    if (r->soup->texcoords) memcpy(r->soup->texcoords + 2 * corner, &texcoord, sizeof texcoord);
    return FCT_OK;
}

static uint32_t hash_name(const char *text, size_t length) {
    uint32_t h = 2166136261u; /* FNV-1a */
    for (size_t i = 0; i < length; ++i) h = (h ^ (unsigned char)text[i]) * 16777619u;
    return h;
}

static uint32_t *find_slot(const reader *r, const char *text, size_t length) {
    size_t i = hash_name(text, length) & (r->slot_count - 1);
    for (;; i = (i + 1) & (r->slot_count - 1)) {
        uint32_t number = r->slots[i];
        if (number == FCT_NONE) return r->slots + i;
        const char *name = r->soup->material_names[number];
        if (strlen(name) == length && !memcmp(name, text, length)) return r->slots + i;
    }
}

static fct_result grow_slots(reader *r) {
    size_t count = r->slot_count ? 2 * r->slot_count : 64;
    uint32_t *slots = fct_allocate(r->t.env, count, sizeof(uint32_t));
    if (!slots) return fct_fail_memory(r->t.env, "material names");
    memset(slots, 0xff, count * sizeof(uint32_t));
    fct_release(r->t.env, r->slots);
    r->slots = slots;
    r->slot_count = count;
    for (uint32_t i = 0; i < r->soup->material_count; ++i) {
        const char *name = r->soup->material_names[i];
        *find_slot(r, name, strlen(name)) = i;
    }
    return FCT_OK;
}

/* Finds the material of that name or adds one, and returns its number. */
static fct_result number_material(reader *r, const char *text, size_t length, uint32_t *number) {
    fct_soup *soup = r->soup;
    fct_result result = FCT_OK;
    if (2 * ((size_t)soup->material_count + 1) > r->slot_count) result = grow_slots(r);
    if (result != FCT_OK) return result;
    uint32_t *slot = find_slot(r, text, length);
    if (*slot == FCT_NONE) {
        result = fct_grow(r->t.env, (void **)&soup->material_names, &r->name_capacity,
                          (size_t)soup->material_count + 1, sizeof(char *));
        if (result != FCT_OK) return result;
        char *name = fct_copy_text(r->t.env, text, length);
        if (!name) return fct_fail_memory(r->t.env, "material names");
        soup->material_names[soup->material_count] = name;
        *slot = soup->material_count++;
    }
    *number = *slot;
    return FCT_OK;
}

/* The name is the rest of the line. It may contain blanks, `#` and `\`. */
static fct_result read_usemtl(reader *r) {
    fct_text *t = &r->t;
    fct_text_skip_blanks(t);
    const char *begin = t->p, *end = begin;
    while (end < t->end && *end != '\n') ++end;
    t->p = end;
    while (end > begin && fct_text_is_blank(end[-1])) --end;
    if (memchr(begin, 0, (size_t)(end - begin)))
        return fct_text_fail(t, "a material's name with a zero byte in it");
    fct_soup *soup = r->soup;
    if (!soup->materials) {
        soup->materials = fct_allocate(r->t.env, r->total.faces, sizeof(uint32_t));
        if (!soup->materials) return fct_fail_memory(r->t.env, "materials");
        /* Faces before the first usemtl get a material with an empty name. */
        if (r->seen.faces) {
            fct_result result = number_material(r, "", 0, &r->material);
            if (result != FCT_OK) return result;
            for (size_t i = 0; i < r->seen.faces; ++i) soup->materials[i] = r->material;
        }
    }
    r->material = FCT_NONE;
    return number_material(r, begin, (size_t)(end - begin), &r->material);
}

static fct_result read_face(reader *r) {
    size_t first = r->seen.corners;
    while (!at_line_end(&r->t)) {
        fct_result result = read_corner(r);
        if (result != FCT_OK) return result;
    }
    size_t corners = r->seen.corners - first;
    if (corners < 3) return fct_text_fail(&r->t, "a face has at least 3 corners, not %zu", corners);
    size_t face = r->seen.faces++;
    if (r->soup->starts) r->soup->starts[face + 1] = (uint32_t)r->seen.corners;
    if (r->soup->materials) r->soup->materials[face] = r->material;
    return FCT_OK;
}

static fct_result read_texcoord(reader *r) {
    float values[3] = {0, 0, 0};
    size_t count;
    fct_result result = read_floats(r, 1, 3, values, &count);
    memcpy(r->texcoords + 2 * r->seen.texcoords++, values, 2 * sizeof(float));
    return result;
}

static fct_result read_normal(reader *r) {
    size_t count;
    return read_floats(r, 3, 3, r->normals + 3 * r->seen.normals++, &count);
}

static bool list_contains(const char *word, size_t length, const char *const *list) {
    for (; *list; ++list)
        if (fct_text_word_is(word, length, *list)) return true;
    return false;
}

/* Skips statements that hold neither vertices nor faces. The first statement must be a known one. */
static fct_result read_other(reader *r, const char *word, size_t length) {
    static const char *const silent[] = {"o",      "g",          "s",         "mg",    "mtllib", "maplib",
                                         "usemap", "bevel",      "c_interp",  "lod",   "vp",     "d_interp",
                                         "ctech",  "shadow_obj", "trace_obj", "stech", NULL};
    static const char *const geometry[] = {"p",    "l",    "curv", "curv2",  "surf", "parm",
                                           "trim", "hole", "scrv", "sp",     "end",  "con",
                                           "deg",  "bmat", "step", "cstype", NULL};
    if (list_contains(word, length, geometry)) {
        ++r->elements_left_out;
    } else if (!list_contains(word, length, silent)) {
        if (!r->known) {
            r->t.p = word;
            return fct_text_expected(&r->t, "an OBJ statement");
        }
        if (!r->unknown++)
            fct_note(r->t.env, FCT_MESSAGE_WARNING, "%s:%llu: unknown statements are left out, '%.*s' first",
                     r->t.name, (unsigned long long)r->t.line, (int)(length < 40 ? length : 40), word);
    }
    r->known = true;
    while (!at_line_end(&r->t)) skip_word(&r->t);
    return FCT_OK;
}

static fct_result read_statement(reader *r) {
    const char *word = r->t.p;
    skip_word(&r->t);
    size_t length = (size_t)(r->t.p - word);
    fct_result (*read)(reader *) = NULL;
    size_t seen = 0, total = 1;
    if (length == 1 && *word == 'v')
        read = read_vertex, seen = r->seen.vertices, total = r->total.vertices;
    else if (length == 1 && *word == 'f')
        read = read_face, seen = r->seen.faces, total = r->total.faces;
    else if (length == 2 && word[0] == 'v' && word[1] == 't')
        read = read_texcoord, seen = r->seen.texcoords, total = r->total.texcoords;
    else if (length == 2 && word[0] == 'v' && word[1] == 'n')
        read = read_normal, seen = r->seen.normals, total = r->total.normals;
    else if (fct_text_word_is(word, length, "usemtl"))
        read = read_usemtl;
    if (!read) return read_other(r, word, length);
    if (seen >= total) return fct_text_expected(&r->t, "numbers on the same line");
    r->known = true;
    fct_result result = read(r);
    if (result == FCT_OK && !at_line_end(&r->t)) return fct_text_expected(&r->t, "the end of the line");
    return result;
}

static fct_result allocate_mesh(reader *r) {
    const fct_env *env = r->t.env;
    const counts *c = &r->total;
    if (c->vertices > FCT_MESH_LIMIT || c->faces > FCT_MESH_LIMIT || c->corners > UINT32_MAX ||
        c->texcoords >= FCT_NONE || c->normals >= FCT_NONE)
        return fct_fail(env, FCT_ERROR_DATA, "%s: %zu vertices and %zu faces are too many", r->t.name,
                        c->vertices, c->faces);
    fct_soup *soup = r->soup;
    soup->vertex_count = (uint32_t)c->vertices;
    soup->polygon_count = (uint32_t)c->faces;
    soup->corner_count = c->corners;
    const fct_array arrays[] = {
        FCT_ARRAY(soup->positions, 3 * c->vertices),
        FCT_ARRAY(soup->corners, c->corners),
        FCT_ARRAY(r->texcoords, 2 * c->texcoords),
        FCT_ARRAY(r->normals, 3 * c->normals),
        FCT_ARRAY_IF(c->texcoords, soup->texcoords, 2 * c->corners),
        FCT_ARRAY_IF(c->normals, r->corner_normals, c->corners),
        FCT_ARRAY_IF(c->corners != 3 * c->faces, soup->starts, c->faces + 1),
    };
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "a mesh");
    if (soup->starts) soup->starts[0] = 0;
    return result;
}

static void look_up_texcoords(reader *r) {
    fct_soup *soup = r->soup;
    if (!soup->texcoords) return;
    if (r->corners_without_texcoord == soup->corner_count) { /* the file has vt, but no face uses them */
        fct_release(r->t.env, soup->texcoords);
        soup->texcoords = NULL;
        return;
    }
    if (r->corners_without_texcoord)
        fct_note(r->t.env, FCT_MESSAGE_WARNING, "%s: %zu corners have no texture coordinate and get 0 0",
                 r->t.name, r->corners_without_texcoord);
    for (size_t i = 0; i < soup->corner_count; ++i) {
        static const float none[2] = {0, 0};
        uint32_t number;
        memcpy(&number, soup->texcoords + 2 * i, sizeof number);
        memcpy(soup->texcoords + 2 * i, number == FCT_NONE ? none : r->texcoords + 2 * (size_t)number,
               sizeof none);
    }
}

/* Whether every corner has a normal and all corners of a vertex have the same. numbers[v] receives the number
 * of vertex v's normal. */
static bool normals_agree(const reader *r, uint32_t *numbers) {
    const fct_soup *soup = r->soup;
    memset(numbers, 0xff, soup->vertex_count * sizeof(uint32_t));
    for (size_t i = 0; i < soup->corner_count; ++i) {
        uint32_t number = r->corner_normals[i], *place = numbers + soup->corners[i];
        if (number == FCT_NONE) return false;
        if (*place != FCT_NONE && *place != number &&
            memcmp(r->normals + 3 * (size_t)*place, r->normals + 3 * (size_t)number, 3 * sizeof(float)))
            return false;
        *place = number;
    }
    return true;
}

static fct_result collect_normals(reader *r) {
    fct_soup *soup = r->soup;
    if (!r->corner_normals || r->corners_without_normal == soup->corner_count) return FCT_OK;
    uint32_t *numbers = fct_allocate(r->t.env, soup->vertex_count, sizeof(uint32_t));
    if (!numbers) return fct_fail_memory(r->t.env, "normals");
    fct_result result = FCT_OK;
    if (!normals_agree(r, numbers)) {
        fct_note(r->t.env, FCT_MESSAGE_NOTE,
                 "%s: normals are left out, because the corners of a vertex do not share one", r->t.name);
    } else if ((soup->normals = fct_allocate_zero(r->t.env, soup->vertex_count, 3 * sizeof(float)))) {
        for (size_t v = 0; v < soup->vertex_count; ++v)
            if (numbers[v] != FCT_NONE)
                memcpy(soup->normals + 3 * v, r->normals + 3 * (size_t)numbers[v], 3 * sizeof(float));
    } else {
        result = fct_fail_memory(r->t.env, "normals");
    }
    fct_release(r->t.env, numbers);
    return result;
}

static fct_result complete_mesh(reader *r) {
    if (!r->known) return fct_fail(r->t.env, FCT_ERROR_DATA, "%s: the file has no OBJ statement", r->t.name);
    if (r->soup->colors && r->vertices_without_color)
        fct_note(r->t.env, FCT_MESSAGE_WARNING, "%s: %zu vertices have no colour and get white", r->t.name,
                 r->vertices_without_color);
    if (r->elements_left_out)
        fct_note(r->t.env, FCT_MESSAGE_NOTE,
                 "%s: %zu statements of points, lines and free-form shapes are left out", r->t.name,
                 r->elements_left_out);
    look_up_texcoords(r);
    return collect_normals(r);
}

fct_result fct_read_obj(const fct_source *source, fct_soup *out) {
    const char *begin = source->data;
    reader r = {
        .t = {begin, begin + source->size, source->env, source->name, 1}, .soup = out, .material = FCT_NONE};
    count_statements(r.t, &r.total);
    fct_result result = allocate_mesh(&r);
    for (uint64_t n = 0; result == FCT_OK && fct_text_skip_lines(&r.t, '#'); ++n) {
        if (n % 262144 == 0)
            result = fct_progress(source->env, "read", (double)(r.t.p - begin) / (double)source->size);
        if (result == FCT_OK) result = read_statement(&r);
        if (result == FCT_OK) fct_text_next_line(&r.t);
    }
    if (result == FCT_OK) result = complete_mesh(&r);
    fct_release(source->env, r.texcoords);
    fct_release(source->env, r.normals);
    fct_release(source->env, r.corner_normals);
    fct_release(source->env, r.slots);
    return result;
}
