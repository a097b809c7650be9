/* mesh/obj/read.c: Wavefront OBJ.
 *
 * The first pass counts statements and corners, so that each array is allocated once. The second pass reads.
 * Faces keep their order and all their corners, repeated ones too. Faces of fewer than three corners are left
 * out. Texture coordinates are stored per corner. Materials are numbered in the order of their first use.
 * Normals are kept only if every corner has one and all corners of a vertex have the same one. An index out
 * of range or a value that is not finite drops the texture coordinates or the normals, not the mesh. The
 * reader skips lines, points and free-form surfaces with a message, and groups and smoothing without one.
 */
#include "mesh/obj/read.h"

#include <math.h>
#include <string.h>

#include "mesh/obj/color.h"
#include "mesh/obj/text.h"

typedef struct counts {
    size_t vertices, texcoords, normals, faces, corners;
    size_t short_faces; /* of fewer than three corners, not in `faces` */
} counts;

/* Texture coordinates or normals. */
typedef struct attribute {
    float *values;
    size_t not_finite;      /* elements */
    size_t corners_without; /* an index in range */
    size_t bad_indices;     /* out of range */
    uint64_t bad_line;      /* of the first bad index */
} attribute;

typedef struct reader {
    fct_text t;
    fct_soup *soup;
    counts total; /* of the file */
    counts seen;  /* so far */
    attribute texcoords, normals;
    fct_obj_colors colors;
    uint32_t *corner_normals; /* per corner, FCT_NONE: the corner has none; NULL: the file has no vn */
    size_t unknown, elements_left_out;
    uint32_t material; /* FCT_NONE before the first usemtl */
    uint32_t *slots;   /* hash table of material numbers, FCT_NONE: free slot */
    size_t slot_count;
    size_t name_capacity, material_capacity;
    bool known; /* the reader has understood a statement */
} reader;

/* Sizes the arrays, so both passes must split the text into the same statements and corners. */
static void count_statements(fct_text t, counts *c) {
    while (fct_text_skip_lines(&t, '#')) {
        size_t length;
        const char *word = fct_obj_statement(&t, &length);
        if (fct_obj_is_face(word, length)) {
            size_t corners = fct_obj_count_words(&t);
            c->short_faces += corners < 3;
            c->faces += corners >= 3;
            c->corners += corners >= 3 ? corners : 0;
        } else if (length && length <= 2 && *word == 'v') {
            c->vertices += length == 1;
            c->texcoords += length == 2 && word[1] == 't';
            c->normals += length == 2 && word[1] == 'n';
        }
        if (!fct_obj_takes_name(word, length)) fct_obj_count_words(&t);
        fct_text_next_line(&t);
    }
}

static fct_result read_vertex(reader *r) {
    fct_text *t = &r->t;
    double point[3], more[4];
    size_t v = r->seen.vertices++, count = 0;
    fct_result result = FCT_OK;
    for (size_t k = 0; result == FCT_OK && k < 3; ++k) {
        fct_obj_skip_blanks(t);
        result = fct_text_coordinate(t, "a number", point + k);
    }
    if (result == FCT_OK) fct_soup_place(r->soup, point, r->soup->positions + 3 * v);
    while (result == FCT_OK && count < 4 && !fct_obj_at_line_end(t))
        result = fct_text_any_double(t, "a number", more + count++);
    if (result == FCT_OK && count == 2) return fct_text_fail(t, "a vertex has 3, 4, 6 or 7 numbers, not 5");
    if (result == FCT_OK) result = fct_obj_set_color(t->env, &r->colors, v, r->total.vertices, more, count);
    return result;
}

/* Reads `least` to `most` numbers of the line. Stores the first `kept`; a missing one is 0. */
static fct_result read_attribute(reader *r, attribute *a, size_t index, size_t least, size_t most,
                                 size_t kept) {
    float *values = a->values + kept * index;
    bool finite = true;
    for (size_t k = 0; k < most; ++k) {
        double value = 0;
        if (!fct_obj_at_line_end(&r->t) || k < least) {
            fct_result result = fct_text_any_double(&r->t, "a number", &value);
            if (result != FCT_OK) return result;
        }
        if (k < kept) values[k] = (float)value;
        finite &= k >= kept || isfinite((float)value);
    }
    a->not_finite += !finite;
    return FCT_OK;
}

