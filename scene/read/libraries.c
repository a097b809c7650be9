/* scene/read/libraries.c: see libraries.h. */
#include "scene/read/libraries.h"

#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "mesh/mesh.h"
#include "scene/read/path.h"

/* A longer line is cut in pieces of so many words. */
enum { MOST_WORDS = 32 };

static bool is_file(const char *path, struct stat *status) {
    return stat(path, status) == 0 && S_ISREG(status->st_mode);
}

/* *path: base + name if this is a regular file, else NULL. Errors: MEMORY. */
static fct_result try_name(const fct_env *env, const char *base, const char *name, char **path) {
    struct stat status;
    *path = fct_path_join(env, base, name);
    if (!*path) return FCT_ERROR_MEMORY;
    if (!is_file(*path, &status)) {
        fct_release(env, *path);
        *path = NULL;
    }
    return FCT_OK;
}

/* Copies a name without quotes. NULL after a MEMORY error. */
static char *copy_name(const fct_env *env, const char *text, size_t length) {
    if (length > 2 && text[0] == '"' && text[length - 1] == '"') ++text, length -= 2;
    char *name = fct_copy_text(env, text, length);
    if (!name) fct_fail_memory(env, "a path");
    return name;
}

/* *path: the file of that name, with `/` for `\` if needed, or NULL. */
static fct_result find_file(const fct_env *env, const char *base, const char *text, size_t length,
                            char **path) {
    *path = NULL;
    char *name = copy_name(env, text, length);
    if (!name) return FCT_ERROR_MEMORY;
    fct_result result = try_name(env, base, name, path);
    if (result == FCT_OK && !*path && strchr(name, '\\')) {
        for (char *p = name; (p = strchr(p, '\\'));) *p = '/';
        result = try_name(env, base, name, path);
    }
    fct_release(env, name);
    return result;
}

/* *path: the file beside the OBJ that has the last part of the name, or NULL. */
static fct_result find_beside(const fct_env *env, const char *base, const char *text, size_t length,
                              char **path) {
    *path = NULL;
    char *name = copy_name(env, text, length);
    if (!name) return FCT_ERROR_MEMORY;
    const char *part = name;
    for (const char *p = name; (p = strpbrk(p, "\\/"));) part = ++p;
    fct_result result = try_name(env, base, part, path);
    fct_release(env, name);
    return result;
}

/* Adds the file unless it is there already. Takes `path`. */
static fct_result add_path(const fct_env *env, char *path, fct_libraries *l) {
    struct stat status;
    char key[64];
    bool file = is_file(path, &status);
    snprintf(key, sizeof key, "%llu %llu", file ? (unsigned long long)status.st_dev : 0,
             file ? (unsigned long long)status.st_ino : 0);
    if (!l->known) l->known = json_object();
    if (json_object_get(l->known, key)) {
        ++l->repeated;
        fct_release(env, path);
        return FCT_OK;
    }
    fct_result result = fct_grow(env, (void **)&l->paths, &l->capacity, l->count + 1, sizeof *l->paths);
    if (result == FCT_OK && json_object_set_new_nocheck(l->known, key, json_true()))
        result = fct_fail_memory(env, "names");
    if (result == FCT_OK)
        l->paths[l->count++] = path;
    else
        fct_release(env, path);
    return result;
}

void fct_libraries_add_missing(fct_libraries *l, const char *name, size_t length) {
    if (!l->missing++) fct_text_show(name, length, l->first_missing);
}

typedef struct words {
    const char *begin[MOST_WORDS], *end[MOST_WORDS];
    size_t count;
    size_t last[MOST_WORDS];        /* of the name that begins at this word */
    bool found[MOST_WORDS];         /* that name is a file */
    size_t missing[MOST_WORDS + 1]; /* names from this word on */
} words;

/* Takes up to MOST_WORDS words. A word that begins with `#` begins a comment. */
static void split_words(fct_text *t, words *w) {
    for (w->count = 0; w->count < MOST_WORDS && !fct_text_at_line_end(t) && *t->p != '#'; ++w->count) {
        size_t length;
        w->begin[w->count] = fct_text_word(t, &length);
        w->end[w->count] = t->p;
    }
}

