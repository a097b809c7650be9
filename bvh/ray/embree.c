/* bvh/ray/embree.c: Embree over the same scaled triangles, in order of place.
 *
 * Each structure has its own device. Robust traversal is watertight, as ours is. Embree requires that
 * denormals are flushed to zero, so each call switches the floating-point mode and restores the caller's.
 */
#include "bvh/ray/embree.h"

#include <embree3/rtcore.h>
#include <stdio.h>

#if defined(__SSE__)
#include <xmmintrin.h>
typedef unsigned float_mode;
static float_mode flush_denormals(void) {
    float_mode before = _mm_getcsr();
    _mm_setcsr(before | 0x8040u);
    return before;
}
static void restore_mode(float_mode mode) {
    _mm_setcsr(mode);
}
#else
typedef int float_mode;
static float_mode flush_denormals(void) {
    return 0;
}
static void restore_mode(float_mode mode) {
    (void)mode;
}
#endif

struct fct_embree {
    RTCDevice device;
    RTCScene scene;
    float *positions;
    uint32_t *triangles;
    size_t own_bytes;      /* of positions and triangles */
    _Atomic int64_t bytes; /* that Embree has allocated */
};

static bool count_embree_memory(void *user, ssize_t bytes, bool post) {
    (void)post;
    fct_embree *embree = user;
    embree->bytes += bytes;
    return true;
}

/* The device's error as a result. `made` tells whether the call returned an object: if not, the result is an
 * error even if the device reports none. */
static fct_result check_device_error(const fct_env *env, RTCDevice device, bool made) {
    enum RTCError error = rtcGetDeviceError(device);
    if (made && error == RTC_ERROR_NONE) return FCT_OK;
    if (error == RTC_ERROR_OUT_OF_MEMORY) return fct_fail_memory(env, "Embree");
    return fct_fail(env, FCT_ERROR_INTERNAL, "Embree failed with error %d", (int)error);
}

/* A degenerate face becomes a point, which Embree never hits. */
static fct_result copy_scaled_triangles(const fct_bvh *bvh, fct_embree *embree) {
    const fct_tree_view *view = &bvh->view;
    /* Embree reads 16 bytes per vertex of 12 bytes: the last read must stay in the array. */
    embree->positions = fct_allocate(bvh->env, 3 * (size_t)view->vertex_count + 4, sizeof(float));
    embree->triangles = fct_allocate(bvh->env, 3 * (size_t)view->face_count, sizeof(uint32_t));
    embree->own_bytes = 12 * ((size_t)view->vertex_count + view->face_count);
    if (!embree->positions || !embree->triangles) return fct_fail_memory(bvh->env, "Embree's triangles");
    for (uint32_t i = 0; i < view->vertex_count; ++i)
        fct_bvh_position(bvh, i, embree->positions + 3 * (size_t)i);
    for (uint32_t f = 0; f < view->face_count; ++f) {
        bool point = fct_bvh_degenerate(bvh, f);
        for (size_t c = 0; c < 3; ++c)
            embree->triangles[3 * (size_t)f + c] = view->triangles[3 * (size_t)f + (point ? 0 : c)];
    }
    return FCT_OK;
}

static fct_result build_embree_scene(const fct_bvh *bvh, fct_embree *embree) {
    char config[64];
    snprintf(config, sizeof config, "threads=%u", fct_env_threads(bvh->env));
    embree->device = rtcNewDevice(config);
    if (!embree->device) return check_device_error(bvh->env, NULL, false);
    rtcSetDeviceMemoryMonitorFunction(embree->device, count_embree_memory, embree);
    embree->scene = rtcNewScene(embree->device);
    if (!embree->scene) return check_device_error(bvh->env, embree->device, false);
    RTCGeometry geometry = rtcNewGeometry(embree->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    if (!geometry) return check_device_error(bvh->env, embree->device, false);
    rtcSetSceneFlags(embree->scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, embree->positions, 0,
                               12, bvh->view.vertex_count);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, embree->triangles, 0, 12,
                               bvh->view.face_count);
    /* A geometry without its buffers must not reach the scene: Embree reads them all the same. */
    fct_result result = check_device_error(bvh->env, embree->device, true);
    if (result == FCT_OK) {
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(embree->scene, geometry, 0);
        result = check_device_error(bvh->env, embree->device, true);
    }
    rtcReleaseGeometry(geometry);
    if (result != FCT_OK) return result;
    rtcCommitScene(embree->scene);
    return check_device_error(bvh->env, embree->device, true);
}

