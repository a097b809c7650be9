/* scene/read/obj.c: reads Wavefront OBJ with MTL.
 *
 * The mesh reader reads the mesh. This file reads the objects and the material libraries. Statements `o` and
 * `g` begin an object; objects of one name are one. Kd is the reflectance and Ke the emission; other
 * statements of a library are ignored. A material without emission is two-sided, because the winding of such
 * files is often wrong. A material with emission is one-sided, by the winding. Errors: a library that cannot
 * be read, a material that is used but not defined, a polygon before the first usemtl.
 */
#include "scene/read/obj.h"

#include <jansson.h>
#include <string.h>

#include "base/io/file.h"
#include "mesh/load.h"
#include "mesh/mesh.h"
#include "mesh/text/text.h"
#include "scene/read/path.h"

typedef struct span {
    uint32_t first; /* polygon */
    uint32_t object;
} span;

typedef struct reader {
    fct_scene *scene;
    const fct_env *env;
    const char *name, *base;
    fct_mesh mesh;
    char **objects;     /* their names */
    json_t *object_ids; /* by name */
    span *spans;        /* in the order of the file */
    size_t object_count, object_capacity, span_count, span_capacity;
    char **libraries;
    size_t library_count, library_capacity;
    uint32_t polygons;
} reader;

/* ---- Material libraries ---- */

static fct_result read_color(fct_text *t, const char *what, float out[3]) {
    for (int c = 0; c < 3; ++c) {
        fct_result result = fct_text_float(t, what, out + c);
        if (result != FCT_OK) return result;
        if (c == 0 && (fct_text_at_line_end(t) || *t->p == '#')) {
            out[1] = out[2] = out[0]; /* a single number is grey */
            return FCT_OK;
        }
    }
    if (!fct_text_at_line_end(t) && *t->p != '#') return fct_text_expected(t, "the end of the line");
    return FCT_OK;
}

static const char *read_rest_of_line(fct_text *t, size_t *length) {
    fct_text_skip_blanks(t);
    const char *begin = t->p, *end = begin;
    while (end < t->end && *end != '\n') ++end;
    t->p = end;
    while (end > begin && fct_text_is_blank(end[-1])) --end;
    *length = (size_t)(end - begin);
    return begin;
}

static uint32_t find_material(const fct_scene *scene, const char *name) {
    for (uint32_t m = 0; m < scene->material_count; ++m)
        if (strcmp(scene->materials[m].name, name) == 0) return m;
    return FCT_NONE;
}

static fct_result begin_material(reader *r, fct_text *t, fct_material *material) {
    size_t length;
    const char *name = read_rest_of_line(t, &length);
    *material = (fct_material){.reflectance = {.7f, .7f, .7f}};
    if (length == 0 || length >= sizeof material->name)
        return fct_text_fail(t, "a material's name has %zu bytes, expected 1 to %zu", length,
                             sizeof material->name - 1);
    memcpy(material->name, name, length);
    if (strlen(material->name) != length) return fct_text_fail(t, "a material's name has a zero byte");
    if (find_material(r->scene, material->name) != FCT_NONE)
        return fct_text_fail(t, "material \"%s\" is defined twice", material->name);
    return FCT_OK;
}

static fct_result end_material(reader *r, const fct_text *t, fct_material *material) {
    uint32_t id;
    if (!material->name[0]) return FCT_OK;
    for (int c = 0; c < 3; ++c) {
        if (!(material->reflectance[c] >= 0 && material->reflectance[c] < 1))
            return fct_text_fail(t, "material \"%s\" ends here: expected Kd in [0, 1), found %g",
                                 material->name, (double)material->reflectance[c]);
        if (!(material->emission[c] >= 0))
            return fct_text_fail(t, "material \"%s\" ends here: expected Ke >= 0, found %g", material->name,
                                 (double)material->emission[c]);
    }
    const float *e = material->emission;
    material->two_sided = !(e[0] > 0 || e[1] > 0 || e[2] > 0);
    return fct_scene_add_material(r->scene, material, &id);
}

static fct_result read_library_text(reader *r, fct_text *t) {
    fct_material material = {0};
    fct_result result = FCT_OK;
    while (result == FCT_OK && fct_text_skip_lines(t, '#')) {
        size_t length;
        const char *word = fct_text_word(t, &length);
        if (fct_text_word_is(word, length, "newmtl")) {
            result = end_material(r, t, &material);
            if (result == FCT_OK) result = begin_material(r, t, &material);
        } else if (fct_text_word_is(word, length, "Kd") || fct_text_word_is(word, length, "Ke")) {
            if (!material.name[0]) return fct_text_fail(t, "expected newmtl before %.2s", word);
            result = read_color(t, word[1] == 'd' ? "a reflectance" : "an emission",
                                word[1] == 'd' ? material.reflectance : material.emission);
        }
        if (result == FCT_OK) fct_text_next_line(t);
    }
    return result == FCT_OK ? end_material(r, t, &material) : result;
}

