/* base/io/temporary.h: temporary files beside an output.
 *
 * A temporary file has no name if the file system allows that (O_TMPFILE), so it vanishes however the program
 * ends. Otherwise, and while it replaces an older file, its name is .facetree-PROCESS-NUMBER.tmp. The owner
 * holds a lock (flock) on a named file. A file without a lock belongs to no running process, also if the
 * process was on another machine or in another container.
 */
#ifndef FCT_BASE_TEMPORARY_H
#define FCT_BASE_TEMPORARY_H

#include "base/env.h"

/* The folder of the file `path`. False if it does not fit into `size` bytes. */
bool fct_folder_of(const char *path, char *folder, size_t size);

/* Opens an empty file in `folder` for reading and writing. `name` receives its path, or "" if it has none.
 * Returns the descriptor, or -1 with errno. */
int fct_temporary_open(const char *folder, char *name, size_t size);
/* Gives a nameless file the path `name`. Returns 0, or -1 with errno (EEXIST: there is such a file). */
int fct_temporary_link(int descriptor, const char *name);
/* Gives a nameless file a temporary name in `folder`, which `name` receives. Returns 0, or -1 with errno. */
int fct_temporary_link_any(int descriptor, const char *folder, char *name, size_t size);
/* Removes the temporary files of ended processes from `folder`. Errors are ignored. */
void fct_temporary_sweep(const char *folder);

#endif
