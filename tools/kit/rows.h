/* tools/kit/rows.h: rows of numbers in a text file, such as rays, points and probes. */
#ifndef FCT_TOOLS_ROWS_H
#define FCT_TOOLS_ROWS_H

#include "tools/kit/env.h"

typedef struct tool_rows {
    size_t count;
    double *values; /* count x columns; those that are finite fit a float */
} tool_rows;

/* Reads rows of least..columns numbers; "-" is stdin. missing (columns - least): the values of absent
 * columns. Empty lines and text after # are skipped. The first `least` columns must be finite. Returns an
 * exit code. */
int tool_rows_read(tool *t, const char *path, int least, int columns, const double *missing, tool_rows *rows);
/* The same for an open file. `name` is used in messages. */
int tool_rows_parse(tool *t, const char *name, FILE *file, int least, int columns, const double *missing,
                    tool_rows *rows);
/* Writes count points relative to the origin: columns [column, column + 3) of each row. */
void tool_rows_points(const tool_rows *rows, int columns, int column, const double origin[3], float *points);
void tool_rows_release(tool *t, tool_rows *rows);

#endif
