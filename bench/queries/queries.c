/* bench/queries/queries.c: the same queries for our structure and for other libraries, in one process and in
 * turns.
 *
 * usage: bench_queries [-n RAYS] [-p POINTS] [-c POSES] [-i IMAGE] [-g GRID] [-b BODIES] [-f FRAMES]
 *        [-r ROUNDS] [-s SECONDS] [-o FILE.csv] MESH...
 * A count that is 0 leaves out its rows. Each round asks all sides the same queries; a ratio is the time of a
 * side over that of ours in the same round, and tables give medians. A side that has used SECONDS in a row
 * has fewer rounds, and one that needs far more for a single round answers an even part of the queries. One
 * thread is measured in processor time, two in wall time. The program fails if answers differ.
 */
#define _GNU_SOURCE
#include <malloc.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench/cluster/bench.h"
#include "bench/queries/sides.h"
#include "bench/queries/workloads.h"

enum { MOST_ROUNDS = 99, MOST_SIDES = 8 };
/* Larger meshes have no row of the Hausdorff distance. */
enum { MOST_HAUSDORFF = 100000 };

/* PQP is not in Debian. Its time over that of FCL's OBBRSS for the bunny near contact, from an earlier study:
 * touching 18 to 28 us beside 55, apart 19 to 27 beside 51, distance 1.0 ms beside 1.23. */
static const double pqp_touching = 23. / 55, pqp_apart = 23. / 51, pqp_distance = 1. / 1.23;

typedef struct options {
    uint32_t rays, points, poses, image, grid, bodies, frames, rounds;
    double seconds;
    FILE *csv;
} options;

typedef struct subject {
    const options *o;
    const char *name;
    fct_mesh mesh;
    fct_tree *tree;
    const fct_bvh *bvh; /* that of models[0] */
    double diagonal;
    void *models[MOST_SIDES];
    void *batch; /* for two threads */
    bool differ;
} subject;

/* --- Rows --- */

static void write_row(const subject *s, const char *row, uint32_t threads, const char *side, const char *unit,
                      double value, double ratio, const char *rest) {
    if (s->o->csv)
        fprintf(s->o->csv, "%s,%u,%s,%u,%s,%s,%g,%.4g,%s\n", s->name, s->mesh.face_count, row, threads, side,
                unit, value, ratio, rest);
}

