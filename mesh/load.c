/* mesh/load.c: selects the reader by the ending of the file name. */
#include "mesh/load.h"

#include <string.h>
#include <strings.h>

#include "base/io/file.h"
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
} format;

static const format *find_format(const char *ending) {
    static const format formats[] = {{"ply", fct_read_ply}, {"obj", fct_read_obj}, {"off", fct_read_off},
                                     {"stl", fct_read_stl}, {"glb", fct_read_glb}, {"om", fct_read_om}};
    for (size_t i = 0; i < sizeof formats / sizeof *formats; ++i)
        if (!strcasecmp(formats[i].ending, ending)) return formats + i;
    return NULL;
}

static fct_result fail_format(const fct_env *env, const char *name) {
    return fct_fail(env, FCT_ERROR_DATA,
                    "%s: unknown kind of file; .obj, .ply, .off, .stl, .om and .glb are known", name);
}

fct_result fct_mesh_parse(const fct_env *env, const char *name, const void *data, size_t size,
                          const char *ending, fct_mesh *out) {
    *out = (fct_mesh){0};
    const format *f = find_format(ending);
    if (!f) return fail_format(env, name);
    if (!size) return fct_fail(env, FCT_ERROR_DATA, "%s: the file is empty", name);
    fct_result result = fct_progress(env, "read", 0);
    if (result != FCT_OK) return result;
    fct_source source = {env, name, data, size};
    fct_soup soup = {0};
    result = f->read(&source, &soup);
    if (result == FCT_OK) result = fct_progress(env, "read", 1);
    if (result == FCT_OK) return fct_soup_mesh(env, name, &soup, out);
    fct_soup_release(env, &soup);
    return result;
}

fct_result fct_mesh_load(const fct_env *env, const char *path, fct_mesh *out) {
    *out = (fct_mesh){0};
    bool standard = !strcmp(path, "-");
    const char *dot = strrchr(path, '.'), *ending = standard ? "ply" : dot ? dot + 1 : "";
    if (!find_format(ending)) return fail_format(env, path);
    fct_file file;
    fct_result result = fct_file_open(env, path, &file);
    if (result != FCT_OK) return result;
    result = fct_mesh_parse(env, standard ? "standard input" : path, file.data, file.size, ending, out);
    fct_file_close(env, &file);
    return result;
}
