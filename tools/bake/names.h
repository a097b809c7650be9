/* tools/bake/names.h: file names for named objects. */
#ifndef FCT_TOOLS_BAKE_NAMES_H
#define FCT_TOOLS_BAKE_NAMES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct bake_name {
    char *key;     /* the name as a file system without case sees it */
    uint32_t last; /* the number that the last name with this key got */
} bake_name;

/* The names that are in use: a hash table. Zero is an empty set. */
typedef struct bake_names {
    bake_name *places;
    size_t count, capacity;
} bake_names;

/* A file name without ending for the object `wanted`, different from all earlier ones, also if case is
 * ignored. Characters that some file system cannot store become _. A name that is in use gets -2, -3, ... The
 * caller frees the result; NULL if memory is exhausted. */
char *bake_make_name(bake_names *names, const char *wanted);
void bake_release_names(bake_names *names);

#endif
