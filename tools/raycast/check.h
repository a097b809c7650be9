/* tools/raycast/check.h: rays of several kinds, and both backends beside each other. Return exit codes. */
#ifndef FCT_TOOLS_RAYCAST_CHECK_H
#define FCT_TOOLS_RAYCAST_CHECK_H

#include "tools/kit/rows.h"

/* Shoots `count` rays with both backends and reports the differences; TOOL_NO if one is not explained. rows:
 * the rays; NULL: it makes them. */
int raycast_check(tool *t, const tool_rows *rows, size_t count);
/* Writes `count` rays for --rays. */
int raycast_make(tool *t, size_t count);

#endif
