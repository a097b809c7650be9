/* bench/queries/workloads.h: the rays, points, poses and motions that the benchmark asks about. The same mesh
 * gives the same ones on every machine. */
#ifndef FCT_BENCH_QUERIES_WORKLOADS_H
#define FCT_BENCH_QUERIES_WORKLOADS_H

#include "facetree/facetree.h"

/* A square image of the whole model, seen from above one corner of its bounds, row by row. */
void bench_primary_rays(const fct_bvh *bvh, size_t count, fct_ray *rays);
/* From one random point of the bounds towards another. */
void bench_incoherent_rays(const fct_bvh *bvh, size_t count, fct_ray *rays);

/* Within 2 % of the diagonal of random faces; count x 3. */
void bench_near_points(const fct_mesh *mesh, double diagonal, size_t count, float *points);
/* Anywhere in the bounds. */
void bench_box_points(const fct_bvh *bvh, size_t count, float *points);
/* side^3 points of a grid over the bounds, with a margin of 5 %. */
void bench_grid_points(const fct_bvh *bvh, uint32_t side, float *points);

/* A copy whose vertices have moved by up to `most` in each coordinate. */
void bench_move_vertices(const fct_env *env, const fct_mesh *mesh, double most, fct_mesh *out);

/* Poses of the model beside itself, with random rotations and directions: pose i of `touching` is 1 % of the
 * diagonal nearer than first contact, and of `apart` 1 % farther. */
void bench_contact_poses(const fct_bvh *bvh, double diagonal, size_t count, fct_pose *touching,
                         fct_pose *apart);
/* A body that turns by 2 `step` radians and comes nearer by `step` diagonals from pose to pose until it
 * touches, goes away for 30 poses, and so on. */
void bench_path(const fct_bvh *bvh, double diagonal, double step, size_t count, fct_pose *poses);

/* Copies of the model fall into a box without a lid, push each other apart and come to rest: frames x count
 * poses. The pushes are simple, because the poses matter here and not the physics. */
void bench_falling_poses(const fct_env *env, const fct_bvh *bvh, double diagonal, uint32_t count,
                         uint32_t frames, fct_pose *poses);

#endif
