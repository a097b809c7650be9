/* radiosity/output/anchor.h: indirect light over a surface from gathers at a few of its vertices, the
 * anchors.
 *
 * The vertices are grouped by halving, and each group's middle vertex gathers; a group whose vertices lie far
 * from its anchor, in units of the harmonic mean distance to what the anchor sees (Ward, Rubinstein, Clear
 * 1988), or turn away from it, is halved again. So grooves and contacts get an anchor a vertex, and open
 * ground very few. A vertex blends the anchors near it.
 */
#ifndef FCT_RADIOSITY_ANCHOR_H
#define FCT_RADIOSITY_ANCHOR_H

#include "radiosity/output/surface.h"
#include "radiosity/solve/element.h"

typedef struct fct_anchor {
    float position[3], normal[3]; /* of the sample point; light is gathered on the normal's side */
    float offset;
    float reach;          /* harmonic mean distance, clamped */
    float irradiance[3];  /* RGB */
    float gradient[3][3]; /* per channel: irradiance vector, for normals that differ */
} fct_anchor;

typedef struct fct_anchors {
    fct_anchor *items; /* in kd-tree order */
    uint8_t *axes;     /* split axis of each item's node */
    uint32_t count;
    double turn; /* length that a difference of normals counts for */
    uint64_t rays;
} fct_anchors;

typedef struct fct_anchors_def {
    uint32_t rays;    /* least number per anchor */
    double tolerance; /* of distance over reach plus turn, within a group */
    double side;      /* 1: front; -1: the back of the surface */
    uint64_t seed;
} fct_anchors_def;

/* stored: as in fct_transport. Errors: MEMORY, CANCELLED. */
fct_result fct_anchors_create(const fct_env *env, const fct_elements *set, const float *stored,
                              const fct_surface *surface, const fct_anchors_def *def, fct_anchors *out);
void fct_anchors_release(const fct_env *env, fct_anchors *anchors);

/* Indirect irradiance at a point; near_wall asks for a ray to anchors whose light is much unlike the others',
 * so that light does not come through walls that stand on one floor. */
void fct_anchors_irradiance(const fct_anchors *anchors, const fct_elements *set, const float point[3],
                            const float normal[3], float offset, bool near_wall, double irradiance[3],
                            uint64_t *rays);

/* One gather: `rays` cosine-distributed rays. */
void fct_anchor_gather(const fct_elements *set, const float *stored, uint32_t rays, uint64_t seed,
                       fct_anchor *anchor);

#endif
