/* scene/read/path.c: paths of files that other files name. */
#include "scene/read/path.h"

#include <ctype.h>
#include <string.h>

bool fct_path_ends(const char *path, const char *ending) {
    size_t length = strlen(path), tail = strlen(ending);
    if (length < tail) return false;
    for (size_t k = 0; k < tail; ++k)
        if (tolower((unsigned char)path[length - tail + k]) != ending[k]) return false;
    return true;
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
