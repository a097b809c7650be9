/* facetree/bvh.h: ray, distance and error queries on one model.
 *
 * An fct_bvh is built from a tree, is immutable, and serves any number of threads. Queries neither allocate
 * nor fail. Faces in results are input face ids. Rays: points origin + t direction with t_min <= t <= t_max;
 * the direction need not have unit length; a ray with a NaN, or a zero direction, hits nothing. Triangles are
 * two-sided and watertight (Woop, Benthin, Wald 2013): a ray through a shared edge or vertex never slips
 * between. A degenerate triangle is never hit.
 */
#ifndef FACETREE_BVH_H
#define FACETREE_BVH_H

#include "facetree/cluster.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct fct_bvh fct_bvh;

typedef enum fct_backend { FCT_BACKEND_OBB, FCT_BACKEND_EMBREE } fct_backend;

/* Packs the tree for traversal. The tree must outlive the bvh. Errors: MEMORY, CANCELLED, INTERNAL (Embree).
 */
FCT_API fct_result fct_bvh_create(const fct_env *env, const fct_tree *tree, fct_backend backend,
                                  fct_bvh **out);
FCT_API void fct_bvh_destroy(fct_bvh *bvh);
/* Bytes the structure holds beside the tree (0 where the backend does not tell). */
FCT_API size_t fct_bvh_bytes(const fct_bvh *bvh);
FCT_API fct_bounds fct_bvh_bounds(const fct_bvh *bvh);
FCT_API const fct_tree *fct_bvh_tree(const fct_bvh *bvh);

typedef struct fct_ray {
    float origin[3], t_min;
    float direction[3], t_max;
} fct_ray;

typedef struct fct_hit {
    float t;
    float u, v;      /* the hit is (1 - u - v) p0 + u p1 + v p2 in the face's input corner order */
    uint32_t face;   /* input face id, FCT_NONE on a miss */
    float normal[3]; /* geometric, (p1 - p0) x (p2 - p0), not normalised (a positive multiple of it where a
                        float would overflow or vanish); undefined on a miss */
    uint32_t place;  /* the face's place in the tree's order */
} fct_hit;

/* What a query visited, added to the counts given. */
typedef struct fct_visits {
    uint64_t nodes, boxes, triangles;
} fct_visits;

/* Closest hit; returns whether there is one. visits may be NULL. Equal t: the lower face id. */
FCT_API bool fct_bvh_closest_hit(const fct_bvh *bvh, const fct_ray *ray, fct_hit *hit, fct_visits *visits);
FCT_API bool fct_bvh_any_hit(const fct_bvh *bvh, const fct_ray *ray, fct_visits *visits);
/* Batches over the environment's threads. */
FCT_API void fct_bvh_closest_hits(const fct_bvh *bvh, size_t count, const fct_ray *rays, fct_hit *hits);
/* Bit i % 64 of occluded[i / 64] tells of ray i. */
FCT_API void fct_bvh_any_hits(const fct_bvh *bvh, size_t count, const fct_ray *rays, uint64_t *occluded);

/* Two backends' answers on the same rays, each disagreement settled by testing the faces concerned in double
 * precision. Times are of one thread. */
typedef struct fct_ray_check {
    size_t rays, hits;
    size_t differences; /* neither the same face nor the same t to 1e-5 of the extent, or hit against miss */
    size_t explained;   /* the double-precision test finds ours right, or the case on the rim of a triangle
                           within rounding */
    size_t unexplained; /* ours is wrong */
    size_t occlusion_differences; /* any-hit against our own closest hit */
    double seconds_obb, seconds_embree;
} fct_ray_check;
/* Both over the same tree: `obb` and `embree`. Errors: MEMORY, CANCELLED. */
FCT_API fct_result fct_bvh_check(const fct_env *env, const fct_bvh *obb, const fct_bvh *embree, size_t count,
                                 const fct_ray *rays, fct_ray_check *out);

/* `count` rays of every kind that has broken a ray tracer, kind i % 12 at place i: anywhere; from the
 * surface; grazing; along an axis; along an axis through a vertex to the last bit; through a vertex; through
 * an edge; from up to 10^6 diameters away; with a direction of length 2^-60 to 2^60; between two points of
 * the surface; in a coordinate plane; from a vertex. The same rays for the same tree and seed. */
FCT_API void fct_ray_mix(const fct_bvh *bvh, uint64_t seed, size_t count, fct_ray *rays);

typedef struct fct_closest {
    float point[3];
    float distance;
    uint32_t face;  /* input face id; FCT_NONE when nothing lies within the maximum distance */
    float u, v;     /* barycentrics of the point as in fct_hit */
    uint32_t place; /* of the face in the tree's order */
} fct_closest;
/* The point of the surface nearest to `point`, if within max_distance (may be infinity). OBB backend only. */
FCT_API bool fct_bvh_closest_point(const fct_bvh *bvh, const float point[3], float max_distance,
                                   fct_closest *out, fct_visits *visits);
FCT_API void fct_bvh_closest_points(const fct_bvh *bvh, size_t count, const float *points, float max_distance,
                                    fct_closest *out);

/* Distance between two surfaces sampled at every referenced vertex and at samples_per_face points of every
 * face (Garland 1999, (2.7), (2.8)); avg is the mean squared distance, max the largest distance. _ab: samples
 * of a, measured to b. Colours are those at the nearest point; where faces are equally near, to 1e-6 of the
 * diameter, at the one whose normal is closest to the sample's. */
typedef struct fct_mesh_error {
    double e_avg, e_avg_ab, e_avg_ba;
    double e_max, e_max_ab, e_max_ba;
    double diameter;             /* diagonal of the bounds of a */
    double color_rms, color_max; /* over RGB, at the samples; 0 unless both meshes have vertex colours */
    double color_rms_relative;   /* the same over the root mean square colour of a, with differences and
                                    colours of each channel cut at what 95 % of a's area does not exceed:
                                    lamps do not outweigh all else; 0 likewise */
    size_t samples;
} fct_mesh_error;
/* Both bvh with the OBB backend. Errors: MEMORY, CANCELLED. */
FCT_API fct_result fct_mesh_compare(const fct_env *env, const fct_bvh *a, const fct_bvh *b,
                                    uint32_t samples_per_face, uint64_t seed, fct_mesh_error *out);

#ifdef __cplusplus
}
#endif
#endif
