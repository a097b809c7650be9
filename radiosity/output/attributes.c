/* radiosity/output/attributes.c: see attributes.h. */
#include "radiosity/output/attributes.h"

#include <string.h>

#include "base/env.h"

#define KNOWN (FCT_MESH_IRRADIANCE | FCT_MESH_DIRECT | FCT_MESH_INDIRECT | FCT_MESH_NORMALS | FCT_MESH_ERROR)
#define PARTS (FCT_MESH_DIRECT | FCT_MESH_INDIRECT)

fct_result fct_attributes_check(const fct_env *env, const fct_bake_def *def) {
    if (def->outputs & ~(unsigned)KNOWN)
        return fct_fail(env, FCT_ERROR_DATA,
                        "outputs are irradiance, direct and indirect light, error and normals, found bits "
                        "%#x",
                        def->outputs);
    if (def->outputs & ~(unsigned)FCT_MESH_NORMALS && def->keep == FCT_KEEP_FACE)
        return fct_fail(env, FCT_ERROR_DATA, "faces have one colour, the radiosity; found other outputs");
    if (def->outputs & FCT_MESH_ERROR && (def->method == FCT_BAKE_REFERENCE || def->final == FCT_FINAL_NONE))
        return fct_fail(env, FCT_ERROR_DATA,
                        "the error of the light needs the method face with a final direct or gather");
    if (!(def->outputs & PARTS)) return FCT_OK;
    if (def->method == FCT_BAKE_REFERENCE)
        return fct_fail(env, FCT_ERROR_DATA,
                        "the reference does not tell direct from indirect light; it gives radiosity and "
                        "irradiance");
    if (def->final == FCT_FINAL_NONE)
        return fct_fail(env, FCT_ERROR_DATA,
                        "the solution as it is does not tell direct from indirect light; expected a final "
                        "direct or gather");
    if (def->indirect_only && def->outputs & FCT_MESH_DIRECT)
        return fct_fail(env, FCT_ERROR_DATA, "direct light is an output and is left out");
    return FCT_OK;
}

static fct_result add_copy(const fct_env *env, const float *values, size_t count, float **out) {
    *out = fct_allocate(env, count, sizeof **out);
    if (!*out) return fct_fail_memory(env, "the output");
    if (count) memcpy(*out, values, count * sizeof **out);
    return FCT_OK;
}

fct_result fct_attributes_add(const fct_env *env, unsigned outputs, const float *direct,
                              const float *indirect, fct_mesh *mesh) {
    const size_t count = 3 * (size_t)mesh->vertex_count;
    fct_result result = FCT_OK;
    if (outputs & FCT_MESH_IRRADIANCE) result = add_copy(env, indirect, count, &mesh->irradiance);
    if (result == FCT_OK && outputs & FCT_MESH_DIRECT) result = add_copy(env, direct, count, &mesh->direct);
    if (result == FCT_OK && outputs & FCT_MESH_INDIRECT)
        result = add_copy(env, indirect, count, &mesh->indirect);
    for (size_t i = 0; result == FCT_OK && mesh->irradiance && direct && i < count; ++i)
        mesh->irradiance[i] = (float)((double)direct[i] + (double)indirect[i]);
    return result;
}
