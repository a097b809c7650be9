/* radiosity/output/near.h: the light that a ray brings from a surface close by.
 *
 * The stored light is one number per leaf. In the gap between a statue and its plinth this number is wrong,
 * because nearly all light of the plinth's leaf comes from outside the gap. So where a ray meets a leaf at a
 * distance that is short against the leaf's radius, the path goes on: the hit takes its light from one shadow
 * ray and from one cosine-distributed ray, whose hit may be near again. After
 * three near hits it takes the stored light. Cost: at most two rays per near hit.
 */
#ifndef FCT_RADIOSITY_NEAR_H
#define FCT_RADIOSITY_NEAR_H

#include "radiosity/light/lamp.h"
#include "radiosity/solve/guide.h"
#include "radiosity/solve/transport.h"

/* The stored solution that gather rays look up. */
typedef struct fct_source {
    const fct_elements *set;
    const fct_guides *guides; /* NULL: cosine-distributed rays alone */
    const float *stored;      /* as in fct_transport */
    double longest;           /* hits farther away, and misses, count as if at this distance; also the longest
                                 reach. One far hit makes no wall smooth */
    const fct_lamps *lamps;   /* for the light of near hits (near.h). NULL: stored light alone */
} fct_source;

/* The radiosity at the hit of a ray, without the emission of lamps. Without source->lamps it is the stored
 * one. *rays grows by the rays after the first one. */
void fct_near_light(const fct_source *source, const fct_found *found, const float origin[3],
                    const float direction[3], uint64_t seed, double radiosity[3], uint64_t *rays);

#endif
