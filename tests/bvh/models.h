/* tests/bvh/models.h: models for the tests of queries, their trees, and the answers of brute force. */
#ifndef FCT_TESTS_BVH_MODELS_H
#define FCT_TESTS_BVH_MODELS_H

#include "support.h"

#include "base/math/vec.h"
#include "facetree/bvh.h"

typedef struct model {
    fct_mesh mesh;
    fct_tree *tree;
    fct_bvh *bvh;
} model;

static inline model model_make(const fct_env *env, fct_mesh mesh, fct_backend backend) {
    model m = {.mesh = mesh};
    fct_tree_def def = fct_tree_def_default();
    assert_int_equal(fct_tree_build(env, &mesh, &def, NULL, &m.tree), FCT_OK);
    assert_int_equal(fct_bvh_create(env, m.tree, backend, &m.bvh), FCT_OK);
    return m;
}

static inline void model_release(const fct_env *env, model *m) {
    fct_bvh_destroy(m->bvh);
    fct_tree_destroy(m->tree);
    fct_mesh_release(env, &m->mesh);
}

static inline uint64_t random_next(uint64_t *state) {
    uint64_t x = *state += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}
/* In [0, 1). */
static inline double random_unit(uint64_t *state) {
    return (double)(random_next(state) >> 11) * 0x1p-53;
}
static inline v3 random_direction(uint64_t *state) {
    double z = 2 * random_unit(state) - 1, phi = 6.283185307179586 * random_unit(state), r = sqrt(1 - z * z);
    return v3_make(r * cos(phi), r * sin(phi), z);
}

/* A closed, bumpy, star-shaped body about the origin, of radius .6 to 1. */
static inline fct_mesh make_pebble(const fct_env *env, uint32_t n, uint64_t seed) {
    fct_mesh mesh = make_sphere(env, n);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        double radius = .6 + .4 * random_unit(&seed);
        for (int k = 0; k < 3; ++k) mesh.positions[3 * v + k] *= (float)radius;
    }
    return mesh;
}

/* Triangles anywhere in the unit cube: needles, specks, some without area, every tenth twice. */
static inline fct_mesh make_soup(const fct_env *env, uint32_t count, uint64_t seed) {
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(env, 3 * count, count, 0, &mesh), FCT_OK);
    for (uint32_t f = 0; f < count; ++f) {
        v3 at = {random_unit(&seed), random_unit(&seed), random_unit(&seed)};
        double size = exp2(-8 * random_unit(&seed)), thin = random_next(&seed) % 3 ? 1 : 1e-4;
        v3 u = random_direction(&seed), w = random_direction(&seed);
        v3_store(mesh.positions + 9 * f, at);
        v3_store(mesh.positions + 9 * f + 3, v3_mad(at, .3 * size, u));
        v3_store(mesh.positions + 9 * f + 6, v3_mad(v3_mad(at, .15 * size, u), .3 * size * thin, w));
        if (f % 17 == 0) memcpy(mesh.positions + 9 * f + 6, mesh.positions + 9 * f + 3, 12);
        if (f % 10 == 9) memcpy(mesh.positions + 9 * f, mesh.positions + 9 * (f - 1), 36);
        for (uint32_t c = 0; c < 3; ++c) mesh.triangles[3 * f + c] = 3 * f + c;
    }
    return mesh;
}

static inline void face_corners(const fct_mesh *mesh, uint32_t face, v3 p[3]) {
    for (int c = 0; c < 3; ++c) p[c] = v3_load(mesh->positions + 3 * (size_t)mesh->triangles[3 * face + c]);
}

/* The nearest point of a triangle by cases: its plane inside, else the nearest of its sides. */
static inline v3 plain_closest(v3 p, const v3 t[3]) {
    v3 best = t[0], e = v3_sub(t[1], t[0]), f = v3_sub(t[2], t[0]), r = v3_sub(p, t[0]);
    double ee = v3_dot(e, e), ef = v3_dot(e, f), ff = v3_dot(f, f), det = ee * ff - ef * ef;
    double u = (ff * v3_dot(e, r) - ef * v3_dot(f, r)) / det,
           v = (ee * v3_dot(f, r) - ef * v3_dot(e, r)) / det;
    if (det > 1e-12 * ee * ff && u > 0 && v > 0 && u + v < 1) return v3_mad(v3_mad(t[0], u, e), v, f);
    for (int i = 0; i < 3; ++i) {
        v3 a = t[i], side = v3_sub(t[(i + 1) % 3], a);
        double length2 = v3_dot(side, side), s = length2 > 0 ? v3_dot(v3_sub(p, a), side) / length2 : 0;
        v3 q = v3_mad(a, fmin(fmax(s, 0), 1), side);
        if (v3_norm(v3_sub(q, p)) < v3_norm(v3_sub(best, p))) best = q;
    }
    return best;
}

static inline fct_ray make_ray(v3 origin, v3 direction, double t_min, double t_max) {
    fct_ray ray = {.t_min = (float)t_min, .t_max = (float)t_max};
    v3_store(ray.origin, origin);
    v3_store(ray.direction, direction);
    return ray;
}

/* The point that a hit names by its barycentrics. */
static inline v3 hit_point(const fct_mesh *mesh, const fct_hit *hit) {
    v3 p[3];
    face_corners(mesh, hit->face, p);
    double u = (double)hit->u, v = (double)hit->v;
    return v3_add(v3_scale(p[0], 1 - u - v), v3_add(v3_scale(p[1], u), v3_scale(p[2], v)));
}

/* Moller and Trumbore in double over all faces; *margin receives how far from its nearest face's rim, or, on
 * a miss, INFINITY or 0 where a rim came within `rim` of the ray in barycentrics. */
static inline uint32_t brute_closest(const fct_mesh *mesh, const fct_ray *ray, double rim, double *t_out,
                                     bool *doubtful) {
    uint32_t best = FCT_NONE;
    double best_t = (double)ray->t_max;
    *doubtful = false;
    v3 o = v3_load(ray->origin), d = v3_load(ray->direction);
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        v3 p[3];
        face_corners(mesh, f, p);
        v3 e1 = v3_sub(p[1], p[0]), e2 = v3_sub(p[2], p[0]), q = v3_cross(d, e2), s = v3_sub(o, p[0]);
        double det = v3_dot(e1, q);
        if (det == 0) continue;
        double u = v3_dot(s, q) / det, v = v3_dot(d, v3_cross(s, e1)) / det,
               t = v3_dot(e2, v3_cross(s, e1)) / det;
        double inside = fmin(fmin(u, v), 1 - u - v), grazing = fabs(det) / (v3_norm(q) * v3_norm(e1));
        if (inside < -rim || t < (double)ray->t_min - rim || t > (double)ray->t_max + rim) continue;
        if (inside < rim || grazing < 1e-3 || fabs(t - (double)ray->t_min) < rim) {
            *doubtful = true;
            continue;
        }
        if (t < best_t) best_t = t, best = f;
    }
    *t_out = best_t;
    return best;
}

#endif
