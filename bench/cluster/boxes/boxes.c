/* bench/cluster/boxes/boxes.c: compares our boxes with those of a top-down OBB tree and of an axis-aligned
 * tree, by surface area and by the boxes that queries visit.
 *
 * usage: boxes MESH [REPEATS]
 * All trees have one triangle per leaf, and the same code walks them. Queries: a grid of parallel rays from
 * outside; random rays from inside the bounds; the mesh against a copy at random poses, a thousandth of the
 * diagonal before and behind the first contact. The program fails unless all trees give the same answers.
 * Times are medians of REPEATS (5) measurements in turns.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench/cluster/bench.h"
#include "bench/cluster/boxes/boxtree.h"

enum { TREES = 5, CUT = 4096, QUERIES = 4, GRID = 160, RAYS = 20000, POSES = 150, MOST_REPEATS = 25 };

static const char *const tree_names[TREES] = {"rounds", "greedy", "regrouped", "obbtree", "aligned"};
static const char *const query_names[QUERIES] = {"primary", "incoherent", "touching", "apart"};

typedef struct ray {
    v3 origin, direction;
} ray;

typedef struct tests {
    size_t counts[QUERIES];
    ray *rays[2];
    box_pose *poses[2];
} tests;

typedef struct figure {
    box_visits visits;
    double seconds[MOST_REPEATS];
    double sum; /* of the results */
    size_t found;
} figure;

static fct_tree *build_ours(const fct_env *env, const fct_mesh *mesh, fct_cluster_method method,
                            double *seconds) {
    fct_tree_def def = fct_tree_def_default();
    fct_tree *tree;
    def.method = method;
    double start = bench_seconds();
    bench_check(fct_tree_build(env, mesh, &def, NULL, &tree), "the tree");
    *seconds = bench_seconds() - start;
    return tree;
}

static void make_trees(const fct_env *env, const fct_mesh *mesh, box_tree trees[TREES]) {
    double seconds;
    fct_tree *tree = build_ours(env, mesh, FCT_CLUSTER_ROUNDS, &seconds);
    box_tree_take(mesh, tree, &trees[0]);
    trees[0].seconds = seconds;
    double start = bench_seconds();
    box_tree_regroup(mesh, tree, CUT, &trees[2]);
    trees[2].seconds = seconds + bench_seconds() - start;
    fct_tree_destroy(tree);
    tree = build_ours(env, mesh, FCT_CLUSTER_GREEDY, &seconds);
    box_tree_take(mesh, tree, &trees[1]);
    trees[1].seconds = seconds;
    fct_tree_destroy(tree);
    box_tree_oriented(mesh, &trees[3]);
    box_tree_aligned(mesh, &trees[4]);
}

/* --- Queries --- */

static v3 any_direction(bench_dice *dice) {
    v3 d;
    do d = (v3){2 * bench_unit(dice) - 1, 2 * bench_unit(dice) - 1, 2 * bench_unit(dice) - 1};
    while (v3_norm2(d) > 1 || v3_norm2(d) < 1e-4);
    return v3_unit(d);
}

static void make_rays(const fct_mesh *mesh, double diagonal, tests *t) {
    bench_dice dice = {11};
    v3 low = {INFINITY, INFINITY, INFINITY}, high = {-INFINITY, -INFINITY, -INFINITY}, u, v;
    for (size_t i = 0; i < 3 * (size_t)mesh->face_count; ++i) {
        v3 p = v3_load(mesh->positions + 3 * (size_t)mesh->triangles[i]);
        low = (v3){fmin(low.x, p.x), fmin(low.y, p.y), fmin(low.z, p.z)};
        high = (v3){fmax(high.x, p.x), fmax(high.y, p.y), fmax(high.z, p.z)};
    }
    v3 center = v3_scale(v3_add(low, high), .5), view = v3_unit((v3){-.48, -.36, -.8});
    v3_frame(view, &u, &v);
    for (size_t i = 0; i < t->counts[0]; ++i) {
        double x = ((double)(i % GRID) + .5) / GRID - .5, y = ((double)(i / GRID) + .5) / GRID - .5;
        v3 at = v3_mad(v3_mad(v3_mad(center, -diagonal, view), x * diagonal, u), y * diagonal, v);
        t->rays[0][i] = (ray){at, view};
    }
    for (size_t i = 0; i < t->counts[1]; ++i) {
        double x = bench_unit(&dice), y = bench_unit(&dice), z = bench_unit(&dice);
        v3 at = {low.x + x * (high.x - low.x), low.y + y * (high.y - low.y), low.z + z * (high.z - low.z)};
        t->rays[1][i] = (ray){at, any_direction(&dice)};
    }
}

/* A random rotation about the centre of the root's box, and a random direction to move along. */
static box_pose any_pose(bench_dice *dice, v3 center, v3 *out) {
    box_pose pose;
    v3 a = any_direction(dice), b, c;
    v3_frame(a, &b, &c);
    double angle = 6.283185307179586 * bench_unit(dice);
    pose.axes[0] = a;
    pose.axes[1] = v3_add(v3_scale(b, cos(angle)), v3_scale(c, sin(angle)));
    pose.axes[2] = v3_cross(a, pose.axes[1]);
    v3 turned = {v3_dot(pose.axes[0], center), v3_dot(pose.axes[1], center), v3_dot(pose.axes[2], center)};
    pose.shift = v3_sub(center, turned);
    *out = any_direction(dice);
    return pose;
}