static fct_result read_library(reader *r, const char *library) {
    fct_file file = {0};
    char *path = fct_path_join(r->env, r->base, library);
    if (!path) return FCT_ERROR_MEMORY;
    fct_result result = fct_file_open(r->env, path, &file);
    if (result == FCT_OK) {
        fct_text t = {(const char *)file.data, (const char *)file.data + file.size, r->env, path, 1};
        result = read_library_text(r, &t);
    } else if (result == FCT_ERROR_INPUT) {
        fct_fail(r->env, result, "%s: its material library \"%s\" cannot be read", r->name, path);
    }
    fct_file_close(r->env, &file);
    fct_release(r->env, path);
    return result;
}

/* ---- Objects ---- */

static fct_result add_name(reader *r, char ***names, size_t *count, size_t *capacity, const char *text,
                           size_t length) {
    fct_result result = fct_grow(r->env, (void **)names, capacity, *count + 1, sizeof **names);
    if (result != FCT_OK) return result;
    char *copy = fct_copy_text(r->env, text, length);
    if (!copy) return fct_fail_memory(r->env, "names");
    (*names)[(*count)++] = copy;
    return FCT_OK;
}

static fct_result begin_object(reader *r, const char *name, size_t length) {
    char key[101];
    if (length == 0) name = "object", length = 6;
    if (length >= sizeof key) length = sizeof key - 1;
    memcpy(key, name, length);
    key[length] = 0;
    json_t *known = json_object_get(r->object_ids, key);
    size_t k = known ? (size_t)json_integer_value(known) : r->object_count;
    fct_result result = FCT_OK;
    if (!known) {
        result = add_name(r, &r->objects, &r->object_count, &r->object_capacity, key, length);
        if (result == FCT_OK && json_object_set_new_nocheck(r->object_ids, key, json_integer((json_int_t)k)))
            result = fct_fail_memory(r->env, "names");
    }
    if (result == FCT_OK)
        result = fct_grow(r->env, (void **)&r->spans, &r->span_capacity, r->span_count + 1, sizeof *r->spans);
    if (result == FCT_OK) r->spans[r->span_count++] = (span){r->polygons, (uint32_t)k};
    return result;
}

/* Lists where objects begin, and the material libraries. The mesh reader has already checked the syntax. */
static fct_result scan_objects(reader *r, const char *text, size_t size) {
    fct_text t = {text, text + size, r->env, r->name, 1};
    fct_result result = begin_object(r, "", 0);
    while (result == FCT_OK && fct_text_skip_lines(&t, '#')) {
        size_t length;
        const char *word = fct_text_word(&t, &length);
        if (fct_text_word_is(word, length, "f")) {
            ++r->polygons;
        } else if (fct_text_word_is(word, length, "o") || fct_text_word_is(word, length, "g")) {
            const char *name = read_rest_of_line(&t, &length);
            result = begin_object(r, name, length);
        } else if (fct_text_word_is(word, length, "mtllib")) {
            const char *name = read_rest_of_line(&t, &length);
            result = add_name(r, &r->libraries, &r->library_count, &r->library_capacity, name, length);
        }
        if (result == FCT_OK) fct_text_next_line(&t);
    }
    return result;
}

/* Replaces the file's material ids of faces by those of the scene. */
static fct_result resolve_materials(reader *r) {
    fct_mesh *mesh = &r->mesh;
    if (!mesh->materials)
        return fct_fail(r->env, FCT_ERROR_DATA, "%s: expected usemtl before the first face", r->name);
    uint32_t *ids = fct_allocate(r->env, mesh->material_count, sizeof *ids);
    if (!ids) return fct_fail_memory(r->env, "materials");
    fct_result result = FCT_OK;
    for (uint32_t m = 0; m < mesh->material_count; ++m)
        ids[m] = find_material(r->scene, mesh->material_names[m]);
    for (uint32_t f = 0; f < mesh->face_count && result == FCT_OK; ++f) {
        uint32_t m = mesh->materials[f];
        const char *name = mesh->material_names[m];
        if (ids[m] != FCT_NONE)
            mesh->materials[f] = ids[m];
        else if (name[0])
            result = fct_fail(r->env, FCT_ERROR_DATA,
                              "%s: material \"%s\" is used, but no library defines it", r->name, name);
        else
            result = fct_fail(r->env, FCT_ERROR_DATA, "%s: expected usemtl before the first face", r->name);
    }
    fct_release(r->env, ids);
    return result;
}

