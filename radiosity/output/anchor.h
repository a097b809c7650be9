/* radiosity/output/anchor.h: gathers indirect light at a few vertices of a surface, its anchors.
 *
 * 1. All vertices that have no anchor near enough form one group.
 * 2. The middle vertex of each group, its anchor, gathers stored radiosity, unless it already has.
 * 3. A group is halved if a vertex lies too far from its anchor, in units of the harmonic mean distance to
 * the hits (Ward, Rubinstein and Clear 1988), or turns too far from it. Back to 2 with the halves. So grooves
 * and contacts get an anchor per vertex, and open ground gets few. Anchors of halved groups stay.
 */
#ifndef FCT_RADIOSITY_ANCHOR_H
#define FCT_RADIOSITY_ANCHOR_H

#include "radiosity/output/anchor_tree.h"
#include "radiosity/output/near.h"
#include "radiosity/surface/surface.h"

typedef struct fct_anchors_def {
    uint32_t rays;          /* least number per anchor, on bent surfaces twice that; anchors of large groups
                               send up to five times as many */
    double tolerance;       /* of distance / reach + sqrt(1 - n . n'), within a group */
    double side;            /* 1: front of the surface; -1: back */
    uint32_t instance;      /* of the surface */
    uint32_t first;         /* lower vertices need no anchor of their own */
    const uint8_t *covered; /* per vertex: it needs no light. NULL: none is covered */
    const float *nearest;   /* per vertex: distance to some surface in front of it, which limits how far away
                               its anchor may be. NULL: infinity */
    uint64_t seed;
} fct_anchors_def;

/* Adds anchors for the vertices from def->first on that have none within the tolerance among the given ones
 * (at first {0}). No reach of these counts as more than that of another anchor plus the distance to it.
 * anchors->rays grows. Errors: MEMORY, CANCELLED; the anchors are then released. */
fct_result fct_anchors_extend(const fct_env *env, const fct_source *source, const fct_surface *surface,
                              const fct_anchors_def *def, fct_anchors *anchors);

/* Sends `rays` rays from position + offset * normal. Sets reach, irradiance and gradient as weighted means
 * over the rays' directions d, with hits at distance r whose surface has the cosine c' to the ray: E = sum w
 * b / sum w,  1 / reach = sum w / r / sum w, and the part of sum w b d / max(d . n, .15) / sum w across n is
 * the gradient (Ward and Heckbert 1992). The part along n would make every turn darker, because it knows no
 * light from below the horizon. Without a guide all rays are cosine-distributed and w = 1. With an aimed
 * guide, a third of them (rounded down) go to points of its sources, with the density p_g per area; p_c = d .
 * n c' / (pi r^2) is that of the others, and w = p_c / (n_c p_c + n_g p_g), the balance heuristic of Veach
 * and Guibas. A ray that does not reach its point has w = 0. The sum of all w has the mean 1. Division by
 * it makes the weights of all hits sum to 1: where all hits have one radiosity, E is exact. Near hits take an
 * estimate of the light at their point (near.h), which is noisy. Returns the number of all rays. */
uint64_t fct_anchor_gather(const fct_source *source, const fct_guide *guide, uint32_t rays, uint64_t seed,
                           fct_anchor *anchor);

#endif