static int compare_doubles(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double find_median(double *values, uint32_t count) {
    qsort(values, count, sizeof *values, compare_doubles);
    return values[count / 2];
}

/* --- Asking --- */

/* Only our batches have signs. */
static bool needs_signs(bench_question q) {
    return q == BENCH_SIGNED_DISTANCE || q == BENCH_RELATION || q == BENCH_INSIDE;
}

typedef struct work {
    bench_ask *ask;
    void *model;
    size_t count;
    const char *queries;
    double *answers;
} work;

static void *do_work(void *work_) {
    const work *w = work_;
    w->ask(w->model, w->count, w->queries, w->answers);
    return NULL;
}

static size_t query_size(bench_question q) {
    return q <= BENCH_ALL_HITS        ? sizeof(fct_ray)
           : q <= BENCH_NEAREST       ? 3 * sizeof(float)
           : q <= BENCH_BOX           ? sizeof(bench_ball)
           : q == BENCH_WITHIN        ? sizeof(bench_near)
           : q == BENCH_FIRST_CONTACT ? sizeof(fct_motion)
           : q == BENCH_EXCEPT        ? sizeof(bench_except)
                                      : sizeof(fct_pose);
}

static double time_work(const bench_side *side, work w, bench_question q, uint32_t threads) {
    if (threads == 1 || side->whole) {
        double start = threads == 1 ? bench_cpu_seconds() : bench_seconds();
        do_work(&w);
        return (threads == 1 ? bench_cpu_seconds() : bench_seconds()) - start;
    }
    pthread_t thread;
    work other = w;
    w.count /= 2;
    other.count -= w.count, other.queries += w.count * query_size(q), other.answers += w.count;
    double start = bench_seconds();
    if (pthread_create(&thread, NULL, do_work, &other)) bench_fail("no thread");
    do_work(&w);
    pthread_join(thread, NULL);
    return bench_seconds() - start;
}

/* Every step-th query. */
static work thin_out(work w, bench_question q, size_t step) {
    size_t size = query_size(q), count = (w.count + step - 1) / step;
    char *queries = bench_allocate(count, size);
    for (size_t i = 0; i < count; ++i) memcpy(queries + i * size, w.queries + i * step * size, size);
    return (work){w.ask, w.model, count, queries, bench_allocate(count, sizeof(double))};
}

/* 1 if the side is fast enough for all queries; 0 if it cannot answer for this mesh. */
static size_t choose_step(const options *o, work w, bench_question q, const bench_side *side) {
    work few = thin_out(w, q, w.count / 100 + 1), first = few;
    first.count = 1;
    do_work(&first); /* makes what the side makes when first asked */
    size_t step = 1;
    if (isnan(first.answers[0])) {
        step = 0;
    } else {
        double needed = time_work(side, few, q, 1) / (double)few.count * (double)w.count;
        if (needed > 4 * o->seconds) step = (size_t)ceil(needed / (2 * o->seconds));
    }
    free((char *)few.queries), free(few.answers);
    return step;
}

/* --- Equal answers --- */

static bool are_equal(const subject *s, const bench_side *side, bench_question q, const void *query,
                      double ours, double theirs) {
    switch (q) {
    case BENCH_CLOSEST_HIT:
    case BENCH_EXCEPT: { /* its ray comes first */
        if (isinf(ours) || isinf(theirs)) return isinf(ours) && isinf(theirs);
        const float *d = ((const fct_ray *)query)->direction;
        double length = sqrt((double)(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]));
        return fabs(ours - theirs) * length <= 1e-5 * s->diagonal;
    }
    case BENCH_SIGNED_DISTANCE: /* a point that lies on the surface has either sign */
        if (side->no_sign || fabs(ours) <= 1e-6 * s->diagonal) ours = fabs(ours), theirs = fabs(theirs);
        return fabs(ours - theirs) <= 1e-6 * s->diagonal;
    case BENCH_CLOSEST_POINT:
    case BENCH_DISTANCE:
        return fabs(ours - theirs) <= 1e-6 * s->diagonal;
    default:
        return ours == theirs;
    }
}

/* How many answers differ. A thousandth of the rays may, because sides without watertight triangles miss rays
 * that pass a rim, and of the lists of faces, because other sides round; nothing else may, and no answer of
 * our own batches. */
static size_t compare_answers(subject *s, const char *row, bench_question q, const bench_side *side,
                              const work *ours, const work *theirs, size_t step) {
    size_t different = 0, size = query_size(q);
    for (size_t i = 0; i < theirs->count; ++i)
        different += !are_equal(s, side, q, ours->queries + i * step * size, ours->answers[i * step],
                                theirs->answers[i]);
    const bool may_miss = (q <= BENCH_ALL_HITS || q == BENCH_EXCEPT || q == BENCH_BOX || q == BENCH_PAIRS) &&
                          side != &bench_batch;
    if (different > (may_miss ? theirs->count / 1000 + 8 : 0)) {
        printf("  DIFFERENT: %s, %s: %zu of %zu answers\n", row, side->name, different, theirs->count);
        s->differ = true;
    }
    return different;
}

/* --- One row --- */

static double pqp_factor(bench_question q, const char *row) {
    return q == BENCH_DISTANCE ? pqp_distance : strcmp(row, "touching") == 0 ? pqp_touching : pqp_apart;
}

static void print_peer(const subject *s, const char *row, uint32_t threads, const char *side, double rate,
                       double ratio, size_t different) {
    char rest[64];
    snprintf(rest, sizeof rest, "%zu,,,", different);
    printf("  %s %.4g (%.2f)", side, rate / 1e3, ratio);
    write_row(s, row, threads, side, "per second", rate, ratio, rest);
}

