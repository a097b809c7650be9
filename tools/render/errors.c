/* tools/render/errors.c: see errors.h. */
#include "tools/render/errors.h"

#include <math.h>
#include <stdlib.h>

/* Share of the area with errors up to the end of the scale. */
#define COVERED .98

/* The value of a face, the mean of its corners, and its area. */
typedef struct ranked {
    double value, area;
} ranked;

static int compare_values(const void *a, const void *b) {
    const double x = ((const ranked *)a)->value, y = ((const ranked *)b)->value;
    return (x > y) - (x < y);
}

/* The least value that is not exceeded on `share` of the area; 0 without area. Sorts the faces. */
static double find_quantile(ranked *faces, size_t count, double share) {
    double area = 0, below = 0;
    qsort(faces, count, sizeof *faces, compare_values);
    for (size_t i = 0; i < count; ++i) area += faces[i].area;
    for (size_t i = 0; i < count; ++i) {
        below += faces[i].area;
        if (area > 0 && below >= share * area) return faces[i].value;
    }
    return 0;
}

static double measure_area(const fct_mesh *m, size_t face) {
    const uint32_t *t = m->triangles + 3 * face;
    double a[3], b[3], square = 0;
    for (size_t k = 0; k < 3; ++k) {
        const double p = m->positions[3 * (size_t)t[0] + k];
        a[k] = m->positions[3 * (size_t)t[1] + k] - p, b[k] = m->positions[3 * (size_t)t[2] + k] - p;
    }
    for (size_t k = 0; k < 3; ++k) {
        const double n = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
        square += n * n;
    }
    return .5 * sqrt(square);
}

/* Lists faces with a positive value, the mean of `width` floats per vertex. Returns their number. */
static size_t list_faces(const fct_mesh *m, const float *values, size_t width, ranked *out) {
    size_t count = 0;
    for (size_t f = 0; f < m->face_count; ++f) {
        double sum = 0;
        for (size_t k = 0; k < 3; ++k)
            for (size_t c = 0; c < width; ++c) sum += values[width * m->triangles[3 * f + k] + c];
        if (sum > 0) out[count++] = (ranked){sum / (3 * (double)width), measure_area(m, f)};
    }
    return count;
}

/* The next 1, 2 or 5 times a power of ten. */
static double round_up(double value) {
    const double power = pow(10, floor(log10(value)));
    return power * (value <= power ? 1 : value <= 2 * power ? 2 : value <= 5 * power ? 5 : 10);
}

int drawing_show_errors(tool *t, const char *path, drawing *d, double *end) {
    const fct_mesh *m = &d->mesh;
    if (!m->error || !m->colors)
        return tool_fail(
            t, TOOL_DATA,
            "%s: expected the error of its light at the vertices, as bake --light radiosity,error "
            "writes it, found none",
            path);
    ranked *faces = tool_allocate(t, m->face_count, sizeof *faces);
    d->values = tool_allocate(t, m->vertex_count, sizeof *d->values);
    if (!faces || !d->values) {
        tool_release(t, faces);
        return TOOL_MEMORY;
    }
    const double light = find_quantile(faces, list_faces(m, m->colors, 3, faces), .5);
    const double high = find_quantile(faces, list_faces(m, m->error, 1, faces), COVERED);
    tool_release(t, faces);
    const bool known = light > 0 && high > 0;
    if (!(*end > 0)) *end = known ? round_up(100 * high / light) : 1;
    for (size_t v = 0; v < m->vertex_count; ++v)
        d->values[v] = known ? (float)(100 * (double)m->error[v] / light / *end) : 0;
    d->shading = DRAWING_LIGHT;
    return TOOL_DONE;
}
