/* radiosity/solve/refine.h: decides which pairs of elements exchange light directly. */
#ifndef FCT_RADIOSITY_REFINE_H
#define FCT_RADIOSITY_REFINE_H

#include "radiosity/solve/link.h"

/* Splits links, and elements where needed, until no link carries an error above `epsilon` (power, summed over
 * channels) that a split can lower. Links that stay keep their rays. `done` is the value for the progress
 * hook. Errors: MEMORY, CANCELLED. */
fct_result fct_links_refine(fct_elements *set, fct_links *links, double epsilon, const char *phase,
                            double done);

#endif
