/* scene/read/obj.c: reads Wavefront OBJ with MTL.
 *
 * The mesh reader reads the mesh. This file reads the objects and puts the materials together. Statements `o`
 * and `g` begin an object; objects of one name are one. A face whose material is in no library, or that has
 * no material, becomes grey, with a message.
 */
#include "scene/read/obj.h"

#include <jansson.h>
#include <string.h>

#include "base/io/beside.h"
#include "mesh/load.h"
#include "mesh/mesh.h"
#include "mesh/obj/text.h"
#include "scene/attributes.h"
#include "scene/read/libraries.h"
#include "scene/read/mtl.h"
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
    fct_mtl mtl;
    fct_libraries libraries;
    char **objects;     /* their names in the scene */
    json_t *object_ids; /* by the names of the file */
    json_t *used_names; /* in the scene */
    span *spans;        /* in the order of the file */
    size_t object_count, object_capacity, span_count, span_capacity;
    uint32_t polygons;
    fct_mtl_tally undefined; /* materials */
    size_t bare_faces;       /* without a material */
} reader;

/* ---- Materials ---- */

/* A library that cannot be read is missing. */
static fct_result read_library(reader *r, const char *path) {
    fct_file file = {0};
    fct_env quiet = *r->env;
    quiet.message = NULL;
    fct_result result = fct_file_open(&quiet, path, &file);
    if (result == FCT_OK) {
        fct_text t = fct_text_begin(r->env, path, file.data, file.size);
        char *base = fct_file_folder(r->env, path);
        result = base ? fct_mtl_read(&r->mtl, base, &t) : FCT_ERROR_MEMORY;
        fct_release(r->env, base);
    } else if (result == FCT_ERROR_INPUT) {
        fct_libraries_add_missing(&r->libraries, path, strlen(path));
        result = FCT_OK;
    } else if (result == FCT_ERROR_MEMORY) {
        fct_fail_memory(r->env, "a material library");
    }
    fct_file_close(&quiet, &file);
    return result;
}

static fct_result read_libraries(reader *r) {
    fct_result result = fct_mtl_create(r->scene, &r->mtl);
    for (size_t k = 0; result == FCT_OK && k < r->libraries.count; ++k)
        result = read_library(r, r->libraries.paths[k]);
    return result;
}

/* Finds a material by the name of a usemtl line, which may end in a comment, or adds a grey one. */
static fct_result resolve_name(reader *r, const char *name, uint32_t *id) {
    *id = fct_mtl_find(&r->mtl, name);
    const char *comment = strstr(name, " #");
    if (*id != FCT_NONE) return FCT_OK;
    if (comment) {
        while (comment > name && fct_text_is_blank(comment[-1])) --comment;
        char *part = fct_copy_text(r->env, name, (size_t)(comment - name));
        if (!part) return fct_fail_memory(r->env, "names");
        *id = fct_mtl_find(&r->mtl, part);
        fct_release(r->env, part);
        if (*id != FCT_NONE) return FCT_OK;
    }
    if (name[0] && !r->undefined.count++) fct_text_show(name, strlen(name), r->undefined.first);
    return fct_mtl_add_grey(&r->mtl, name, id);
}

/* Replaces the file's material ids of faces by those of the scene. */
static fct_result resolve_materials(reader *r) {
    fct_mesh *mesh = &r->mesh;
    uint32_t none = FCT_NONE, count = mesh->materials ? mesh->material_count : 0;
    uint32_t *ids = fct_allocate(r->env, count, sizeof *ids);
    fct_result result = ids ? FCT_OK : fct_fail_memory(r->env, "materials");
    for (uint32_t m = 0; ids && m < count; ++m) ids[m] = FCT_NONE;
    if (ids && !mesh->materials) {
        mesh->materials = fct_allocate(r->env, mesh->face_count, sizeof *mesh->materials);
        if (!mesh->materials) result = fct_fail_memory(r->env, "materials");
    }
    for (uint32_t f = 0; f < mesh->face_count && result == FCT_OK; ++f) {
        const char *name = count ? mesh->material_names[mesh->materials[f]] : "";
        uint32_t *id = count ? ids + mesh->materials[f] : &none;
        if (*id == FCT_NONE) result = resolve_name(r, name, id);
        r->bare_faces += !name[0];
        mesh->materials[f] = *id;
    }
    fct_release(r->env, ids);
    return result;
}

