/* radiosity/light/polygon.h: irradiance at a point from a triangle of radiant exitance 1, by Lambert's
 * formula.
 *
 * E = 1 / (2 pi) sum theta_i (n . gamma_i) over the sides, where theta_i is the angle that a side subtends at
 * the point and gamma_i the unit normal of the plane through side and point. The formula is exact at any
 * distance for a polygon above the receiver's horizon; fct_triangle_clip cuts off the part below.
 */
#ifndef FCT_RADIOSITY_POLYGON_H
#define FCT_RADIOSITY_POLYGON_H

#include "radiosity/sample.h"

/* atan2(y, x) for y >= 0, to 1e-10: the series about 0 or about pi / 4. Takes a third of atan2's time. */
static inline double fct_angle(double y, double x) {
    double wide = fabs(x), t = y < wide ? y / wide : wide / y, shift = 0;
    if (t > .41421356237309503) t = (t - 1) / (t + 1), shift = FCT_PI / 4;
    double q = t * t, sum = 1. / 21;
    for (int k = 19; k > 0; k -= 2) sum = 1. / k - q * sum;
    double angle = shift + t * sum;
    if (y >= wide) angle = FCT_PI / 2 - angle;
    return x < 0 ? FCT_PI - angle : angle;
}

/* The part of the triangle with n . p >= 0; corners are relative to the point. Returns 0, 3 or 4 corners. */
static inline int fct_triangle_clip(const v3 corners[3], v3 n, v3 out[4]) {
    double height[3];
    int above = 0, count = 0;
    for (int i = 0; i < 3; ++i) above += (height[i] = v3_dot(corners[i], n)) > 0;
    if (above == 0) return 0;
    for (int i = 0; i < 3; ++i) {
        int j = i == 2 ? 0 : i + 1;
        if (height[i] > 0) out[count++] = corners[i];
        if ((height[i] > 0) != (height[j] > 0))
            out[count++] =
                v3_mad(corners[i], height[i] / (height[i] - height[j]), v3_sub(corners[j], corners[i]));
    }
    return count;
}

/* Irradiance over exitance at the origin with unit normal n, in [0, 1], for either winding; 0 if the origin
 * lies in the triangle's plane. Corners are relative to the origin. */
static inline double fct_triangle_irradiance(const v3 corners[3], v3 n) {
    v3 p[4], sum = {0, 0, 0};
    int count = fct_triangle_clip(corners, n, p);
    for (int i = 0; i < count; ++i) {
        v3 a = p[i], b = p[i + 1 == count ? 0 : i + 1], cross = v3_cross(a, b);
        double length = v3_norm(cross);
        if (length > 0) sum = v3_mad(sum, fct_angle(length, v3_dot(a, b)) / length, cross);
    }
    double e = fabs(v3_dot(sum, n)) / (2 * FCT_PI);
    return e < 1 ? e : 1;
}

#endif