static void print_own(const subject *s, const char *row, bench_question q, uint32_t threads, const char *side,
                      double rate, const work *w) {
    char rest[96] = "0,,,";
    fct_visits v = {0, 0, 0};
    if (threads == 1 && !needs_signs(q)) {
        bench_count_visits(s->models[0], q, w->count, w->queries, &v);
        double n = (double)w->count;
        snprintf(rest, sizeof rest, "0,%.4g,%.4g,%.4g", (double)v.nodes / n, (double)v.boxes / n,
                 (double)v.triangles / n);
        printf("  %-14s visits %7.2f nodes %7.1f boxes %7.2f triangles\n", row, (double)v.nodes / n,
               (double)v.boxes / n, (double)v.triangles / n);
    }
    printf("  %-14s T%u %s %.4g", row, threads, side, rate / 1e3);
    write_row(s, row, threads, side, "per second", rate, 1, rest);
}

/* All sides that have the question, on `threads` threads. */
static void measure_threads(subject *s, const char *row, bench_question q, size_t count, const void *queries,
                            uint32_t threads, const size_t steps[MOST_SIDES]) {
    work works[MOST_SIDES];
    double times[MOST_SIDES][MOST_ROUNDS], ratios[MOST_SIDES][MOST_ROUNDS], spent[MOST_SIDES] = {0};
    uint32_t rounds[MOST_SIDES] = {0};
    size_t own = needs_signs(q);
    for (size_t i = own; i < bench_side_count; ++i) {
        const bench_side *side = bench_sides[i];
        void *model = side == &bench_batch && threads > 1 ? s->batch : s->models[i];
        works[i] = (work){side->ask[q], model, count, queries, NULL};
        if (!steps[i] || (threads > 1 && side->alone && q == BENCH_OVERLAP)) works[i].ask = NULL;
        if (!works[i].ask) continue;
        if (steps[i] > 1)
            works[i] = thin_out(works[i], q, steps[i]);
        else
            works[i].answers = bench_allocate(count, sizeof(double));
    }
    for (uint32_t r = 0; r < s->o->rounds; ++r)
        for (size_t i = own; i < bench_side_count; ++i) {
            if (!works[i].ask || (i > own && spent[i] > s->o->seconds)) continue;
            double seconds = time_work(bench_sides[i], works[i], q, threads);
            times[i][r] = seconds / (double)works[i].count;
            ratios[i][r] = times[i][r] / times[own][r];
            spent[i] += seconds, rounds[i] = r + 1;
        }
    /* the medians sort */
    print_own(s, row, q, threads, bench_sides[own]->name, 1 / find_median(times[own], rounds[own]),
              works + own);
    for (size_t i = own + 1; i < bench_side_count; ++i) {
        if (!works[i].ask) continue;
        size_t different = compare_answers(s, row, q, bench_sides[i], works + own, works + i, steps[i]);
        double rate = 1 / find_median(times[i], rounds[i]), ratio = find_median(ratios[i], rounds[i]);
        print_peer(s, row, threads, bench_sides[i]->name, rate, ratio, different);
        if (threads == 1 && bench_sides[i]->ask[BENCH_DISTANCE] && !bench_sides[i]->whole &&
            (q == BENCH_OVERLAP || q == BENCH_DISTANCE)) {
            double factor = pqp_factor(q, row);
            print_peer(s, row, threads, "PQP*", rate / factor, ratio * factor, 0);
        }
    }
    putchar('\n');
    fflush(stdout);
    for (size_t i = own; i < bench_side_count; ++i)
        if (works[i].ask) {
            free(works[i].answers);
            if (steps[i] > 1) free((char *)works[i].queries);
        }
}

static void measure_row(subject *s, const char *row, bench_question q, size_t count, const void *queries) {
    size_t steps[MOST_SIDES] = {0};
    for (size_t i = 0; i < bench_side_count; ++i)
        if (s->models[i] && bench_sides[i]->ask[q]) {
            work w = {bench_sides[i]->ask[q], s->models[i], count, queries, NULL};
            steps[i] = i < 2 ? 1 : choose_step(s->o, w, q, bench_sides[i]);
        }
    const uint32_t most = q == BENCH_RELATION || q == BENCH_INSIDE ? 1 : 2; /* without batches of their own */
    for (uint32_t threads = 1; threads <= most; ++threads)
        measure_threads(s, row, q, count, queries, threads, steps);
}

/* --- Builds --- */

