/* facetree/bvh.h: ray, distance and error queries on one model. docs/queries.md is the guide.
 *
 * An fct_bvh is built from a tree, is immutable, and serves any number of threads. Queries do not allocate
 * and do not fail. Faces in results are input face ids.
 *
 * A ray is the set of points origin + t direction with t_min <= t <= t_max. Its direction may have any
 * length. A ray with a NaN, an infinite origin or direction, or a zero direction hits nothing. Triangles are
 * two-sided and watertight (Woop, Benthin, Wald 2013): no ray passes between two faces at a shared edge or
 * vertex. A triangle without area is never hit.
 */
#ifndef FACETREE_BVH_H
#define FACETREE_BVH_H

#include "facetree/cluster.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct fct_bvh fct_bvh;

/* OBB is our own structure, which answers all queries. EMBREE answers ray queries alone. MULTIRES is for
 * scenes (scene.h): OBB, and coarse forms of large models for the solution of radiosity; for a single model
 * it is OBB. */
typedef enum fct_backend { FCT_BACKEND_OBB, FCT_BACKEND_EMBREE, FCT_BACKEND_MULTIRES } fct_backend;

/* What an OBB structure holds beside rays and points. */
enum {
    FCT_BVH_PAIRS = 1, /* queries on two models (collide.h): about 11 bytes per triangle */
    FCT_BVH_SIGN = 2   /* winding numbers and signed distances: about 24 bytes per triangle */
};

typedef struct fct_bvh_def {
    uint32_t size; /* sizeof(fct_bvh_def), set by fct_bvh_def_default */
    fct_backend backend;
    uint32_t parts; /* FCT_BVH_PAIRS | FCT_BVH_SIGN, or 0; the Embree backend ignores it */
} fct_bvh_def;

/* The OBB backend without further parts. */
FCT_API fct_bvh_def fct_bvh_def_default(void);
/* The tree must outlive the bvh. A def that is NULL means the default. Errors: DATA (a damaged hierarchy
 * file), MEMORY, CANCELLED, INTERNAL (Embree). */
FCT_API fct_result fct_bvh_build(const fct_env *env, const fct_tree *tree, const fct_bvh_def *def,
                                 fct_bvh **out);
/* The same with a backend and no further parts. */
FCT_API fct_result fct_bvh_create(const fct_env *env, const fct_tree *tree, fct_backend backend,
                                  fct_bvh **out);
/* The structure of the same faces with other positions (vertex_count x 3, in the order of the input's
 * vertices, relative to the tree's origin). The clusters and the nodes stay, and their boxes follow. It has
 * the parts of `bvh` and answers like it; boxes above vertices that have not moved keep their bytes if the
 * bounds of the model are the same. The tree must outlive it; `bvh` need not. *work, which may be NULL,
 * receives how much work a ray is expected to take, over that of the structure that was built first: build a
 * new tree from about 1.5 on. 1 with Embree. Errors: DATA (a position that is not finite), MEMORY, INTERNAL
 * (Embree). */
FCT_API fct_result fct_bvh_refit(const fct_env *env, const fct_bvh *bvh, const float *positions,
                                 fct_bvh **out, double *work);
FCT_API void fct_bvh_destroy(fct_bvh *bvh);
/* Bytes of the structure, without the tree. */
FCT_API size_t fct_bvh_bytes(const fct_bvh *bvh);
/* Bounds of the vertices that faces use. */
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
    float normal[3]; /* (p1 - p0) x (p2 - p0), not normalised; a positive multiple of it if a float would
                        overflow or vanish; undefined on a miss */
    uint32_t place;  /* the face's place in the tree's order; FCT_NONE on a miss */
} fct_hit;

/* A query adds its visits to these counts. */
typedef struct fct_visits {
    uint64_t nodes, boxes, triangles;
} fct_visits;

/* The hit of least t; returns whether there is one. Equal t: the lower face id. visits may be NULL; the
 * Embree backend does not count. */
FCT_API bool fct_bvh_closest_hit(const fct_bvh *bvh, const fct_ray *ray, fct_hit *hit, fct_visits *visits);
/* The same, but the ray passes through one face, such as the face that it starts on. FCT_NONE excepts none.
 * OBB backend only: others return false. */
FCT_API bool fct_bvh_closest_hit_except(const fct_bvh *bvh, const fct_ray *ray, uint32_t face, fct_hit *hit,
                                        fct_visits *visits);
/* All hits in order of t, and of face ids where t is equal. `hits` receives the first `capacity` of them and
 * may be NULL if that is 0. Returns how many a complete answer has, so a result above `capacity` asks for a
 * larger array. OBB backend only: others return 0. */
