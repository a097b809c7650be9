/* bvh/pair/orient.c: see orient.h.
 *
 * A determinant of differences in double has the right sign if its magnitude exceeds its error bound
 * (Shewchuk 1997, sections 4.2 and 4.3: (3 + 16 u) u times the sum of magnitudes in the plane, (7 + 56 u) u
 * in space, u = 2^-53). Otherwise the determinant of the coordinates themselves, 6 or 24 products, is added
 * up as an expansion.
 */
#include "bvh/pair/orient.h"

#include "base/math/expansion.h"

#define PLANE_ERROR ((3 + 16 * 0x1p-53) * 0x1p-53)
#define SPACE_ERROR ((7 + 56 * 0x1p-53) * 0x1p-53)

static int find_sign(double value) {
    return (value > 0) - (value < 0);
}

/* Adds sign det(a, b, c). */
static void add_determinant(fct_expansion *e, double sign, v3 a, v3 b, v3 c) {
    double x = sign * a.x, y = sign * a.y, z = sign * a.z;
    fct_expansion_add_product(e, b.y, c.z, x), fct_expansion_add_product(e, b.z, c.y, -x);
    fct_expansion_add_product(e, b.z, c.x, y), fct_expansion_add_product(e, b.x, c.z, -y);
    fct_expansion_add_product(e, b.x, c.y, z), fct_expansion_add_product(e, b.y, c.x, -z);
}

static int orient_space_exactly(v3 a, v3 b, v3 c, v3 d) {
    fct_expansion e;
    e.count = 0;
    add_determinant(&e, 1, b, c, d);
    add_determinant(&e, -1, a, c, d);
    add_determinant(&e, 1, a, b, d);
    add_determinant(&e, -1, a, b, c);
    return fct_expansion_sign(&e);
}

int fct_orient_space(v3 a, v3 b, v3 c, v3 d) {
    v3 ad = v3_sub(a, d), bd = v3_sub(b, d), cd = v3_sub(c, d);
    double bxcy = bd.x * cd.y, cxby = cd.x * bd.y, cxay = cd.x * ad.y, axcy = ad.x * cd.y, axby = ad.x * bd.y,
           bxay = bd.x * ad.y;
    double value = ad.z * (bxcy - cxby) + bd.z * (cxay - axcy) + cd.z * (axby - bxay);
    double size = (fabs(bxcy) + fabs(cxby)) * fabs(ad.z) + (fabs(cxay) + fabs(axcy)) * fabs(bd.z) +
                  (fabs(axby) + fabs(bxay)) * fabs(cd.z);
    if (fabs(value) > SPACE_ERROR * size) return -find_sign(value);
    return orient_space_exactly(a, b, c, d);
}

void fct_orient_corners(const v3 p[3], const v3 t[3], int side[3]) {
    v3 b = v3_sub(p[1], p[0]), c = v3_sub(p[2], p[0]);
    double bycz = b.y * c.z, bzcy = b.z * c.y, bzcx = b.z * c.x, bxcz = b.x * c.z, bxcy = b.x * c.y,
           bycx = b.y * c.x;
    v3 n = v3_make(bycz - bzcy, bzcx - bxcz, bxcy - bycx);
    v3 size = v3_make(fabs(bycz) + fabs(bzcy), fabs(bzcx) + fabs(bxcz), fabs(bxcy) + fabs(bycx));
    for (int i = 0; i < 3; ++i) {
        v3 d = v3_sub(t[i], p[0]);
        double value = n.x * d.x + n.y * d.y + n.z * d.z;
        double sum = size.x * fabs(d.x) + size.y * fabs(d.y) + size.z * fabs(d.z);
        side[i] =
            fabs(value) > SPACE_ERROR * sum ? find_sign(value) : orient_space_exactly(p[0], p[1], p[2], t[i]);
    }
}

static int orient_plane_exactly(double ax, double ay, double bx, double by, double cx, double cy) {
    const double product[6][2] = {{ax, by}, {-ay, bx}, {bx, cy}, {-by, cx}, {cx, ay}, {-cy, ax}};
    fct_expansion e;
    e.count = 0;
    for (int i = 0; i < 6; ++i) {
        double high, low = fct_product_rest(product[i][0], product[i][1], &high);
        fct_expansion_add(&e, low), fct_expansion_add(&e, high);
    }
    return fct_expansion_sign(&e);
}

int fct_orient_plane(int axis, v3 a, v3 b, v3 c) {
    double p[3][3] = {{a.x, a.y, a.z}, {b.x, b.y, b.z}, {c.x, c.y, c.z}};
    int x = (axis + 1) % 3, y = (axis + 2) % 3;
    double left = (p[1][x] - p[0][x]) * (p[2][y] - p[0][y]),
           right = (p[1][y] - p[0][y]) * (p[2][x] - p[0][x]);
    double value = left - right;
    if (fabs(value) > PLANE_ERROR * (fabs(left) + fabs(right))) return find_sign(value);
    return orient_plane_exactly(p[0][x], p[0][y], p[1][x], p[1][y], p[2][x], p[2][y]);
}
