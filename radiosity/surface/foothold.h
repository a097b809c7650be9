/* radiosity/surface/foothold.h: the place and normal at which the light of a vertex is computed. */
#ifndef FCT_RADIOSITY_FOOTHOLD_H
#define FCT_RADIOSITY_FOOTHOLD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/math/vec.h"

/* Faces with normals within .26 degrees lie in one plane. */
#define FCT_FLAT_COSINE (1 - 1e-5)

/* A mesh before vertices on creases are doubled. Corner k of face f is number 3 f + k. */
typedef struct fct_corners {
    uint32_t vertex_count, face_count;
    const float *positions;
    const uint32_t *triangles;
} fct_corners;

/* Where a vertex takes its light, from the corners of one smooth group. */
typedef struct fct_foothold {
    v3 normal;     /* unit, or zero if every face is degenerate */
    v3 sample;     /* a point of `face` */
    double offset; /* rays start at sample + offset * normal */
    uint32_t face;
    bool flat; /* all faces lie in one plane */
} fct_foothold;

/* Angle-weighted normal of `count` > 0 corners that meet in one point, turned until it is in front of all
 * their faces. Returns false if the search finds no such direction; *normal is then the weighted one. */
bool fct_corner_normal(const fct_corners *mesh, const uint32_t *corners, size_t count, v3 *normal);
/* True if the unit direction is in front of all the corners' faces. */
bool fct_corner_front(const fct_corners *mesh, const uint32_t *corners, size_t count, v3 direction);
/* The foothold for a given normal. rim: the corners do not close around the point. */
fct_foothold fct_corner_foothold(const fct_corners *mesh, const uint32_t *corners, size_t count, v3 normal,
                                 bool rim);

#endif
