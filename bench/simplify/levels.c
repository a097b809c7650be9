/* bench/simplify/levels.c: progressive meshes: splits per second, sizes of files, and seconds for a change of
 * the resolution.
 *
 * usage: levels MESH [FACES], FACES of the base mesh: default 200.
 * Goes from the coarsest level to the finest and back, 100 times or for a second, as Fahn, Chen and Shiau do
 * for table 1 of "Polygonal Mesh Simplification with Face Color and Boundary Edge Preservation Using Quadric
 * Error Metric".
 */
#include <stdio.h>
#include <sys/stat.h>

#include "bench/cluster/bench.h"
#include "facetree/progressive.h"

enum { CHANGES = 100 };
#define FILE_NAME "levels.fpm"
#define PLY_NAME  "levels.ply"

static double find_size(const char *path) {
    struct stat status;
    if (stat(path, &status)) bench_fail("%s: no such file", path);
    return (double)status.st_size;
}

/* Seconds per mesh of a level. */
static double time_mesh(const fct_env *env, fct_progressive *progressive, uint32_t faces) {
    fct_mesh mesh;
    fct_progressive_go(progressive, faces);
    int count = 0;
    double start = bench_cpu_seconds(), end;
    do {
        bench_check(fct_progressive_mesh(progressive, &mesh), "a level");
        fct_mesh_release(env, &mesh);
        ++count, end = bench_cpu_seconds();
    } while (end - start < .2);
    return (end - start) / count;
}

int main(int argc, char **argv) {
    if (argc < 2 || argc > 3) bench_fail("usage: levels MESH [FACES]");
    fct_env env = bench_env(0);
    fct_mesh mesh, simple;
    bench_load(&env, argv[1], &mesh);
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = argc > 2 ? bench_count(argv[2], "faces") : 200;
    fct_progressive *progressive, *loaded;
    double start = bench_cpu_seconds();
    bench_check(fct_simplify(&env, &mesh, &def, &simple, NULL), "a simplification");
    double simplified = bench_cpu_seconds() - start;
    fct_mesh_release(&env, &simple);
    start = bench_cpu_seconds();
    bench_check(fct_simplify_progressive(&env, &mesh, &def, &simple, NULL, &progressive),
                "a progressive mesh");
    double made = bench_cpu_seconds() - start;
    start = bench_cpu_seconds();
    bench_check(fct_progressive_save(progressive, FILE_NAME), "a file");
    double saved = bench_cpu_seconds() - start;
    start = bench_cpu_seconds();
    bench_check(fct_progressive_load(&env, FILE_NAME, &loaded), "a file");
    double read = bench_cpu_seconds() - start;
    bench_save(&env, PLY_NAME, &mesh);
    fct_progressive_info info;
    fct_progressive_inspect(loaded, &info);
    double forward = 0, backward = 0;
    int changes = 0;
    for (; changes < CHANGES && (changes < 5 || forward + backward < 1); ++changes) {
        double begin = bench_cpu_seconds();
        fct_progressive_go(loaded, FCT_NONE);
        double middle = bench_cpu_seconds();
        fct_progressive_go(loaded, 0);
        forward += middle - begin, backward += bench_cpu_seconds() - middle;
    }
    double splits = (double)info.split_count * changes;
    printf("{\"faces\": %u, \"splits\": %u, \"bytes\": %.0f, \"ply_bytes\": %.0f, \"simplify\": %.4f, "
           "\"simplify_progressive\": %.4f, \"save\": %.4f, \"load\": %.4f, \"splits_per_second\": %.0f, "
           "\"contractions_per_second\": %.0f, \"change\": %.6f, \"mesh_1000\": %.7f, \"mesh_all\": %.7f}\n",
           info.most_faces, info.split_count, find_size(FILE_NAME), find_size(PLY_NAME), simplified, made,
           saved, read, splits / forward, splits / backward, (forward + backward) / 2 / changes,
           time_mesh(&env, loaded, 1000), time_mesh(&env, loaded, FCT_NONE));
    remove(FILE_NAME), remove(PLY_NAME);
    fct_progressive_destroy(progressive);
    fct_progressive_destroy(loaded);
    fct_mesh_release(&env, &simple);
    fct_mesh_release(&env, &mesh);
    return 0;
}
