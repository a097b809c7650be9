/* simplify/refit/refit.h: moves the remaining points and attributes closer to the input. */
#ifndef FCT_SIMPLIFY_REFIT_H
#define FCT_SIMPLIFY_REFIT_H

#include "simplify/state.h"

/* Makes def->refit_passes passes. Errors: MEMORY, CANCELLED. */
fct_result fct_simplify_refit(fct_simplifier *s);

#endif
