/* bench/queries/facetree.c: our answers, one query at a time and in batches, and the list of all sides. */
#include <math.h>
#include <stdlib.h>

#include "bench/cluster/bench.h"
#include "bench/queries/sides.h"

typedef struct model {
    fct_env env;
    fct_bvh *bvh;
} model;

static void *build_parts(const fct_tree *tree, uint32_t threads, uint32_t parts) {
    model *m = bench_allocate(1, sizeof *m);
    m->env = bench_env(threads);
    fct_bvh_def def = fct_bvh_def_default();
    def.parts = parts;
    bench_check(fct_bvh_build(&m->env, tree, &def, &m->bvh), "our structure");
    return m;
}

static void *build_model(const fct_mesh *mesh, const fct_tree *tree, uint32_t threads) {
    (void)mesh;
    return build_parts(tree, threads, FCT_BVH_PAIRS);
}

static void *build_batch_model(const fct_mesh *mesh, const fct_tree *tree, uint32_t threads) {
    (void)mesh;
    return build_parts(tree, threads, FCT_BVH_PAIRS | FCT_BVH_SIGN);
}

static void destroy_model(void *model_) {
    model *m = model_;
    fct_bvh_destroy(m->bvh);
    free(m);
}

static size_t count_bytes(const void *m) {
    return fct_bvh_bytes(((const model *)m)->bvh);
}

/* --- One query at a time --- */

static void ask_closest_hit(const fct_bvh *bvh, size_t count, const fct_ray *rays, double *t, fct_visits *v) {
    fct_hit hit;
    for (size_t i = 0; i < count; ++i)
        t[i] = fct_bvh_closest_hit(bvh, rays + i, &hit, v) ? (double)hit.t : INFINITY;
}

static void ask_any_hit(const fct_bvh *bvh, size_t count, const fct_ray *rays, double *hit, fct_visits *v) {
    for (size_t i = 0; i < count; ++i) hit[i] = fct_bvh_any_hit(bvh, rays + i, v);
}

static void ask_closest_point(const fct_bvh *bvh, size_t count, const float *points, double *distances,
                              fct_visits *v) {
    fct_closest closest;
    for (size_t i = 0; i < count; ++i) {
        fct_bvh_closest_point(bvh, points + 3 * i, INFINITY, &closest, v);
        distances[i] = (double)closest.distance;
    }
}

static void ask_overlap(const fct_bvh *bvh, size_t count, const fct_pose *poses, double *touching,
                        fct_visits *v) {
    for (size_t i = 0; i < count; ++i) touching[i] = fct_bvh_overlap(bvh, bvh, poses + i, NULL, v);
}

static void ask_distance(const fct_bvh *bvh, size_t count, const fct_pose *poses, double *distances,
                         fct_visits *v) {
    fct_distance distance;
    for (size_t i = 0; i < count; ++i) {
        fct_bvh_distance(bvh, bvh, poses + i, NULL, NULL, &distance, v);
        distances[i] = distance.distance;
    }
}

static void ask_all_hits(const fct_bvh *bvh, size_t count, const fct_ray *rays, double *hits, fct_visits *v) {
    fct_hit list[64];
    for (size_t i = 0; i < count; ++i) hits[i] = (double)fct_bvh_all_hits(bvh, rays + i, 64, list, v);
}

enum { NEAREST = 8 };

static void ask_nearest(const fct_bvh *bvh, size_t count, const float *points, double *distances,
                        fct_visits *v) {
    fct_closest nearest[NEAREST];
    for (size_t i = 0; i < count; ++i) {
        uint32_t found = fct_bvh_nearest(bvh, points + 3 * i, NEAREST, INFINITY, nearest, v);
        distances[i] = found ? (double)nearest[found - 1].distance : INFINITY;
    }
}

static void ask_ball(const fct_bvh *bvh, size_t count, const bench_ball *balls, double *faces,
                     fct_visits *v) {
    uint32_t list[256];
    for (size_t i = 0; i < count; ++i)
        faces[i] = fct_bvh_faces_in_ball(bvh, balls[i].center, balls[i].radius, 256, list, v);
}

