/* radiosity/solve/link.h: links between elements, and the solution over them.
 *
 * A link says that one element receives light directly from another, with a measured visibility. Every pair
 * of leaves is covered by exactly one link between two of their ancestors, or by none if they cannot see each
 * other. refine.c makes the links.
 */
#ifndef FCT_RADIOSITY_LINK_H
#define FCT_RADIOSITY_LINK_H

#include "radiosity/solve/element.h"

typedef struct fct_link {
    uint32_t receiver, source;
    float weight; /* far: visible fraction V; near: form factor from receiver to source, V included */
    uint8_t near; /* 1: weight is a mean over point pairs, because the pair is too close for one sample */
    uint8_t rays; /* point pairs tried so far; 0: the source was dark, and weight is unknown */
} fct_link;

typedef struct fct_links {
    fct_link *items;
    size_t count, capacity;
    uint32_t *first; /* after sorting: links of receiver id are [first[id], first[id + 1]) */
    size_t first_capacity, element_count; /* elements when the links were sorted; later ones have no links */
    double *rows; /* per element, leaves only: sum of form factors; above 1 the irradiance is divided by it */
    size_t row_capacity;
    uint64_t rays;
} fct_links;

/* One unrefined link from the whole scene to itself. Errors: MEMORY. */
fct_result fct_links_create(const fct_env *env, fct_links *out);
void fct_links_release(const fct_env *env, fct_links *links);

/* Sorts links by receiver, links of one receiver in their old order, and fills `first`. Errors: MEMORY. */
fct_result fct_links_sort(const fct_elements *set, fct_links *links);

/* Gathers and pulls until the change is below tolerance x (1 - rho_max) / rho_max of the solution, or `most`
 * sweeps are done. *sweeps grows by their number. Errors: MEMORY. */
fct_result fct_links_solve(fct_elements *set, fct_links *links, double tolerance, uint32_t most,
                           uint32_t *sweeps);

/* Irradiance (RGB) over the links at a point with a unit normal on leaf `leaf`. A leaf that is newer than the
 * links uses the links of its ancestors. */
void fct_links_irradiance(const fct_elements *set, const fct_links *links, uint32_t leaf, v3 point, v3 normal,
                          double irradiance[3]);

/* The links of a leaf and of its ancestors at such a point: their sources, and the form factors to these
 * (visibility included). Returns their number; the arrays have room for all of them. */
uint32_t fct_links_factors(const fct_elements *set, const fct_links *links, uint32_t leaf, v3 point,
                           v3 normal, uint32_t *sources, double *factors);

#endif