/* Adds an object of the listed faces. Its material ids are those of the scene, which may exceed the mesh's
 * own material count, so they are detached from the mesh before it is checked. */
static fct_result add_object(reader *r, const char *name, const uint32_t *faces, uint32_t count) {
    fct_mesh part;
    fct_result result = fct_mesh_extract(r->env, &r->mesh, faces, count, &part, NULL);
    if (result != FCT_OK) return result;
    uint32_t *materials = part.materials;
    part.materials = NULL;
    result = fct_scene_add_object(r->scene, name, &part, NULL, NULL, 0, materials);
    fct_release(r->env, materials);
    fct_mesh_release(r->env, &part);
    return result;
}

static fct_result add_objects(reader *r) {
    const fct_mesh *mesh = &r->mesh;
    uint32_t count = (uint32_t)r->object_count;
    uint32_t *lists = fct_allocate(r->env, mesh->face_count, 2 * sizeof *lists);
    uint32_t *starts = fct_allocate(r->env, r->object_count + 1, sizeof *starts);
    fct_result result = FCT_OK;
    if (!lists || !starts) {
        result = fct_fail_memory(r->env, "objects");
        goto done;
    }
    uint32_t *faces = lists + mesh->face_count;
    size_t at = 0;
    for (uint32_t f = 0; f < mesh->face_count; ++f) { /* lists[f]: object of face f */
        uint32_t polygon = mesh->source_faces ? mesh->source_faces[f] : f;
        while (at + 1 < r->span_count && r->spans[at + 1].first <= polygon) ++at;
        lists[f] = r->spans[at].object;
    }
    fct_scene_sort_faces(lists, mesh->face_count, count, starts, faces);
    for (uint32_t k = 0; k < count && result == FCT_OK; ++k)
        if (starts[k + 1] > starts[k])
            result = add_object(r, r->objects[k], faces + starts[k], starts[k + 1] - starts[k]);
done:
    fct_release(r->env, lists);
    fct_release(r->env, starts);
    return result;
}

bool fct_scene_obj_names_materials(const char *text, size_t size) {
    fct_env env = fct_env_default();
    fct_text t = {text, text + size, &env, "", 1};
    for (; fct_text_skip_lines(&t, '#'); fct_text_next_line(&t)) {
        size_t length;
        const char *word = fct_text_word(&t, &length);
        if (fct_text_word_is(word, length, "usemtl") || fct_text_word_is(word, length, "mtllib")) return true;
    }
    return false;
}

fct_result fct_scene_read_obj(fct_scene *scene, const char *name, const char *text, size_t size,
                              const char *base) {
    reader r = {.scene = scene, .env = scene->env, .name = name, .base = base};
    fct_result result = fct_mesh_parse(r.env, name, text, size, "obj", &r.mesh);
    if (result != FCT_OK) return result;
    r.object_ids = json_object();
    if (!r.object_ids) result = fct_fail_memory(r.env, "names");
    if (result == FCT_OK && r.mesh.face_count == 0)
        result = fct_fail(r.env, FCT_ERROR_DATA, "%s: a scene needs at least one face, found none", name);
    if (result == FCT_OK) result = scan_objects(&r, text, size);
    uint32_t last = r.mesh.face_count ? r.mesh.face_count - 1 : 0;
    if (result == FCT_OK && r.polygons != (r.mesh.source_faces ? r.mesh.source_faces[last] : last) + 1)
        result = fct_fail(r.env, FCT_ERROR_DATA, "%s: a statement other than f continues after a \\", name);
    for (size_t k = 0; result == FCT_OK && k < r.library_count; ++k)
        result = read_library(&r, r.libraries[k]);
    if (result == FCT_OK) result = resolve_materials(&r);
    if (result == FCT_OK) result = add_objects(&r);
    for (size_t k = 0; k < r.object_count; ++k) fct_release(r.env, r.objects[k]);
    for (size_t k = 0; k < r.library_count; ++k) fct_release(r.env, r.libraries[k]);
    json_decref(r.object_ids);
    fct_release(r.env, r.objects);
    fct_release(r.env, r.libraries);
    fct_release(r.env, r.spans);
    fct_mesh_release(r.env, &r.mesh);
    return result;
}
