/* partition/meshlet/ball.h: the smallest ball around points. */
#ifndef FCT_PARTITION_BALL_H
#define FCT_PARTITION_BALL_H

#include <stdint.h>

#include "base/math/vec.h"

/* Center and radius of the smallest ball about count >= 1 finite points, to rounding; the radius is the
 * distance of the farthest point as computed. */
void fct_smallest_ball(const v3 *points, uint32_t count, v3 *center, double *radius);

#endif
