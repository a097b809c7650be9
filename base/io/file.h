/* base/io/file.h: whole files in, whole files out.
 *
 * Reading maps a regular file and reads anything else (a pipe, standard input) into memory. Writing goes
 * through a temporary file beside the target that takes its name only when it is complete and on the disk: no
 * reader ever sees half a file, and a failure leaves the old one as it was.
 */
#ifndef FCT_BASE_FILE_H
#define FCT_BASE_FILE_H

#include <stdio.h>

#include "base/env.h"

typedef struct fct_file {
    const unsigned char *data; /* never NULL while open */
    size_t size;
    bool mapped;
} fct_file;

/* Opens `path` for reading, "-" being standard input. A mapped file must not be shortened by others while it
 * is open. Errors: INPUT (missing, a folder, unreadable), MEMORY. On failure *out is all zero. */
fct_result fct_file_open(const fct_env *env, const char *path, fct_file *out);
/* Closes and zeroes; a zero struct is allowed. */
void fct_file_close(const fct_env *env, fct_file *file);

/* How a part of a mapped file will be read: here and there, nothing but the pages that are touched; from end
 * to end; in some way. Only the speed depends on it: a whole file that is on the disk and not in memory takes
 * 20 times as long page by page. */
typedef enum fct_file_use { FCT_FILE_SPARSE, FCT_FILE_WHOLE, FCT_FILE_USUAL } fct_file_use;
void fct_file_advise(const fct_file *file, uint64_t offset, uint64_t size, fct_file_use use);

/* Writes what produce(user, stream) puts into the stream to `path`, "-" being standard output. produce need
 * not look at the results of fwrite: the stream's error state is checked afterwards. What it returns, if not
 * FCT_OK, is returned, and the target stays as it was. A symbolic link is followed; a target that is no
 * regular file (a device, a pipe) is written directly. Errors: OUTPUT, MEMORY and those of produce. */
fct_result fct_file_write_atomic(const fct_env *env, const char *path,
                                 fct_result (*produce)(void *user, FILE *stream), void *user);

#endif
