/* tools/wishes.h: the files of `facetree simplify --contour` and `--paint`. */
#ifndef FCT_TOOLS_WISHES_H
#define FCT_TOOLS_WISHES_H

#include "facetree/simplifier.h"
#include "tools/kit/env.h"

/* Constrains the edges that a file lists: two vertex numbers per line. Returns an exit code. */
int tool_read_contour(tool *t, const char *path, fct_simplifier *s);
/* Paints the vertices: one weight per line. Returns an exit code. */
int tool_read_paint(tool *t, const char *path, fct_paint_level level, fct_simplifier *s);

#endif
