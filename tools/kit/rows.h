/* tools/kit/rows.h: rows of numbers in a text file, such as rays, points and probes. */
#ifndef FCT_TOOLS_ROWS_H
#define FCT_TOOLS_ROWS_H

#include "tools/kit/env.h"

typedef struct tool_rows {
    size_t count;
    float *values; /* count x columns */
} tool_rows;

/* Reads rows of least..columns numbers; "-" is stdin. missing (columns - least): the values of absent
 * columns. Empty lines and text after # are skipped. The first `least` columns must be finite. Returns an
 * exit code. */
int tool_rows_read(tool *t, const char *path, int least, int columns, const float *missing, tool_rows *rows);
void tool_rows_release(tool *t, tool_rows *rows);

#endif
