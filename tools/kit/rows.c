/* tools/kit/rows.c: see rows.h. An error states the file, the line, the expected value and the found one. */
#define _GNU_SOURCE
#include "tools/kit/rows.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The word at `text`, shortened for a message. */
static const char *copy_word(const char *text, char word[40]) {
    size_t length = strcspn(text, " \t\r\n#");
    if (length > 32)
        snprintf(word, 40, "%.29s...", text);
    else
        snprintf(word, 40, "%.*s", (int)length, text);
    return word;
}

typedef struct reader {
    tool *t;
    const char *path;
    size_t line;
    const tool_row_format *format;
} reader;

/* Reads the numbers of one line into `row`; *found receives their count. */
static int parse_row(const reader *r, const char *text, double *row, int *found) {
    char word[40];
    *found = 0;
    for (;;) {
        text += strspn(text, " \t\r\n\v\f");
        if (!*text || *text == '#') break;
        char *end;
        double value = strtod(text, &end);
        if (end == text || !strchr(" \t\r\n\v\f#", *end))
            return tool_fail(r->t, TOOL_DATA, "%s:%zu: expected a number, found '%s'", r->path, r->line,
                             copy_word(text, word));
        bool must_be_finite = *found < r->format->least || isnan(value);
        bool written_infinite = strncasecmp(text + strspn(text, "+-"), "inf", 3) == 0;
        if (!isfinite((float)value) && (must_be_finite || !written_infinite))
            return tool_fail(r->t, TOOL_DATA, "%s:%zu: expected a number below 3.4e38, found '%s'", r->path,
                             r->line, copy_word(text, word));
        if (*found == r->format->columns)
            return tool_fail(r->t, TOOL_DATA, "%s:%zu: expected %d numbers at most, found more: '%s'",
                             r->path, r->line, r->format->columns, copy_word(text, word));
        row[(*found)++] = value;
        text = end;
    }
    if (*found && *found < r->format->least)
        return tool_fail(r->t, TOOL_DATA, "%s:%zu: expected %d numbers, found %d", r->path, r->line,
                         r->format->least, *found);
    for (int i = *found; *found && i < r->format->columns; ++i)
        row[i] = r->format->missing[i - r->format->least];
    return TOOL_DONE;
}

static int reserve_row(tool *t, tool_rows *rows, size_t *capacity, int columns) {
    if (rows->count < *capacity) return TOOL_DONE;
    size_t larger = *capacity ? *capacity + *capacity / 2 : 1024;
    double *values = tool_allocate(t, larger, (size_t)columns * sizeof *values);
    if (!values) return TOOL_MEMORY;
    if (rows->values) memcpy(values, rows->values, rows->count * (size_t)columns * sizeof *values);
    tool_release(t, rows->values);
    rows->values = values;
    *capacity = larger;
    return TOOL_DONE;
}

static int check_row(const reader *r, double *row) {
    char place[1024];
    if (!r->format->check) return TOOL_DONE;
    snprintf(place, sizeof place, "%s:%zu", r->path, r->line);
    return r->format->check(r->t, place, row, r->format->user);
}

static int read_rows(reader *r, FILE *file, tool_rows *rows) {
    char *text = NULL;
    size_t size = 0, capacity = 0;
    int code = TOOL_DONE, found;
    ssize_t length;
    errno = 0;
    while (code == TOOL_DONE && (length = getline(&text, &size, file)) >= 0) {
        ++r->line;
        if (memchr(text, 0, (size_t)length)) {
            code = tool_fail(r->t, TOOL_DATA, "%s:%zu: expected text, found a zero byte", r->path, r->line);
            break;
        }
        code = reserve_row(r->t, rows, &capacity, r->format->columns);
        if (code == TOOL_DONE)
            code = parse_row(r, text, rows->values + rows->count * (size_t)r->format->columns, &found);
        if (code == TOOL_DONE && found)
            code = check_row(r, rows->values + rows->count * (size_t)r->format->columns);
        if (code == TOOL_DONE && found) ++rows->count;
    }
    if (code == TOOL_DONE && (ferror(file) || !feof(file)))
        code = tool_fail(r->t, TOOL_INPUT, "%s: cannot be read: %s", r->path, strerror(errno));
    free(text);
    return code;
}

int tool_rows_parse(tool *t, const char *name, FILE *file, const tool_row_format *format, tool_rows *rows) {
    *rows = (tool_rows){0};
    reader r = {t, name, 0, format};
    int code = read_rows(&r, file, rows);
    if (code != TOOL_DONE) tool_rows_release(t, rows);
    return code;
}

int tool_rows_read(tool *t, const char *path, const tool_row_format *format, tool_rows *rows) {
    *rows = (tool_rows){0};
    if (!strcmp(path, "-")) return tool_rows_parse(t, "standard input", stdin, format, rows);
    FILE *file = fopen(path, "re");
    if (!file) return tool_fail(t, TOOL_INPUT, "%s: cannot be read: %s", path, strerror(errno));
    int code = tool_note_input(t, path);
    if (code == TOOL_DONE) code = tool_rows_parse(t, path, file, format, rows);
    fclose(file);
    return code;
}

void tool_rows_points(const tool_rows *rows, int columns, int column, const double origin[3], float *points) {
    for (size_t i = 0; i < rows->count; ++i)
        for (int k = 0; k < 3; ++k)
            points[3 * i + (size_t)k] =
                (float)(rows->values[i * (size_t)columns + (size_t)(column + k)] - origin[k]);
}

void tool_rows_release(tool *t, tool_rows *rows) {
    tool_release(t, rows->values);
    *rows = (tool_rows){0};
}
