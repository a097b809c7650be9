/* simplify/handle/wish.h: the paint and the constraints of the caller. A way back keeps them. */
#ifndef FCT_SIMPLIFY_WISH_H
#define FCT_SIMPLIFY_WISH_H

#include "simplify/state.h"

/* The largest weight of a contour or of a point constraint of the caller. */
#define WISH_MOST_WEIGHT 1e12

/* Whether a vertex may be painted with this weight. */
static inline bool is_paint(float weight) {
    return weight >= 1e-6f && weight <= 1e6f;
}

typedef struct fct_wishes {
    float *paint; /* per point of the input; NULL: none */
    fct_mark *marks;
    size_t mark_count;
} fct_wishes;

/* Errors: MEMORY, with nothing to release. */
fct_result fct_wishes_copy(const fct_simplifier *s, fct_wishes *out);
/* Gives an earlier state the wishes of a later one, as if the caller had asked for them then. Errors: MEMORY.
 */
fct_result fct_wishes_apply(fct_simplifier *s, const fct_wishes *wishes);
void fct_wishes_release(const fct_env *env, fct_wishes *wishes);

/* Gives the points of the input these weights (point_count; NULL: all 1). Errors: MEMORY. */
fct_result fct_paint_points(fct_simplifier *s, const float *weights);
/* Adds marks to the state. Errors: MEMORY, DATA (a contour that is no edge), without a change. */
fct_result fct_mark_add(fct_simplifier *s, const fct_mark *marks, size_t count);

#endif
