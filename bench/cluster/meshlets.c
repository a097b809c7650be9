/* bench/cluster/meshlets.c: times the flat clustering of Debian's meshoptimizer.
 *
 * usage: meshlets MESH
 * Meshlets have at most 64 vertices and 124 triangles, and no weight on cones: the usual arguments of
 * buildMeshlets. The time excludes the allocation of its output, but includes the first touch of the pages.
 */
#include <meshoptimizer.h>
#include <stdio.h>
#include <stdlib.h>

#include "bench/cluster/bench.h"

enum { VERTICES = 64, TRIANGLES = 124 };

int main(int argc, char **argv) {
    if (argc != 2) bench_fail("usage: meshlets MESH");
    fct_env env = bench_env(1);
    fct_mesh mesh;
    bench_load(&env, argv[1], &mesh);
    size_t corners = 3 * (size_t)mesh.face_count;
    size_t most = meshopt_buildMeshletsBound(corners, VERTICES, TRIANGLES);
    struct meshopt_Meshlet *meshlets = bench_allocate(most, sizeof *meshlets);
    unsigned int *vertices = bench_allocate(most, VERTICES * sizeof *vertices);
    unsigned char *triangles = bench_allocate(most, 3 * TRIANGLES);
    bench_memory before = bench_memory_start();
    double start = bench_seconds();
    size_t count =
        meshopt_buildMeshlets(meshlets, vertices, triangles, mesh.triangles, corners, mesh.positions,
                              mesh.vertex_count, 3 * sizeof(float), VERTICES, TRIANGLES, 0);
    double seconds = bench_seconds() - start;
    size_t grown = bench_memory_grown(before), placed = 0;
    for (size_t i = 0; i < count; ++i) placed += meshlets[i].triangle_count;
    if (placed != mesh.face_count) bench_fail("%zu of %u faces are in a meshlet", placed, mesh.face_count);
    printf("{\"faces\": %u, \"seconds\": %.6g, \"grown_bytes\": %zu, \"clusters\": %zu}\n", mesh.face_count,
           seconds, grown, count);
    free(meshlets);
    free(vertices);
    free(triangles);
    fct_mesh_release(&env, &mesh);
    return 0;
}
