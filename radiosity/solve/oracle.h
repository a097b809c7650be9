/* radiosity/solve/oracle.h: how much power may flow over a pair of elements, and how uncertain that is.
 *
 * A pair i <- j is fine enough when (largest power from j that i reflects) x (relative uncertainty) is at
 * most epsilon. The scheme is that of hierarchical radiosity (Hanrahan, Salzman and Aupperle 1991, reference
 * [81] of Garland's dissertation); docs/radiosity.md derives the figures.
 */
#ifndef FCT_RADIOSITY_ORACLE_H
#define FCT_RADIOSITY_ORACLE_H

#include "radiosity/solve/transfer.h"

/* Typical distance of an element's surface from its centroid over the radius of its bounding ball. A
 * larger value splits pairs that need no split; a smaller one lets near pairs exchange light in one sample.
 */
#define FCT_TYPICAL_RADIUS .55
/* Change of irradiance over a receiver, relative, per typical radius over distance. The study in
 * docs/notes/radiosity.md measured the receiver's error as R / 2r for RMS radii; larger values split
 * receivers that are already smooth. */
#define FCT_RECEIVER_ERROR .25
/* Reflectance that a volume has for the oracle: its instances differ, and most materials are below this. With
 * a smaller value volumes keep links that their bright walls need finer. */
#define FCT_VOLUME_REFLECTANCE .7
/* Least reflectance for the oracle. With 0, black receivers keep the coarsest links, and their irradiance,
 * which probes report, is wrong. */
#define FCT_LEAST_REFLECTANCE .05

/* Factor on the spread of a leaf that is partly in full shadow. Such a leaf may reach under a wall into a
 * room without light, and its mean would shine there. The factor makes the solver split it earlier. */
#define FCT_DARK_WEIGHT 16

/* Where the source lies as the receiver's centroid sees it. */
typedef struct fct_pair {
    v3 toward;       /* unit vector from receiver to source; zero if the centroids coincide */
    double distance; /* of the centroids */
    double radii;    /* sum of the typical radii */
    bool overlap;    /* distance <= radii */
} fct_pair;

static inline fct_pair fct_pair_place(const fct_element *receiver, const fct_element *source) {
    v3 d = v3_sub(source->center, receiver->center);
    fct_pair pair = {.distance = v3_norm(d)};
    pair.radii = FCT_TYPICAL_RADIUS * (receiver->radius + source->radius);
    pair.overlap = pair.distance <= pair.radii;
    if (pair.distance > 0) pair.toward = v3_scale(d, 1 / pair.distance);
    return pair;
}

/* Upper bound of the form factor from receiver i to source j, in [0, 1].
 *   apart:    P_j(u) P_i(u) / A_i / (pi r^2 + P_j(u)), with both projected areas bounded over all directions
 *             between the elements;
 *   overlap:  two patches exchange at most the amount by which their union is bent, A - |S|: the self form
 *             factor of a concave patch with a flat rim is exactly 1 - |S| / A. */
static inline double fct_pair_form_bound(const fct_element *i, const fct_element *j, const fct_pair *pair) {
    if (!pair->overlap) {
        double spread = .5 * (pair->radii / pair->distance);
        double pj = fct_projected_bound(j, v3_scale(pair->toward, -1), spread);
        double pi = i->area > 0 ? fct_projected_bound(i, pair->toward, spread) / i->area : 0;
        return fct_min(pj * pi * fct_distance_factor(pair->distance * pair->distance, pj), 1);
    }
    if (i->kind == FCT_ELEMENT_VOLUME || j->kind == FCT_ELEMENT_VOLUME) return 1;
    v3 s = i == j ? i->vector : v3_add(i->vector, j->vector);
    double area = i == j ? i->area : i->area + j->area;
    double bend = fct_max(area - v3_norm(s), 0);
    return i->area > 0 ? fct_min(fct_min(bend, fct_min(i->area, j->area)) / i->area, 1) : 0;
}

/* Largest power, summed over channels, that i reflects of what j sends if nothing blocks it: rho_i b_j F_ij
 * A_i. */
static inline double fct_pair_flow(const fct_element *i, const fct_element *j, const fct_pair *pair) {
    double form = fct_pair_form_bound(i, j, pair), flow = 0;
    for (int c = 0; c < 3; ++c) {
        double rho = i->kind == FCT_ELEMENT_VOLUME ? FCT_VOLUME_REFLECTANCE : i->reflectance[c];
        flow += fct_max(rho, FCT_LEAST_REFLECTANCE) * j->radiosity[c];
    }
    return flow * form * i->area;
}

/* Relative uncertainty of one sample for the pair: (R_j / r)^2 from the source's extent, R_i / 4r from the
 * receiver's, with typical radii R. */
static inline double fct_pair_source_error(const fct_element *source, const fct_pair *pair) {
    double ratio = FCT_TYPICAL_RADIUS * source->radius / pair->distance;
    return ratio * ratio;
}
static inline double fct_pair_receiver_error(const fct_element *receiver, const fct_pair *pair) {
    return FCT_RECEIVER_ERROR * FCT_TYPICAL_RADIUS * receiver->radius / pair->distance;
}

/* Power by which the reflected direct light of a leaf varies over `count` of its points: sum over channels of
 * rho (max E - min E) A, times FCT_DARK_WEIGHT if a point is dark and another is not. */
static inline double fct_direct_spread(const fct_element *e, int count, const double irradiance[][3]) {
    double spread = 0;
    bool dark = false;
    for (int c = 0; c < 3; ++c) {
        double least = irradiance[0][c], most = irradiance[0][c];
        for (int k = 1; k < count; ++k) {
            least = fct_min(least, irradiance[k][c]);
            most = fct_max(most, irradiance[k][c]);
        }
        spread += e->reflectance[c] * (most - least) * e->area;
        dark |= least <= 0 && most > 0;
    }
    return dark ? spread * FCT_DARK_WEIGHT : spread;
}

#endif
