/* radiosity/solve/transfer.h: how much of a distant element one sees, and the light it sends, from its area
 * vector and moment matrix.
 *
 * Formulas: docs/radiosity.md. u is a unit vector from the element towards the viewer.
 */
#ifndef FCT_RADIOSITY_TRANSFER_H
#define FCT_RADIOSITY_TRANSFER_H

#include "radiosity/solve/element.h"

/* Projected area: exact for a triangle and for one flat sheet seen from the front, and between Cauchy and
 * Schwarz's bound and the sheet's own elsewhere: (0.95 sqrt(A u^T M u) + S.u) / 2, at least S.u. */
static inline double fct_projected_area(const fct_element *e, v3 u) {
    double sheet = v3_dot(e->vector, u);
    if (e->kind == FCT_ELEMENT_TRIANGLE) return sheet > 0 ? sheet : 0;
    double form = sym3_form(e->moment, u, u);
    double mean = .5 * (.95 * sqrt(fmax(e->area * form, 0)) + sheet);
    return fmax(fmax(mean, sheet), 0);
}

/* No direction within `spread` (sine of the half-angle) of u sees more: (sqrt(A u^T M u) + S.u) / 2, widened.
 */
static inline double fct_projected_bound(const fct_element *e, v3 u, double spread) {
    double sheet = v3_dot(e->vector, u);
    double form = sym3_form(e->moment, u, u);
    double bound = .5 * (sqrt(fmax(e->area * form, 0)) + sheet) + spread * e->area;
    return fmin(fmax(bound, 0), e->area);
}

/* Whether every normal turns away from every direction within `angle` of u. */
static inline bool fct_faces_away(const fct_element *e, v3 u, double angle) {
    double length = v3_norm(e->vector);
    if (e->cone >= FCT_ELEMENT_OPEN_CONE || length <= 0) return false;
    double cosine = v3_dot(e->vector, u) / length;
    return acos(fmin(fmax(cosine, -1), 1)) - e->cone - angle > FCT_ELEMENT_OPEN_CONE;
}

/* Power over pi that leaves the element along u: its b S dotted with u where all it shows is lit alike, at
 * least its mean. */
static inline double fct_sent_power(const fct_element *e, v3 u, double projected, int channel) {
    return fmax(v3_dot(e->power[channel], u), e->radiosity[channel] * projected);
}

/* Geometric factor of irradiance: E = projected source x radiosity x mean receiver cosine x this. The
 * source's own projected area in the denominator keeps the factor finite when it is near (exact for a disk on
 * the axis). */
static inline double fct_distance_factor(double r2, double projected) {
    return 1 / (FCT_PI * r2 + projected);
}

#endif
