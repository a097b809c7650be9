/* tools/bake/errors.h: the estimated errors of a bake, and bakes until an error is reached. */
#ifndef FCT_TOOLS_BAKE_ERRORS_H
#define FCT_TOOLS_BAKE_ERRORS_H

#include <argp.h>

#include "tools/kit/env.h"

/* The estimate that a bake must reach; share 0: any. */
typedef struct bake_target {
    double share, last; /* last: the estimate of the bake before */
    int tries;          /* so far */
    bool more_rays;     /* the last bake had more rays than the one before */
} bake_target;

/* Reads --error: a share of power, or a percentage such as 2%, which sets the target. */
error_t bake_parse_error(struct argp_state *state, const char *text, double *error, bake_target *target);
/* True if the estimate is above the target and another bake may help; then *def asks for more rays, and for
 * shorter edges if more rays have hardly helped. */
bool bake_try_again(tool *t, bake_target *target, const fct_bake_stats *stats, fct_bake_def *def);
/* One {object, error_estimate, bias, area} per object that has been checked. NULL without memory. */
json_t *bake_describe_errors(const fct_bake *bake, const fct_scene_view *scene);
/* Prints the objects with the largest errors among those of at least .5 % of the area, without lamps. Returns
 * an exit code. */
int bake_print_errors(tool *t, const fct_bake *bake, const fct_scene_view *scene);

#endif
