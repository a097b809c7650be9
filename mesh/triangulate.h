/* mesh/triangulate.h: polygons to triangles. */
#ifndef FCT_MESH_TRIANGULATE_H
#define FCT_MESH_TRIANGULATE_H

#include <stddef.h>
#include <stdint.h>

/* Scratch for polygons of up to `capacity` corners; see fct_triangulate_bytes. */
typedef struct fct_polygon_scratch {
    double (*flat)[2];         /* corners in the polygon's plane */
    uint32_t *next, *previous; /* ring of what is left */
    unsigned char *reflex;
} fct_polygon_scratch;

/* Writes count - 2 triangles as corner numbers (0 .. count - 1) to `out`, keeping the polygon's winding.
 * Convex polygons become a fan about corner 0; others lose one ear after another; where the polygon is flat
 * to a line or crosses itself, so that no ear is left, the rest becomes a fan. *budget bounds the
 * corner-in-ear tests; when it is used up the rest becomes a fan as well. count >= 3; corners are indices
 * into positions. */
void fct_triangulate(const float *positions, const uint32_t *corners, uint32_t count,
                     const fct_polygon_scratch *scratch, uint64_t *budget, uint32_t *out);

#endif
