/* bvh/ray/mix.c: rays that look for trouble: of every kind that has broken a ray tracer. A hash of seed and
 * number makes each ray, so that any one can be made again.
 */
#include "bvh/model.h"

#include <float.h>

typedef struct source {
    uint64_t state;
} source;

static uint64_t next(source *s) {
    uint64_t x = s->state += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

static double uniform(source *s) {
    return (double)(next(s) >> 11) * 0x1p-53;
}

static uint32_t below(source *s, uint32_t count) {
    return (uint32_t)(uniform(s) * count);
}

static v3 direction(source *s) {
    double z = 2 * uniform(s) - 1, phi = 6.283185307179586 * uniform(s), r = sqrt(fmax(0, 1 - z * z));
    return v3_make(r * cos(phi), r * sin(phi), z);
}

/* What a ray is aimed at; in the model's own unit. */
typedef struct target {
    v3 corner[3], point, normal; /* point: anywhere inside the face */
} target;

static target pick(const fct_bvh *bvh, source *s) {
    const uint32_t *t = bvh->view.triangles + 3 * (size_t)below(s, bvh->view.face_count);
    target out;
    for (int c = 0; c < 3; ++c) out.corner[c] = v3_load(bvh->view.positions + 3 * (size_t)t[c]);
    double u = uniform(s), v = uniform(s);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    out.point = v3_add(v3_scale(out.corner[0], 1 - u - v),
                       v3_add(v3_scale(out.corner[1], u), v3_scale(out.corner[2], v)));
    /* Squares of lengths of 10^30 or 10^-30 are within a double, and so is the cross product. */
    out.normal =
        v3_unit(v3_scale(v3_cross(v3_sub(out.corner[1], out.corner[0]), v3_sub(out.corner[2], out.corner[0])),
                         bvh->scale * bvh->scale));
    return out;
}

/* A point in a box three times the model's. */
static v3 around(const fct_bvh *bvh, source *s) {
    v3 low = v3_load(bvh->bounds.lower), high = v3_load(bvh->bounds.upper);
    v3 size = v3_sub(high, low);
    return v3_make(low.x + (3 * uniform(s) - 1) * size.x, low.y + (3 * uniform(s) - 1) * size.y,
                   low.z + (3 * uniform(s) - 1) * size.z);
}

static v3 along_axis(source *s) {
    double sign = next(s) & 1 ? 1 : -1;
    switch (below(s, 3)) {
    case 0:
        return v3_make(sign, 0, 0);
    case 1:
        return v3_make(0, sign, 0);
    default:
        return v3_make(0, 0, sign);
    }
}

static void set(fct_ray *ray, v3 origin, v3 d, double t_min, double t_max) {
    v3_store(ray->origin, origin);
    v3_store(ray->direction, d);
    ray->t_min = (float)t_min;
    ray->t_max = t_max < (double)FLT_MAX ? (float)t_max : INFINITY;
}

static void make_ray(const fct_bvh *bvh, source *s, uint64_t kind, fct_ray *ray) {
    double size = 1 / bvh->scale;
    target at = pick(bvh, s);
    v3 origin = around(bvh, s), tangent, binormal;
    switch (kind) {
    case 0: /* anywhere */
        set(ray, origin, direction(s), 0, INFINITY);
        break;
    case 1: /* from the surface, with an offset or without */
        set(ray, at.point, direction(s), next(s) & 1 ? 1e-4 * size : 0, INFINITY);
        break;
    case 2: /* grazing */
        v3_frame(at.normal, &tangent, &binormal);
        tangent = v3_mad(tangent, 2 * uniform(s) - 1, binormal);
        tangent = v3_unit(v3_mad(tangent, 1e-3 * (uniform(s) - .5), at.normal));
        set(ray, v3_mad(at.point, -size * uniform(s), tangent), tangent, 0, INFINITY);
        break;
    case 3: /* along an axis */
        tangent = along_axis(s);
        set(ray, v3_mad(at.point, -3 * size * uniform(s), tangent), tangent, 0, INFINITY);
        break;
    case 4: /* along an axis, through a vertex to the last bit */
        tangent = along_axis(s);
        set(ray, v3_mad(at.corner[0], -3 * size, tangent), tangent, 0, INFINITY);
        break;
    case 5: /* through a vertex */
        set(ray, origin, v3_scale(v3_sub(at.corner[0], origin), bvh->scale), 0, INFINITY);
        break;
    case 6: { /* through an edge */
        v3 point = v3_mad(at.corner[0], uniform(s), v3_sub(at.corner[1], at.corner[0]));
        set(ray, origin, v3_scale(v3_sub(point, origin), bvh->scale), 0, INFINITY);
        break;
    }
    case 7: { /* from far away */
        tangent = direction(s);
        double far = size * exp2(2 + 18 * uniform(s));
        set(ray, v3_mad(at.point, -far, tangent), tangent, 0, INFINITY);
        break;
    }
    case 8: /* with a very long or very short direction */
        tangent = v3_sub(at.point, origin);
        set(ray, origin, v3_scale(tangent, bvh->scale * exp2(floor(120 * uniform(s) - 60))), 0, INFINITY);
        break;
    case 9: { /* between two points of the surface */
        target other = pick(bvh, s);
        set(ray, at.point, v3_sub(other.point, at.point), 1e-4, 1 - 1e-4);
        break;
    }
    case 10: /* in a plane of coordinates */
        tangent = v3_unit(v3_sub(at.point, origin));
        if (next(s) & 1)
            tangent.x = 0, origin.x = at.point.x;
        else
            tangent.y = 0, origin.y = at.point.y;
        set(ray, origin, v3_unit(tangent), 0, INFINITY);
        break;
    default: /* from a vertex */
        set(ray, at.corner[0], direction(s), 0, INFINITY);
        break;
    }
}

void fct_ray_mix(const fct_bvh *bvh, uint64_t seed, size_t count, fct_ray *rays) {
    for (size_t i = 0; i < count; ++i) {
        source s = {seed * 0xd1342543de82ef95u + i * 0x9e3779b97f4a7c15u};
        s.state = next(&s);
        make_ray(bvh, &s, i % 12, &rays[i]);
    }
}