static fct_result read_texcoord(reader *r) {
    return read_attribute(r, &r->texcoords, r->seen.texcoords++, 1, 3, 2);
}

static fct_result read_normal(reader *r) {
    return read_attribute(r, &r->normals, r->seen.normals++, 3, 3, 3);
}

static bool at_index_end(const fct_text *t) {
    return t->p == t->end || *t->p == '/' || fct_text_is_blank(*t->p) || fct_text_is_line_end(*t->p) ||
           fct_obj_at_continuation(t);
}

/* Converts an OBJ number to an index from 0. OBJ counts from 1 forwards, and from -1 backwards from the last
 * element read so far. A positive number may refer to an element that follows later in the file. Out of
 * range: an error without an attribute, else FCT_NONE. */
static fct_result read_index(reader *r, size_t seen, size_t total, attribute *a, uint32_t *index) {
    fct_text *t = &r->t;
    const char *begin = t->p, *digits;
    bool negative = t->p < t->end && *t->p == '-';
    t->p += negative;
    uint64_t number = 0;
    for (digits = t->p; t->p < t->end && (unsigned char)(*t->p - '0') < 10; ++t->p)
        if (number < UINT64_MAX / 100) number = 10 * number + (uint64_t)(*t->p - '0');
    if (t->p == digits || !at_index_end(t)) {
        t->p = begin;
        return fct_text_expected(t, "an index such as 1, 1/2, 1//3 or 1/2/3");
    }
    uint64_t limit = negative ? seen : total;
    if (number && number <= limit) {
        *index = (uint32_t)(negative ? seen - number : number - 1);
        return FCT_OK;
    }
    if (!a)
        return fct_text_fail(t, "vertex index %s%llu is out of range, of %zu", negative ? "-" : "",
                             (unsigned long long)number, negative ? seen : total);
    if (!a->bad_indices++) a->bad_line = t->line;
    *index = FCT_NONE;
    return FCT_OK;
}

/* Reads `/` and the index behind it, which may be missing. */
static fct_result read_further_index(reader *r, size_t seen, size_t total, attribute *a, uint32_t *index) {
    fct_text *t = &r->t;
    *index = FCT_NONE;
    if (t->p == t->end || *t->p != '/') return FCT_OK;
    ++t->p;
    return at_index_end(t) ? FCT_OK : read_index(r, seen, total, a, index);
}

static fct_result read_corner(reader *r) {
    size_t corner = r->seen.corners++;
    uint32_t texcoord = FCT_NONE, normal = FCT_NONE;
    fct_result result = read_index(r, r->seen.vertices, r->total.vertices, NULL, r->soup->corners + corner);
    if (result == FCT_OK)
        result = read_further_index(r, r->seen.texcoords, r->total.texcoords, &r->texcoords, &texcoord);
    if (result == FCT_OK)
        result = read_further_index(r, r->seen.normals, r->total.normals, &r->normals, &normal);
    if (result != FCT_OK) return result;
    if (r->t.p < r->t.end && *r->t.p == '/') return fct_text_expected(&r->t, "the end of a corner");
    r->texcoords.corners_without += texcoord == FCT_NONE;
    r->normals.corners_without += normal == FCT_NONE;
    if (r->corner_normals) r->corner_normals[corner] = normal;
    /* vt lines may follow the faces, so this array holds their numbers until look_up_texcoords. */
    if (r->soup->texcoords) memcpy(r->soup->texcoords + 2 * corner, &texcoord, sizeof texcoord);
    return FCT_OK;
}

static bool skip_short_face(reader *r) {
    fct_text ahead = r->t;
    if (!r->total.short_faces || fct_obj_count_words(&ahead) >= 3) return false;
    r->t = ahead;
    return true;
}