FCT_API size_t fct_bvh_all_hits(const fct_bvh *bvh, const fct_ray *ray, size_t capacity, fct_hit *hits,
                                fct_visits *visits);
/* Whether the ray hits anything. */
FCT_API bool fct_bvh_any_hit(const fct_bvh *bvh, const fct_ray *ray, fct_visits *visits);
/* The same as the single queries for `count` rays, on the threads of the environment. On large models several
 * rays of a thread take turns, so a batch is faster than single rays. */
FCT_API void fct_bvh_closest_hits(const fct_bvh *bvh, size_t count, const fct_ray *rays, fct_hit *hits);
/* Bit i % 64 of occluded[i / 64] tells whether ray i hits anything. `occluded` has (count + 63) / 64 words.
 */
FCT_API void fct_bvh_any_hits(const fct_bvh *bvh, size_t count, const fct_ray *rays, uint64_t *occluded);

/* The answers of two backends to the same rays. A test in double of the faces concerned decides each
 * difference. Each of our hits is also checked alone: t, u, v and normal describe one point of the ray and of
 * the face. Times are of one thread. */
typedef struct fct_ray_check {
    size_t rays, hits;
    size_t differences; /* a hit and a miss, points over 1e-5 of the extent apart, or a hit of ours that
                           does not describe one point */
    size_t explained;   /* differences where our answer is right, or the ray meets the rim of a triangle
                           within rounding */
    size_t unexplained; /* differences where our answer is wrong */
    size_t occlusion_differences; /* our any hit differs from our closest hit */
    double seconds_obb, seconds_embree;
} fct_ray_check;
/* `obb` and `embree` are built from the same tree. Errors: MEMORY, CANCELLED. */
FCT_API fct_result fct_bvh_check(const fct_env *env, const fct_bvh *obb, const fct_bvh *embree, size_t count,
                                 const fct_ray *rays, fct_ray_check *out);

/* Makes `count` rays of the kinds that have broken ray tracers; ray i has kind i % 12: anywhere; from the
 * surface; grazing; along an axis; along an axis exactly through a vertex; through a vertex; through an edge;
 * from up to 10^6 diameters away; with a direction of length 2^-60 to 2^60; between two points of the
 * surface; in a coordinate plane; from a vertex. The same tree and seed give the same rays. */
FCT_API void fct_ray_mix(const fct_bvh *bvh, uint64_t seed, size_t count, fct_ray *rays);

typedef struct fct_closest {
    float point[3];
    float distance;
    uint32_t face;  /* input face id; FCT_NONE if no face is within the maximum distance */
    float u, v;     /* barycentrics of the point as in fct_hit */
    uint32_t place; /* of the face in the tree's order */
} fct_closest;
/* The point of the surface that is nearest to `point`; returns whether it is within max_distance, which may
 * be infinity. Equal distances: the lower face id. OBB backend only: others return false. visits may be NULL.
 */
FCT_API bool fct_bvh_closest_point(const fct_bvh *bvh, const float point[3], float max_distance,
                                   fct_closest *out, fct_visits *visits);
/* The same for `count` points (count x 3), on the threads of the environment. */
FCT_API void fct_bvh_closest_points(const fct_bvh *bvh, size_t count, const float *points, float max_distance,
                                    fct_closest *out);

/* The generalised winding number of the surface about a point (Jacobson, Kavan, Sorkine-Hornung 2013): the
 * sum of the signed solid angles of the faces over 4 pi. About a closed surface whose faces wind outwards it
 * is 1 inside and 0 outside; inwards, -1 inside. Holes and overlaps change it smoothly. Far clusters count by
 * their moments up to the third (Barill et al. 2018): the result errs by less than .001 on scans. The result
 * is NaN if the bvh was built without FCT_BVH_SIGN or with the Embree backend, or if the point is not finite.
 * visits may be NULL. */
FCT_API double fct_bvh_winding_number(const fct_bvh *bvh, const float point[3], fct_visits *visits);
/* Whether the winding number is above .5 or below -.5: inside of a closed surface, also of one that is inside
 * out, and where parts overlap or small holes are open. About a closed surface one ray decides; otherwise the
 * sum of all faces does where the winding number is within .01 of the limit. Points at rounding distance from
 * the surface may count as either. False for a bvh that was built without FCT_BVH_SIGN, and for a point that
 * is not finite. visits may be NULL. */
FCT_API bool fct_bvh_inside(const fct_bvh *bvh, const float point[3], fct_visits *visits);
/* The same for `count` points (count x 3), on the threads of the environment. Bit i % 64 of inside[i / 64]
 * tells whether point i lies inside. `inside` has (count + 63) / 64 words. */