static double time_build(const subject *s, const bench_side *side, uint32_t threads) {
    double start = threads == 1 ? bench_cpu_seconds() : bench_seconds();
    void *model = side->build(&s->mesh, s->tree, threads);
    double seconds = (threads == 1 ? bench_cpu_seconds() : bench_seconds()) - start;
    if (model) side->destroy(model);
    return seconds;
}

static double time_tree(const subject *s, uint32_t threads) {
    fct_env env = bench_env(threads);
    fct_tree *tree;
    double start = threads == 1 ? bench_cpu_seconds() : bench_seconds();
    bench_check(fct_tree_build(&env, &s->mesh, NULL, NULL, &tree), "a tree");
    double seconds = (threads == 1 ? bench_cpu_seconds() : bench_seconds()) - start;
    fct_tree_destroy(tree);
    return seconds;
}

static void measure_builds(const subject *s, uint32_t threads) {
    double times[MOST_SIDES][MOST_ROUNDS], trees[MOST_ROUNDS], spent[MOST_SIDES] = {0}, tree_spent = 0;
    uint32_t rounds[MOST_SIDES] = {0}, tree_rounds = 0;
    for (uint32_t r = 0; r < s->o->rounds; ++r) {
        if (tree_spent <= s->o->seconds) tree_spent += trees[tree_rounds++] = time_tree(s, threads);
        for (size_t i = 0; i < bench_side_count; ++i) {
            if (!s->models[i] || bench_sides[i] == &bench_batch || spent[i] > s->o->seconds) continue;
            spent[i] += times[i][r] = time_build(s, bench_sides[i], threads);
            rounds[i] = r + 1;
        }
    }
    double own = find_median(times[0], rounds[0]), tree = find_median(trees, tree_rounds);
    printf("  %-14s T%u facetree %.4g s, and the clusters %.4g s", "build", threads, own, tree);
    write_row(s, "build", threads, "facetree", "seconds", own, 1, "0,,,");
    write_row(s, "clusters", threads, "facetree", "seconds", tree, 1, "0,,,");
    for (size_t i = 1; i < bench_side_count; ++i) {
        if (rounds[i] == 0) continue;
        double theirs = find_median(times[i], rounds[i]);
        printf("  %s %.4g (%.2f)", bench_sides[i]->name, theirs, theirs / own);
        write_row(s, "build", threads, bench_sides[i]->name, "seconds", theirs, theirs / own, "0,,,");
    }
    putchar('\n');
}

/* New positions, which are the old ones, and the faces that cross each other: seconds of one thread. */
static void measure_whole_model(const subject *s) {
    fct_env env = bench_env(1);
    double start = bench_cpu_seconds(), quality, refit, own;
    fct_bvh *moved;
    bench_check(fct_bvh_refit(&env, s->bvh, s->mesh.positions, &moved, &quality), "a refit");
    refit = bench_cpu_seconds() - start;
    start = bench_cpu_seconds();
    size_t pairs = fct_bvh_self_pairs(moved, SIZE_MAX, 0, NULL, NULL);
    own = bench_cpu_seconds() - start;
    fct_bvh_destroy(moved);
    printf("  %-14s T1 facetree %.4g s   %-14s T1 facetree %.4g s, %zu pairs\n", "refit", refit, "self pairs",
           own, pairs);
    write_row(s, "refit", 1, "facetree", "seconds", refit, 1, "0,,,");
    write_row(s, "self pairs", 1, "facetree", "seconds", own, 1, "0,,,");
}

/* The Hausdorff distance from a copy whose vertices have moved, from two meshes to the number: up to .0001 of
 * the diagonal. */
static void measure_hausdorff(subject *s) {
    const double error = 1e-4 * s->diagonal;
    fct_env env = bench_env(1);
    fct_mesh moved;
    double times[MOST_SIDES], found[MOST_SIDES];
    if (s->mesh.face_count > MOST_HAUSDORFF) return;
    bench_move_vertices(&env, &s->mesh, .002 * s->diagonal, &moved);
    for (size_t i = 0; i < bench_side_count; ++i) {
        const bench_side *side = bench_sides[i];
        if (!side->find_hausdorff || !s->models[i]) continue;
        double start = bench_cpu_seconds();
        found[i] = side->find_hausdorff(&s->mesh, &moved, error);
        times[i] = bench_cpu_seconds() - start;
        if (i == 0) printf("  %-14s T1 facetree %.4g s", "Hausdorff", times[0]);
        if (i) printf("  %s %.4g (%.2f)", side->name, times[i], times[i] / times[0]);
        write_row(s, "Hausdorff", 1, side->name, "seconds", times[i], times[i] / times[0], "0,,,");
        if (fabs(found[i] - found[0]) <= 2 * error) continue;
        printf("\n  DIFFERENT: Hausdorff, %s: %g and %g\n", side->name, found[0], found[i]);
        s->differ = true;
    }
    putchar('\n');
    fct_mesh_release(&env, &moved);
}

