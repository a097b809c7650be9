/* simplify/refit/refit.h: moves the remaining points and attributes closer to the input. */
#ifndef FCT_SIMPLIFY_REFIT_H
#define FCT_SIMPLIFY_REFIT_H

#include "simplify/refit/measure.h"

/* Makes def->refit_passes passes, none with subset placement, and measures the result if fit is not NULL.
 * Errors: MEMORY, CANCELLED. */
fct_result fct_simplify_refit(fct_simplifier *s, fct_fit *fit);

#endif