static void ask_box(const fct_bvh *bvh, size_t count, const bench_ball *balls, double *faces, fct_visits *v) {
    uint32_t list[256];
    for (size_t i = 0; i < count; ++i) {
        double planes[6][4] = {{0}};
        for (int k = 0; k < 6; ++k) {
            double sign = k % 2 ? -1 : 1;
            planes[k][k / 2] = sign;
            planes[k][3] = (double)balls[i].radius - sign * (double)balls[i].center[k / 2];
        }
        faces[i] = fct_bvh_faces_in_planes(bvh, 6, planes[0], 256, list, v);
    }
}

static void ask_path(const fct_bvh *bvh, size_t count, const fct_pose *poses, double *touching,
                     fct_visits *v) {
    fct_pair_hint hint = fct_pair_hint_none();
    for (size_t i = 0; i < count; ++i) touching[i] = fct_bvh_overlap(bvh, bvh, poses + i, &hint, v);
}

static void ask_pairs(const fct_bvh *bvh, size_t count, const fct_pose *poses, double *pairs, fct_visits *v) {
    static _Thread_local fct_face_pair list[4096];
    for (size_t i = 0; i < count; ++i)
        pairs[i] = (double)fct_bvh_pairs(bvh, bvh, poses + i, SIZE_MAX, 4096, list, NULL, v);
}

static void ask_within(const fct_bvh *bvh, size_t count, const bench_near *near, double *found,
                       fct_visits *v) {
    for (size_t i = 0; i < count; ++i)
        found[i] = fct_bvh_within(bvh, bvh, &near[i].pose, near[i].distance, NULL, v);
}

static void ask_relation(const fct_bvh *bvh, size_t count, const fct_pose *poses, double *relations,
                         fct_visits *v) {
    for (size_t i = 0; i < count; ++i) relations[i] = fct_bvh_relation(bvh, bvh, poses + i, NULL, v);
}

static void ask_first_contact(const fct_bvh *bvh, size_t count, const fct_motion *motions, double *times,
                              fct_visits *v) {
    fct_bounds b = fct_bvh_bounds(bvh);
    fct_first_contact first;
    double tolerance = 1e-4 * ((double)b.upper[0] - (double)b.lower[0]);
    for (size_t i = 0; i < count; ++i)
        times[i] = fct_bvh_first_contact(bvh, bvh, motions + i, tolerance, &first, v) ? first.time : INFINITY;
}

static void ask_except(const fct_bvh *bvh, size_t count, const bench_except *queries, double *t,
                       fct_visits *v) {
    fct_hit hit;
    for (size_t i = 0; i < count; ++i)
        t[i] = fct_bvh_closest_hit_except(bvh, &queries[i].ray, queries[i].face, &hit, v) ? (double)hit.t
                                                                                          : INFINITY;
}

static void find_except(void *m, size_t count, const void *queries, double *t) {
    ask_except(((model *)m)->bvh, count, queries, t, NULL);
}

static void find_inside(void *m, size_t count, const void *points, double *inside) {
    for (size_t i = 0; i < count; ++i)
        inside[i] = fct_bvh_inside(((model *)m)->bvh, (const float *)points + 3 * i, NULL);
}

static double find_hausdorff(const fct_mesh *a, const fct_mesh *b, double error) {
    fct_env env = bench_env(1);
    const fct_mesh *meshes[2] = {a, b};
    fct_tree *trees[2];
    fct_bvh *bvhs[2];
    fct_hausdorff found;
    for (int i = 0; i < 2; ++i) {
        bench_check(fct_tree_build(&env, meshes[i], NULL, NULL, &trees[i]), "a tree");
        bench_check(fct_bvh_create(&env, trees[i], FCT_BACKEND_OBB, &bvhs[i]), "our structure");
    }
    bench_check(fct_mesh_hausdorff(&env, bvhs[0], bvhs[1], 0, error, &found), "a distance");
    for (int i = 0; i < 2; ++i) fct_bvh_destroy(bvhs[i]), fct_tree_destroy(trees[i]);
    return found.distance;
}

static void find_all_hits(void *m, size_t count, const void *rays, double *hits) {
    ask_all_hits(((model *)m)->bvh, count, rays, hits, NULL);
}

static void find_nearest(void *m, size_t count, const void *points, double *distances) {
    ask_nearest(((model *)m)->bvh, count, points, distances, NULL);
}

static void find_in_ball(void *m, size_t count, const void *balls, double *faces) {
    ask_ball(((model *)m)->bvh, count, balls, faces, NULL);
}

static void find_in_box(void *m, size_t count, const void *balls, double *faces) {
    ask_box(((model *)m)->bvh, count, balls, faces, NULL);
}

