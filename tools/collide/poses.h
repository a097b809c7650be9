/* tools/collide/poses.h: the poses of --pose and --poses, and what moves them to the models' own origins. */
#ifndef FCT_TOOLS_COLLIDE_POSES_H
#define FCT_TOOLS_COLLIDE_POSES_H

#include "tools/kit/rows.h"

typedef struct collide_poses {
    tool_rows rows; /* 12 columns: the rows of R|t, B into A, in the coordinates of the files */
    double origin_a[3], origin_b[3];
} collide_poses;

/* `text` is the value of --pose and `path` that of --poses; without both there is one pose, the identity.
 * Refuses a pose without an inverse. Returns an exit code. */
int collide_poses_read(tool *t, const char *text, const char *path, collide_poses *out);
void collide_poses_release(tool *t, collide_poses *poses);
/* Pose number i, between coordinates that are relative to the origins. */
fct_pose collide_pose(const collide_poses *poses, size_t i);

#endif
