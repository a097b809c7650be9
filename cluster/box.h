/* cluster/box.h: corners of consecutive faces as streams, and the box of such a run. */
#ifndef FCT_CLUSTER_BOX_H
#define FCT_CLUSTER_BOX_H

#include "base/vec.h"
#include "facetree/cluster.h"

/* Corners by place (3 a face) and unit normals by place; NaN for a face without area. */
typedef struct fct_soup {
    float *corner[3]; /* x, y, z */
    float *normal[3];
} fct_soup;

/* Corner and normal streams of one face. */
void fct_soup_face(const fct_soup *soup, size_t place, const float *positions, const uint32_t triangle[3]);

/* The rotation whose rows are the box's axes, as a float quaternion; frame is right-handed. */
void fct_box_rotation(const v3 frame[3], float rotation[4]);

/* Sets center and half extents from the rotation, exactly and rounded outwards, so that every corner of the
 * faces [first, first + count) is inside. Where such a box would leave the range of a float, the rotation
 * becomes none. */
void fct_box_fit(const fct_soup *soup, size_t first, size_t count, fct_cluster *cluster);

/* Turns the frame (t, b, normal) about its normal so that the box about a sample of at most 64 corners has
 * the least area. */
void fct_box_turn(const fct_soup *soup, size_t first, size_t count, v3 frame[3]);

/* Half the surface area of a cluster's box, over 4. */
double fct_box_area(const fct_cluster *cluster);

/* The angle, rounded up, within which all normals are to the area vector. */
float fct_cone_angle(const fct_soup *soup, size_t first, size_t count, const float vector[3]);

#endif
