/* radiosity/solve/transport.h: the stored solution, gathered by rays over the surface of each leaf element.
 *
 * Input: the elements that the links chose, with the links' solution as a start. Each leaf takes its direct
 * light D_i from the lamps at four of its points and sends cosine-distributed rays from points all over its
 * surface. The hits stay in memory, so the iteration of E_i = (D_i + mean of b over the hits) / O_i needs no
 * further ray. O_i is the open part of the leaf: rays that meet a black back close by start on a part that
 * another body covers. Rows sum to at most 1 for any mesh, because each ray counts one hit or none; so a
 * furnace is exact. Cost: leaves x rays, and up to eight short rays for each that meets a black back.
 */
#ifndef FCT_RADIOSITY_TRANSPORT_H
#define FCT_RADIOSITY_TRANSPORT_H

#include "radiosity/light/lamp.h"
#include "radiosity/solve/element.h"

typedef struct fct_transport {
    float *stored;  /* per element x 3: radiosity that a gather ray finds; without the emission of lamps,
                       because shadow rays bring that */
    double *direct; /* per element x 3: mean direct irradiance of a leaf, also over its covered part */
    uint64_t rays;
    uint32_t sweeps;
    double change; /* of the last sweep, relative to the solution */
    bool converged;
    double noise; /* half the RMS difference between the leaves' irradiances from the first and from the
                     second half of the rays, over the RMS irradiance; area-weighted */
    double emitted, absorbed, escaped; /* power, summed over channels; escaped: carried out by rays */
} fct_transport;

typedef struct fct_transport_def {
    uint64_t seed;
    double epsilon;   /* power; a leaf whose direct light varies by more (fct_direct_spread) is split */
    double tolerance; /* of the iteration */
    double fineness;  /* factor on the number of rays per leaf */
} fct_transport_def;

/* Splits bent leaves and leaves on shadow borders, gathers, and solves. Afterwards the radiosities in `set`
 * are the solution. Errors: MEMORY, CANCELLED. */
fct_result fct_transport_solve(fct_elements *set, const fct_lamps *lamps, const fct_transport_def *def,
                               fct_transport *out);
void fct_transport_release(const fct_env *env, fct_transport *t);

/* The hit of a ray, as light. */
typedef struct fct_found {
    const float *radiosity; /* 3 floats, never NULL */
    uint32_t leaf;          /* FCT_NONE: no hit, or a black back */
    double distance;        /* infinity on a miss */
    double cosine;          /* of the hit surface's normal with the way back */
    bool black;             /* the back of a one-sided material */
    v3 normal;              /* unit, of the hit surface, on the ray's side; with a leaf only */
} fct_found;
/* Traces a ray and looks up the stored radiosity of the leaf that it hits. */
fct_found fct_transport_look(const fct_elements *set, const float *stored, const float origin[3],
                             const float direction[3]);

#endif