/* The distance of the last contact along the direction: steps of 1/64 of the diagonal, refined to 1/1024. */
static void make_poses(const box_tree *tree, double diagonal, tests *t) {
    bench_dice dice = {13};
    v3 center = v3_load(tree->boxes[tree->root].center);
    size_t made = 0;
    for (int tries = 0; tries < 4 * POSES && made < POSES; ++tries) {
        v3 way;
        box_pose start = any_pose(&dice, center, &way), pose = start;
        box_visits unused = {0, 0};
        double near = 1.25, far = 1.25;
        while (near > 0) {
            near = far - 1. / 64;
            pose.shift = v3_mad(start.shift, near * diagonal, way);
            if (box_tree_touches(tree, &pose, &unused)) break;
            far = near;
        }
        if (!(near > 0)) continue;
        while (far - near > 1. / 1024) {
            double middle = .5 * (near + far);
            pose.shift = v3_mad(start.shift, middle * diagonal, way);
            if (box_tree_touches(tree, &pose, &unused))
                near = middle;
            else
                far = middle;
        }
        t->poses[0][made] = t->poses[1][made] = start;
        t->poses[0][made].shift = v3_mad(start.shift, near * diagonal, way);
        t->poses[1][made++].shift = v3_mad(start.shift, far * diagonal, way);
    }
    t->counts[2] = t->counts[3] = made;
}

static void ask(const box_tree *tree, const tests *t, int query, int repeat, figure *f) {
    f->visits = (box_visits){0, 0};
    f->sum = 0, f->found = 0;
    double start = bench_seconds();
    for (size_t i = 0; i < t->counts[query]; ++i)
        if (query < 2) {
            const ray *r = &t->rays[query][i];
            double at = box_tree_ray(tree, r->origin, r->direction, &f->visits);
            if (at < INFINITY) f->sum += at, ++f->found;
        } else
            f->found += box_tree_touches(tree, &t->poses[query - 2][i], &f->visits);
    f->seconds[repeat] = bench_seconds() - start;
}

/* --- The report --- */

static int compare(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static void say_tree(const char *name, const box_tree *tree, double diagonal, const tests *t,
                     figure figures[QUERIES], int repeats) {
    printf("\"%s\": {\"seconds\": %.6g, \"area\": %.6g, \"depth\": %u", name, tree->seconds,
           box_tree_area(tree, diagonal), box_tree_depth(tree));
    for (int q = 0; q < QUERIES; ++q) {
        figure *f = &figures[q];
        double count = t->counts[q] > 0 ? (double)t->counts[q] : 1;
        qsort(f->seconds, (size_t)repeats, sizeof *f->seconds, compare);
        printf(", \"%s\": {\"boxes\": %.6g, \"triangles\": %.6g, \"microseconds\": %.6g}", query_names[q],
               (double)f->visits.boxes / count, (double)f->visits.triangles / count,
               1e6 * f->seconds[repeats / 2] / count);
    }
    printf("}");
}

int main(int argc, char **argv) {
    if (argc < 2 || argc > 3) bench_fail("usage: boxes MESH [REPEATS]");
    int repeats = argc == 3 ? (int)bench_count(argv[2], "REPEATS") : 5;
    if (repeats < 1 || repeats > MOST_REPEATS) bench_fail("expected 1 to %d repeats", MOST_REPEATS);
    fct_env env = bench_env(2);
    fct_mesh mesh;
    box_tree trees[TREES];
    static figure figures[TREES][QUERIES];
    bench_load(&env, argv[1], &mesh);
    double diagonal = bench_diagonal(&mesh);
    make_trees(&env, &mesh, trees);
    tests t = {.counts = {(size_t)GRID * GRID, RAYS, POSES, POSES}};
    for (int i = 0; i < 2; ++i) {
        t.rays[i] = bench_allocate(t.counts[i], sizeof *t.rays[i]);
        t.poses[i] = bench_allocate(POSES, sizeof *t.poses[i]);
    }
    make_rays(&mesh, diagonal, &t);
    make_poses(&trees[3], diagonal, &t);
    for (int i = 0; i < TREES; ++i) {
        uint64_t escaped = box_tree_escaped(&trees[i], diagonal);
        if (escaped)
            bench_fail("%s: %llu corners outside their boxes", tree_names[i], (unsigned long long)escaped);
    }
    for (int r = 0; r < repeats; ++r)
        for (int q = 0; q < QUERIES; ++q)
            for (int i = 0; i < TREES; ++i) ask(&trees[i], &t, q, r, &figures[i][q]);
    for (int q = 0; q < QUERIES; ++q)
        for (int i = 1; i < TREES; ++i)
            if (figures[i][q].found != figures[0][q].found || figures[i][q].sum != figures[0][q].sum)
                bench_fail("%s and %s differ on %s queries: %zu, %zu found", tree_names[0], tree_names[i],
                           query_names[q], figures[0][q].found, figures[i][q].found);
    printf("{\"faces\": %u, \"poses\": %zu, \"hits\": [%zu, %zu], ", mesh.face_count, t.counts[2],
           figures[0][0].found, figures[0][1].found);
    for (int i = 0; i < TREES; ++i) {
        if (i > 0) printf(", ");
        say_tree(tree_names[i], &trees[i], diagonal, &t, figures[i], repeats);
        box_tree_release(&trees[i]);
    }
    puts("}");
    for (int i = 0; i < 2; ++i) free(t.rays[i]), free(t.poses[i]);
    fct_mesh_release(&env, &mesh);
    return 0;
}
