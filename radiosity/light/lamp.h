/* radiosity/light/lamp.h: direct light of the scene's emitting instances at a point.
 *
 * A lamp is one instance whose material emits. Its irradiance is that of the whole surface without blockers,
 * times the visible fraction. The first factor comes from lamp_cut.h: Lambert's formula for near triangles,
 * area vectors for far clusters. Stratified shadow rays measure the second. Cost: O(log F) nodes per lamp,
 * and the rays.
 */
#ifndef FCT_RADIOSITY_LAMP_H
#define FCT_RADIOSITY_LAMP_H

#include "facetree/scene.h"

typedef struct fct_lamps fct_lamps;

/* The scene must be committed, and must outlive the lamps. A scene without emitters is valid. Errors: MEMORY,
 * CANCELLED. */
fct_result fct_lamps_create(const fct_env *env, const fct_scene *scene, fct_lamps **out);
void fct_lamps_destroy(fct_lamps *lamps);

/* Number of lamps. */
uint32_t fct_lamps_count(const fct_lamps *lamps);
/* True if fct_lamps_direct brings the direct light of this instance. False for an instance that does not
 * emit, and for a bent emitter of more than a quarter of the scene's area: gather rays find such an emitter
 * with less noise. */
bool fct_lamps_sampled(const fct_lamps *lamps, uint32_t instance);

/* Added to base_rays: send exactly base_rays rays. A search that stops when its rays agree is biased; the
 * mean over many receivers must not be. */
#define FCT_LAMPS_FIXED 0x80000000u

/* What shadow rays to the lamps met: bit k is for the lamps whose numbers are k modulo 31, bit 31 for the
 * minor lamps, which share their rays. */
typedef struct fct_sight {
    uint32_t open, blocked; /* some ray reached the lamp; something blocked some ray */
    float variance;         /* of the light that the rays gave, summed over channels; 0 if they agree */
} fct_sight;
static inline uint32_t fct_sight_mixed(fct_sight s) {
    return s.open & s.blocked;
}

/* What a receiver wants to know of its lamps. */
typedef struct fct_lamp_goal {
    double other; /* its light from elsewhere, summed over channels. It hides the noise of the lamps' light */
    double slack; /* factor on the wanted standard error */
    uint32_t doubt; /* lamps in doubt, as in fct_sight; 0 in a first call */
} fct_lamp_goal;

/* Irradiance (RGB) of all lamps at a point with a unit normal, without blockers. */
void fct_lamps_unoccluded(const fct_lamps *lamps, const double point[3], const double normal[3],
                          double irradiance[3]);
/* The same with shadows. Rays start at point + offset * normal. Each lamp receives base_rays rays (0: no
 * shadows). Where they disagree, more follow, up to 64, until the standard error of its light is 2 % /
 * base_rays * slack of the receiver's light. Without a goal (NULL) nothing is in doubt, slack is 1, and the
 * lamps alone are the receiver's light. Minor lamps share their rays. Equal values of item_seed give equal
 * rays. *rays (may be NULL) grows by the number of rays. Any number of threads may call. Returns the visible
 * fraction over all lamps, weighted by their light; 0 if no lamp lies above the horizon.
 *
 * Few rays may agree by chance and miss a thin shadow. Neighbours tell: *sight (may be NULL) receives what
 * the rays met. If the sights of a receiver and its neighbours together are mixed for a lamp, and the
 * receiver's own sight is not, call again with these lamps in doubt, the same seed, and irradiance and *sight
 * as the first call left them: these lamps get up to 32 rays at first, and irradiance and *sight change as if
 * the first call had sent these. Other lamps get no ray, and no ray is sent twice to a major lamp. */
double fct_lamps_direct(const fct_lamps *lamps, const fct_scene *scene, const double point[3],
                        const double normal[3], double offset, uint64_t item_seed, uint32_t base_rays,
                        const fct_lamp_goal *goal, fct_sight *sight, double irradiance[3], uint64_t *rays);
/* An unbiased estimate of the same from at most one shadow ray, to a lamp chosen in proportion to its
 * estimated light. Every lamp is estimated in O(1), so the cost grows with their number: 40 lamps take
 * .9 us in all. *rays grows. */
void fct_lamps_sample(const fct_lamps *lamps, const fct_scene *scene, const double point[3],
                      const double normal[3], double offset, uint64_t seed, double irradiance[3],
                      uint64_t *rays);

#endif
