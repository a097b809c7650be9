/* bench/simplify/judge.c: compares simplified meshes with the original: distances, colours, defects.
 *
 * usage: bench_simplify_judge SAMPLES BUDGET ORIGINAL RESULT...
 * Prints one JSON line per result. Each face gets SAMPLES random points, or fewer if both meshes together
 * would get more than BUDGET, but at least one. e_avg is divided by the squared diagonal of the original,
 * e_max and drift by the diagonal. Each defect has three counts: all of the result, all of the original, and
 * those of the result that the original does not have nearby. drift is -1 if only one of the meshes has
 * borders.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "bench/simplify/defects.h"
#include "facetree/bvh.h"

enum { SEED = 1 };

typedef struct subject {
    fct_mesh mesh;
    fct_tree *tree;
    fct_bvh *bvh;
    bench_places places;
} subject;

static void load_subject(const fct_env *env, const char *path, subject *s) {
    *s = (subject){0};
    bench_check(fct_mesh_load(env, path, &s->mesh), path);
    s->places = bench_find_defects(&s->mesh);
    if (s->mesh.face_count == 0) return;
    fct_tree_def def = fct_tree_def_default();
    bench_check(fct_tree_build(env, &s->mesh, &def, NULL, &s->tree), path);
    bench_check(fct_bvh_create(env, s->tree, FCT_BACKEND_OBB, &s->bvh), path);
}

static void free_subject(const fct_env *env, subject *s) {
    fct_bvh_destroy(s->bvh);
    fct_tree_destroy(s->tree);
    bench_free_places(&s->places);
    fct_mesh_release(env, &s->mesh);
}

static void print_errors(const fct_env *env, const subject *original, const subject *result,
                         uint32_t samples) {
    fct_mesh_error e;
    bench_check(fct_mesh_compare(env, original->bvh, result->bvh, samples, SEED, &e), "fct_mesh_compare");
    double d = e.diameter > 0 ? e.diameter : 1;
    printf(", \"samples\": %u, \"e_avg\": %.6g, \"e_max\": %.6g", samples, e.e_avg / (d * d), e.e_max / d);
    if (original->mesh.colors && result->mesh.colors)
        printf(", \"color_rms\": %.6g, \"color_relative\": %.6g", e.color_rms, e.color_rms_relative);
}

static void judge(const fct_env *env, const subject *original, const subject *result, uint32_t samples,
                  uint64_t budget) {
    static const char *const names[BENCH_DEFECTS] = {"duplicates", "flat", "folds", "nonmanifold", "borders"};
    printf("{\"faces\": %u", result->mesh.face_count);
    uint64_t each = budget / ((uint64_t)original->mesh.face_count + result->mesh.face_count + 1);
    if (each < samples) samples = each < 1 ? 1 : (uint32_t)each;
    if (result->bvh) print_errors(env, original, result, samples);
    for (int kind = 0; kind < BENCH_DEFECTS; ++kind)
        printf(", \"%s\": %u, \"input_%s\": %u, \"new_%s\": %u", names[kind], result->places.count[kind],
               names[kind], original->places.count[kind], names[kind],
               bench_count_new(env, &original->mesh, &original->places, &result->mesh, &result->places,
                               (bench_defect)kind));
    double drift =
        bench_border_drift(env, &original->mesh, &original->places, &result->mesh, &result->places);
    printf(", \"drift\": %.6g}\n", isinf(drift) ? -1 : drift / bench_diagonal(&original->mesh));
}

int main(int argc, char **argv) {
    if (argc < 5) bench_fail("usage: %s SAMPLES BUDGET ORIGINAL RESULT...", argv[0]);
    uint32_t samples = bench_count(argv[1], "SAMPLES"), budget = bench_count(argv[2], "BUDGET");
    fct_env env = bench_env(2);
    subject original, result;
    load_subject(&env, argv[3], &original);
    if (!original.bvh) bench_fail("%s: a mesh without faces", argv[3]);
    for (int i = 4; i < argc; ++i) {
        load_subject(&env, argv[i], &result);
        judge(&env, &original, &result, samples, budget);
        free_subject(&env, &result);
    }
    free_subject(&env, &original);
    return 0;
}
