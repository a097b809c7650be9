/* bench/simplify/meshopt.c: meshopt_simplify of Debian's meshoptimizer 0.18, without a limit on the error.
 *
 * This version has no attributes: colours do not count, but vertices keep theirs, because the result uses
 * vertices of the input. The policy is default.
 */
#include <meshoptimizer.h>
#include <stdlib.h>
#include <string.h>

#include "bench/simplify/side.h"

/* Relative to the extent of the mesh; its square is finite in float. */
#define NO_LIMIT 1e18f

typedef struct model {
    const fct_mesh *mesh;
    uint32_t *triangles;
    size_t corners;
} model;

static void *open_model(const fct_mesh *mesh, const char *policy, uint32_t threads, const char **refused) {
    (void)threads;
    (void)refused;
    if (strcmp(policy, "default") != 0) return NULL;
    model *m = bench_allocate(1, sizeof *m);
    *m = (model){mesh, bench_allocate(mesh->face_count, 3 * sizeof(uint32_t)), 0};
    return m;
}

static void run_model(void *user, uint32_t faces) {
    model *m = user;
    m->corners = meshopt_simplify(m->triangles, m->mesh->triangles, 3 * (size_t)m->mesh->face_count,
                                  m->mesh->positions, m->mesh->vertex_count, 3 * sizeof(float),
                                  3 * (size_t)faces, NO_LIMIT, 0, NULL);
}

static void get_result(void *user, const fct_env *env, fct_mesh *out) {
    model *m = user;
    bench_pick_vertices(env, m->mesh, m->triangles, (uint32_t)(m->corners / 3), out);
}

static void close_model(void *user) {
    model *m = user;
    free(m->triangles);
    free(m);
}

const bench_side bench_library = {"default", open_model, run_model, get_result, close_model};
