/* simplify/refit.c: placeholder while the pass is written. */
#include "simplify/state.h"

fct_result fct_simplify_refit(fct_simplifier *s) {
    (void)s;
    return FCT_OK;
}