static fct_result read_face(reader *r) {
    if (skip_short_face(r)) return FCT_OK;
    while (!fct_obj_at_line_end(&r->t)) {
        fct_result result = read_corner(r);
        if (result != FCT_OK) return result;
    }
    size_t face = r->seen.faces++;
    if (r->soup->starts) r->soup->starts[face + 1] = (uint32_t)r->seen.corners;
    if (r->soup->materials) r->soup->materials[face] = r->material;
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

static fct_result read_usemtl(reader *r) {
    size_t length;
    const char *name = fct_text_rest(&r->t, &length);
    if (memchr(name, 0, length)) return fct_text_fail(&r->t, "a material's name with a zero byte in it");
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
    return number_material(r, name, length, &r->material);
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
        char shown[FCT_TEXT_SHOWN];
        if (!r->unknown++)
            fct_note(r->t.env, FCT_MESSAGE_WARNING, "%s:%llu: unknown statements are left out, '%s' first",
                     r->t.name, (unsigned long long)r->t.line, fct_text_show(word, length, shown));
    }
    r->known = true;
    if (fct_obj_takes_name(word, length))
        fct_text_rest(&r->t, &length);
    else
        fct_obj_count_words(&r->t);
    return FCT_OK;
}

static fct_result read_statement(reader *r) {
    size_t length;
    const char *word = fct_obj_statement(&r->t, &length);
    fct_result (*read)(reader *) = NULL;
    if (!length) return FCT_OK;
    if (length == 1 && *word == 'v')
        read = read_vertex;
    else if (fct_obj_is_face(word, length))
        read = read_face;
    else if (length == 2 && word[0] == 'v' && word[1] == 't')
        read = read_texcoord;
    else if (length == 2 && word[0] == 'v' && word[1] == 'n')
        read = read_normal;
    else if (fct_text_word_is(word, length, "usemtl"))
        read = read_usemtl;
    if (!read) return read_other(r, word, length);
    r->known = true;
    fct_result result = read(r);
    if (result == FCT_OK && !fct_obj_at_line_end(&r->t))
        return fct_text_expected(&r->t, "the end of the line");
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
        FCT_ARRAY(r->texcoords.values, 2 * c->texcoords),
        FCT_ARRAY(r->normals.values, 3 * c->normals),
        FCT_ARRAY_IF(c->texcoords, soup->texcoords, 2 * c->corners),
        FCT_ARRAY_IF(c->normals, r->corner_normals, c->corners),
        FCT_ARRAY_IF(c->corners != 3 * c->faces, soup->starts, c->faces + 1),
    };
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "a mesh");
    if (soup->starts) soup->starts[0] = 0;
    return result;
}

/* Whether the attribute has to be left out. Sends the warning. not_finite: of corners. */
static bool is_unusable(const reader *r, const char *what, const attribute *a, size_t not_finite) {
    if (a->bad_indices)
        fct_note(r->t.env, FCT_MESSAGE_WARNING,
                 "%s: %s are left out, because %zu indices are out of range, on line %llu first", r->t.name,
                 what, a->bad_indices, (unsigned long long)a->bad_line);
    else if (not_finite)
        fct_note(r->t.env, FCT_MESSAGE_WARNING,
                 "%s: %s are left out, because those of %zu corners are not finite", r->t.name, what,
                 not_finite);
    return a->bad_indices || not_finite;
}

static bool is_finite_array(const float *values, size_t count) {
    for (size_t k = 0; k < count; ++k)
        if (!isfinite(values[k])) return false;
    return true;
}

/* Replaces the numbers of vt lines by their values. */
static void look_up_texcoords(reader *r) {
    fct_soup *soup = r->soup;
    size_t not_finite = 0;
    for (size_t i = 0; soup->texcoords && i < soup->corner_count; ++i) {
        static const float none[2] = {0, 0};
        uint32_t number;
        memcpy(&number, soup->texcoords + 2 * i, sizeof number);
        const float *value = number == FCT_NONE ? none : r->texcoords.values + 2 * (size_t)number;
        memcpy(soup->texcoords + 2 * i, value, sizeof none);
        if (r->texcoords.not_finite) not_finite += !is_finite_array(value, 2);
    }
    /* A file may have vt lines that no face uses. */
    if (is_unusable(r, "texture coordinates", &r->texcoords, not_finite) ||
        r->texcoords.corners_without == soup->corner_count) {
        fct_release(r->t.env, soup->texcoords);
        soup->texcoords = NULL;
    } else if (r->texcoords.corners_without) {
        fct_note(r->t.env, FCT_MESSAGE_WARNING, "%s: %zu corners have no texture coordinate and get 0 0",
                 r->t.name, r->texcoords.corners_without);
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
            memcmp(r->normals.values + 3 * (size_t)*place, r->normals.values + 3 * (size_t)number,
                   3 * sizeof(float)))
            return false;
        *place = number;
    }
    return true;
}

