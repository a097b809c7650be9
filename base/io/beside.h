/* base/io/beside.h: opens a file that another file names.
 *
 * The named file must be a regular file in the folder of the naming file or below it, so that a file from a
 * stranger cannot make the program read other files, devices or endless streams.
 */
#ifndef FCT_BASE_BESIDE_H
#define FCT_BASE_BESIDE_H

#include "base/io/file.h"

/* Opens `path`, which the file `owner` names. A relative path starts at `folder` ("" or ending in '/'; NULL:
 * the owner has no folder, and no file is opened). Absolute paths, paths with a component "..", and links
 * that lead out of the folder are refused unless env->allow_outside is true. `owner` begins the messages.
 * fct_file_close closes *out. Errors: DATA (outside, not a regular file), INPUT (missing, unreadable),
 * MEMORY. */
fct_result fct_file_open_beside(const fct_env *env, const char *owner, const char *folder, const char *path,
                                fct_file *out);

/* "folder/" of a path, or "" if the path has no folder. NULL after a MEMORY error. The caller releases it. */
char *fct_file_folder(const fct_env *env, const char *path);

#endif
