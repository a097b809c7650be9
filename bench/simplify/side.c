/* bench/simplify/side.c: simplifies one mesh with one library, and prints time and memory.
 *
 * usage: bench_simplify_LIBRARY POLICY MESH FACES THREADS [OUT]
 * Time and memory are those of the library alone: the mesh is loaded and converted before, and written after.
 * A mesh that the library cannot hold gives {"refused": WHY}.
 */
#include "bench/simplify/side.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void bench_pick_vertices(const fct_env *env, const fct_mesh *mesh, const uint32_t *triangles,
                         uint32_t face_count, fct_mesh *out) {
    uint32_t *places = bench_allocate(mesh->vertex_count, sizeof *places), count = 0;
    for (size_t c = 0; c < 3 * (size_t)face_count; ++c)
        if (places[triangles[c]] == 0) places[triangles[c]] = ++count;
    bench_check(fct_mesh_create(env, count, face_count, mesh->colors ? FCT_MESH_COLORS : 0, out),
                "the result");
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        if (places[v] == 0) continue;
        size_t to = 3 * (size_t)(places[v] - 1);
        memcpy(out->positions + to, mesh->positions + 3 * v, 3 * sizeof(float));
        if (mesh->colors) memcpy(out->colors + to, mesh->colors + 3 * v, 3 * sizeof(float));
    }
    for (size_t c = 0; c < 3 * (size_t)face_count; ++c) out->triangles[c] = places[triangles[c]] - 1;
    free(places);
}

int main(int argc, char **argv) {
    if (argc < 5 || argc > 6)
        bench_fail("usage: %s POLICY MESH FACES THREADS [OUT]; policies: %s", argv[0],
                   bench_library.policies);
    uint32_t faces = bench_count(argv[3], "FACES"), threads = bench_count(argv[4], "THREADS");
    fct_env env = bench_env(2);
    fct_mesh mesh, result;
    bench_load(&env, argv[2], &mesh);
    const char *refused = NULL;
    void *model = bench_library.open(&mesh, argv[1], threads, &refused);
    if (!model) {
        if (!refused) bench_fail("unknown policy '%s', expected one of: %s", argv[1], bench_library.policies);
        printf("{\"faces\": %u, \"refused\": \"%s\"}\n", mesh.face_count, refused);
        return 0;
    }
    bench_memory before = bench_memory_start();
    double start = bench_seconds(), start_cpu = bench_cpu_seconds();
    bench_library.run(model, faces);
    double cpu = bench_cpu_seconds() - start_cpu, seconds = bench_seconds() - start;
    size_t grown = bench_memory_grown(before);
    bench_library.get(model, &env, &result);
    printf("{\"faces\": %u, \"reached\": %u, \"seconds\": %.6g, \"cpu\": %.6g, \"grown_bytes\": %zu}\n",
           mesh.face_count, result.face_count, seconds, cpu, grown);
    if (argc == 6) bench_save(&env, argv[5], &result);
    bench_library.close(model);
    fct_mesh_release(&env, &result);
    fct_mesh_release(&env, &mesh);
    return 0;
}
