/* tests/radiosity/refining.h: refinement without a limit. */
#ifndef FCT_TESTS_RADIOSITY_REFINING_H
#define FCT_TESTS_RADIOSITY_REFINING_H

#include "radiosity/solve/refine.h"

static inline fct_result refine_links(fct_elements *set, fct_links *links, double epsilon) {
    const fct_refine_def def = {.epsilon = epsilon, .most = SIZE_MAX, .phase = "links"};
    fct_refine_result done;
    return fct_links_refine(set, links, &def, &done);
}

#endif