FCT_API void fct_bvh_inside_points(const fct_bvh *bvh, size_t count, const float *points, uint64_t *inside);
/* fct_bvh_closest_point, with a negative distance where the point lies inside. Returns false for a bvh that
 * was built without FCT_BVH_SIGN. */
FCT_API bool fct_bvh_signed_distance(const fct_bvh *bvh, const float point[3], float max_distance,
                                     fct_closest *out, fct_visits *visits);
/* The same for `count` points (count x 3), on the threads of the environment. */
FCT_API void fct_bvh_signed_distances(const fct_bvh *bvh, size_t count, const float *points,
                                      float max_distance, fct_closest *out);

/* The k nearest faces within max_distance, by distance and then by face id, each as fct_bvh_closest_point
 * gives it. `out` has room for k. Returns the number of faces found, at most k; 0 where fct_bvh_closest_point
 * returns false. */
FCT_API uint32_t fct_bvh_nearest(const fct_bvh *bvh, const float point[3], uint32_t k, float max_distance,
                                 fct_closest *out, fct_visits *visits);

/* The faces that touch a region: a point of the face lies in the region or on its border. Writes the lowest
 * `capacity` face ids, ascending, and returns the number of all such faces, which may be larger. `faces` may
 * be NULL if capacity is 0. A face without area counts as its sides. The OBB backend only: others find
 * nothing.
 *
 * The ball of `radius` around `center`; the distance is computed in double. A radius may be infinite. Nothing
 * touches a ball with a NaN, an infinite centre or a negative radius. */
FCT_API uint32_t fct_bvh_faces_in_ball(const fct_bvh *bvh, const float center[3], float radius,
                                       uint32_t capacity, uint32_t *faces, fct_visits *visits);
/* Most half-spaces of a region. */
enum { FCT_BVH_PLANES = 32 };
/* The points x with n.x + d >= 0 for all `count` planes (count x 4: n, d; n may have any length): a box, a
 * frustum, or another convex region. Without planes it is all of space. Each face is clipped in double, so a
 * face that crosses every plane outside of the region is not listed. Nothing touches a region with a NaN or
 * an infinite number, or with more than FCT_BVH_PLANES planes. */
FCT_API uint32_t fct_bvh_faces_in_planes(const fct_bvh *bvh, uint32_t count, const double *planes,
                                         uint32_t capacity, uint32_t *faces, fct_visits *visits);

/* The distance between two surfaces (Garland 1999, (2.7) and (2.8)): e_avg is the mean squared distance of
 * all samples, e_max the largest distance. _ab: samples of a, measured to b. Samples are the vertices that
 * faces use and samples_per_face points per face. Colours are compared at the nearest point. If several faces
 * are equally near, up to 1e-6 of the diameter, the face whose normal is closest to the sample's counts. */
typedef struct fct_mesh_error {
    double e_avg, e_avg_ab, e_avg_ba;
    double e_max, e_max_ab, e_max_ba;
    double diameter;             /* diagonal of the bounds of a */
    double color_rms, color_max; /* over RGB and all samples; 0 unless both meshes have vertex colours */
    double color_rms_relative; /* color_rms over the root mean square colour of a. Differences and colours are
                                  cut per channel at the colour that 95 % of a's area does not exceed, so
                                  that lamps do not outweigh the rest; 0 unless both have colours */
    size_t samples;
} fct_mesh_error;
/* Both with the OBB backend. Errors: MEMORY, CANCELLED. */
FCT_API fct_result fct_mesh_compare(const fct_env *env, const fct_bvh *a, const fct_bvh *b,
                                    uint32_t samples_per_face, uint64_t seed, fct_mesh_error *out);

/* The Hausdorff distance: the largest distance of any point of one surface, not only of samples, from the
 * other. */
typedef struct fct_hausdorff {
    double distance, distance_ab,
        distance_ba;               /* the larger of the two; of points of a from b; of points of b from a */
    double point_a[3], point_b[3]; /* the point of a that is farthest from b, and the other way round */
    uint32_t face_a, face_b;       /* on these faces, input ids */
} fct_hausdorff;
/* The distances are those of the points named, and at most relative * distance + absolute (or 1e-7 of the
 * diagonal) below the true ones. Both with the OBB backend. Errors: DATA (a negative tolerance, the other
 * backend), MEMORY, CANCELLED. */
FCT_API fct_result fct_mesh_hausdorff(const fct_env *env, const fct_bvh *a, const fct_bvh *b, double relative,
                                      double absolute, fct_hausdorff *out);

#ifdef __cplusplus
}
#endif
#endif