static void note_missing(const fct_env *env, const char *name, const fct_libraries *l) {
    if (l->missing)
        fct_note(env, FCT_MESSAGE_WARNING, "%s: %zu material libraries cannot be read (\"%s\" first)", name,
                 l->missing, l->first_missing);
}

static void send_notes(const reader *r) {
    const fct_libraries *l = &r->libraries;
    note_missing(r->env, r->name, l);
    if (l->repeated)
        fct_note(r->env, FCT_MESSAGE_NOTE, "%s: material libraries are named again %zu times and read once",
                 r->name, l->repeated);
    fct_mtl_send_notes(&r->mtl, r->name);
    fct_textures_report(r->env, r->name, &r->mtl.loss);
    if (r->undefined.count)
        fct_note(r->env, FCT_MESSAGE_WARNING,
                 "%s: %zu materials are in no library and become grey (\"%s\" first)", r->name,
                 r->undefined.count, r->undefined.first);
    if (r->bare_faces)
        fct_note(r->env, FCT_MESSAGE_NOTE, "%s: %zu faces have no material and become grey", r->name,
                 r->bare_faces);
}

/* ---- Objects ---- */

static fct_result add_object_name(reader *r, const char *name) {
    char shorter[101]; /* the scene adds a number to names of models */
    fct_result result =
        fct_grow(r->env, (void **)&r->objects, &r->object_capacity, r->object_count + 1, sizeof *r->objects);
    if (result == FCT_OK) result = fct_mtl_choose_name(r->env, r->used_names, name, shorter, sizeof shorter);
    if (result == FCT_OK &&
        json_object_set_new_nocheck(r->object_ids, name, json_integer((json_int_t)r->object_count)))
        result = fct_fail_memory(r->env, "names");
    if (result != FCT_OK) return result;
    char *copy = fct_copy_text(r->env, shorter, strlen(shorter));
    if (!copy) return fct_fail_memory(r->env, "names");
    r->objects[r->object_count++] = copy;
    return FCT_OK;
}

static fct_result begin_object(reader *r, const char *text, size_t length) {
    char *name = length ? fct_copy_text(r->env, text, length) : fct_copy_text(r->env, "object", 6);
    if (!name) return fct_fail_memory(r->env, "names");
    json_t *known = json_object_get(r->object_ids, name);
    size_t k = known ? (size_t)json_integer_value(known) : r->object_count;
    fct_result result = known ? FCT_OK : add_object_name(r, name);
    fct_release(r->env, name);
    if (result == FCT_OK)
        result = fct_grow(r->env, (void **)&r->spans, &r->span_capacity, r->span_count + 1, sizeof *r->spans);
    if (result == FCT_OK) r->spans[r->span_count++] = (span){r->polygons, (uint32_t)k};
    return result;
}

/* Lists where objects begin, and the material libraries. The mesh reader has already checked the syntax. */
static fct_result scan_objects(reader *r, const char *text, size_t size) {
    fct_text t = fct_text_begin(r->env, r->name, text, size);
    fct_result result = begin_object(r, "", 0);
    while (result == FCT_OK && fct_text_skip_lines(&t, '#')) {
        size_t length, rest = 0;
        const char *word = fct_obj_statement(&t, &length), *name = word;
        if (fct_obj_takes_name(word, length))
            name = fct_text_rest(&t, &rest);
        else if (fct_obj_count_words(&t) >= 3)
            r->polygons += fct_obj_is_face(word, length); /* the mesh reader leaves out shorter ones */
        if (length == 1 && (*word == 'o' || *word == 'g'))
            result = begin_object(r, name, rest);
        else if (fct_text_word_is(word, length, "mtllib"))
            result = fct_libraries_add(r->env, r->base, name, rest, &r->libraries);
        fct_text_next_line(&t);
    }
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
    for (uint32_t k = 0; k < count && result == FCT_OK; ++k) {
        if (starts[k + 1] > starts[k])
            result = add_object(r, r->objects[k], faces + starts[k], starts[k + 1] - starts[k]);
        if (result == FCT_OK) result = fct_progress(r->env, "models", (k + 1.0) / count);
    }
done:
    fct_release(r->env, lists);
    fct_release(r->env, starts);
    return result;
}

