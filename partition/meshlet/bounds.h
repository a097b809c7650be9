/* partition/meshlet/bounds.h: bounds of one meshlet. */
#ifndef FCT_PARTITION_BOUNDS_H
#define FCT_PARTITION_BOUNDS_H

#include "facetree/partition.h"

enum { FCT_MESHLET_VERTICES = 256, FCT_MESHLET_TRIANGLES = 512 }; /* the highest limits */

/* Sphere, cone and boxes. positions: vertex_count x 3, triangles: triangle_count x 3 indices into them. */
void fct_meshlet_bound(const float *positions, uint32_t vertex_count, const uint8_t *triangles,
                       uint32_t triangle_count, fct_meshlet_bounds *out);

#endif
