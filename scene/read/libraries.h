/* scene/read/libraries.h: finds the material libraries that an OBJ file names. */
#ifndef FCT_SCENE_LIBRARIES_H
#define FCT_SCENE_LIBRARIES_H

#include <jansson.h>

#include "mesh/text/text.h"

typedef struct fct_libraries {
    char **paths; /* of the files that exist, each once, in the order of their names */
    size_t count, capacity;
    json_t *known; /* device and number of these files */
    size_t repeated, missing;
    char first_missing[FCT_TEXT_SHOWN];
} fct_libraries;

/* Adds the files of a mtllib line; names[0 .. length) follows the word. The names are relative to `base` (""
 * or ending in '/').
 *
 * A line holds one name that may contain blanks, or several names. The whole line is tried first. Otherwise
 * the line is cut so that as few words as possible are missing. A file is found under its name, with `/` for
 * `\`, or beside the OBJ under the last part of its name. Errors: MEMORY. */
fct_result fct_libraries_add(const fct_env *env, const char *base, const char *names, size_t length,
                             fct_libraries *libraries);
void fct_libraries_add_missing(fct_libraries *libraries, const char *name, size_t length);
/* *path: a regular file of that name, relative to `base`, found as libraries are; or NULL. The caller
 * releases it. Errors: MEMORY. */
fct_result fct_libraries_find(const fct_env *env, const char *base, const char *name, size_t length,
                              char **path);
void fct_libraries_release(const fct_env *env, fct_libraries *libraries);

#endif
