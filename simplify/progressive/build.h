/* simplify/progressive/build.h: the progressive mesh of a log. */
#ifndef FCT_SIMPLIFY_BUILD_H
#define FCT_SIMPLIFY_BUILD_H

#include "facetree/progressive.h"
#include "simplify/log.h"

/* The progressive mesh of the contractions in s->log, after them and before the refit. Errors: MEMORY, with
 * *out = NULL. */
fct_result fct_progressive_build(const fct_simplifier *s, fct_progressive **out);

#endif
