/* bvh/ray/exact.c: see exact.h.
 *
 * The line with direction d passes on one side of the edge a b by the sign of
 *
 *     det(d, a - o, b - o) = det(d, a, b) - det(d, a, o) + det(d, b, o).
 *
 * These are 18 products of three coordinates. The product of two has at most 48 bits. It is split into halves
 * of at most 24 and 29 bits, so that the products with the third coordinate are exact in a double. The terms
 * are added to an expansion: doubles in order of magnitude that do not overlap, whose sum is exact (Shewchuk
 * 1997).
 */
#include "bvh/ray/exact.h"

#include <stdint.h>
#include <string.h>

enum { TERMS = 36 };

typedef struct expansion {
    double term[TERMS];
    int count;
} expansion;

/* Grow-Expansion (Shewchuk 1997, figure 6). */
static void add_term(expansion *e, double x) {
    for (int i = 0; i < e->count; ++i) {
        double sum = x + e->term[i], part = sum - x;
        e->term[i] = (x - (sum - part)) + (e->term[i] - part);
        x = sum;
    }
    e->term[e->count++] = x;
}

/* The largest term that is not zero outweighs the others. */
static int find_sign(const expansion *e) {
    for (int i = e->count; i-- > 0;)
        if (e->term[i] != 0) return e->term[i] > 0 ? 1 : -1;
    return 0;
}

static void add_product(expansion *e, double a, double b, double c) {
    double product = a * b, high;
    uint64_t bits;
    memcpy(&bits, &product, sizeof bits);
    bits &= ~(uint64_t)0x1fffffff;
    memcpy(&high, &bits, sizeof high);
    add_term(e, high * c);
    add_term(e, (product - high) * c);
}

/* Adds sign det(a, b, c). */
static void add_determinant(expansion *e, double sign, v3 a, v3 b, v3 c) {
    double x = sign * a.x, y = sign * a.y, z = sign * a.z;
    add_product(e, x, b.y, c.z), add_product(e, -x, b.z, c.y);
    add_product(e, y, b.z, c.x), add_product(e, -y, b.x, c.z);
    add_product(e, z, b.x, c.y), add_product(e, -z, b.y, c.x);
}

/* On which side of the edge a b the line passes: 1 or -1, or 0 if the edge is a point seen along the line. If
 * the line meets the edge, the origin is shifted along x; if that changes nothing, along y, then along z. A
 * shift s e changes the determinant by s det(d, e, a - b). */
static int find_side(v3 o, v3 d, v3 a, v3 b) {
    static const v3 shifts[3] = {{.x = 1}, {.y = 1}, {.z = 1}};
    expansion e = {.count = 0};
    add_determinant(&e, 1, d, a, b);
    add_determinant(&e, -1, d, a, o);
    add_determinant(&e, 1, d, b, o);
    int sign = find_sign(&e);
    for (int i = 0; i < 3 && sign == 0; ++i) {
        e.count = 0;
        add_determinant(&e, 1, d, shifts[i], a);
        add_determinant(&e, -1, d, shifts[i], b);
        sign = find_sign(&e);
    }
    return sign;
}

bool fct_line_crosses(v3 origin, v3 direction, const v3 p[3]) {
    int side = find_side(origin, direction, p[0], p[1]);
    return side != 0 && find_side(origin, direction, p[1], p[2]) == side &&
           find_side(origin, direction, p[2], p[0]) == side;
}
