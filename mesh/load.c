/* mesh/load.c: selects the reader by the ending of the file name. */
#include "mesh/load.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#define XXH_STATIC_LINKING_ONLY /* the size of XXH3_state_t */
#include <xxhash.h>

#include "base/io/beside.h"
#include "mesh/glb/read.h"
#include "mesh/obj/read.h"
#include "mesh/om/read.h"
#include "mesh/ply/read.h"
#include "mesh/soup.h"
#include "mesh/text/off_read.h"
#include "mesh/text/stl_read.h"

typedef struct format {
    const char *ending;
    fct_result (*read)(const fct_source *source, fct_soup *out);
    unsigned layouts;
} format;

static const format *find_format(const char *ending) {
    static const format formats[] = {{"ply", fct_read_ply, FCT_PLY_LAYOUTS},
                                     {"obj", fct_read_obj, 1},
                                     {"off", fct_read_off, FCT_OFF_LAYOUTS},
                                     {"stl", fct_read_stl, 1},
                                     {"glb", fct_read_glb, 1},
                                     {"gltf", fct_read_glb, 1},
                                     {"om", fct_read_om, 1}};
    for (size_t i = 0; i < sizeof formats / sizeof *formats; ++i)
        if (!strcasecmp(formats[i].ending, ending)) return formats + i;
    return NULL;
}

static fct_result fail_format(const fct_env *env, const char *name) {
    return fct_fail(env, FCT_ERROR_DATA,
                    "%s: unknown kind of file; .obj, .ply, .off, .stl, .om, .glb and .gltf are known", name);
}

/* Messages of one attempt to read a file, kept until it is known which attempt counts. Beyond MOST, the last
 * message replaces the one before it, because an error comes last. */
enum { MOST = 24 };
typedef struct held {
    int count;
    fct_severity severity[MOST];
    char text[MOST][1024];
} held;

static void hold_message(void *user, fct_severity severity, const char *text) {
    held *h = user;
    if (h->count < MOST) ++h->count;
    h->severity[h->count - 1] = severity;
    snprintf(h->text[h->count - 1], sizeof h->text[0], "%s", text);
}

static void send_held(const fct_env *env, const held *h) {
    for (int i = 0; i < h->count; ++i) fct_note(env, h->severity[i], "%s", h->text[i]);
}

/* One attempt with the layout and the origin in *soup. The rest of the soup is replaced. */
static fct_result attempt_read(const format *f, const fct_source *source, fct_soup *soup, held *h) {
    fct_env env = *source->env;
    env.message = hold_message, env.message_user = h;
    fct_source quiet = *source;
    quiet.env = &env;
    fct_soup empty = {.layout = soup->layout, .wants_corners = soup->wants_corners};
    memcpy(empty.origin, soup->origin, sizeof empty.origin);
    fct_soup_release(source->env, soup);
    *soup = empty;
    h->count = 0;
    return f->read(&quiet, soup);
}

/* Tries the layouts of the format in their order until one fits. If none fits, the messages are those of the
 * first. Coordinates that need a local origin are then read again, relative to it. */
static fct_result read_soup(const format *f, const fct_source *source, fct_soup *soup, held *first,
                            held *next) {
    fct_result result = attempt_read(f, source, soup, first);
    const held *sent = first;
    while (result == FCT_ERROR_DATA && soup->layout + 1 < f->layouts) {
        ++soup->layout;
        result = attempt_read(f, source, soup, next);
        sent = result == FCT_ERROR_DATA ? first : next;
    }
    if (result == FCT_OK && fct_extent_origin(&soup->extent, soup->origin)) {
        result = attempt_read(f, source, soup, next);
        sent = next;
    }
    send_held(source->env, sent);
    return result;
}

static fct_result parse_source(const fct_source *source, const format *f, bool corner_normals,
                               fct_mesh *out) {
    const fct_env *env = source->env;
    if (!source->size) return fct_fail(env, FCT_ERROR_DATA, "%s: the file is empty", source->name);
    fct_result result = fct_progress(env, "read", 0);
    if (result != FCT_OK) return result;
    held *messages = fct_allocate(env, 2, sizeof *messages);
    if (!messages) return fct_fail_memory(env, "messages");
    fct_soup soup = {.wants_corners = corner_normals};
    result = read_soup(f, source, &soup, messages, messages + 1);
    fct_release(env, messages);
    if (result == FCT_OK) result = fct_progress(env, "read", 1);
    if (result == FCT_OK) return fct_soup_mesh(env, source->name, &soup, out);
    fct_soup_release(env, &soup);
    return result;
}

