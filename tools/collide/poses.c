/* tools/collide/poses.c: see poses.h. */
#define _GNU_SOURCE
#include "tools/collide/poses.h"

#include <math.h>
#include <string.h>

enum { COLUMNS = 12 };

/* |det R| over the product of the lengths of the columns. A smaller share is rounding. */
#define SINGULAR_RATIO 1e-12
/* Differences of R^T R from a multiple of the identity, relative to it. The least of six decimals that people
 * write is below this. */
#define RIGID_TOLERANCE 1e-4

/* --- Checks --- */

/* The value of row r and column c of R. */
static double get_entry(const double *row, int r, int c) {
    return row[4 * r + c];
}

static double find_determinant(const double *row) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) {
        int d = (c + 1) % 3, e = (c + 2) % 3;
        sum += get_entry(row, 0, c) *
               (get_entry(row, 1, d) * get_entry(row, 2, e) - get_entry(row, 1, e) * get_entry(row, 2, d));
    }
    return sum;
}

static bool has_inverse(const double *row, double determinant) {
    double size = 1;
    for (int c = 0; c < 3; ++c)
        size *=
            sqrt(get_entry(row, 0, c) * get_entry(row, 0, c) + get_entry(row, 1, c) * get_entry(row, 1, c) +
                 get_entry(row, 2, c) * get_entry(row, 2, c));
    return fabs(determinant) > SINGULAR_RATIO * size;
}

/* Whether R is a factor times a rotation or reflection. */
static bool is_similar(const double *row) {
    double product[3][3];
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            product[i][j] = 0;
            for (int k = 0; k < 3; ++k) product[i][j] += get_entry(row, k, i) * get_entry(row, k, j);
        }
    double square = (product[0][0] + product[1][1] + product[2][2]) / 3;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            if (fabs(product[i][j] - (i == j ? square : 0)) > RIGID_TOLERANCE * square) return false;
    return true;
}

/* The rows so far. */
typedef struct pose_check {
    size_t count;
    bool warned;
} pose_check;

static int check_pose(tool *t, const char *place, double *row, void *user) {
    pose_check *so_far = user;
    double determinant = find_determinant(row);
    size_t number = so_far->count++;
    if (!has_inverse(row, determinant))
        return tool_fail(t, TOOL_DATA,
                         "%s: pose %zu: expected a matrix with an inverse, found the determinant %g", place,
                         number, determinant);
    if (so_far->warned || is_similar(row)) return TOOL_DONE;
    tool_warn(t, "%s: pose %zu: the matrix shears or scales unequally, so its queries are slow", place,
              number);
    so_far->warned = true;
    return TOOL_DONE;
}

/* --- Reading --- */

static tool_row_format make_format(pose_check *so_far) {
    return (tool_row_format){.least = COLUMNS, .columns = COLUMNS, .check = check_pose, .user = so_far};
}

/* The numbers may be separated by commas. */
static int parse_pose(tool *t, const char *text, tool_rows *rows) {
    char copy[1024];
    size_t length = strlen(text);
    if (!length || length >= sizeof copy)
        return tool_fail(t, TOOL_USAGE, "--pose: expected 12 numbers, found %zu characters", length);
    for (size_t i = 0; i <= length; ++i) copy[i] = text[i] == ',' || text[i] == '\n' ? ' ' : text[i];
    FILE *file = fmemopen(copy, length, "r");
    if (!file) return tool_fail(t, TOOL_MEMORY, "--pose: out of memory");
    pose_check so_far = {0};
    const tool_row_format format = make_format(&so_far);
    int code = tool_rows_parse(t, "--pose", file, &format, rows);
    fclose(file);
    if (code == TOOL_DONE && rows->count == 0)
        code = tool_fail(t, TOOL_USAGE, "--pose: expected 12 numbers, found none");
    return code == TOOL_DATA ? TOOL_USAGE : code;
}

static int set_identity(tool *t, tool_rows *rows) {
    static const double identity[COLUMNS] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    *rows = (tool_rows){.values = tool_allocate(t, 1, sizeof identity)};
    if (!rows->values) return TOOL_MEMORY;
    memcpy(rows->values, identity, sizeof identity);
    rows->count = 1;
    return TOOL_DONE;
}

int collide_poses_read(tool *t, const char *text, const char *path, collide_poses *out) {
    *out = (collide_poses){0};
    if (text) return parse_pose(t, text, &out->rows);
    if (!path) return set_identity(t, &out->rows);
    pose_check so_far = {0};
    const tool_row_format format = make_format(&so_far);
    return tool_rows_read(t, path, &format, &out->rows);
}

void collide_poses_release(tool *t, collide_poses *poses) {
    tool_rows_release(t, &poses->rows);
}

fct_pose collide_pose(const collide_poses *poses, size_t i) {
    const double *row = poses->rows.values + COLUMNS * i;
    fct_pose pose;
    for (int r = 0; r < 3; ++r) {
        double shift = row[4 * r + 3] - poses->origin_a[r];
        for (int c = 0; c < 3; ++c) {
            pose.rotation[r][c] = get_entry(row, r, c);
            shift += get_entry(row, r, c) * poses->origin_b[c];
        }
        pose.translation[r] = shift;
    }
    return pose;
}
