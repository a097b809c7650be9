/* radiosity/surface/shading.c: see shading.h. */
#include "radiosity/surface/shading.h"

#include "base/math/barycentric.h"
#include "base/math/elementary.h"
#include "radiosity/sample.h"
#include "scene/transform.h"

/* Least cosine between a usable normal and that of its face: 88 degrees. Rays along a lower normal start
 * inside the surface (foothold.c). */
#define LEAST_FRONT .0349
/* Cosine of one degree: nearer normals are the same. Normals of bytes err by half a degree. */
#define SAME_COSINE .99985
/* The cosine of the crease angle is lowered by this, because face normals are rounded. So an edge of exactly
 * that angle is smooth. */
#define ROUNDING 1e-6
/* Least cosine between the normals of a triangle and of its corners for the lift. Beyond 45 degrees they do
 * not describe a surface near the triangle: the lift of a cube of three such normals per corner would be a
 * third of its side. */
#define LIFT_COSINE .7071
/* Lifts below this share of the triangle's edge are rounding. */
#define LEAST_LIFT 1e-6
/* Part of the lift at which the ray along it begins, so that it does not meet the triangle. */
#define LIFT_BEGIN 1e-3
/* A weight below this is rounding of barycentrics. */
#define LEAST_WEIGHT 1e-6

fct_shading fct_shading_make(const fct_scene *scene, uint32_t instance, fct_normals rule, double crease,
                             bool back) {
    const fct_scene_view view = fct_scene_get(scene);
    const fct_model *model = &view.models[view.instances[instance].model];
    const bool given = model->normals || model->corner_normals;
    const double degrees = rule == FCT_NORMALS_CREASE ? crease : FCT_CREASE_DEGREES;
    return (fct_shading){.scene = scene,
                         .instance = instance,
                         .rule = rule == FCT_NORMALS_FILE && !given ? FCT_NORMALS_CREASE : rule,
                         .crease_cosine = fct_cos(degrees * FCT_PI / 180) - ROUNDING,
                         .back = back};
}

static v3 find_face_normal(const v3 p[3]) {
    return v3_unit(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
}

void fct_shading_face(const fct_shading *shading, uint32_t place, fct_shaded_face *out) {
    const fct_scene_view view = fct_scene_get(shading->scene);
    const fct_instance *placed = &view.instances[shading->instance];
    const fct_model *model = &view.models[placed->model];
    const fct_tree_view t = fct_tree_get(model->tree);
    out->mirrored = placed->mirrored;
    for (size_t k = 0; k < 3; ++k) {
        const size_t corner = 3 * (size_t)place + (placed->mirrored ? (3 - k) % 3 : k);
        const size_t v = 3 * (size_t)t.triangles[corner];
        const float *own = model->normals ? model->normals + v : model->corner_normals + 3 * corner;
        const v3 n = v3_unit(fct_transform_normal(placed->normal_matrix, v3_load(own)));
        out->positions[k] = fct_transform_point(placed->to_world, v3_load(t.positions + v));
        out->normals[k] = placed->mirrored ? v3_scale(n, -1) : n;
    }
    out->normal = find_face_normal(out->positions);
    for (int k = 0; k < 3; ++k) {
        out->given[k] = v3_dot(out->normals[k], out->normal) >= LEAST_FRONT;
        if (!out->given[k]) out->normals[k] = out->normal;
    }
}

/* Weights of the corners in their order in the world. */
static void find_weights(const fct_shaded_face *face, const float uv[2], double weights[3]) {
    weights[0] = 1 - (double)uv[0] - (double)uv[1];
    weights[face->mirrored ? 2 : 1] = uv[0];
    weights[face->mirrored ? 1 : 2] = uv[1];
}

v3 fct_shaded_normal(const fct_shaded_face *face, const float uv[2]) {
    double weights[3];
    v3 sum = {0, 0, 0};
    bool given = false;
    find_weights(face, uv, weights);
    for (int k = 0; k < 3; ++k) {
        if (weights[k] < LEAST_WEIGHT) continue;
        sum = v3_mad(sum, weights[k], face->normals[k]);
        given |= face->given[k];
    }
    return given ? v3_unit(sum) : (v3){0, 0, 0};
}

v3 fct_shading_mean(const fct_shading *shading, const uint32_t *corners, size_t count,
                    const uint32_t *face_places, const float *source_uv) {
    v3 sum = {0, 0, 0};
    for (size_t i = 0; shading->rule == FCT_NORMALS_FILE && i < count; ++i) {
        fct_shaded_face face;
        fct_shading_face(shading, face_places[corners[i] / 3], &face);
        sum = v3_add(sum, fct_shaded_normal(&face, source_uv + 2 * (size_t)corners[i]));
    }
    return v3_unit(sum);
}

bool fct_shading_same(v3 a, v3 b) {
    return v3_dot(a, b) >= SAME_COSINE;
}

/* The way from a point of the triangle to the curved surface. */
static v3 find_lift(const fct_shaded_face *face, v3 point, double side) {
    double uv[2];
    fct_barycentrics(face->positions, point, uv);
    const double weights[3] = {1 - uv[0] - uv[1], uv[0], uv[1]};
    v3 lift = {0, 0, 0};
    for (int k = 0; k < 3; ++k) {
        const double height = side * v3_dot(v3_sub(point, face->positions[k]), face->normals[k]);
        if (height < 0) lift = v3_mad(lift, -side * weights[k] * height, face->normals[k]);
    }
    return lift;
}

v3 fct_shading_lift(const fct_shading *shading, uint32_t place, v3 point) {
    fct_shaded_face face;
    if (shading->rule != FCT_NORMALS_FILE || place == FCT_NONE) return point;
    fct_shading_face(shading, place, &face);
    for (int k = 0; k < 3; ++k)
        if (v3_dot(face.normals[k], face.normal) < LIFT_COSINE) return point;
    const v3 lift = find_lift(&face, point, shading->back ? -1 : 1);
    const double edge = v3_norm(v3_sub(face.positions[1], face.positions[0]));
    if (!(v3_norm(lift) > LEAST_LIFT * edge)) return point;
    fct_ray ray = {.t_min = (float)LIFT_BEGIN, .t_max = 1};
    v3_store(ray.origin, point);
    v3_store(ray.direction, lift);
    return fct_scene_any_hit(shading->scene, &ray, NULL) ? point : v3_add(point, lift);
}

uint64_t fct_shading_count_unusable(const fct_shading *shading, uint64_t *corners) {
    const fct_scene_view view = fct_scene_get(shading->scene);
    const uint32_t faces = fct_tree_get(view.models[view.instances[shading->instance].model].tree).face_count;
    uint64_t count = 0;
    for (uint32_t place = 0; place < faces; ++place) {
        fct_shaded_face face;
        fct_shading_face(shading, place, &face);
        for (int k = 0; k < 3 && v3_norm2(face.normal) > 0; ++k) count += !face.given[k];
    }
    *corners = 3 * (uint64_t)faces;
    return count;
}