static void find_path(void *m, size_t count, const void *poses, double *touching) {
    ask_path(((model *)m)->bvh, count, poses, touching, NULL);
}

static void find_pairs(void *m, size_t count, const void *poses, double *pairs) {
    ask_pairs(((model *)m)->bvh, count, poses, pairs, NULL);
}

static void find_within(void *m, size_t count, const void *near, double *found) {
    ask_within(((model *)m)->bvh, count, near, found, NULL);
}

static void find_relations(void *m, size_t count, const void *poses, double *relations) {
    ask_relation(((model *)m)->bvh, count, poses, relations, NULL);
}

static void find_first_contacts(void *m, size_t count, const void *motions, double *times) {
    ask_first_contact(((model *)m)->bvh, count, motions, times, NULL);
}

static void find_closest_hits(void *m, size_t count, const void *rays, double *t) {
    ask_closest_hit(((model *)m)->bvh, count, rays, t, NULL);
}

static void find_any_hits(void *m, size_t count, const void *rays, double *hit) {
    ask_any_hit(((model *)m)->bvh, count, rays, hit, NULL);
}

static void find_closest_points(void *m, size_t count, const void *points, double *distances) {
    ask_closest_point(((model *)m)->bvh, count, points, distances, NULL);
}

static void find_overlaps(void *m, size_t count, const void *poses, double *touching) {
    ask_overlap(((model *)m)->bvh, count, poses, touching, NULL);
}

static void find_distances(void *m, size_t count, const void *poses, double *distances) {
    ask_distance(((model *)m)->bvh, count, poses, distances, NULL);
}

const fct_bvh *bench_own_bvh(const void *m) {
    return ((const model *)m)->bvh;
}

void bench_count_visits(const void *m, bench_question question, size_t count, const void *queries,
                        fct_visits *visits) {
    const fct_bvh *bvh = bench_own_bvh(m);
    double *answers = bench_allocate(count, sizeof *answers);
    switch (question) {
    case BENCH_CLOSEST_HIT:
        ask_closest_hit(bvh, count, queries, answers, visits);
        break;
    case BENCH_ANY_HIT:
        ask_any_hit(bvh, count, queries, answers, visits);
        break;
    case BENCH_ALL_HITS:
        ask_all_hits(bvh, count, queries, answers, visits);
        break;
    case BENCH_CLOSEST_POINT:
        ask_closest_point(bvh, count, queries, answers, visits);
        break;
    case BENCH_EXCEPT:
        ask_except(bvh, count, queries, answers, visits);
        break;
    case BENCH_NEAREST:
        ask_nearest(bvh, count, queries, answers, visits);
        break;
    case BENCH_BALL:
        ask_ball(bvh, count, queries, answers, visits);
        break;
    case BENCH_BOX:
        ask_box(bvh, count, queries, answers, visits);
        break;
    case BENCH_PATH:
        ask_path(bvh, count, queries, answers, visits);
        break;
    case BENCH_PAIRS:
        ask_pairs(bvh, count, queries, answers, visits);
        break;
    case BENCH_WITHIN:
        ask_within(bvh, count, queries, answers, visits);
        break;
    case BENCH_FIRST_CONTACT:
        ask_first_contact(bvh, count, queries, answers, visits);
        break;
    case BENCH_OVERLAP:
        ask_overlap(bvh, count, queries, answers, visits);
        break;
    case BENCH_DISTANCE:
        ask_distance(bvh, count, queries, answers, visits);
        break;
    default: /* what needs signs has no visits of its own here */
        break;
    }
    free(answers);
}

/* --- Batches --- */

static void batch_closest_hits(void *m, size_t count, const void *rays, double *t) {
    fct_hit *hits = bench_allocate(count, sizeof *hits);
    fct_bvh_closest_hits(((model *)m)->bvh, count, rays, hits);
    for (size_t i = 0; i < count; ++i) t[i] = hits[i].face == FCT_NONE ? INFINITY : (double)hits[i].t;
    free(hits);
}

static void batch_any_hits(void *m, size_t count, const void *rays, double *hit) {
    uint64_t *bits = bench_allocate((count + 63) / 64, sizeof *bits);
    fct_bvh_any_hits(((model *)m)->bvh, count, rays, bits);
    for (size_t i = 0; i < count; ++i) hit[i] = (double)(bits[i / 64] >> (i % 64) & 1);
    free(bits);
}

