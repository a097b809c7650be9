/* radiosity/solve/guide.h: the links of a solution tell gather rays where light comes from.
 *
 * A gather with cosine-distributed rays is noisy where small bright surfaces bring the light, such as the
 * ceiling above a lamp. The links of the receiver's leaf and of its ancestors know these surfaces. So a part
 * of the rays aims at points of sources, drawn in proportion to the light that the links bring:
 * 1. choose a link by F_ij W_j / A_j, with the form factor F_ij from the receiver's point and the stored
 *    power W_j = sum of b A over the leaves of source j and over channels;
 * 2. choose a leaf of j by its share of W_j;
 * 3. choose a point of the leaf by area.
 * The density of a point of leaf l of source j, per area, is
 *     p_g = s_j b_l / W_j,   s_j = F_ij (W_j / A_j) / sum over the links.
 * The balance heuristic (Veach and Guibas 1995) joins both kinds of rays (anchor.c), so the result is right
 * for any links, also for wrong ones.
 */
#ifndef FCT_RADIOSITY_GUIDE_H
#define FCT_RADIOSITY_GUIDE_H

#include "radiosity/solve/link.h"

typedef struct fct_guides {
    const fct_elements *set;
    const fct_links *links;
    const float *stored; /* as in fct_transport */
    double *powers;      /* W per element */
    uint32_t most_links; /* of any leaf, with those of its ancestors */
} fct_guides;

/* Errors: MEMORY. */
fct_result fct_guides_create(const fct_elements *set, const fct_links *links, const float *stored,
                             fct_guides *out);
void fct_guides_release(const fct_env *env, fct_guides *guides);

/* The sources of one receiver; a thread has one. */
typedef struct fct_guide {
    const fct_guides *all;
    uint32_t count, mask;
    uint32_t *sources; /* count elements */
    double *sums;      /* count: running sums of s_j; the last one is 1 */
    double *densities; /* count: s_j / W_j */
    uint32_t *table;   /* mask + 1: hash table of indices of sources; FCT_NONE: empty */
} fct_guide;

/* Room for the sources of any receiver. Errors: MEMORY. */
fct_result fct_guide_create(const fct_guides *all, fct_guide *out);
void fct_guide_release(const fct_env *env, fct_guide *guide);

/* Lists the sources of a receiver: a point with a unit normal on a leaf. Returns false if the links bring no
 * light. */
bool fct_guide_aim(fct_guide *guide, uint32_t leaf, v3 point, v3 normal);
/* The leaf at share t in [0, 1) of the light. *t becomes the share within the leaf. */
uint32_t fct_guide_pick(const fct_guide *guide, double *t);
/* The density p_g of each point of a leaf; 0 if no link brings its light. */
double fct_guide_density(const fct_guide *guide, uint32_t leaf);

#endif
