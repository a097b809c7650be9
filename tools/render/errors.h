/* tools/render/errors.h: the error of a bake as false colours. */
#ifndef FCT_TOOLS_RENDER_ERRORS_H
#define FCT_TOOLS_RENDER_ERRORS_H

#include "tools/render/drawing.h"

/* Sets d->values from the error at the vertices, in percent of the median light: half of the area that shines
 * at all is brighter. *end: the percentage that d->values has as 1; if it is 0, it becomes 1, 2 or 5 times a
 * power of ten, so that about 2 % of the area exceeds it. path: of the input, for messages. Returns an exit
 * code: TOOL_DATA without an error at the vertices. */
int drawing_show_errors(tool *t, const char *path, drawing *d, double *end);

#endif
