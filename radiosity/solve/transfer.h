/* radiosity/solve/transfer.h: light between two elements from their area A, area vector S = sum A_k n_k and
 * moment matrix M = sum A_k n_k n_k^T.
 *
 * u is a unit vector from the element towards the viewer. The projected area P(u) = sum A_k max(0, n_k.u)
 * lies between S.u and (sqrt(A u^T M u) + S.u) / 2. The upper bound follows from max(0, x) = (|x| + x) / 2
 * and sum A_k |n_k.u| <= sqrt(A u^T M u) (Cauchy-Schwarz). Neither bound knows self-occlusion. Source:
 * Willmott, Heckbert and Garland 1999 use S and P for clusters (section 8.3.2 of Garland's dissertation
 * summarizes them); the moments are our addition.
 */
#ifndef FCT_RADIOSITY_TRANSFER_H
#define FCT_RADIOSITY_TRANSFER_H

#include "base/math/elementary.h"
#include "radiosity/solve/element.h"

/* sum A_k |n_k.u| over its Cauchy-Schwarz bound, for the estimate of the projected area. The bound is 1.03 to
 * 1.3 times the projected area on average over scans, so the estimate lies a little below it. */
#define FCT_TYPICAL_SPREAD .95

/* Estimate of the projected area: exact for a triangle and for a flat sheet seen from its front, else
 * (.95 sqrt(A u^T M u) + S.u) / 2, at least S.u and at least 0. */
static inline double fct_projected_area(const fct_element *e, v3 u) {
    double sheet = v3_dot(e->vector, u);
    if (e->kind == FCT_ELEMENT_TRIANGLE) return sheet > 0 ? sheet : 0;
    double form = sym3_form(e->moment, u, u);
    double mean = .5 * (FCT_TYPICAL_SPREAD * sqrt(fct_max(e->area * form, 0)) + sheet);
    return fct_max(fct_max(mean, sheet), 0);
}

/* Upper bound of the projected area in every direction whose sine to u is at most `spread`. */
static inline double fct_projected_bound(const fct_element *e, v3 u, double spread) {
    double sheet = v3_dot(e->vector, u);
    double form = sym3_form(e->moment, u, u);
    double bound = .5 * (sqrt(fct_max(e->area * form, 0)) + sheet) + spread * e->area;
    return fct_min(fct_max(bound, 0), e->area);
}

/* True if every normal of the element turns away from every direction within `angle` of u. */
static inline bool fct_faces_away(const fct_element *e, v3 u, double angle) {
    double length = v3_norm(e->vector);
    if (e->cone >= FCT_ELEMENT_OPEN_CONE || length <= 0) return false;
    double cosine = v3_dot(e->vector, u) / length;
    return fct_acos(fct_min(fct_max(cosine, -1), 1)) - e->cone - angle > FCT_ELEMENT_OPEN_CONE;
}

/* pi times the radiant intensity along u: P.u with P = sum b_k S_k, but at least the mean radiosity times the
 * projected area. P.u is right for a body that is lit on one side; it is zero for a closed body that emits
 * evenly, where the second term is right. */
static inline double fct_sent_power(const fct_element *e, v3 u, double projected, int channel) {
    return fct_max(v3_dot(e->power[channel], u), e->radiosity[channel] * projected);
}

/* Irradiance of a receiver that faces the source, per fct_sent_power: 1 / (pi r^2 + projected area). The area
 * in the denominator keeps the factor below 1 / area at any distance; the sum is exact on the axis of a disk,
 * where E / B = R^2 / (r^2 + R^2). */
static inline double fct_distance_factor(double r2, double projected) {
    return 1 / (FCT_PI * r2 + projected);
}

#endif
