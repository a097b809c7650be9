/* simplify/refit/samples.h: the samples of the input and the faces on which they land. */
#ifndef FCT_SIMPLIFY_SAMPLES_H
#define FCT_SIMPLIFY_SAMPLES_H

#include "simplify/state.h"

/* Quadrature over a face, exact for polynomials of degree 2: the centroid weighs 3/4 of the area, each corner
 * 1/12. */
#define CENTROID_WEIGHT .75
#define CORNER_DIVISOR  12

/* A corner or the centroid of a face of the input. */
typedef struct fct_sample {
    v3 at;
    double weight; /* the area for which it stands; 0: it does not count */
} fct_sample;

/* The point of the remaining faces that is nearest to a sample. */
typedef struct fct_landing {
    uint32_t face;   /* FCT_NONE: there is none */
    float u, v;      /* weights of its second and third corner */
    bool attributes; /* the face is on the sample's side of a seam, so its attributes count */
} fct_landing;

/* The least-squares system of a point, and what limits its step. Each sample that lands on a face of the
 * point adds to it, weighted by its area and by the landing's barycentric b of the point. */
typedef struct fct_system {
    double matrix[6]; /* b^2 n n^T: xx xy xz yy yz zz, where n points from the landing to the sample */
    double side[3];   /* b times the vector from the landing to the sample */
    double residual2; /* b times its squared length */
    double weight;    /* b */
    double unused;    /* twelve numbers are added in pairs */
} fct_system;

/* A face of the input that stands for the input near a point: its centroid is the nearest one among the
 * samples that land around the point and the faces with a corner that was contracted to it. */
typedef struct fct_near_face {
    double distance2;
    uint32_t face; /* FCT_NONE: there is none */
} fct_near_face;

typedef struct fct_refit {
    fct_simplifier *s;
    uint32_t pass;
    uint32_t stride;        /* each stride-th wedge and face of the input has a sample */
    uint32_t wedge_samples; /* the first samples; those of faces follow */
    uint32_t *corners;      /* per sample of a wedge: one of its corners, or FCT_NONE */
    fct_sample *samples;
    fct_landing *landings; /* per sample */
    fct_system *systems;   /* per point */
    double *sums;          /* per wedge and channel: weighted residuals */
    double *weights;       /* per wedge */
    fct_near_face *near;   /* per point; found in the first pass, because points move little */
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

/* A sample is the mean of these corners: one for a wedge, three for a face. Returns their number. The sample
 * counts. */
static inline uint32_t find_sample_corners(const fct_refit *r, size_t sample, uint32_t corners[3]) {
    if (sample < r->wedge_samples) {
        corners[0] = r->corners[sample];
        return 1;
    }
    uint32_t f = (uint32_t)(sample - r->wedge_samples) * r->stride;
    for (uint32_t k = 0; k < 3; ++k) corners[k] = 3 * f + k;
    return 3;
}

/* The scaled value of a channel at a corner of the input. */
static inline double find_input_value(const fct_simplifier *s, const fct_channel *channel, uint32_t corner) {
    const fct_mesh *mesh = s->mesh;
    size_t v = mesh->triangles[corner], i = channel->component;
    double value = channel->source == CHANNEL_TEXCOORD
                       ? mesh->texcoords[2 * (size_t)corner + i]
                       : stream_values(mesh, channel->stream)[stream_width(channel->stream) * v + i];
    return value * channel->factor;
}

#endif
