/* simplify/refit/measure.h: how far the result is from the input. */
#ifndef FCT_SIMPLIFY_MEASURE_H
#define FCT_SIMPLIFY_MEASURE_H

#include "simplify/refit/samples.h"

/* The distances from samples of the input to the result, in the unit cube: mean square and largest square.
 * The mean square of the difference of each channel, times its factor. */
typedef struct fct_fit {
    double distance2, farthest2, channels2[SIMPLIFY_MAX_CHANNELS];
    double lost; /* the share of the input's area at points without faces in the result */
} fct_fit;

/* Compares the samples with the points on which they landed. Errors: MEMORY. */
fct_result fct_refit_measure(const fct_refit *r, size_t samples, fct_fit *out);

#endif