fct_result fct_embree_create(fct_bvh *bvh) {
    fct_embree *embree = fct_allocate_zero(bvh->env, 1, sizeof *embree);
    if (!embree) return fct_fail_memory(bvh->env, "Embree");
    bvh->embree = embree;
    fct_result result = fct_progress(bvh->env, "ray structure", 0);
    if (result == FCT_OK) result = copy_scaled_triangles(bvh, embree);
    if (result == FCT_OK) {
        float_mode mode = flush_denormals();
        result = build_embree_scene(bvh, embree);
        restore_mode(mode);
    }
    return result == FCT_OK ? fct_progress(bvh->env, "ray structure", 1) : result;
}

void fct_embree_destroy(const fct_env *env, fct_embree *embree) {
    if (!embree) return;
    if (embree->scene) rtcReleaseScene(embree->scene);
    if (embree->device) rtcReleaseDevice(embree->device);
    fct_release(env, embree->positions);
    fct_release(env, embree->triangles);
    fct_release(env, embree);
}

size_t fct_embree_bytes(const fct_embree *embree) {
    return embree->own_bytes + (size_t)embree->bytes;
}

/* Distance from the centre of the model at which a far ray starts: outside of the model, whose half diagonal
 * is below sqrt(3). */
static const double START = 2;

/* The ray in scaled space: the caller's t is (*shift + t) *unit. A ray that begins far from the model, or at
 * a negative t, begins START before its point nearest to the centre instead. Returns false for a ray that
 * hits nothing by the definition of fct_ray. */
static bool make_embree_ray(const fct_bvh *bvh, const fct_ray *ray, struct RTCRay *out, double *shift,
                            double *unit) {
    v3 d = v3_load(ray->direction), to_center;
    double largest = fmax(fabs(d.x), fmax(fabs(d.y), fabs(d.z)));
    bool finite = isfinite(ray->origin[0]) && isfinite(ray->origin[1]) && isfinite(ray->origin[2]) &&
                  isfinite(d.x) && isfinite(d.y) && isfinite(d.z);
    if (!finite || largest == 0 || !(ray->t_min <= ray->t_max)) return false;
    double factor = ldexp(1, -ilogb(largest));
    v3 origin = fct_bvh_to_scaled(bvh, v3_load(ray->origin));
    d = v3_scale(d, factor);
    *unit = factor / bvh->scale;
    double t_min = (double)ray->t_min / *unit, t_max = (double)ray->t_max / *unit;
    to_center = v3_sub(v3_load(bvh->center), origin);
    *shift = 0;
    if (v3_norm(to_center) > 2 * START || t_min < 0) {
        *shift = fmax(t_min, (v3_dot(to_center, d) - START * v3_norm(d)) / v3_norm2(d));
        origin = v3_mad(origin, *shift, d);
    }
    *out = (struct RTCRay){.org_x = (float)origin.x,
                           .org_y = (float)origin.y,
                           .org_z = (float)origin.z,
                           .tnear = (float)fmax(t_min - *shift, 0),
                           .dir_x = (float)d.x,
                           .dir_y = (float)d.y,
                           .dir_z = (float)d.z,
                           .tfar = (float)(t_max - *shift),
                           .mask = ~0u};
    return out->tfar >= 0;
}

bool fct_embree_closest(const fct_bvh *bvh, const fct_ray *ray, fct_raw_hit *hit, double *t) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    struct RTCRayHit query = {.hit = {.geomID = RTC_INVALID_GEOMETRY_ID}};
    double shift, unit;
    if (!make_embree_ray(bvh, ray, &query.ray, &shift, &unit)) return false;
    float_mode mode = flush_denormals();
    rtcIntersect1(bvh->embree->scene, &context, &query);
    restore_mode(mode);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
    *hit = (fct_raw_hit){.t = query.ray.tfar, .u = query.hit.u, .v = query.hit.v, .place = query.hit.primID};
    *t = (shift + (double)query.ray.tfar) * unit;
    const uint32_t *corner = bvh->embree->triangles + 3 * (size_t)hit->place;
    v3 p[3];
    for (int c = 0; c < 3; ++c) p[c] = v3_load(bvh->embree->positions + 3 * (size_t)corner[c]);
    hit->normal = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
    return true;
}

bool fct_embree_any(const fct_bvh *bvh, const fct_ray *ray) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    struct RTCRay query;
    double shift, unit;
    if (!make_embree_ray(bvh, ray, &query, &shift, &unit)) return false;
    float_mode mode = flush_denormals();
    rtcOccluded1(bvh->embree->scene, &context, &query);
    restore_mode(mode);
    return query.tfar < 0;
}
