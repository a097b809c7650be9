/* tools/guard/inputs.h: the files that a command reads, by device and inode, so that it does not overwrite
 * them. */
#ifndef FCT_TOOLS_GUARD_INPUTS_H
#define FCT_TOOLS_GUARD_INPUTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

typedef struct guard_input {
    dev_t device;
    ino_t inode;
    uint64_t size; /* when the command opened it */
    char *path;    /* NULL: a free place of the table */
} guard_input;

/* A hash table. Zero is an empty set. */
typedef struct guard_inputs {
    guard_input *places;
    size_t count, capacity;
} guard_inputs;

/* Adds a file. Anything that is no regular file is ignored. False if memory is exhausted. */
bool guard_add_input(guard_inputs *inputs, const char *path);
/* The input that is the same file as `path`, or NULL. */
const char *guard_find_input(const guard_inputs *inputs, const char *path);
/* An input that is shorter than when the command opened it, or NULL. A signal handler may call it. */
const char *guard_find_shortened(const guard_inputs *inputs);
void guard_release_inputs(guard_inputs *inputs);

#endif
