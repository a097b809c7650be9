/* scene/read/load.c: from a path to a committed scene: which reader a file goes to, and model files with the
 * hierarchy beside them.
 */
#include "scene/read/load.h"

#include <ctype.h>
#include <string.h>
#include <unistd.h>
#include <xxhash.h>

#include "base/io/file.h"

bool fct_path_ends(const char *path, const char *ending) {
    size_t length = strlen(path), tail = strlen(ending);
    if (length < tail) return false;
    for (size_t k = 0; k < tail; ++k)
        if (tolower((unsigned char)path[length - tail + k]) != ending[k]) return false;
    return true;
}

char *fct_path_folder(const fct_env *env, const char *path) {
    const char *slash = strrchr(path, '/');
    size_t length = slash ? (size_t)(slash - path) + 1 : 0;
    char *folder = fct_allocate(env, length + 1, 1);
    if (!folder) {
        fct_fail_memory(env, "a path");
        return NULL;
    }
    memcpy(folder, path, length);
    folder[length] = 0;
    return folder;
}

char *fct_path_join(const fct_env *env, const char *base, const char *relative) {
    size_t head = relative[0] == '/' ? 0 : strlen(base), tail = strlen(relative);
    char *path = fct_allocate(env, head + tail + 1, 1);
    if (!path) {
        fct_fail_memory(env, "a path");
        return NULL;
    }
    memcpy(path, base, head);
    memcpy(path + head, relative, tail + 1);
    return path;
}

/* ---- Model files ---- */

/* The hierarchy beside the mesh, if there is one and it is of these very bytes. */
static fct_result open_beside(const fct_env *env, const char *path, fct_tree **out) {
    *out = NULL;
    const char *dot = strrchr(path, '.'), *slash = strrchr(path, '/');
    if (!dot || (slash && dot < slash)) return FCT_OK;
    size_t stem = (size_t)(dot - path);
    char *beside = fct_allocate(env, stem + 5, 1);
    if (!beside) return fct_fail_memory(env, "a path");
    memcpy(beside, path, stem);
    memcpy(beside + stem, ".fct", 5);
    fct_file file = {0};
    fct_result result = FCT_OK;
    if (access(beside, F_OK) == 0) {
        result = fct_file_open(env, path, &file);
        if (result == FCT_OK) result = fct_tree_open(env, beside, out);
        if (result == FCT_OK && fct_tree_get(*out).source_hash != XXH3_64bits(file.data, file.size)) {
            fct_note(env, FCT_MESSAGE_NOTE, "%s is not of the present %s and is left aside", beside, path);
            fct_tree_destroy(*out);
            *out = NULL;
        }
    }
    fct_file_close(env, &file);
    fct_release(env, beside);
    return result;
}

fct_result fct_model_open(const fct_env *env, const char *path, bool want_mesh, fct_model_file *out) {
    *out = (fct_model_file){0};
    if (fct_path_ends(path, ".fct")) return fct_tree_open(env, path, &out->tree);
    fct_result result = want_mesh ? FCT_OK : open_beside(env, path, &out->tree);
    if (result != FCT_OK || out->tree) return result;
    result = fct_mesh_load(env, path, &out->mesh);
    if (result == FCT_OK && out->mesh.face_count == 0) {
        fct_mesh_release(env, &out->mesh);
        result = fct_fail(env, FCT_ERROR_DATA, "%s: a model needs at least one face, found none", path);
    }
    return result;
}

void fct_model_close(const fct_env *env, fct_model_file *file) {
    if (file->tree) fct_tree_destroy(file->tree);
    fct_mesh_release(env, &file->mesh);
    *file = (fct_model_file){0};
}

/* Any mesh or hierarchy file: one grey object without light. */
static fct_result read_mesh(fct_scene *scene, const char *path) {
    const fct_env *env = scene->env;
    fct_material grey = {.name = "grey", .reflectance = {.7f, .7f, .7f}, .two_sided = true};
    fct_model_file file;
    uint32_t material;
    fct_result result = fct_model_open(env, path, false, &file);
    if (result != FCT_OK) return result;
    result = fct_scene_add_material(scene, &grey, &material);
    if (result == FCT_OK) {
        const char *slash = strrchr(path, '/');
        char name[128];
        strncpy(name, slash ? slash + 1 : path, sizeof name - 1);
        name[sizeof name - 1] = 0;
        fct_tree *tree = file.tree;
        file.tree = NULL;
        result = fct_scene_add_object(scene, name, tree ? NULL : &file.mesh, tree, NULL, material, NULL);
    }
    fct_model_close(env, &file);
    return result;
}

/* ---- Scene files ---- */

fct_result fct_scene_parse_json(const fct_env *env, const char *name, const char *text, size_t size,
                                const char *base, fct_backend backend, fct_scene **out) {
    fct_result result = fct_scene_create(env, backend, out);
    if (result != FCT_OK) return result;
    result = fct_scene_read_json(*out, name, text, size, base);
    if (result == FCT_OK) result = fct_scene_commit(*out);
    if (result != FCT_OK) {
        fct_scene_destroy(*out);
        *out = NULL;
    }
    return result;
}

static fct_result read_any(fct_scene *scene, const char *path) {
    const fct_env *env = scene->env;
    bool json = fct_path_ends(path, ".json"), obj = fct_path_ends(path, ".obj"),
         gltf = fct_path_ends(path, ".gltf") || fct_path_ends(path, ".glb");
    if (!json && !obj && !gltf) return read_mesh(scene, path);
    fct_file file;
    fct_result result = fct_file_open(env, path, &file);
    if (result != FCT_OK) return result;
    const char *text = (const char *)file.data;
    bool plain = obj && !fct_scene_obj_names_materials(text, file.size);
    char *base = fct_path_folder(env, path);
    if (!base)
        result = FCT_ERROR_MEMORY;
    else if (json)
        result = fct_scene_read_json(scene, path, text, file.size, base);
    else if (gltf)
        result = fct_scene_read_gltf(scene, path, file.data, file.size, base);
    else if (!plain)
        result = fct_scene_read_obj(scene, path, text, file.size, base);
    fct_release(env, base);
    fct_file_close(env, &file);
    return result == FCT_OK && plain ? read_mesh(scene, path) : result;
}

fct_result fct_scene_load(const fct_env *env, const char *path, fct_backend backend, fct_scene **out) {
    fct_result result = fct_scene_create(env, backend, out);
    if (result != FCT_OK) return result;
    result = read_any(*out, path);
    if (result == FCT_OK) result = fct_scene_commit(*out);
    if (result != FCT_OK) {
        fct_scene_destroy(*out);
        *out = NULL;
    }
    return result;
}
