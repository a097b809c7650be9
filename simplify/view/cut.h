/* simplify/view/cut.h: moves the cut of a vertex hierarchy to a view. */
#ifndef FCT_SIMPLIFY_CUT_H
#define FCT_SIMPLIFY_CUT_H

#include "base/math/vec.h"
#include "simplify/view/hierarchy.h"

/* A view whose eye is relative to the origin of the mesh. */
typedef struct fct_cut_view {
    v3 eye, right, up, forward; /* unit directions */
    double slopes[2];           /* of the picture's right and upper side */
    double secant;              /* of the angle between `forward` and a corner of the picture */
    double focal;               /* pixels */
    double tolerance, silhouette_tolerance, back_factor, outside_factor, color_tolerance;
} fct_cut_view;

/* The view of a mesh with this origin. Errors: DATA. */
fct_result fct_cut_read_view(const fct_env *env, const fct_view *view, const double origin[3],
                             fct_cut_view *out);

/* What a view makes of a step that is not done. */
typedef struct fct_cut_error {
    double pixels; /* at most the distance on the screen between the finest level and the faces */
    double limit;  /* pixels that are allowed */
    double extent; /* pixels: the diameter of what the step changes */
    bool hidden;   /* outside of the picture, or seen from behind only */
} fct_cut_error;
fct_cut_error fct_cut_measure(const fct_cut_view *view, const fct_bound *bound);
/* Whether the step has to be done, if its ancestors in the tree have to. */
bool fct_cut_wants(const fct_cut_view *view, const fct_bound *bound);

/* Splits and contracts until the cut has the wanted steps, all steps that they need and no others. Fills in
 * splits, forced, done, undone, tested and the errors. Cost: proportional to both cuts, plus a bit per
 * step. */
void fct_cut_move(const fct_progressive *m, fct_hierarchy *h, const fct_cut_view *view,
                  fct_view_stats *stats);

#endif
