/* base/math/origin.c: see origin.h. */
#include "base/math/origin.h"

#include <math.h>

/* Below this ratio, floats keep at least 17 bits of the longest side. Coordinates of UTM reach 10^7 metres,
 * so models of up to 150 km get an origin. */
static const double FAR = 64;
/* A ratio of at most 62 stays below 64: a point that moves the largest coordinate by d makes the box at least
 * d long. */
static const double NEAR = 62;

/* Whether x is a float, or the decimal number of 9 digits that prints a float. */
static bool is_float(double x) {
    static const double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                    1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    double f = (double)(float)x, magnitude = fabs(f);
    if (f == x) return true;
    if (magnitude >= 1e9) {
        int k = 0;
        while (k < 22 && magnitude >= 1e9 * powers[k]) ++k;
        return rint(magnitude / powers[k]) * powers[k] == fabs(x);
    }
    int k = 0;
    while (k < 22 && magnitude * powers[k] < 1e8) ++k;
    return rint(magnitude * powers[k]) / powers[k] == fabs(x);
}

static double longest_side(const fct_extent *e) {
    double side = 0;
    for (int k = 0; k < 3; ++k)
        if (e->upper[k] - e->lower[k] > side) side = e->upper[k] - e->lower[k];
    return side;
}

static double largest_coordinate(const fct_extent *e) {
    double largest = 0;
    for (int k = 0; k < 3; ++k) {
        if (-e->lower[k] > largest) largest = -e->lower[k];
        if (e->upper[k] > largest) largest = e->upper[k];
    }
    return largest;
}

void fct_extent_widen(fct_extent *e, const double point[3]) {
    for (int k = 0; k < 3; ++k)
        if (!isfinite((float)point[k])) return;
    for (int k = 0; k < 3; ++k) {
        if (!e->any || point[k] < e->lower[k]) e->lower[k] = point[k];
        if (!e->any || point[k] > e->upper[k]) e->upper[k] = point[k];
        e->fine = e->fine || !is_float(point[k]);
    }
    e->any = true;
    e->near = largest_coordinate(e) <= NEAR * longest_side(e);
}

/* The least power of two that is at least `side`. */
static double find_step(double side) {
    int exponent;
    double fraction = frexp(side, &exponent);
    return ldexp(1, fraction > .5 ? exponent : exponent - 1);
}

bool fct_extent_origin(const fct_extent *e, double origin[3]) {
    double side = longest_side(e);
    bool far = e->fine && side > 0 && largest_coordinate(e) > FAR * side;
    for (int k = 0; k < 3; ++k) {
        double centre = .5 * e->lower[k] + .5 * e->upper[k];
        origin[k] = far ? centre : 0;
        /* Beyond 2^52 steps the centre is a multiple already. */
        double steps = far ? centre / find_step(side) : 0;
        if (far && fabs(steps) < 4503599627370496.0) origin[k] = rint(steps) * find_step(side);
    }
    return far;
}