/* Corners whose normal is not finite. */
static size_t count_bad_normals(const reader *r) {
    size_t bad = 0;
    for (size_t i = 0; r->normals.not_finite && i < r->soup->corner_count; ++i) {
        uint32_t number = r->corner_normals[i];
        bad += number != FCT_NONE && !is_finite_array(r->normals.values + 3 * (size_t)number, 3);
    }
    return bad;
}

/* A normal per corner, zero where the file gives none. */
static fct_result spread_normals(reader *r) {
    fct_soup *soup = r->soup;
    soup->corner_normals = fct_allocate_zero(r->t.env, soup->corner_count, 3 * sizeof(float));
    if (!soup->corner_normals) return fct_fail_memory(r->t.env, "normals");
    for (size_t i = 0; i < soup->corner_count; ++i)
        if (r->corner_normals[i] != FCT_NONE)
            memcpy(soup->corner_normals + 3 * i, r->normals.values + 3 * (size_t)r->corner_normals[i],
                   3 * sizeof(float));
    return FCT_OK;
}

static fct_result collect_normals(reader *r) {
    fct_soup *soup = r->soup;
    if (is_unusable(r, "normals", &r->normals, count_bad_normals(r)) || !r->corner_normals ||
        r->normals.corners_without == soup->corner_count)
        return FCT_OK;
    uint32_t *numbers = fct_allocate(r->t.env, soup->vertex_count, sizeof(uint32_t));
    if (!numbers) return fct_fail_memory(r->t.env, "normals");
    fct_result result = FCT_OK;
    if (!normals_agree(r, numbers) && soup->wants_corners) {
        result = spread_normals(r);
    } else if (!normals_agree(r, numbers)) {
        fct_note(r->t.env, FCT_MESSAGE_NOTE,
                 "%s: normals are left out, because the corners of a vertex do not share one", r->t.name);
    } else if ((soup->normals = fct_allocate_zero(r->t.env, soup->vertex_count, 3 * sizeof(float)))) {
        for (size_t v = 0; v < soup->vertex_count; ++v)
            if (numbers[v] != FCT_NONE)
                memcpy(soup->normals + 3 * v, r->normals.values + 3 * (size_t)numbers[v], 3 * sizeof(float));
    } else {
        result = fct_fail_memory(r->t.env, "normals");
    }
    fct_release(r->t.env, numbers);
    return result;
}

static fct_result complete_mesh(reader *r) {
    if (!r->known) return fct_fail(r->t.env, FCT_ERROR_DATA, "%s: the file has no OBJ statement", r->t.name);
    if (r->total.short_faces)
        fct_note(r->t.env, FCT_MESSAGE_WARNING, "%s: %zu faces of fewer than 3 corners are left out",
                 r->t.name, r->total.short_faces);
    if (r->elements_left_out)
        fct_note(r->t.env, FCT_MESSAGE_NOTE,
                 "%s: %zu statements of points, lines and free-form shapes are left out", r->t.name,
                 r->elements_left_out);
    fct_obj_finish_colors(r->t.env, r->t.name, &r->colors, r->soup);
    look_up_texcoords(r);
    return collect_normals(r);
}

fct_result fct_read_obj(const fct_source *source, fct_soup *out) {
    const char *begin = source->data;
    reader r = {.t = fct_text_begin(source->env, source->name, source->data, source->size),
                .soup = out,
                .material = FCT_NONE};
    count_statements(r.t, &r.total);
    fct_result result = allocate_mesh(&r);
    for (uint64_t n = 0; result == FCT_OK && fct_text_skip_lines(&r.t, '#'); ++n) {
        if (n % 262144 == 0)
            result = fct_progress(source->env, "read", (double)(r.t.p - begin) / (double)source->size);
        if (result == FCT_OK) result = read_statement(&r);
        if (result == FCT_OK) fct_text_next_line(&r.t);
    }
    if (result == FCT_OK) result = complete_mesh(&r);
    fct_obj_release_colors(source->env, &r.colors);
    fct_release(source->env, r.texcoords.values);
    fct_release(source->env, r.normals.values);
    fct_release(source->env, r.corner_normals);
    fct_release(source->env, r.slots);
    return result;
}
