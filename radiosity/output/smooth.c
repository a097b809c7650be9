/* radiosity/output/smooth.c: see smooth.h. */
#include "radiosity/output/smooth.h"

#include <math.h>
#include <string.h>

#include "base/env.h"

/* Difference of two neighbours over the sum of their light that may be noise of the rays. Larger values blur
 * contacts, smaller ones leave the noise of anchors that are close together. */
#define NOISE .1
/* Passes: each reaches one edge further. */
enum { PASSES = 2 };

/* Adds the light of vertex b to the sum of vertex a (light and weight). */
static void add_neighbour(const fct_surface *f, const float *light, uint32_t a, uint32_t b, float *sums) {
    const float *x = light + 3 * (size_t)a, *y = light + 3 * (size_t)b;
    double difference = 0, level = 0;
    for (int c = 0; c < 3; ++c) difference += fabs((double)x[c] - y[c]), level += (double)x[c] + y[c];
    double apart = level > 0 ? difference / (level * NOISE) : 0;
    if (apart >= 1 || !f->flat[a] || !f->flat[b]) return;
    float weight = (float)((1 - apart * apart) * (1 - apart * apart));
    for (int c = 0; c < 3; ++c) sums[4 * (size_t)a + (size_t)c] += weight * y[c];
    sums[4 * (size_t)a + 3] += weight;
}

fct_result fct_light_smooth(const fct_env *env, const fct_surface *f, const uint8_t *covered, float *light) {
    const fct_mesh *m = &f->mesh;
    float *sums = fct_allocate(env, 4 * (size_t)m->vertex_count, sizeof *sums);
    if (!sums) return fct_fail_memory(env, "the output");
    for (int pass = 0; pass < PASSES; ++pass) {
        memset(sums, 0, 4 * (size_t)m->vertex_count * sizeof *sums);
        for (size_t i = 0; i < m->face_count; ++i)
            for (int k = 0; k < 3; ++k) {
                uint32_t a = m->triangles[3 * i + (size_t)k], b = m->triangles[3 * i + (size_t)(k + 1) % 3];
                if (covered[a] || covered[b]) continue;
                add_neighbour(f, light, a, b, sums);
                add_neighbour(f, light, b, a, sums);
            }
        for (size_t v = 0; v < m->vertex_count; ++v)
            for (int c = 0; c < 3; ++c)
                light[3 * v + (size_t)c] =
                    (light[3 * v + (size_t)c] + sums[4 * v + (size_t)c]) / (1 + sums[4 * v + 3]);
    }
    fct_release(env, sums);
    return FCT_OK;
}
