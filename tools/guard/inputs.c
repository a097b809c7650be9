/* tools/guard/inputs.c: see inputs.h. */
#define _DEFAULT_SOURCE
#include "tools/guard/inputs.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* The place of the file, or the free place where it belongs. */
static guard_input *find_place(guard_input *places, size_t capacity, dev_t device, ino_t inode) {
    size_t i = ((uint64_t)inode * 0x9E3779B97F4A7C15U + (uint64_t)device) & (capacity - 1);
    while (places[i].path && (places[i].inode != inode || places[i].device != device))
        i = (i + 1) & (capacity - 1);
    return places + i;
}

/* Keeps a quarter of the places free. */
static bool reserve_place(guard_inputs *inputs) {
    if (4 * (inputs->count + 1) <= 3 * inputs->capacity) return true;
    size_t capacity = inputs->capacity ? 2 * inputs->capacity : 64;
    guard_input *places = calloc(capacity, sizeof *places);
    if (!places) return false;
    for (size_t i = 0; i < inputs->capacity; ++i) {
        const guard_input *old = inputs->places + i;
        if (old->path) *find_place(places, capacity, old->device, old->inode) = *old;
    }
    free(inputs->places);
    inputs->places = places;
    inputs->capacity = capacity;
    return true;
}

bool guard_add_input(guard_inputs *inputs, const char *path) {
    struct stat status;
    if (stat(path, &status) || !S_ISREG(status.st_mode)) return true;
    if (!reserve_place(inputs)) return false;
    guard_input *place = find_place(inputs->places, inputs->capacity, status.st_dev, status.st_ino);
    if (place->path) return true;
    char *copy = strdup(path);
    if (!copy) return false;
    *place = (guard_input){status.st_dev, status.st_ino, (uint64_t)status.st_size, copy};
    ++inputs->count;
    return true;
}

const char *guard_find_input(const guard_inputs *inputs, const char *path) {
    struct stat status;
    if (!inputs->count || stat(path, &status) || !S_ISREG(status.st_mode)) return NULL;
    return find_place(inputs->places, inputs->capacity, status.st_dev, status.st_ino)->path;
}

const char *guard_find_shortened(const guard_inputs *inputs) {
    struct stat status;
    for (size_t i = 0; i < inputs->capacity; ++i) {
        const guard_input *input = inputs->places + i;
        if (input->path && stat(input->path, &status) == 0 && status.st_ino == input->inode &&
            status.st_dev == input->device && (uint64_t)status.st_size < input->size)
            return input->path;
    }
    return NULL;
}

void guard_release_inputs(guard_inputs *inputs) {
    for (size_t i = 0; i < inputs->capacity; ++i) free(inputs->places[i].path);
    free(inputs->places);
    *inputs = (guard_inputs){0};
}