static fct_result parse_memory(const fct_source *source, const char *ending, bool corner_normals,
                               fct_mesh *out) {
    *out = (fct_mesh){0};
    const format *f = find_format(ending);
    return f ? parse_source(source, f, corner_normals, out) : fail_format(source->env, source->name);
}

fct_result fct_mesh_parse(const fct_env *env, const char *name, const void *data, size_t size,
                          const char *ending, fct_mesh *out) {
    const fct_source source = {env, name, data, size, NULL};
    return parse_memory(&source, ending, false, out);
}

fct_result fct_mesh_parse_shaded(const fct_env *env, const char *name, const void *data, size_t size,
                                 const char *ending, fct_mesh *out) {
    const fct_source source = {env, name, data, size, NULL};
    return parse_memory(&source, ending, true, out);
}

static fct_result load_file(const fct_env *env, const char *path, bool corner_normals, fct_mesh *out) {
    *out = (fct_mesh){0};
    bool standard = !strcmp(path, "-");
    const format *f = find_format(fct_file_format(env, path));
    if (!f) return fail_format(env, path);
    fct_file file;
    char *folder = fct_file_folder(env, path);
    if (!folder) return FCT_ERROR_MEMORY;
    fct_result result = fct_file_open(env, path, &file);
    if (result == FCT_OK) {
        fct_source source = {env, standard ? "standard input" : path, file.data, file.size, folder};
        result = parse_source(&source, f, corner_normals, out);
    }
    fct_file_close(env, &file);
    fct_release(env, folder);
    return result;
}

fct_result fct_mesh_load(const fct_env *env, const char *path, fct_mesh *out) {
    return load_file(env, path, false, out);
}

fct_result fct_mesh_load_shaded(const fct_env *env, const char *path, fct_mesh *out) {
    return load_file(env, path, true, out);
}

fct_result fct_mesh_file_holds_light(const fct_env *env, const char *path, bool *out) {
    const char *ending = fct_file_format(env, path);
    struct stat status;
    *out = false;
    if (strcasecmp(ending, "glb") != 0 && strcasecmp(ending, "gltf") != 0) return FCT_OK;
    if (stat(path, &status) || !S_ISREG(status.st_mode)) return FCT_OK;
    fct_file file;
    fct_result result = fct_file_open(env, path, &file);
    if (result != FCT_OK) return result;
    fct_source source = {env, path, file.data, file.size, NULL};
    result = fct_glb_holds_light(&source, out);
    fct_file_close(env, &file);
    return result;
}

enum { HASH_BLOCK = 1 << 24 };

/* Lets pages go when they have been read, so that a file of many gigabytes does not fill the memory. */
static uint64_t hash_file(const fct_file *file) {
    XXH3_state_t state;
    XXH3_64bits_reset(&state);
    for (size_t at = 0; at < file->size; at += HASH_BLOCK) {
        const size_t size = file->size - at < HASH_BLOCK ? file->size - at : HASH_BLOCK;
        XXH3_64bits_update(&state, file->data + at, size);
        fct_file_advise(file, at, size, FCT_FILE_UNUSED);
    }
    return XXH3_64bits_digest(&state);
}

fct_result fct_mesh_file_hash(const fct_env *env, const char *path, uint64_t *out) {
    *out = 0;
    const format *f = find_format(fct_file_format(env, path));
    fct_file file;
    char *folder = fct_file_folder(env, path);
    if (!folder) return FCT_ERROR_MEMORY;
    fct_result result = fct_file_open(env, path, &file);
    if (result == FCT_OK && f && f->read == fct_read_glb) {
        fct_source source = {env, path, file.data, file.size, folder};
        result = fct_glb_hash(&source, out);
    } else if (result == FCT_OK) {
        *out = hash_file(&file);
    }
    fct_file_close(env, &file);
    fct_release(env, folder);
    return result;
}
