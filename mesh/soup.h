/* mesh/soup.h: the input and the output of every reader.
 *
 * A reader gets an fct_source and fills an fct_soup, which is empty but for the inputs: polygons as lists of
 * vertex indices, in the order of the file. If the reader fails, the caller releases the soup. A reader
 * allocates at most a small multiple of the file's size, whatever counts the file declares. fct_soup_mesh
 * checks the soup, triangulates its polygons and moves the arrays into a mesh. It moves a soup of triangles
 * (starts == NULL) without a copy.
 */
#ifndef FCT_MESH_SOUP_H
#define FCT_MESH_SOUP_H

#include "base/math/origin.h"
#include "mesh/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A file in memory. */
typedef struct fct_source {
    const fct_env *env;
    const char *name; /* begins every message */
    const void *data;
    size_t size;
    const char *folder; /* where relative paths start, "" or ending in '/'. NULL: no other file may be read */
} fct_source;

typedef struct fct_soup {
    uint32_t vertex_count, polygon_count;
    size_t corner_count;
    unsigned layout;    /* input: a reader with several layouts of text tries this one */
    bool wants_corners; /* input: keep normals that differ between the corners of a vertex */
    double origin[3];   /* input: the reader subtracts this from the coordinates */
    fct_extent extent;  /* the coordinates in double, if the file can hold more digits than a float */
    float *positions;   /* vertex_count x 3 */
    float *colors;      /* vertex_count x 3, linear, or NULL */
    float *normals;     /* vertex_count x 3 or NULL */
    float *irradiance, *direct, *indirect; /* vertex_count x 3 or NULL */
    float *error;                          /* vertex_count or NULL */
    uint32_t *corners;                     /* corner_count vertex indices, possibly out of range */
    uint32_t *starts;      /* polygon_count + 1 places in corners, ascending, or NULL: three corners each */
    float *texcoords;      /* corner_count x 2 or NULL */
    float *corner_normals; /* corner_count x 3 or NULL */
    float *polygon_colors; /* polygon_count x 3, linear, or NULL */
    uint32_t *materials;   /* polygon_count, or NULL */
    uint32_t material_count;
    char **material_names; /* material_count strings, or NULL */
} fct_soup;

/* Stores a point relative to the origin, and adds it to the extent. */
static inline void fct_soup_place(fct_soup *soup, const double point[3], float *position) {
    for (int k = 0; k < 3; ++k) position[k] = (float)(point[k] - soup->origin[k]);
    fct_extent_add(&soup->extent, point);
}

void fct_soup_release(const fct_env *env, fct_soup *soup);

/* Checks indices and floats, triangulates and moves. The soup is empty afterwards, whatever the result. A
 * polygon of fewer than three corners gives no triangle but keeps its number, with one warning. An attribute
 * with a value that is not finite is dropped, with one warning. `name` begins every message. Errors: DATA,
 * MEMORY. */
fct_result fct_soup_mesh(const fct_env *env, const char *name, fct_soup *soup, fct_mesh *out);

#ifdef __cplusplus
}
#endif
#endif
