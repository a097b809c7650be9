/* base/io/file.h: reads whole files. A regular file is mapped; a pipe or standard input is copied into
 * memory. */
#ifndef FCT_BASE_FILE_H
#define FCT_BASE_FILE_H

#include "base/env.h"

typedef struct fct_file {
    const unsigned char *data; /* never NULL while open */
    size_t size;
    bool mapped;
} fct_file;

/* Opens `path` for reading. "-" is standard input. Nobody may shorten a mapped file while it is open. Errors:
 * INPUT (missing, a folder, unreadable), MEMORY. On failure *out is all zero. */
fct_result fct_file_open(const fct_env *env, const char *path, fct_file *out);
/* The ending of the name without the dot, or the format that env gives to names without one. Never NULL. */
const char *fct_file_format(const fct_env *env, const char *path);
/* Closes and zeroes; a zero struct is allowed. */
void fct_file_close(const fct_env *env, fct_file *file);

/* A hint how the program will read a part of a mapped file: few pages, everything in order, or unknown; or
 * that it will not read it soon, so that its pages leave the process. Reading a whole file from the disk with
 * SPARSE takes 20 times as long as with WHOLE. */
typedef enum fct_file_use { FCT_FILE_SPARSE, FCT_FILE_WHOLE, FCT_FILE_USUAL, FCT_FILE_UNUSED } fct_file_use;
void fct_file_advise(const fct_file *file, uint64_t offset, uint64_t size, fct_file_use use);

#endif
