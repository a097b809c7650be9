/* radiosity/light/lamp.h: direct light of the scene's emitting instances at a point.
 *
 * A lamp is the surface of one instance whose material emits. Its light at a receiver is the irradiance of
 * the whole surface without blockers (Lambert's polygon formula for triangles near by, area vectors of
 * clusters farther off) times the visible fraction, which stratified shadow rays find. Cost: O(log F) nodes a
 * lamp beside the rays.
 */
#ifndef FCT_RADIOSITY_LAMP_H
#define FCT_RADIOSITY_LAMP_H

#include "facetree/scene.h"

typedef struct fct_lamps fct_lamps;

/* The scene must be committed and outlive the lamps. A scene without light is valid. Errors: MEMORY,
 * CANCELLED. */
fct_result fct_lamps_create(const fct_env *env, const fct_scene *scene, fct_lamps **out);
void fct_lamps_destroy(fct_lamps *lamps);

/* Lamps that shadow rays are sent to. */
uint32_t fct_lamps_count(const fct_lamps *lamps);
/* Whether the direct light of this instance comes from fct_lamps_direct. False for what does not emit and for
 * an emitter of more than a quarter of the scene's area that is not flat, which gather rays see better. */
bool fct_lamps_sampled(const fct_lamps *lamps, uint32_t instance);

/* Added to base_rays: exactly so many, so that the mean over many receivers is not biased by when the search
 * stops. */
#define FCT_LAMPS_FIXED 0x80000000u

/* Irradiance (RGB) of all lamps at the point with unit normal as though nothing blocked the way. */
void fct_lamps_unoccluded(const fct_lamps *lamps, const double point[3], const double normal[3],
                          double irradiance[3]);
/* The same with shadows. Rays start at point + offset * normal; for each lamp base_rays (4 is good) are sent,
 * 16 where they disagree, up to 64 where what is uncertain is a large part of the light; lamps that together
 * matter little share their rays. item_seed names the receiver: equal seeds give equal rays. *rays (may be
 * NULL) grows by the rays sent. base_rays 0: as fct_lamps_unoccluded. Any number of threads at once. Returns
 * the visible fraction, over all lamps by power; 0 where no lamp shines, hidden or not. Four rays that agree
 * by chance stop the search: send 16 where the fraction differs from a neighbour's. */
double fct_lamps_direct(const fct_lamps *lamps, const fct_scene *scene, const double point[3],
                        const double normal[3], double offset, uint64_t item_seed, uint32_t base_rays,
                        double irradiance[3], uint64_t *rays);

#endif