static void batch_points(void *m, size_t count, const void *points, double *distances) {
    fct_closest *closest = bench_allocate(count, sizeof *closest);
    fct_bvh_closest_points(((model *)m)->bvh, count, points, INFINITY, closest);
    for (size_t i = 0; i < count; ++i) distances[i] = (double)closest[i].distance;
    free(closest);
}

static void batch_signed_distances(void *m, size_t count, const void *points, double *distances) {
    fct_closest *closest = bench_allocate(count, sizeof *closest);
    fct_bvh_signed_distances(((model *)m)->bvh, count, points, INFINITY, closest);
    for (size_t i = 0; i < count; ++i) distances[i] = (double)closest[i].distance;
    free(closest);
}

static void batch_overlaps(void *m, size_t count, const void *poses, double *touching) {
    uint64_t *bits = bench_allocate((count + 63) / 64, sizeof *bits);
    fct_bvh_overlaps(((model *)m)->bvh, ((model *)m)->bvh, count, poses, bits);
    for (size_t i = 0; i < count; ++i) touching[i] = (double)(bits[i / 64] >> (i % 64) & 1);
    free(bits);
}

static void batch_distances(void *m, size_t count, const void *poses, double *distances) {
    fct_distance *found = bench_allocate(count, sizeof *found);
    fct_bvh_distances(((model *)m)->bvh, ((model *)m)->bvh, count, poses, NULL, found);
    for (size_t i = 0; i < count; ++i) distances[i] = found[i].distance;
    free(found);
}

static void count_touching(void *m, uint32_t count, uint32_t frames, const fct_pose *poses, double *pairs) {
    fct_body *bodies = bench_allocate(count, sizeof *bodies);
    for (uint32_t f = 0; f < frames; ++f) {
        size_t found;
        for (uint32_t i = 0; i < count; ++i)
            bodies[i] = (fct_body){((model *)m)->bvh, poses[(size_t)f * count + i]};
        bench_check(fct_bodies_touching(&((model *)m)->env, count, bodies, 0, NULL, &found), "bodies");
        pairs[f] = (double)found;
    }
    free(bodies);
}

const bench_side bench_facetree = {
    .name = "facetree",
    .most_triangles = UINT32_MAX,
    .build = build_model,
    .destroy = destroy_model,
    .bytes = count_bytes,
    .ask = {[BENCH_CLOSEST_HIT] = find_closest_hits,
            [BENCH_ANY_HIT] = find_any_hits,
            [BENCH_ALL_HITS] = find_all_hits,
            [BENCH_CLOSEST_POINT] = find_closest_points,
            [BENCH_NEAREST] = find_nearest,
            [BENCH_BALL] = find_in_ball,
            [BENCH_BOX] = find_in_box,
            [BENCH_OVERLAP] = find_overlaps,
            [BENCH_PATH] = find_path,
            [BENCH_PAIRS] = find_pairs,
            [BENCH_WITHIN] = find_within,
            [BENCH_DISTANCE] = find_distances,
            [BENCH_FIRST_CONTACT] = find_first_contacts,
            [BENCH_EXCEPT] = find_except},
    .count_touching = count_touching,
    .find_hausdorff = find_hausdorff,
};

const bench_side bench_batch = {
    .name = "batch",
    .most_triangles = UINT32_MAX,
    .whole = true,
    .build = build_batch_model,
    .destroy = destroy_model,
    .bytes = count_bytes,
    .ask = {[BENCH_CLOSEST_HIT] = batch_closest_hits,
            [BENCH_ANY_HIT] = batch_any_hits,
            [BENCH_CLOSEST_POINT] = batch_points,
            [BENCH_SIGNED_DISTANCE] = batch_signed_distances,
            [BENCH_OVERLAP] = batch_overlaps,
            [BENCH_PATH] = batch_overlaps,
            [BENCH_RELATION] = find_relations,
            [BENCH_INSIDE] = find_inside,
            [BENCH_DISTANCE] = batch_distances},
};

const bench_side *const bench_sides[] = {
    &bench_facetree, &bench_batch, &bench_embree, &bench_robust,
#ifdef BENCH_CGAL
    &bench_cgal,
#endif
#ifdef BENCH_BULLET
    &bench_bullet,
#endif
#ifdef BENCH_FCL
    &bench_fcl,
#endif
};
const size_t bench_side_count = sizeof bench_sides / sizeof *bench_sides;
