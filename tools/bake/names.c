/* tools/bake/names.c: see names.h. */
#define _GNU_SOURCE
#include "tools/bake/names.h"

#include <limits.h>
#include <locale.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <wchar.h>
#include <wctype.h>

enum { LONGEST = 200 }; /* bytes of a name; NAME_MAX leaves room for a number and the ending */

/* Replaces characters and cuts the name between two characters of UTF-8. */
static void clean_name(const char *wanted, char name[LONGEST + 1]) {
    size_t length = strlen(wanted);
    if (length > LONGEST) {
        length = LONGEST;
        while (length > 0 && ((unsigned char)wanted[length] & 0xC0) == 0x80) --length;
    }
    memcpy(name, wanted, length);
    name[length] = 0;
    for (char *c = name; *c; ++c)
        if ((unsigned char)*c < 32 || *c == 127 || strchr("/\\:*?\"<>|", *c) || (c == name && *c == '.'))
            *c = '_';
    if (!length) strcpy(name, "object");
}

/* The name in lower case. Bytes that are no UTF-8 stay. NULL if memory is exhausted. */
static char *fold_name(const char *name) {
    size_t length = strlen(name), used = 0;
    char *key = malloc(MB_LEN_MAX * length + 1);
    locale_t locale = newlocale(LC_CTYPE_MASK, "C.UTF-8", (locale_t)0), before = uselocale(locale);
    mbstate_t in = {0}, out = {0};
    for (size_t at = 0; key && at < length;) {
        wchar_t letter;
        size_t bytes = mbrtowc(&letter, name + at, length - at, &in);
        if (bytes == 0 || bytes > length) {
            key[used++] = name[at++];
            in = (mbstate_t){0};
            continue;
        }
        size_t put = wcrtomb(key + used, (wchar_t)towlower((wint_t)letter), &out);
        used += put <= MB_LEN_MAX ? put : 0;
        at += bytes;
    }
    if (key) key[used] = 0;
    uselocale(before);
    if (locale) freelocale(locale);
    return key;
}

static bake_name *find_name(bake_name *places, size_t capacity, const char *key) {
    uint64_t hash = 0xCBF29CE484222325U;
    for (const char *c = key; *c; ++c) hash = (hash ^ (unsigned char)*c) * 0x100000001B3U;
    size_t i = hash & (capacity - 1);
    while (places[i].key && strcmp(places[i].key, key) != 0) i = (i + 1) & (capacity - 1);
    return places + i;
}

static bool reserve_name(bake_names *names) {
    if (4 * (names->count + 1) <= 3 * names->capacity) return true;
    size_t capacity = names->capacity ? 2 * names->capacity : 64;
    bake_name *places = calloc(capacity, sizeof *places);
    if (!places) return false;
    for (size_t i = 0; i < names->capacity; ++i)
        if (names->places[i].key) *find_name(places, capacity, names->places[i].key) = names->places[i];
    free(names->places);
    names->places = places;
    names->capacity = capacity;
    return true;
}

/* Adds the name. *taken: it is in use; *last then receives the address of its number. False if memory is
 * exhausted. */
static bool add_name(bake_names *names, const char *name, bool *taken, uint32_t **last) {
    char *key = reserve_name(names) ? fold_name(name) : NULL;
    if (!key) return false;
    bake_name *place = find_name(names->places, names->capacity, key);
    *taken = place->key != NULL;
    if (*taken) {
        *last = &place->last;
        free(key);
        return true;
    }
    *place = (bake_name){key, 1};
    ++names->count;
    return true;
}

char *bake_make_name(bake_names *names, const char *wanted) {
    char name[LONGEST + 1], numbered[LONGEST + 16];
    uint32_t *last = NULL, number = 1;
    bool taken;
    clean_name(wanted, name);
    if (!add_name(names, name, &taken, &last)) return NULL;
    if (!taken) return strdup(name);
    number = *last;
    while (taken) {
        uint32_t *other;
        snprintf(numbered, sizeof numbered, "%s-%u", name, ++number);
        if (!add_name(names, numbered, &taken, &other)) return NULL;
    }
    if (add_name(names, name, &taken, &last) && taken) *last = number;
    return strdup(numbered);
}

void bake_release_names(bake_names *names) {
    for (size_t i = 0; i < names->capacity; ++i) free(names->places[i].key);
    free(names->places);
    *names = (bake_names){0};
}
