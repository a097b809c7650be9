/* tests/radiosity/place.h: meshes and materials for small scenes. */
#ifndef FCT_TESTS_RADIOSITY_PLACE_H
#define FCT_TESTS_RADIOSITY_PLACE_H

#include "base/math/vec.h"
#include "facetree/scene.h"
#include "radiosity/sample.h"
#include "radiosity/surface/shading.h"
#include "support.h"

/* The default shading of an instance: a pointer that is valid in the block. */
#define SHADE(scene, instance)                                                                               \
    ((const fct_shading[]){fct_shading_make(scene, instance, FCT_NORMALS_FILE, FCT_CREASE_DEGREES, false)})

static inline uint32_t place_material(fct_scene *scene, double reflectance, double emission, bool two_sided) {
    fct_material material = {.two_sided = two_sided};
    for (int k = 0; k < 3; ++k)
        material.reflectance[k] = (float)reflectance, material.emission[k] = (float)emission;
    uint32_t id;
    assert_int_equal(fct_scene_add_material(scene, &material, &id), FCT_OK);
    return id;
}

/* Random colours: reflectances in [low, high), emissions up to 1.2 times the given one. */
static inline uint32_t place_colours(fct_scene *scene, uint64_t seed, double low, double high,
                                     double emission, bool two_sided) {
    fct_material material = {.two_sided = two_sided};
    for (uint64_t k = 0; k < 3; ++k) {
        material.reflectance[k] = (float)(low + (high - low) * fct_uniform(fct_hash2(seed, k)));
        material.emission[k] = (float)(emission * (.2 + fct_uniform(fct_hash2(seed, 3 + k))));
    }
    uint32_t id;
    assert_int_equal(fct_scene_add_material(scene, &material, &id), FCT_OK);
    return id;
}

static inline void place_mesh(fct_scene *scene, const fct_mesh *mesh, uint32_t material,
                              const float *transform) {
    assert_int_equal(fct_scene_add_object(scene, "part", mesh, NULL, transform, material, NULL), FCT_OK);
}

/* A parallelogram with corner o and sides u, v, as n x n x 2 triangles; its front faces u x v. */
static inline fct_mesh make_sheet(const fct_env *env, uint32_t n, v3 o, v3 u, v3 v) {
    fct_mesh mesh = make_grid(env, n);
    for (size_t i = 0; i < mesh.vertex_count; ++i) {
        float *p = mesh.positions + 3 * i;
        v3_store(p, v3_mad(v3_mad(o, p[0], u), p[1], v));
    }
    return mesh;
}

static inline void place_sheet(const fct_env *env, fct_scene *scene, uint32_t material, uint32_t n, v3 o,
                               v3 u, v3 v) {
    fct_mesh mesh = make_sheet(env, n, o, u, v);
    place_mesh(scene, &mesh, material, NULL);
    fct_mesh_release(env, &mesh);
}

/* A regular polygon with n corners around c in the plane z = c.z; its front faces up or down. */
static inline fct_mesh make_disk(const fct_env *env, uint32_t n, v3 c, double radius, bool up) {
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(env, n + 1, n, 0, &mesh), FCT_OK);
    v3_store(mesh.positions + 3 * (size_t)n, c);
    for (uint32_t i = 0; i < n; ++i) {
        double angle = 2 * FCT_PI * i / n;
        v3_store(mesh.positions + 3 * (size_t)i,
                 v3_add(c, v3_make(radius * cos(angle), radius * sin(angle), 0)));
        uint32_t *t = mesh.triangles + 3 * (size_t)i, next = (i + 1) % n;
        t[0] = n, t[1] = up ? i : next, t[2] = up ? next : i;
    }
    return mesh;
}

/* The unit sphere of n rings with waves of the given height. */
static inline fct_mesh make_bumpy(const fct_env *env, uint32_t n, double height) {
    fct_mesh mesh = make_sphere(env, n);
    for (size_t i = 0; i < mesh.vertex_count; ++i) {
        float *p = mesh.positions + 3 * i;
        double factor = 1 + height * sin(7 * p[0] + 1) * sin(6 * p[1]) * cos(8 * p[2]);
        for (int k = 0; k < 3; ++k) p[k] = (float)(p[k] * factor);
    }
    return mesh;
}

/* The unit sphere with its own normals; hollow: wound and turned inwards. */
static inline fct_mesh make_smooth_ball(const fct_env *env, uint32_t n, bool hollow) {
    fct_mesh mesh = make_sphere(env, n);
    mesh.normals = fct_allocate(env, mesh.vertex_count, 3 * sizeof(float));
    assert_non_null(mesh.normals);
    for (size_t i = 0; i < 3 * (size_t)mesh.vertex_count; ++i)
        mesh.normals[i] = hollow ? -mesh.positions[i] : mesh.positions[i];
    for (size_t f = 0; hollow && f < mesh.face_count; ++f) {
        uint32_t *t = mesh.triangles + 3 * f, swap = t[1];
        t[1] = t[2], t[2] = swap;
    }
    return mesh;
}

#endif
