/* radiosity/output/check.h: the error of the light that a surface shows.
 *
 * At random points of the surface, half of them by area, half where the light differs, the light that a
 * viewer shows, interpolated between the vertices of a face, is compared with two independent gathers of many
 * rays. With their values r1 and r2, the product (x - r1)(x - r2) has the mean (x - truth)^2: the noise of
 * the gathers cancels. So the estimate contains the noise of the rays, the distances between anchors and the
 * size of the triangles. It does not contain an error of the stored solution, which both gathers look up.
 */
#ifndef FCT_RADIOSITY_CHECK_H
#define FCT_RADIOSITY_CHECK_H

#include "radiosity/output/solution.h"

/* Sums over the checked surfaces, each point weighted with its part of the area. Light is reflected
 * radiosity, the mean over channels. */
typedef struct fct_check {
    double area, light, square, bias; /* area; light, (x - r1)(x - r2) and x - (r1 + r2) / 2 times area */
    uint64_t points;
} fct_check;

/* RMS error over the mean light; 0 without light. */
double fct_check_error(const fct_check *sums);

/* Checks the surface, whose irradiance (vertex x 3) is `light`. back: of the sides. covered: per vertex;
 * faces whose vertices are all covered are left out. *sums grows, *rays too. Errors: MEMORY, CANCELLED. */
fct_result fct_check_surface(const fct_solution *s, const fct_surface *surface, uint32_t instance, bool back,
                             const float *light, const uint8_t *covered, fct_check *sums, uint64_t *rays);

#endif
