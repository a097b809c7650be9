/* bvh/ray/mix.c: makes rays of the kinds that have broken ray tracers.
 *
 * A hash of the seed and the ray's number decides everything about a ray, so each can be made again alone.
 */
#include "base/math/elementary.h"
#include "bvh/model.h"

#include <float.h>

typedef struct random_source {
    uint64_t state;
} random_source;

static uint64_t next_random(random_source *s) {
    uint64_t x = s->state += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

static double random_uniform(random_source *s) {
    return (double)(next_random(s) >> 11) * 0x1p-53;
}

static uint32_t random_below(random_source *s, uint32_t count) {
    return (uint32_t)(random_uniform(s) * count);
}

static v3 random_direction(random_source *s) {
    double z = 2 * random_uniform(s) - 1, phi = 6.283185307179586 * random_uniform(s),
           r = sqrt(fmax(0, 1 - z * z));
    return v3_make(r * fct_cos(phi), r * fct_sin(phi), z);
}

/* A face, and a point inside it. Unscaled. */
typedef struct target {
    v3 corner[3], point, normal;
} target;

static target pick_target(const fct_bvh *bvh, random_source *s) {
    const uint32_t *t = bvh->view.triangles + 3 * (size_t)random_below(s, bvh->view.face_count);
    target out;
    for (int c = 0; c < 3; ++c) out.corner[c] = v3_load(bvh->view.positions + 3 * (size_t)t[c]);
    double u = random_uniform(s), v = random_uniform(s);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    out.point = v3_add(v3_scale(out.corner[0], 1 - u - v),
                       v3_add(v3_scale(out.corner[1], u), v3_scale(out.corner[2], v)));
    /* The scale brings the cross product near 1, so that its square stays in a double's range. */
    out.normal =
        v3_unit(v3_scale(v3_cross(v3_sub(out.corner[1], out.corner[0]), v3_sub(out.corner[2], out.corner[0])),
                         bvh->scale * bvh->scale));
    return out;
}

/* A random point in a box of three times the size of the model's. */
static v3 random_point_around(const fct_bvh *bvh, random_source *s) {
    v3 low = v3_load(bvh->bounds.lower), high = v3_load(bvh->bounds.upper);
    v3 size = v3_sub(high, low);
    return v3_make(low.x + (3 * random_uniform(s) - 1) * size.x, low.y + (3 * random_uniform(s) - 1) * size.y,
                   low.z + (3 * random_uniform(s) - 1) * size.z);
}

static v3 random_axis(random_source *s) {
    double sign = next_random(s) & 1 ? 1 : -1;
    switch (random_below(s, 3)) {
    case 0:
        return v3_make(sign, 0, 0);
    case 1:
        return v3_make(0, sign, 0);
    default:
        return v3_make(0, 0, sign);
    }
}

static void set_ray(fct_ray *ray, v3 origin, v3 d, double t_min, double t_max) {
    v3_store(ray->origin, origin);
    v3_store(ray->direction, d);
    ray->t_min = (float)t_min;
    ray->t_max = t_max < (double)FLT_MAX ? (float)t_max : INFINITY;
}

static void make_ray_of_kind(const fct_bvh *bvh, random_source *s, uint64_t kind, fct_ray *ray) {
    double size = 1 / bvh->scale;
    target at = pick_target(bvh, s);
    v3 origin = random_point_around(bvh, s), tangent, binormal;
    switch (kind) {
    case 0: /* anywhere */
        set_ray(ray, origin, random_direction(s), 0, INFINITY);
        break;
    case 1: /* from the surface, with an offset or without */
        set_ray(ray, at.point, random_direction(s), next_random(s) & 1 ? 1e-4 * size : 0, INFINITY);
        break;
    case 2: /* grazing */
        v3_frame(at.normal, &tangent, &binormal);
        tangent = v3_mad(tangent, 2 * random_uniform(s) - 1, binormal);
        tangent = v3_unit(v3_mad(tangent, 1e-3 * (random_uniform(s) - .5), at.normal));
        set_ray(ray, v3_mad(at.point, -size * random_uniform(s), tangent), tangent, 0, INFINITY);
        break;
    case 3: /* along an axis */
        tangent = random_axis(s);
        set_ray(ray, v3_mad(at.point, -3 * size * random_uniform(s), tangent), tangent, 0, INFINITY);
        break;
    case 4: /* along an axis, through a vertex to the last bit */
        tangent = random_axis(s);
        set_ray(ray, v3_mad(at.corner[0], -3 * size, tangent), tangent, 0, INFINITY);
        break;
    case 5: /* through a vertex */
        set_ray(ray, origin, v3_scale(v3_sub(at.corner[0], origin), bvh->scale), 0, INFINITY);
        break;
    case 6: { /* through an edge */
        v3 point = v3_mad(at.corner[0], random_uniform(s), v3_sub(at.corner[1], at.corner[0]));
        set_ray(ray, origin, v3_scale(v3_sub(point, origin), bvh->scale), 0, INFINITY);
        break;
    }
    case 7: { /* from far away */
        tangent = random_direction(s);
        double far = size * fct_exp2(2 + 18 * random_uniform(s));
        set_ray(ray, v3_mad(at.point, -far, tangent), tangent, 0, INFINITY);
        break;
    }
    case 8: /* with a very long or very short direction */
        tangent = v3_sub(at.point, origin);
        set_ray(ray, origin, v3_scale(tangent, bvh->scale * fct_exp2(floor(120 * random_uniform(s) - 60))), 0,
                INFINITY);
        break;
    case 9: { /* between two points of the surface */
        target other = pick_target(bvh, s);
        set_ray(ray, at.point, v3_sub(other.point, at.point), 1e-4, 1 - 1e-4);
        break;
    }
    case 10: /* in a plane of coordinates */
        tangent = v3_unit(v3_sub(at.point, origin));
        if (next_random(s) & 1)
            tangent.x = 0, origin.x = at.point.x;
        else
            tangent.y = 0, origin.y = at.point.y;
        set_ray(ray, origin, v3_unit(tangent), 0, INFINITY);
        break;
    default: /* from a vertex */
        set_ray(ray, at.corner[0], random_direction(s), 0, INFINITY);
        break;
    }
}

void fct_ray_mix(const fct_bvh *bvh, uint64_t seed, size_t count, fct_ray *rays) {
    for (size_t i = 0; i < count; ++i) {
        random_source s = {seed * 0xd1342543de82ef95u + i * 0x9e3779b97f4a7c15u};
        s.state = next_random(&s);
        make_ray_of_kind(bvh, &s, i % 12, &rays[i]);
    }
}
