/* scene/read/model_file.c: opens the mesh or the hierarchy of a model. */
#define _GNU_SOURCE
#include "scene/read/model_file.h"

#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/io/file.h"
#include "mesh/load.h"
#include "mesh/ply/header.h"
#include "scene/attributes.h"
#include "scene/read/path.h"

/* Opens NAME.fct beside a mesh file if it records the hash of that file. *out is NULL if there is none, if
 * the hash differs, or if it is welded and env->no_weld is set. */
static fct_result open_hierarchy_beside(const fct_env *env, const char *path, fct_tree **out) {
    *out = NULL;
    const char *dot = strrchr(path, '.'), *slash = strrchr(path, '/');
    if (!dot || (slash && dot < slash)) return FCT_OK;
    size_t stem = (size_t)(dot - path);
    char *beside = fct_allocate(env, stem + 5, 1);
    if (!beside) return fct_fail_memory(env, "a path");
    memcpy(beside, path, stem);
    memcpy(beside + stem, ".fct", 5);
    uint64_t hash = 0;
    fct_result result = FCT_OK;
    if (access(beside, F_OK) == 0) {
        result = fct_mesh_file_hash(env, path, &hash);
        if (result == FCT_OK) result = fct_tree_open(env, beside, out);
        const bool same = result == FCT_OK && fct_tree_get(*out).source_hash == hash;
        if (result == FCT_OK && !same)
            fct_note(env, FCT_MESSAGE_NOTE, "%s does not match %s and is not used", beside, path);
        if (result == FCT_OK && (!same || (env->no_weld && fct_tree_get(*out).def.weld))) {
            fct_tree_destroy(*out);
            *out = NULL;
        }
    }
    fct_release(env, beside);
    return result;
}

static fct_result load_mesh(const fct_env *env, const char *path, fct_mesh *out) {
    const char *format = fct_file_format(env, path);
    fct_result result = fct_mesh_load_shaded(env, path, out);
    if (result == FCT_OK && strcasecmp(format, "glb") && strcasecmp(format, "gltf"))
        fct_attributes_count_from_top(out);
    return result;
}

/* Whether the colours of a mesh file are radiosity. */
static fct_result find_light(const fct_env *env, const char *path, bool *out) {
    fct_file file;
    struct stat status;
    *out = false;
    if (strcasecmp(fct_file_format(env, path), "ply")) return fct_mesh_file_holds_light(env, path, out);
    if (stat(path, &status) || !S_ISREG(status.st_mode)) return FCT_OK; /* a pipe is read once */
    fct_result result = fct_file_open(env, path, &file);
    if (result != FCT_OK) return result;
    const char *text = (const char *)file.data, *end = fct_ply_find_body(text, file.size);
    for (const char *p = text; end && p + 12 <= end && !*out; ++p) *out = !memcmp(p, " radiosity_r", 12);
    fct_file_close(env, &file);
    return FCT_OK;
}

/* Whether [text, end) contains the word between blanks. A word that begins with a quotation mark may stand
 * anywhere. */
static bool has_word(const char *text, const char *end, const char *word) {
    const size_t length = strlen(word);
    for (const char *at = text; at && (at = memmem(at, (size_t)(end - at), word, length)); ++at) {
        const bool begins = at == text || (unsigned char)at[-1] <= ' ';
        const bool ends = at + length == end || (unsigned char)at[length] <= ' ';
        if (*word == '"' || (begins && ends)) return true;
    }
    return false;
}

static bool has_any(const char *text, const char *end, const char *const words[5]) {
    for (int i = 0; i < 5 && words[i]; ++i)
        if (has_word(text, end, words[i])) return true;
    return false;
}

/* Whether a mesh file has what a hierarchy file does not store: normals, texture coordinates, colours of
 * faces. True in doubt: then the mesh is read. */
static fct_result find_attributes(const fct_env *env, const char *path, bool *out) {
    static const struct {
        const char *format, *words[5];
    } formats[] = {{"ply", {"nx", "s", "u", "texture_u", "texcoord"}},
                   {"obj", {"vn", "vt"}},
                   {"gltf", {"\"NORMAL\"", "\"TEXCOORD_"}},
                   {"glb", {"\"NORMAL\"", "\"TEXCOORD_"}}};
    static const char *const colors[5] = {"red", "diffuse_red"};
    const char *format = fct_file_format(env, path);
    fct_file file;
    *out = strcasecmp(format, "stl") != 0;
    for (size_t i = 0; i < FCT_LENGTH(formats); ++i) {
        if (strcasecmp(format, formats[i].format)) continue;
        fct_result result = fct_file_open(env, path, &file);
        if (result != FCT_OK) return result;
        const char *text = (const char *)file.data;
        const char *end = i == 0 ? fct_ply_find_body(text, file.size) : text + file.size;
        *out = end && has_any(text, end, formats[i].words);
        if (i == 0 && end)
            *out |= has_any(memmem(text, (size_t)(end - text), "element face", 12), end, colors);
        fct_file_close(env, &file);
    }
    return FCT_OK;
}

fct_result fct_model_open(const fct_env *env, const char *path, bool want_mesh, bool want_paint,
                          fct_model_file *out) {
    bool more = false;
    *out = (fct_model_file){0};
    out->light = true;
    if (!strcasecmp(fct_file_format(env, path), "fct")) return fct_tree_open(env, path, &out->tree);
    fct_result result = want_mesh || env->flip_inward ? FCT_OK : open_hierarchy_beside(env, path, &out->tree);
    if (result == FCT_OK && want_paint) result = find_light(env, path, &out->light);
    if (result == FCT_OK && out->tree && !want_paint) result = find_attributes(env, path, &more);
    if (result != FCT_OK || (out->tree && !want_paint && !more)) return result;
    result = load_mesh(env, path, &out->mesh);
    if (result == FCT_OK && out->mesh.face_count == 0) {
        result = fct_fail(env, FCT_ERROR_DATA, "%s: a model needs at least one face, found none", path);
    }
    if (result != FCT_OK) fct_model_close(env, out);
    return result;
}

void fct_model_close(const fct_env *env, fct_model_file *file) {
    if (file->tree) fct_tree_destroy(file->tree);
    fct_mesh_release(env, &file->mesh);
    *file = (fct_model_file){0};
}
