/* scene/read/load.c: from a path to a committed scene: chooses the reader of a file. */
#include "scene/read/load.h"

#include <string.h>
#include <strings.h>

#include "base/io/beside.h"
#include "scene/read/gltf.h"
#include "scene/read/json/scene_json.h"
#include "scene/read/model_file.h"
#include "scene/read/obj.h"
#include "scene/read/path.h"

/* Adds a mesh or hierarchy file as one grey object without light. */
static fct_result add_plain_model(fct_scene *scene, const char *path) {
    const fct_env *env = scene->env;
    fct_material grey = {.name = "grey", .reflectance = {.7f, .7f, .7f}, .two_sided = true};
    fct_model_file file;
    uint32_t material;
    fct_result result = fct_model_open(env, path, false, false, &file);
    if (result != FCT_OK) return result;
    result = fct_scene_add_material(scene, &grey, &material);
    if (result == FCT_OK) {
        const char *slash = strrchr(path, '/');
        char name[128];
        strncpy(name, slash ? slash + 1 : path, sizeof name - 1);
        name[sizeof name - 1] = 0;
        fct_tree *tree = file.tree;
        file.tree = NULL;
        const fct_mesh *mesh = file.mesh.face_count ? &file.mesh : NULL;
        result = fct_scene_add_object(scene, name, mesh, tree, NULL, material, NULL);
    }
    fct_model_close(env, &file);
    return result;
}

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

static fct_result read_scene_file(fct_scene *scene, const char *path) {
    const fct_env *env = scene->env;
    const char *format = fct_file_format(env, path);
    bool json = !strcasecmp(format, "json"), obj = !strcasecmp(format, "obj"),
         gltf = !strcasecmp(format, "gltf") || !strcasecmp(format, "glb");
    if (!json && !obj && !gltf) return add_plain_model(scene, path);
    fct_file file;
    fct_result result = fct_file_open(env, path, &file);
    if (result != FCT_OK) return result;
    const char *text = (const char *)file.data;
    /* A pipe cannot be read a second time. */
    bool plain = obj && file.mapped && !fct_scene_obj_names_materials(text, file.size);
    char *base = fct_file_folder(env, path);
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
    return result == FCT_OK && plain ? add_plain_model(scene, path) : result;
}

fct_result fct_scene_load(const fct_env *env, const char *path, fct_backend backend, fct_scene **out) {
    fct_result result = fct_scene_create(env, backend, out);
    if (result != FCT_OK) return result;
    result = read_scene_file(*out, path);
    if (result == FCT_OK) result = fct_scene_commit(*out);
    if (result != FCT_OK) {
        fct_scene_destroy(*out);
        *out = NULL;
    }
    return result;
}
