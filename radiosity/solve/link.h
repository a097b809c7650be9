/* radiosity/solve/link.h: links between elements: the oracle that decides how finely light is carried, and
 * the solution over them.
 */
#ifndef FCT_RADIOSITY_LINK_H
#define FCT_RADIOSITY_LINK_H

#include "radiosity/solve/element.h"

typedef struct fct_link {
    uint32_t receiver, source;
    float weight; /* far: visible fraction V; near: the form factor itself, V included */
    uint8_t near; /* the pair is too close for one sample: weight is a mean over point pairs */
    uint8_t rays; /* sent so far; 0: nothing is known yet, for the source was dark */
} fct_link;

typedef struct fct_links {
    fct_link *items;
    size_t count, capacity;
    uint32_t *first; /* element -> its links as receiver, once sorted; element_count + 1 */
    size_t first_capacity, element_count; /* elements when the links were sorted; later ones have none */
    double *rows; /* per element: sum of a leaf's form factors; above 1 they are scaled down */
    size_t row_capacity;
    uint64_t rays;
} fct_links;

/* The one pair of roots, as yet unrefined. Errors: MEMORY. */
fct_result fct_links_create(const fct_env *env, fct_links *out);
void fct_links_release(const fct_env *env, fct_links *links);

/* Splits and keeps links until none carries an error above `epsilon` (power, summed over channels) that a
 * split could lower. Errors: MEMORY, CANCELLED. */
fct_result fct_links_refine(fct_elements *set, fct_links *links, double epsilon, const char *phase,
                            double done);

/* Gathers and pulls until the change is below tolerance x (1 - rho_max) / rho_max of the solution, or `most`
 * sweeps are done; *sweeps grows by those done. Errors: MEMORY. */
fct_result fct_links_solve(fct_elements *set, fct_links *links, double tolerance, uint32_t most,
                           uint32_t *sweeps);

/* Irradiance that the links bring to a point with a normal on leaf `leaf`, which may be newer than they. */
void fct_links_irradiance(const fct_elements *set, const fct_links *links, uint32_t leaf, v3 point, v3 normal,
                          double irradiance[3]);

#endif
