/* base/io/beside.c: see beside.h. */
#define _GNU_SOURCE
#include "base/io/beside.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

char *fct_file_folder(const fct_env *env, const char *path) {
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

/* Whether a component of the path is "..". */
static bool climbs_out(const char *path) {
    for (const char *part = path; *part;) {
        size_t length = strcspn(part, "/");
        if (length == 2 && part[0] == '.' && part[1] == '.') return true;
        part += length + (part[length] == '/');
    }
    return false;
}

/* *within receives whether the file is in the folder or below it after all symbolic links are followed; false
 * if either cannot be resolved. Errors: MEMORY. */
static fct_result find_place(const fct_env *env, const char *folder, const char *path, bool *within) {
    char *top = realpath(*folder ? folder : ".", NULL);
    bool starved = !top && errno == ENOMEM;
    char *file = realpath(path, NULL);
    starved = starved || (!file && errno == ENOMEM);
    size_t length = top ? strlen(top) : 0;
    *within = top && file && !strncmp(top, file, length) && (length == 1 || file[length] == '/');
    free(top);
    free(file);
    return starved ? fct_fail_memory(env, "a path") : FCT_OK;
}

static fct_result check_place(const fct_env *env, const char *owner, const char *folder, const char *named,
                              const char *path) {
    struct stat status;
    bool inside = *named != '/' && !climbs_out(named), within = env->allow_outside;
    if (inside || env->allow_outside) {
        if (stat(path, &status))
            return fct_fail(env, FCT_ERROR_INPUT, "%s: %s cannot be read: %s", owner, path, strerror(errno));
        if (!S_ISREG(status.st_mode))
            return fct_fail(env, FCT_ERROR_DATA, "%s: %s is not a regular file", owner, path);
        fct_result result = within ? FCT_OK : find_place(env, folder, path, &within);
        if (result != FCT_OK || within) return result;
    }
    return fct_fail(env, FCT_ERROR_DATA,
                    "%s: it names \"%s\", which is outside of its folder (--allow-outside permits this)",
                    owner, named);
}

fct_result fct_file_open_beside(const fct_env *env, const char *owner, const char *folder, const char *named,
                                fct_file *out) {
    *out = (fct_file){0};
    if (!folder)
        return fct_fail(env, FCT_ERROR_DATA, "%s: it names the file \"%s\", but has no folder", owner, named);
    size_t head = *named == '/' ? 0 : strlen(folder), size = head + strlen(named) + 1;
    char *path = fct_allocate(env, size, 1);
    if (!path) return fct_fail_memory(env, "a path");
    memcpy(path, folder, head);
    strcpy(path + head, named);
    fct_result result = check_place(env, owner, folder, named, path);
    if (result == FCT_OK) result = fct_file_open(env, path, out);
    fct_release(env, path);
    return result;
}
