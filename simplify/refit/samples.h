/* simplify/refit/samples.h: the samples of the input and the faces on which they land. */
#ifndef FCT_SIMPLIFY_SAMPLES_H
#define FCT_SIMPLIFY_SAMPLES_H

#include "simplify/state.h"

/* Quadrature over a face, exact for polynomials of degree 2: the centroid weighs 3/4 of the area, each corner
 * 1/12. */
#define CENTROID_WEIGHT .75
#define CORNER_DIVISOR  12

/* The point of the remaining faces that is nearest to a sample. */
typedef struct fct_landing {
    uint32_t face;   /* FCT_NONE: there is none */
    float u, v;      /* weights of its second and third corner */
    bool attributes; /* the face is on the sample's side of a seam, so its attributes count */
} fct_landing;

/* The limit of a point's step depends on these. */
typedef struct fct_reach {
    double residual2; /* the mean squared distance of its samples from the surface, times `weight` */
    double weight;
    double nearest2;  /* the smallest squared distance from the point to the centroid of a face of the input
                         that is among its samples or has a corner that was contracted to it */
    uint32_t nearest; /* this face; it stands for the input near the point */
} fct_reach;

typedef struct fct_refit {
    fct_simplifier *s;
    uint32_t pass;
    uint32_t stride;        /* each stride-th wedge and face of the input has a sample */
    uint32_t wedge_samples; /* the first samples; those of faces follow */
    uint32_t *corners;      /* per wedge of the input: one of its corners, or FCT_NONE */
    double *corner_weights; /* per wedge of the input */
    fct_landing *landings;  /* per sample */
    double (*systems)[9];   /* per point: xx xy xz yy yz zz of the matrix, then the right side */
    double *sums;           /* per wedge and channel: weighted residuals */
    double *weights;        /* per wedge */
    fct_reach *reaches;     /* per point */
} fct_refit;

/* A corner of the input in the unit cube. */
static inline v3 find_input_position(const fct_simplifier *s, uint32_t corner) {
    v3 p = v3_load(s->mesh->positions + 3 * (size_t)s->mesh->triangles[corner]);
    return v3_scale(v3_sub(p, s->center), 1 / s->extent);
}

/* Whether two corners of a face of the input share a point. */
static inline bool is_degenerate(const fct_simplifier *s, uint32_t f) {
    const uint32_t *t = s->mesh->triangles + 3 * (size_t)f;
    uint32_t a = s->point_of[t[0]], b = s->point_of[t[1]], c = s->point_of[t[2]];
    return a == b || b == c || c == a;
}

static inline double find_area(const v3 p[3]) {
    return .5 * v3_norm(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
}

static inline uint32_t find_input_wedge(const fct_simplifier *s, uint32_t corner) {
    return s->corner_wedges ? s->corner_wedges[corner] : s->point_of[s->mesh->triangles[corner]];
}

/* A sample is the mean of these corners: one for a wedge, three for a face. Returns their number; 0 if the
 * sample does not count. */
static inline uint32_t find_sample_corners(const fct_refit *r, size_t sample, uint32_t corners[3]) {
    const fct_simplifier *s = r->s;
    if (sample < r->wedge_samples) {
        corners[0] = r->corners[sample * r->stride];
        return corners[0] != FCT_NONE;
    }
    uint32_t f = (uint32_t)(sample - r->wedge_samples) * r->stride;
    for (uint32_t k = 0; k < 3; ++k) corners[k] = 3 * f + k;
    return is_degenerate(s, f) ? 0 : 3;
}

/* The position of a sample; p receives those of its corners. */
static inline v3 find_sample_position(const fct_simplifier *s, const uint32_t *corners, uint32_t count,
                                      v3 p[3]) {
    p[0] = find_input_position(s, corners[0]);
    if (count == 1) return p[0];
    p[1] = find_input_position(s, corners[1]), p[2] = find_input_position(s, corners[2]);
    return v3_scale(v3_add(v3_add(p[0], p[1]), p[2]), 1. / 3);
}

/* The area for which a sample stands; `ends` are the positions of its corners. */
static inline double find_sample_weight(const fct_refit *r, size_t sample, uint32_t count, const v3 ends[3]) {
    return count == 1 ? r->corner_weights[sample * r->stride] : CENTROID_WEIGHT * find_area(ends);
}

/* The scaled value of a channel at a corner of the input. */
static inline double find_input_value(const fct_simplifier *s, const fct_channel *channel, uint32_t corner) {
    const fct_mesh *mesh = s->mesh;
    size_t v = mesh->triangles[corner], i = channel->component;
    double value = channel->source == CHANNEL_COLOR    ? mesh->colors[3 * v + i]
                   : channel->source == CHANNEL_NORMAL ? mesh->normals[3 * v + i]
                                                       : mesh->texcoords[2 * (size_t)corner + i];
    return value * channel->factor;
}

#endif
