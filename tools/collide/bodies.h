/* tools/collide/bodies.h: the instances of a scene that touch. */
#ifndef FCT_TOOLS_COLLIDE_BODIES_H
#define FCT_TOOLS_COLLIDE_BODIES_H

#include "tools/collide/report.h"

/* Reports the pairs of instances of the scene that touch, `limit` at most. Parts of one object do not count,
 * because they adjoin. *seconds receives the time of the query. Returns an exit code. */
int collide_bodies(tool *t, const char *path, size_t limit, collide_report *report, double *seconds);

#endif