/* Adds the libraries of an OBJ up to the first that exists. */
static fct_result find_library(const fct_env *env, const char *base, fct_text t, fct_libraries *l) {
    fct_result result = FCT_OK;
    for (; result == FCT_OK && !l->count && fct_text_skip_lines(&t, '#'); fct_text_next_line(&t)) {
        size_t length, rest;
        const char *word = fct_obj_statement(&t, &length);
        if (!fct_obj_takes_name(word, length)) {
            fct_obj_count_words(&t);
        } else if (fct_text_word_is(word, length, "mtllib")) {
            const char *names = fct_text_rest(&t, &rest);
            result = fct_libraries_add(env, base, names, rest, l);
        }
    }
    return result;
}

fct_result fct_scene_obj_has_library(const fct_env *env, const char *path, bool *found) {
    fct_file file;
    fct_libraries libraries = {0};
    *found = false;
    fct_result result = fct_file_open(env, path, &file);
    if (result != FCT_OK) return result;
    char *base = fct_file_folder(env, path);
    result = base ? FCT_OK : FCT_ERROR_MEMORY;
    if (base) result = find_library(env, base, fct_text_begin(env, path, file.data, file.size), &libraries);
    *found = result == FCT_OK && libraries.count;
    if (result == FCT_OK && !*found) note_missing(env, path, &libraries);
    fct_libraries_release(env, &libraries);
    fct_release(env, base);
    fct_file_close(env, &file);
    return result;
}

bool fct_scene_obj_names_materials(const char *text, size_t size) {
    fct_env env = fct_env_default();
    fct_text t = fct_text_begin(&env, "", text, size);
    for (; fct_text_skip_lines(&t, '#'); fct_text_next_line(&t)) {
        size_t length;
        const char *word = fct_obj_statement(&t, &length);
        if (fct_text_word_is(word, length, "usemtl") || fct_text_word_is(word, length, "mtllib")) return true;
        if (!fct_obj_takes_name(word, length)) fct_obj_count_words(&t);
    }
    return false;
}

static void release_reader(reader *r) {
    for (size_t k = 0; k < r->object_count; ++k) fct_release(r->env, r->objects[k]);
    json_decref(r->object_ids);
    json_decref(r->used_names);
    fct_release(r->env, r->objects);
    fct_release(r->env, r->spans);
    fct_libraries_release(r->env, &r->libraries);
    fct_mtl_release(&r->mtl);
    fct_mesh_release(r->env, &r->mesh);
}

fct_result fct_scene_read_obj(fct_scene *scene, const char *name, const char *text, size_t size,
                              const char *base) {
    reader r = {.scene = scene, .env = scene->env, .name = name, .base = base};
    fct_result result = fct_mesh_parse_shaded(r.env, name, text, size, "obj", &r.mesh);
    if (result != FCT_OK) return result;
    fct_attributes_count_from_top(&r.mesh);
    r.object_ids = json_object();
    r.used_names = json_object();
    if (!r.object_ids || !r.used_names) result = fct_fail_memory(r.env, "names");
    if (result == FCT_OK && r.mesh.face_count == 0)
        result = fct_fail(r.env, FCT_ERROR_DATA, "%s: a scene needs at least one face, found none", name);
    if (result == FCT_OK) result = scan_objects(&r, text, size);
    if (result == FCT_OK) result = read_libraries(&r);
    if (result == FCT_OK) result = resolve_materials(&r);
    if (result == FCT_OK) result = add_objects(&r);
    if (result == FCT_OK) send_notes(&r);
    release_reader(&r);
    return result;
}
