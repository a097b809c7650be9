/* bvh/ray/exact.c: see exact.h.
 *
 * The line with direction d passes on one side of the edge a b by the sign of
 *
 *     det(d, a - o, b - o) = det(d, a, b) - det(d, a, o) + det(d, b, o).
 *
 * These are 18 products of three coordinates. An expansion adds them exactly.
 */
#include "bvh/ray/exact.h"

#include "base/math/expansion.h"

/* Adds sign det(a, b, c). */
static void add_determinant(fct_expansion *e, double sign, v3 a, v3 b, v3 c) {
    double x = sign * a.x, y = sign * a.y, z = sign * a.z;
    fct_expansion_add_product(e, x, b.y, c.z), fct_expansion_add_product(e, -x, b.z, c.y);
    fct_expansion_add_product(e, y, b.z, c.x), fct_expansion_add_product(e, -y, b.x, c.z);
    fct_expansion_add_product(e, z, b.x, c.y), fct_expansion_add_product(e, -z, b.y, c.x);
}

/* On which side of the edge a b the line passes: 1 or -1, or 0 if the edge is a point seen along the line. If
 * the line meets the edge, the origin is shifted along x; if that changes nothing, along y, then along z. A
 * shift s e changes the determinant by s det(d, e, a - b). */
static int find_side(v3 o, v3 d, v3 a, v3 b) {
    static const v3 shifts[3] = {{.x = 1}, {.y = 1}, {.z = 1}};
    fct_expansion e;
    e.count = 0;
    add_determinant(&e, 1, d, a, b);
    add_determinant(&e, -1, d, a, o);
    add_determinant(&e, 1, d, b, o);
    int sign = fct_expansion_sign(&e);
    for (int i = 0; i < 3 && sign == 0; ++i) {
        e.count = 0;
        add_determinant(&e, 1, d, shifts[i], a);
        add_determinant(&e, -1, d, shifts[i], b);
        sign = fct_expansion_sign(&e);
    }
    return sign;
}

bool fct_line_crosses(v3 origin, v3 direction, const v3 p[3]) {
    int side = find_side(origin, direction, p[0], p[1]);
    return side != 0 && find_side(origin, direction, p[1], p[2]) == side &&
           find_side(origin, direction, p[2], p[0]) == side;
}