static double count_ray_bytes(const subject *s) {
    fct_env env = bench_env(2);
    fct_bvh *bvh;
    bench_check(fct_bvh_create(&env, s->tree, FCT_BACKEND_OBB, &bvh), "a structure for rays");
    double bytes = (double)fct_bvh_bytes(bvh);
    fct_bvh_destroy(bvh);
    return bytes;
}

/* Builds the structures that answer, and prints their sizes. */
static void build_models(subject *s) {
    double faces = s->mesh.face_count, own = 0, rays = count_ray_bytes(s);
    printf("  %-14s    rays alone %.1f  ", "bytes/triangle", rays / faces);
    write_row(s, "bytes of rays", 1, "facetree", "per triangle", rays / faces, 1, "0,,,");
    for (size_t i = 0; i < bench_side_count; ++i) {
        const bench_side *side = bench_sides[i];
        if (s->mesh.face_count > side->most_triangles) continue;
        struct mallinfo2 before = mallinfo2();
        s->models[i] = side->build(&s->mesh, s->tree, 1);
        if (!s->models[i]) continue;
        struct mallinfo2 after = mallinfo2();
        double bytes = (double)(after.uordblks + after.hblkhd - before.uordblks - before.hblkhd);
        if (side->bytes) bytes = (double)side->bytes(s->models[i]);
        if (i == 0) own = bytes;
        printf("%s%s %.1f (%.2f)", i ? "  " : "", side->name, bytes / faces, bytes / own);
        write_row(s, "bytes", 1, side->name, "per triangle", bytes / faces, bytes / own, "0,,,");
    }
    putchar('\n');
    s->batch = bench_batch.build(&s->mesh, s->tree, 2);
}

/* --- Parts --- */

static void measure_rays(subject *s) {
    size_t count = s->o->rays;
    fct_ray *rays = bench_allocate(count, sizeof *rays);
    bench_primary_rays(s->bvh, count, rays);
    measure_row(s, "primary", BENCH_CLOSEST_HIT, count, rays);
    bench_incoherent_rays(s->bvh, count, rays);
    measure_row(s, "incoherent", BENCH_CLOSEST_HIT, count, rays);
    measure_row(s, "incoherent any", BENCH_ANY_HIT, count, rays);
    measure_row(s, "all hits", BENCH_ALL_HITS, count / 8, rays);
    bench_except *except = bench_allocate(count, sizeof *except);
    bench_incoherent_rays(s->bvh, count, rays);
    for (size_t i = 0; i < count; ++i) { /* the face that each ray hits first */
        fct_hit hit;
        except[i] = (bench_except){rays[i], FCT_NONE};
        if (fct_bvh_closest_hit(s->bvh, rays + i, &hit, NULL)) except[i].face = hit.face;
    }
    measure_row(s, "except a face", BENCH_EXCEPT, count, except);
    free(except);
    free(rays);
}

static void measure_points(subject *s) {
    size_t count = s->o->points;
    float *points = bench_allocate(count, 3 * sizeof *points);
    bench_near_points(&s->mesh, s->diagonal, count, points);
    measure_row(s, "near points", BENCH_CLOSEST_POINT, count, points);
    bench_box_points(s->bvh, count, points);
    measure_row(s, "box points", BENCH_CLOSEST_POINT, count, points);
    measure_row(s, "inside", BENCH_INSIDE, count, points);
    bench_near_points(&s->mesh, s->diagonal, count, points);
    measure_row(s, "eight nearest", BENCH_NEAREST, count, points);
    bench_ball *balls = bench_allocate(count, sizeof *balls);
    for (size_t i = 0; i < count; ++i) {
        memcpy(balls[i].center, points + 3 * i, sizeof balls[i].center);
        balls[i].radius = (float)(.01 * s->diagonal);
    }
    measure_row(s, "faces in ball", BENCH_BALL, count, balls);
    measure_row(s, "faces in box", BENCH_BOX, count, balls);
    free(balls);
    free(points);
}

