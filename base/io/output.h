/* base/io/output.h: a file that the program writes in any order.
 *
 * The file gets its name when it is complete and on the disk. A failure, or fct_output_abandon, leaves the
 * old file unchanged and no temporary file (base/io/temporary.h).
 */
#ifndef FCT_BASE_OUTPUT_H
#define FCT_BASE_OUTPUT_H

#include <limits.h>
#include <stdio.h>

#include "base/env.h"

typedef struct fct_output {
    const fct_env *env;
    int descriptor;   /* readable and writable */
    uint64_t pending; /* bytes written since the last request to write to the disk */
    bool spooled;     /* the target is no regular file; fct_output_finish copies the bytes to it */
    bool replaces;    /* an older file, whose permissions stay */
    unsigned mode;    /* permissions of the older file */
    char path[PATH_MAX], target[PATH_MAX], folder[PATH_MAX];
    char temporary[PATH_MAX]; /* empty: the file has no name yet */
} fct_output;

/* Fails with "PATH: cannot be written: ..." and OUTPUT, or MEMORY if error is ENOMEM. error: an errno, or 0
 * for a stream's error flag. */
fct_result fct_output_fail(const fct_env *env, const char *path, int error);

/* Opens a new file of `size` zero bytes, and reserves its space if the file system can. "-" is standard
 * output. Symbolic links are followed, also to a file that does not exist. A target that is no regular file
 * is written by fct_output_finish, from a temporary file. Errors: OUTPUT,
 * MEMORY. */
fct_result fct_output_open(const fct_env *env, const char *path, uint64_t size, fct_output *out);
/* The functions below may also fail with MEMORY if the system has none. Errors: OUTPUT. */
fct_result fct_output_write(fct_output *output, uint64_t offset, const void *data, size_t size);
/* Reads bytes that were written before. Errors: OUTPUT. */
fct_result fct_output_read(const fct_output *output, uint64_t offset, void *data, size_t size);
/* Writes everything to the disk, renames the file and closes it, also on failure. Errors: OUTPUT. */
fct_result fct_output_finish(fct_output *output);
void fct_output_abandon(fct_output *output);

/* Whether the path is a pipe, a device or another thing that is neither a file nor a folder. */
bool fct_output_is_device(const char *path);

/* Writes the output of produce(user, stream) to `path` with an fct_writer. If produce fails, the target stays
 * unchanged. Errors: OUTPUT, MEMORY and those of produce. */
fct_result fct_file_write_atomic(const fct_env *env, const char *path,
                                 fct_result (*produce)(void *user, FILE *stream), void *user);

#endif
