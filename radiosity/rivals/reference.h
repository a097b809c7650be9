/* radiosity/rivals/reference.h: unbiased irradiance at points by path tracing, to measure the solver against.
 */
#ifndef FCT_RADIOSITY_REFERENCE_H
#define FCT_RADIOSITY_REFERENCE_H

#include "facetree/scene.h"

/* Irradiance (count x 3) at points with normals (count x 3 each), as the mean of `samples` paths per point.
 * Rays start at point + offset * normal; offsets NULL: a few units in the last place of the coordinates.
 * indirect_only leaves out light that comes straight from emitters. Different seeds give independent
 * estimates; the number of threads does not change a bit. lost (count, may be NULL): the share of the first
 * rays that leave the scene or end on a black back. *rays (may be NULL) grows by the rays traced. Errors:
 * MEMORY, CANCELLED. */
fct_result fct_reference_estimate(const fct_env *env, const fct_scene *scene, size_t count,
                                  const float *points, const float *normals, const float *offsets,
                                  uint32_t samples, uint64_t seed, bool indirect_only, float *irradiance,
                                  float *lost, uint64_t *rays);

#endif
