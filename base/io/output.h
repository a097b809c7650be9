/* base/io/output.h: a file that is written at any place and takes its name only when it is complete and on
 * the disk. A failure, or abandoning it, leaves the old file as it was and nothing beside it.
 */
#ifndef FCT_BASE_OUTPUT_H
#define FCT_BASE_OUTPUT_H

#include <limits.h>

#include "base/env.h"

typedef struct fct_output {
    const fct_env *env;
    int descriptor;   /* readable and writable */
    uint64_t pending; /* bytes written since the disk was last set to work */
    bool spooled;     /* the target is no regular file: it is copied there in the end */
    char path[PATH_MAX], target[PATH_MAX], temporary[PATH_MAX];
} fct_output;

/* Fails with "PATH: cannot be written: ..." and OUTPUT. error: an errno, or 0 for a stream's error flag. */
fct_result fct_output_fail(const fct_env *env, const char *path, int error);

/* Opens a new file of `size` bytes, all zero, whose space is taken at once where the file system can. "-" is
 * standard output; a symbolic link is followed; a target that is no regular file is written in the end, by
 * way of a temporary file. Errors: OUTPUT. */
fct_result fct_output_open(const fct_env *env, const char *path, uint64_t size, fct_output *out);
/* Errors: OUTPUT. */
fct_result fct_output_write(fct_output *output, uint64_t offset, const void *data, size_t size);
/* What was written. Errors: OUTPUT. */
fct_result fct_output_read(const fct_output *output, uint64_t offset, void *data, size_t size);
/* To the disk, and the name. Closes, whatever it returns. Errors: OUTPUT. */
fct_result fct_output_finish(fct_output *output);
void fct_output_abandon(fct_output *output);

#endif
