/* radiosity/solve/transport.h: the stored solution made exact in the mean: each leaf element gathers over its
 * own surface by rays.
 *
 * The links' solution decides which elements there are and starts the iteration. Then every leaf takes its
 * direct light from the lamps at a few of its points, and sends cosine-distributed rays from points spread
 * over its surface; what they hit is kept, so that the system E_i = D_i + mean of b over the hits is solved
 * to any precision without another ray. Its rows sum to at most one.
 */
#ifndef FCT_RADIOSITY_TRANSPORT_H
#define FCT_RADIOSITY_TRANSPORT_H

#include "radiosity/light/lamp.h"
#include "radiosity/solve/element.h"

typedef struct fct_transport {
    float *stored;  /* per element x 3: radiosity that a gather ray finds: without what lamps account for */
    double *direct; /* per element x 3: mean direct irradiance of a leaf */
    uint64_t rays;
    uint32_t sweeps;
    double change; /* relative, of the last sweep */
    bool converged;
    double noise; /* relative standard error of the leaves' irradiance, from two halves of the rays,
                     area-weighted */
    double emitted, absorbed, escaped;
} fct_transport;

typedef struct fct_transport_def {
    uint64_t seed;
    double epsilon;   /* leaves across which direct light varies by more than this power are split */
    double tolerance; /* of the iteration */
    double fineness;  /* factor on the number of rays, which goes by the number of leaves */
} fct_transport_def;

/* Splits leaves at shadow borders, gathers, solves; radiosities in `set` are then the solution. Errors:
 * MEMORY, CANCELLED. */
fct_result fct_transport_solve(fct_elements *set, const fct_lamps *lamps, const fct_transport_def *def,
                               fct_transport *out);
void fct_transport_release(const fct_env *env, fct_transport *t);

/* What a ray from a surface finds: the stored radiosity of what it hits. */
typedef struct fct_found {
    const float *radiosity; /* 3 floats, never NULL */
    uint32_t leaf;          /* FCT_NONE: nothing or a black back */
    double distance;        /* infinity on a miss */
    bool black;             /* a back without a side of its own */
} fct_found;
fct_found fct_transport_look(const fct_elements *set, const float *stored, const float origin[3],
                             const float direction[3]);

#endif
