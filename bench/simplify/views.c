/* bench/simplify/views.c: view-dependent meshes: seconds of the hierarchy, of a cut and of its mesh, for an
 * eye that circles around the middle of a mesh.
 *
 * usage: views MESH [FACES [TOLERANCE [DEGREES]]], FACES of the base mesh (default 200), TOLERANCE in pixels
 * of a picture of 1280 x 800 (default 1), DEGREES of each move (default 1). The eye is 1.2 diagonals away.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "bench/cluster/bench.h"
#include "facetree/progressive.h"

enum { MOVES = 360 };

typedef struct sums {
    double faces, splits, forced, changes, tested, cut, mesh;
} sums;

/* Looks at the middle from an angle; a third of the way up. */
static void aim_view(const fct_mesh_report *report, const double origin[3], double angle, fct_view *view) {
    const double towards[3] = {cos(angle), .33, sin(angle)};
    for (int k = 0; k < 3; ++k) {
        double middle = .5 * ((double)report->bounds.lower[k] + (double)report->bounds.upper[k]) + origin[k];
        view->target[k] = middle;
        view->position[k] = middle + 1.2 * report->diagonal * towards[k];
    }
}

static void add_view(const fct_env *env, fct_progressive *progressive, const fct_view *view, sums *sum,
                     double *hierarchy) {
    fct_mesh mesh;
    fct_view_stats stats;
    double start = bench_cpu_seconds();
    bench_check(fct_progressive_view(progressive, view, &mesh, &stats), "a view");
    double all = bench_cpu_seconds() - start;
    fct_mesh_release(env, &mesh);
    if (stats.seconds_hierarchy > .5 * all) {
        *hierarchy = all; /* the first one, whose cut takes far less */
        return;
    }
    /* The share of each part is that of the clock. */
    double clock = stats.seconds_cut + stats.seconds_mesh;
    sum->cut += all * stats.seconds_cut / clock, sum->mesh += all * stats.seconds_mesh / clock;
    sum->faces += stats.faces, sum->splits += stats.splits, sum->forced += stats.forced;
    sum->changes += stats.done + stats.undone, sum->tested += stats.tested;
}

int main(int argc, char **argv) {
    if (argc < 2 || argc > 5) bench_fail("usage: views MESH [FACES [TOLERANCE [DEGREES]]]");
    fct_env env = bench_env(0);
    fct_mesh mesh, simple;
    fct_mesh_report report;
    fct_progressive *progressive;
    bench_load(&env, argv[1], &mesh);
    bench_check(fct_mesh_inspect(&env, &mesh, &report), "a report");
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = argc > 2 ? bench_count(argv[2], "faces") : 200;
    bench_check(fct_simplify_progressive(&env, &mesh, &def, &simple, NULL, &progressive),
                "a progressive mesh");
    fct_view view = fct_view_default();
    view.tolerance = argc > 3 ? atof(argv[3]) : 1;
    view.silhouette_tolerance = .5 * view.tolerance;
    double degrees = argc > 4 ? atof(argv[4]) : 1, hierarchy = 0;
    sums sum = {0};
    for (int i = 0; i <= MOVES; ++i) {
        aim_view(&report, mesh.origin, i * degrees * 3.14159265358979 / 180, &view);
        add_view(&env, progressive, &view, &sum, &hierarchy);
    }
    printf(
        "{\"faces\": %u, \"hierarchy\": %.4f, \"view_faces\": %.0f, \"splits\": %.0f, \"forced\": %.0f, "
        "\"changes\": %.0f, \"tested\": %.0f, \"cut\": %.7f, \"mesh\": %.7f, \"faces_per_second\": %.0f}\n",
        mesh.face_count, hierarchy, sum.faces / MOVES, sum.splits / MOVES, sum.forced / MOVES,
        sum.changes / MOVES, sum.tested / MOVES, sum.cut / MOVES, sum.mesh / MOVES,
        sum.faces / (sum.cut + sum.mesh));
    fct_progressive_destroy(progressive);
    fct_mesh_release(&env, &simple);
    fct_mesh_release(&env, &mesh);
    return 0;
}
