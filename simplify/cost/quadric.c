/* simplify/cost/quadric.c: quadrics of 2-planes in R^(3 + m), their value, and the elimination of attributes.
 *
 * Source: Garland 1999, section 5.2. Cost: O(m^2) for a plane and a value, O(m^3) for an elimination.
 */
#include "simplify/cost/quadric.h"

#include <string.h>

void fct_quadric_of_plane(double *q, uint32_t m, double x[3][3 + QUADRIC_MAX_ATTRIBUTES]) {
    uint32_t n = 3 + m;
    double e1[3 + QUADRIC_MAX_ATTRIBUTES], e2[3 + QUADRIC_MAX_ATTRIBUTES], b[3 + QUADRIC_MAX_ATTRIBUTES];
    double h = 0, dot = 0, k2 = 0;
    for (uint32_t i = 0; i < n; ++i) e1[i] = x[1][i] - x[0][i], h += e1[i] * e1[i];
    h = 1 / sqrt(h);
    for (uint32_t i = 0; i < n; ++i) e1[i] *= h, e2[i] = x[2][i] - x[0][i], dot += e1[i] * e2[i];
    for (uint32_t i = 0; i < n; ++i) e2[i] -= dot * e1[i], k2 += e2[i] * e2[i];
    k2 = k2 > 0 ? 1 / sqrt(k2) : 0;
    double p1 = 0, p2 = 0, pp = 0;
    for (uint32_t i = 0; i < n; ++i) {
        e2[i] *= k2;
        p1 += x[0][i] * e1[i], p2 += x[0][i] * e2[i], pp += x[0][i] * x[0][i];
    }
    for (uint32_t i = 0; i < n; ++i) b[i] = p1 * e1[i] + p2 * e2[i] - x[0][i];
    double *a = q, *square = q + POSITION_QUADRIC + 4 * m;
    for (uint32_t i = 0; i < 3; ++i)
        for (uint32_t j = i; j < 3; ++j) *a++ = (i == j) - e1[i] * e1[j] - e2[i] * e2[j];
    q[6] = b[0], q[7] = b[1], q[8] = b[2];
    q[9] = pp - p1 * p1 - p2 * p2;
    q[10] = 1;
    for (uint32_t i = 0; i < m; ++i) {
        double *cross = q + POSITION_QUADRIC + 4 * i;
        for (uint32_t j = 0; j < 3; ++j) cross[j] = -e1[3 + i] * e1[j] - e2[3 + i] * e2[j];
        cross[3] = b[3 + i];
        for (uint32_t j = i; j < m; ++j) *square++ = (i == j) - e1[3 + i] * e1[3 + j] - e2[3 + i] * e2[3 + j];
    }
}

double fct_quadric_value(const double *q, uint32_t m, v3 p, const double *a) {
    double value = quadric_at(q, p);
    const double *cross = q + POSITION_QUADRIC, *square = cross + 4 * m;
    for (uint32_t j = 0; j < m; ++j, cross += 4) {
        value += 2 * a[j] * (cross[0] * p.x + cross[1] * p.y + cross[2] * p.z + cross[3]);
        value += a[j] * a[j] * *square++;
        for (uint32_t k = j + 1; k < m; ++k) value += 2 * a[j] * a[k] * *square++;
    }
    return value;
}

void fct_quadric_eliminate(const double *q, uint32_t m, const double *prior, double ridge,
                           fct_elimination *out) {
    double *r = out->position;
    memcpy(r, q, POSITION_QUADRIC * sizeof *r);
    const double *cross = q + POSITION_QUADRIC, *square = cross + 4 * m;
    for (uint32_t j = 0; j < m; ++j) {
        memcpy(out->rows[j], cross + 4 * j, 4 * sizeof(double));
        out->rows[j][3] -= ridge * prior[j];
        for (uint32_t k = j; k < m; ++k) out->upper[j][k] = *square++;
        out->upper[j][j] += ridge;
        r[9] += ridge * prior[j] * prior[j];
    }
    /* A step of Gaussian elimination: removes attribute j from A, b, c and the rows below. */
    for (uint32_t j = 0; j < m; ++j) {
        const double *row = out->rows[j];
        double inverse = out->upper[j][j] > 0 ? 1 / out->upper[j][j] : 0;
        double x = row[0] * inverse, y = row[1] * inverse, z = row[2] * inverse, w = row[3] * inverse;
        r[0] -= x * row[0], r[1] -= x * row[1], r[2] -= x * row[2];
        r[3] -= y * row[1], r[4] -= y * row[2], r[5] -= z * row[2];
        r[6] -= x * row[3], r[7] -= y * row[3], r[8] -= z * row[3], r[9] -= w * row[3];
        for (uint32_t k = j + 1; k < m; ++k) {
            double factor = out->upper[j][k] * inverse;
            for (int i = 0; i < 4; ++i) out->rows[k][i] -= factor * row[i];
            for (uint32_t i = k; i < m; ++i) out->upper[k][i] -= factor * out->upper[j][i];
        }
    }
}

void fct_quadric_attributes(const fct_elimination *e, uint32_t m, v3 p, double *attributes) {
    for (uint32_t j = m; j-- > 0;) {
        const double *row = e->rows[j];
        double sum = row[0] * p.x + row[1] * p.y + row[2] * p.z + row[3];
        for (uint32_t k = j + 1; k < m; ++k) sum += e->upper[j][k] * attributes[k];
        attributes[j] = e->upper[j][j] > 0 ? -sum / e->upper[j][j] : 0;
    }
}
