/* bvh/ray/ray.c: prepares rays.
 *
 * The change to scaled space is exact (model.h), so a prepared ray is the caller's ray in another unit. If
 * the origin is out of FCT_REACH, or t_min is negative, the origin moves along the ray to the bounds, in
 * double. The float tests then see distances of the size of the model. The moved origin is rounded to float,
 * by less than the padding of a box.
 */
#include "bvh/ray/ray.h"

/* The power of two that brings a positive float to [1, 2). */
static double unit_factor(float largest) {
    union {
        float f;
        uint32_t u;
    } bits = {.f = largest};
    uint32_t exponent = bits.u >> 23;
    if (exponent == 0) return ldexp(1, -ilogb((double)largest));
    union {
        uint64_t u;
        double d;
    } factor = {.u = (uint64_t)(1023 + 127 - exponent) << 52};
    return factor.d;
}

/* Moves the origin along the ray to where it enters the bounds, or to t_min if that is later. Returns false
 * if the ray misses the bounds. */
static bool move_origin(const fct_bvh *bvh, const double o[3], const double d[3], double t_min, double t_max,
                        fct_prepared_ray *out) {
    double enter = t_min, leave = t_max;
    for (int i = 0; i < 3; ++i) {
        double lower = (double)bvh->lower[i] - o[i], upper = (double)bvh->upper[i] - o[i];
        if (d[i] == 0) {
            if (lower > 0 || upper < 0) return false;
            continue;
        }
        double a = lower / d[i], b = upper / d[i];
        double first = a < b ? a : b, last = a < b ? b : a;
        if (first > enter) enter = first;
        if (last < leave) leave = last;
    }
    if (!(enter <= leave)) return false;
    for (int i = 0; i < 3; ++i) out->origin[i] = (float)(o[i] + enter * d[i]);
    out->shift = enter;
    out->t_min = 0;
    out->t_max = (float)(t_max - enter);
    out->moved = true;
    return true;
}

bool fct_ray_prepare(const fct_bvh *bvh, const fct_ray *ray, fct_prepared_ray *out) {
    const float *d = ray->direction, *o = ray->origin;
    double sum = ((double)d[0] + (double)d[1] + (double)d[2]) + ((double)o[0] + (double)o[1] + (double)o[2]);
    if (!(fabs(sum) < INFINITY) || !(ray->t_min <= ray->t_max)) return false;
    float ax = fabsf(d[0]), ay = fabsf(d[1]), az = fabsf(d[2]);
    uint32_t largest = ax >= ay ? (ax >= az ? 0 : 2) : (ay >= az ? 1 : 2);
    float length = largest == 0 ? ax : largest == 1 ? ay : az;
    if (length == 0) return false;
    double unit = unit_factor(length), t_factor = bvh->scale / unit;

    double od[3], dd[3];
    bool near = ray->t_min >= 0;
    for (int i = 0; i < 3; ++i) {
        od[i] = bvh->scale * (double)o[i] - (double)bvh->offset[i];
        dd[i] = unit * (double)d[i];
        near = near && fabs(od[i] - (double)bvh->center[i]) <= (double)FCT_REACH;
        out->direction[i] = (float)dd[i];
    }
    out->factor = 1 / t_factor;
    out->except = FCT_NONE;
    double t_min = (double)ray->t_min * t_factor, t_max = (double)ray->t_max * t_factor;
    if (near) {
        for (int i = 0; i < 3; ++i) out->origin[i] = (float)od[i];
        out->shift = 0;
        out->t_min =
            (float)t_min + 0.0f; /* turns -0 to +0, because the traversal sorts distances by their bits */
        out->t_max = (float)t_max;
        out->moved = false;
    } else if (!move_origin(bvh, od, dd, t_min, t_max, out)) {
        return false;
    }

    for (int i = 0; i < 3; ++i) {
        /* A component below 1e-18 moves the ray by less than the padding of a box while it is in the model.
         */
        float c = out->direction[i];
        out->side[i] = c < 0;
        out->inverse[i] = fabsf(c) < 1e-18f ? (c < 0 ? -1e18f : 1e18f) : 1 / c;
    }
    uint32_t kz = largest, kx = kz == 2 ? 0 : kz + 1, ky = kx == 2 ? 0 : kx + 1;
    out->axis[0] = kx, out->axis[1] = ky, out->axis[2] = kz;
    float z = out->direction[kz];
    out->shear[0] = out->direction[kx] / z;
    out->shear[1] = out->direction[ky] / z;
    out->shear[2] = 1 / z;
    return true;
}

double fct_ray_unscale_t(const fct_prepared_ray *prepared, float t) {
    return (prepared->shift + (double)t) * prepared->factor;
}

float fct_ray_clamp_t(const fct_ray *ray, double t) {
    float result = (float)t;
    if (result < ray->t_min) return ray->t_min;
    return result > ray->t_max ? ray->t_max : result;
}
