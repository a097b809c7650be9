/* radiosity/solve/refine.h: decides which pairs of elements exchange light directly. */
#ifndef FCT_RADIOSITY_REFINE_H
#define FCT_RADIOSITY_REFINE_H

#include "radiosity/solve/link.h"

typedef struct fct_refine_def {
    double epsilon;    /* the error that a link may carry: power, summed over channels */
    size_t most;       /* links, at least 1 */
    bool limited;      /* an earlier call reached its limit: split in the order of errors from the start */
    const char *phase; /* for the progress hook */
    double done;
} fct_refine_def;

typedef struct fct_refine_result {
    bool limited;   /* some links shall be split, but there is no room for their parts */
    double epsilon; /* def.epsilon, or the largest error of such a link if that is larger */
} fct_refine_result;

/* Splits links, and elements where needed, until no link carries an error above def->epsilon that a split can
 * lower, or until there are def->most links. Then the links that stay coarse are those with the smallest
 * errors. Links that stay keep their rays. There are at least as many links as before. Errors: MEMORY,
 * CANCELLED; links and elements are those of before then. */
fct_result fct_links_refine(fct_elements *set, fct_links *links, const fct_refine_def *def,
                            fct_refine_result *out);

#endif
