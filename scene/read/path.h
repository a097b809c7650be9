/* scene/read/path.h: paths of files that other files name. */
#ifndef FCT_SCENE_PATH_H
#define FCT_SCENE_PATH_H

#include "base/env.h"

/* base + relative, or `relative` alone if it is absolute. NULL after a MEMORY error. The caller releases it.
 */
char *fct_path_join(const fct_env *env, const char *base, const char *relative);
/* Whether the path ends in `ending`, which is in lower case; ignores the case of the path. */
bool fct_path_ends(const char *path, const char *ending);

#endif
