/* radiosity/solve/paint.c: see paint.h. */
#include "radiosity/solve/paint.h"

#include <string.h>

#include "base/env.h"
#include "base/math/barycentric.h"
#include "scene/texture/reflectance.h"

/* Samples per quarter. Small triangles have fewer texels; on large ones, levels of the texture serve. */
enum { QUARTER_SAMPLES = 1 << 14 };

/* next[i]: the next instance with the model of instance i that has means of its own; heads: per model. */
static fct_result share_means(fct_paints *paints, uint32_t *heads, uint32_t *next) {
    const fct_scene_view view = fct_scene_get(paints->scene);
    for (uint32_t m = 0; m < view.model_count; ++m) heads[m] = FCT_NONE;
    for (uint32_t i = 0; i < view.instance_count; ++i) {
        if (!fct_scene_is_painted(paints->scene, i)) continue;
        uint32_t *head = &heads[view.instances[i].model], same = *head;
        while (same != FCT_NONE && view.instances[same].material != view.instances[i].material)
            same = next[same];
        if (same == FCT_NONE) {
            fct_result result =
                fct_reflectance_of_nodes(paints->env, paints->scene, i, &paints->owned[paints->owned_count]);
            if (result != FCT_OK) return result;
            paints->means[i] = paints->owned[paints->owned_count++];
            next[i] = *head, *head = i;
        } else {
            paints->means[i] = paints->means[same];
        }
    }
    return FCT_OK;
}

fct_result fct_paints_create(const fct_env *env, const fct_scene *scene, fct_paints *out) {
    const fct_scene_view view = fct_scene_get(scene);
    uint32_t *heads, *next;
    *out = (fct_paints){.env = env, .scene = scene};
    const fct_array kept[] = {FCT_ARRAY_ZERO(out->means, view.instance_count),
                              FCT_ARRAY_ZERO(out->owned, view.instance_count)};
    const fct_array arrays[] = {FCT_ARRAY(heads, view.model_count), FCT_ARRAY(next, view.instance_count)};
    fct_result result = fct_allocate_all(env, kept, FCT_LENGTH(kept), "reflectances");
    if (result == FCT_OK) result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "reflectances");
    if (result != FCT_OK) return result;
    result = share_means(out, heads, next);
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    return result;
}

void fct_paints_release(fct_paints *paints) {
    for (uint32_t k = 0; k < paints->owned_count; ++k) fct_release(paints->env, paints->owned[k]);
    if (paints->env) fct_release(paints->env, paints->owned), fct_release(paints->env, paints->means);
    *paints = (fct_paints){0};
}

void fct_paints_node(const fct_paints *paints, uint32_t instance, uint32_t node, float out[3]) {
    const fct_scene_view view = fct_scene_get(paints->scene);
    const float *means = paints->means[instance];
    memcpy(out,
           means ? means + 3 * (size_t)node : view.materials[view.instances[instance].material].reflectance,
           3 * sizeof *out);
}

void fct_paints_quarters(const fct_paints *paints, uint32_t instance, uint32_t place, const v3 face[3],
                         const v3 parts[4][3], const float whole[3], float out[4][3]) {
    double means[4][3], sum[3] = {0, 0, 0};
    for (int k = 0; k < 4; ++k) memcpy(out[k], whole, 3 * sizeof *whole);
    if (!paints->means[instance]) return;
    for (int k = 0; k < 4; ++k) {
        double corners[3][2];
        for (int c = 0; c < 3; ++c) fct_barycentrics(face, parts[k][c], corners[c]);
        fct_reflectance_of_triangle(paints->scene, instance, place, corners, QUARTER_SAMPLES, means[k]);
        for (int c = 0; c < 3; ++c) sum[c] += means[k][c];
    }
    for (int k = 0; k < 4; ++k)
        for (int c = 0; c < 3; ++c)
            if (sum[c] > 0) out[k][c] = (float)(means[k][c] * (4 * (double)whole[c] / sum[c]));
}
