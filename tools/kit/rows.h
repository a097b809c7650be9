/* tools/kit/rows.h: rows of numbers in a text file, such as rays, points and probes. */
#ifndef FCT_TOOLS_ROWS_H
#define FCT_TOOLS_ROWS_H

#include "tools/kit/env.h"

typedef struct tool_rows {
    size_t count;
    double *values; /* count x columns; those that are finite fit a float */
} tool_rows;

/* What a row holds. */
typedef struct tool_row_format {
    int least, columns;    /* numbers; the first `least` must be there, and finite */
    const double *missing; /* columns - least: the values of absent columns */
    /* Checks a row; `place` is "FILE:LINE". Returns an exit code. NULL: every row is good. */
    int (*check)(tool *t, const char *place, double *row, void *user);
    void *user;
} tool_row_format;

/* Reads rows; "-" is stdin. Empty lines and text after # are skipped. Errors name the line. Returns an exit
 * code. */
int tool_rows_read(tool *t, const char *path, const tool_row_format *format, tool_rows *rows);
/* The same for an open file. `name` is used in messages. */
int tool_rows_parse(tool *t, const char *name, FILE *file, const tool_row_format *format, tool_rows *rows);
/* Writes count points relative to the origin: columns [column, column + 3) of each row. */
void tool_rows_points(const tool_rows *rows, int columns, int column, const double origin[3], float *points);
void tool_rows_release(tool *t, tool_rows *rows);

#endif
