/* mesh/triangulate.h: triangulation of one polygon. */
#ifndef FCT_MESH_TRIANGULATE_H
#define FCT_MESH_TRIANGULATE_H

#include <stddef.h>
#include <stdint.h>

/* Scratch with one element per corner of the polygon. */
typedef struct fct_polygon_scratch {
    double (*flat)[2];         /* corners in the polygon's plane */
    uint32_t *next, *previous; /* ring of the corners that are not cut off */
    unsigned char *reflex;
} fct_polygon_scratch;

/* Writes count - 2 triangles to `out`, as corner numbers in [0, count), with the winding of the polygon. A
 * convex polygon becomes a fan about corner 0. Any other polygon is cut ear by ear. If no ear is left (the
 * polygon is flat to a line or crosses itself), or *budget tests are used up, the rest becomes a fan. corners
 * are indices into positions. count >= 3. */
void fct_triangulate(const float *positions, const uint32_t *corners, uint32_t count,
                     const fct_polygon_scratch *scratch, uint64_t *budget, uint32_t *out);

#endif