/* Within a hundredth of the diagonal; and from apart to touching. */
static void measure_near_poses(subject *s, size_t count, const fct_pose *touching, const fct_pose *apart) {
    bench_near *near = bench_allocate(count, sizeof *near);
    fct_motion *motions = bench_allocate(count, sizeof *motions);
    for (size_t i = 0; i < count; ++i) {
        near[i] = (bench_near){apart[i], .01 * s->diagonal};
        motions[i] = (fct_motion){apart[i], touching[i]};
    }
    measure_row(s, "within", BENCH_WITHIN, count, near);
    measure_row(s, "first contact", BENCH_FIRST_CONTACT, count, motions);
    free(motions), free(near);
}

static void measure_poses(subject *s) {
    size_t half = (s->o->poses + 1) / 2;
    fct_pose *touching = bench_allocate(half, sizeof *touching), *apart = bench_allocate(half, sizeof *apart);
    bench_contact_poses(s->bvh, s->diagonal, half, touching, apart);
    measure_row(s, "touching", BENCH_OVERLAP, half, touching);
    measure_row(s, "apart", BENCH_OVERLAP, half, apart);
    measure_row(s, "distance", BENCH_DISTANCE, half, apart);
    measure_row(s, "all pairs", BENCH_PAIRS, half, touching);
    measure_row(s, "relation", BENCH_RELATION, half, touching);
    measure_near_poses(s, half, touching, apart);
    fct_pose *path = touching; /* the same room */
    bench_path(s->bvh, s->diagonal, 1e-4, half, path);
    measure_row(s, "slow path", BENCH_PATH, half, path);
    free(touching), free(apart);
}

static void measure_image(subject *s) {
    size_t count = (size_t)s->o->image * s->o->image;
    fct_ray *rays = bench_allocate(count, sizeof *rays);
    bench_primary_rays(s->bvh, count, rays);
    measure_row(s, "depth image", BENCH_CLOSEST_HIT, count, rays);
    free(rays);
}

static void measure_grid(subject *s) {
    size_t count = (size_t)s->o->grid * s->o->grid * s->o->grid;
    float *points = bench_allocate(count, 3 * sizeof *points);
    bench_grid_points(s->bvh, s->o->grid, points);
    measure_row(s, "distance field", BENCH_SIGNED_DISTANCE, count, points);
    free(points);
}

/* Frames per second. */
static void measure_bodies(subject *s) {
    uint32_t count = s->o->bodies, frames = s->o->frames;
    fct_env env = bench_env(1);
    fct_pose *poses = bench_allocate((size_t)count * frames, sizeof *poses);
    double *pairs[MOST_SIDES], times[MOST_SIDES][MOST_ROUNDS], ratios[MOST_SIDES][MOST_ROUNDS], all = 0;
    bench_falling_poses(&env, s->bvh, s->diagonal, count, frames, poses);
    for (size_t i = 0; i < bench_side_count; ++i) pairs[i] = bench_allocate(frames, sizeof(double));
    for (uint32_t r = 0; r < s->o->rounds; ++r)
        for (size_t i = 0; i < bench_side_count; ++i) {
            if (!s->models[i] || !bench_sides[i]->count_touching) continue;
            double start = bench_cpu_seconds();
            bench_sides[i]->count_touching(s->models[i], count, frames, poses, pairs[i]);
            times[i][r] = (bench_cpu_seconds() - start) / frames;
            ratios[i][r] = times[i][r] / times[0][r];
        }
    for (uint32_t f = 0; f < frames; ++f) all += pairs[0][f];
    double own = 1 / find_median(times[0], s->o->rounds);
    printf("  %-14s T1 facetree %.4g frames/s of %u bodies, %.1f pairs per frame", "falling bodies", own,
           count, all / frames);
    write_row(s, "falling bodies", 1, "facetree", "per second", own, 1, "0,,,");
    for (size_t i = 1; i < bench_side_count; ++i) {
        if (!s->models[i] || !bench_sides[i]->count_touching) continue;
        double rate = 1 / find_median(times[i], s->o->rounds), ratio = find_median(ratios[i], s->o->rounds);
        size_t different = 0;
        for (uint32_t f = 0; f < frames; ++f) different += pairs[i][f] != pairs[0][f];
        printf("  %s %.4g (%.2f)", bench_sides[i]->name, rate, ratio);
        write_row(s, "falling bodies", 1, bench_sides[i]->name, "per second", rate, ratio, "0,,,");
        if (different) {
            printf("\n  DIFFERENT: pairs of %zu of %u frames", different, frames);
            s->differ = true;
        }
    }
    putchar('\n');
    for (size_t i = 0; i < bench_side_count; ++i) free(pairs[i]);
    free(poses);
}