static size_t name_length(const words *w, size_t first, size_t last) {
    return (size_t)(w->end[last] - w->begin[first]);
}

/* Chooses where names end, from the last word to the first, so that as few names as possible are missing. Of
 * equal choices, the longest name. */
static fct_result cut_names(const fct_env *env, const char *base, words *w) {
    w->missing[w->count] = 0;
    for (size_t i = w->count; i-- > 0;) {
        w->last[i] = i, w->found[i] = false, w->missing[i] = w->missing[i + 1] + 1;
        for (size_t j = w->count; j-- > i;) {
            size_t further = w->missing[j + 1];
            if (w->found[i] ? further >= w->missing[i] : further > w->missing[i]) continue;
            char *path;
            fct_result result = find_file(env, base, w->begin[i], name_length(w, i, j), &path);
            if (result != FCT_OK) return result;
            if (path) w->last[i] = j, w->found[i] = true, w->missing[i] = further;
            fct_release(env, path);
        }
    }
    return FCT_OK;
}

/* Adds the file of words first to last, or notes that it is missing. */
static fct_result add_name(const fct_env *env, const char *base, const words *w, size_t first, size_t last,
                           fct_libraries *l) {
    size_t length = name_length(w, first, last);
    char *path;
    fct_result result = w->found[first] ? find_file(env, base, w->begin[first], length, &path)
                                        : find_beside(env, base, w->begin[first], length, &path);
    if (result != FCT_OK) return result;
    if (path) return add_path(env, path, l);
    fct_libraries_add_missing(l, w->begin[first], length);
    return FCT_OK;
}

/* *found: how many words name a file beside the OBJ; *whole: whether the words together do. */
static fct_result look_beside(const fct_env *env, const char *base, const words *w, size_t *found,
                              bool *whole) {
    char *path;
    fct_result result = find_beside(env, base, w->begin[0], name_length(w, 0, w->count - 1), &path);
    *whole = path != NULL;
    fct_release(env, path);
    *found = 0;
    for (size_t i = 0; result == FCT_OK && i < w->count; ++i) {
        result = find_beside(env, base, w->begin[i], name_length(w, i, i), &path);
        *found += path != NULL;
        fct_release(env, path);
    }
    return result;
}

static fct_result add_words(const fct_env *env, const char *base, words *w, fct_libraries *l) {
    fct_result result = cut_names(env, base, w);
    if (result == FCT_OK && w->missing[0] == w->count) {
        size_t found;
        bool whole;
        result = look_beside(env, base, w, &found, &whole);
        if (result == FCT_OK && (found == 0 || (whole && found < w->count)))
            return add_name(env, base, w, 0, w->count - 1, l);
    }
    for (size_t i = 0; result == FCT_OK && i < w->count; i = w->last[i] + 1)
        result = add_name(env, base, w, i, w->last[i], l);
    return result;
}

fct_result fct_libraries_add(const fct_env *env, const char *base, const char *names, size_t length,
                             fct_libraries *l) {
    char *path;
    fct_result result = find_file(env, base, names, length, &path);
    if (result != FCT_OK) return result;
    if (path) return add_path(env, path, l);
    fct_text t = {names, names + length, env, "", 1};
    words w;
    for (split_words(&t, &w); result == FCT_OK && w.count; split_words(&t, &w))
        result = add_words(env, base, &w, l);
    return result;
}

fct_result fct_libraries_find(const fct_env *env, const char *base, const char *name, size_t length,
                              char **path) {
    fct_result result = find_file(env, base, name, length, path);
    return result == FCT_OK && !*path ? find_beside(env, base, name, length, path) : result;
}

void fct_libraries_release(const fct_env *env, fct_libraries *l) {
    for (size_t k = 0; k < l->count; ++k) fct_release(env, l->paths[k]);
    fct_release(env, l->paths);
    json_decref(l->known);
    *l = (fct_libraries){0};
}
