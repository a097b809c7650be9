/* tools/wishes.c: see wishes.h. */
#include "tools/wishes.h"

#include <math.h>

#include "tools/kit/rows.h"

#define LEAST_WEIGHT 1e-6
#define MOST_WEIGHT  1e6

static int check_pair(tool *t, const char *place, double *row, void *user) {
    (void)user;
    for (int k = 0; k < 2; ++k)
        if (!(row[k] >= 0 && row[k] < FCT_NONE && row[k] == floor(row[k])))
            return tool_fail(t, TOOL_DATA, "%s: expected a vertex number, found %g", place, row[k]);
    return TOOL_DONE;
}

static int check_weight(tool *t, const char *place, double *row, void *user) {
    (void)user;
    if (row[0] >= LEAST_WEIGHT && row[0] <= MOST_WEIGHT) return TOOL_DONE;
    return tool_fail(t, TOOL_DATA, "%s: expected a weight from 1e-6 to 1e6, found %g", place, row[0]);
}

int tool_read_contour(tool *t, const char *path, fct_simplifier *s) {
    const tool_row_format format = {.least = 2, .columns = 2, .check = check_pair};
    tool_rows rows;
    int code = tool_rows_read(t, path, &format, &rows);
    if (code != TOOL_DONE) return code;
    if (rows.count > UINT32_MAX / 2) {
        tool_rows_release(t, &rows);
        return tool_fail(t, TOOL_MEMORY, "%s: too many edges", path);
    }
    uint32_t *pairs = tool_allocate(t, rows.count, 2 * sizeof *pairs);
    if (pairs) {
        for (size_t i = 0; i < 2 * rows.count; ++i) pairs[i] = (uint32_t)rows.values[i];
        fct_constrain_def def = fct_constrain_def_default();
        def.contour = pairs, def.contour_count = (uint32_t)rows.count;
        code = tool_result(t, fct_simplifier_constrain(s, &def));
    } else
        code = TOOL_MEMORY;
    tool_release(t, pairs);
    tool_rows_release(t, &rows);
    return code;
}

int tool_read_paint(tool *t, const char *path, fct_paint_level level, fct_simplifier *s) {
    const tool_row_format format = {.least = 1, .columns = 1, .check = check_weight};
    tool_rows rows;
    int code = tool_rows_read(t, path, &format, &rows);
    if (code != TOOL_DONE) return code;
    float *weights = tool_allocate(t, rows.count, sizeof *weights);
    if (weights) {
        for (size_t i = 0; i < rows.count; ++i) weights[i] = (float)rows.values[i];
        uint32_t count = rows.count < UINT32_MAX ? (uint32_t)rows.count : UINT32_MAX;
        code = tool_result(t, fct_simplifier_paint(s, level, weights, count));
    } else
        code = TOOL_MEMORY;
    tool_release(t, weights);
    tool_rows_release(t, &rows);
    return code;
}