/* Returns whether all answers agree. */
static bool measure_mesh(const options *o, const char *path) {
    const char *slash = strrchr(path, '/');
    char name[64];
    snprintf(name, sizeof name, "%s", slash ? slash + 1 : path);
    *strchrnul(name, '.') = 0;
    subject s = {.o = o, .name = name};
    fct_env env = bench_env(2);
    bench_load(&env, path, &s.mesh);
    bench_check(fct_tree_build(&env, &s.mesh, NULL, NULL, &s.tree), "a tree");
    s.diagonal = bench_diagonal(&s.mesh);
    printf("%s: %u triangles (thousands per second; in brackets the time over ours%s)\n", name,
           s.mesh.face_count, o->poses ? "; PQP*: not measured, a fixed part of FCL's time" : "");
    build_models(&s);
    s.bvh = bench_own_bvh(s.models[0]);
    for (uint32_t threads = 1; threads <= 2; ++threads) measure_builds(&s, threads);
    measure_whole_model(&s);
    if (o->points) measure_hausdorff(&s);
    if (o->rays) measure_rays(&s);
    if (o->points) measure_points(&s);
    if (o->poses) measure_poses(&s);
    if (o->image) measure_image(&s);
    if (o->grid) measure_grid(&s);
    if (o->bodies && o->frames) measure_bodies(&s);
    fflush(stdout);
    for (size_t i = 0; i < bench_side_count; ++i)
        if (s.models[i]) bench_sides[i]->destroy(s.models[i]);
    bench_batch.destroy(s.batch);
    fct_tree_destroy(s.tree);
    fct_mesh_release(&env, &s.mesh);
    return !s.differ;
}

static bool read_option(options *o, char letter, const char *value) {
    static const char letters[] = "npcigbfr";
    uint32_t *counts[] = {&o->rays, &o->points, &o->poses,  &o->image,
                          &o->grid, &o->bodies, &o->frames, &o->rounds};
    const char *found = strchr(letters, letter);
    if (found && letter)
        *counts[found - letters] = bench_count(value, "a count");
    else if (letter == 's')
        o->seconds = bench_count(value, "-s");
    else if (letter == 'o') {
        o->csv = fopen(value, "a");
        if (!o->csv) bench_fail("%s: cannot be written", value);
    } else
        return false;
    return true;
}

int main(int argc, char **argv) {
    options o = {.rounds = 5, .seconds = 2};
    int i = 1;
    while (i + 1 < argc && argv[i][0] == '-' && argv[i][1] && !argv[i][2] &&
           read_option(&o, argv[i][1], argv[i + 1]))
        i += 2;
    if (i >= argc || argv[i][0] == '-' || o.rounds < 1 || o.rounds > MOST_ROUNDS)
        bench_fail("usage: bench_queries [-n RAYS] [-p POINTS] [-c POSES] [-i IMAGE] [-g GRID] [-b BODIES] "
                   "[-f FRAMES]"
                   " [-r ROUNDS] [-s SECONDS] [-o FILE.csv] MESH...");
    if (o.csv && ftell(o.csv) == 0)
        fputs("mesh,faces,row,threads,side,unit,value,ratio,differ,nodes,boxes,triangles\n", o.csv);
    bool good = true;
    for (; i < argc; ++i) good = measure_mesh(&o, argv[i]) && good;
    if (o.csv) fclose(o.csv);
    return !good;
}
