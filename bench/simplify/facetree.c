/* bench/simplify/facetree.c: our simplifier.
 *
 * Policies: default; shape, in which colours, texture coordinates and normals do not count; norefit, which
 * only contracts edges, with optimal placement; subset.
 */
#include <stdlib.h>
#include <string.h>

#include "bench/simplify/side.h"
#include "facetree/simplify.h"

typedef struct model {
    const fct_mesh *mesh;
    fct_env env;
    fct_simplify_def def;
    fct_mesh result;
} model;

static void *open_model(const fct_mesh *mesh, const char *policy, uint32_t threads, const char **refused) {
    (void)refused;
    fct_simplify_def def = fct_simplify_def_default();
    if (!strcmp(policy, "shape"))
        def.color_weight = def.texcoord_weight = def.normal_weight = 0;
    else if (!strcmp(policy, "norefit"))
        def.refit_passes = 0;
    else if (!strcmp(policy, "subset"))
        def.placement = FCT_PLACE_SUBSET;
    else if (strcmp(policy, "default") != 0)
        return NULL;
    model *m = bench_allocate(1, sizeof *m);
    *m = (model){.mesh = mesh, .env = bench_env(threads), .def = def};
    return m;
}

static void run_model(void *user, uint32_t faces) {
    model *m = user;
    m->def.target_faces = faces;
    bench_check(fct_simplify(&m->env, m->mesh, &m->def, &m->result, NULL), "fct_simplify");
}

static void get_result(void *user, const fct_env *env, fct_mesh *out) {
    model *m = user;
    bench_check(fct_mesh_copy(env, &m->result, out), "a copy of the result");
}

static void close_model(void *user) {
    model *m = user;
    fct_mesh_release(&m->env, &m->result);
    free(m);
}

const bench_side bench_library = {"default, shape, norefit, subset", open_model, run_model, get_result,
                                  close_model};
