/* mesh/soup.h: what every reader hands over: polygons as lists of vertex indices, in the file's order.
 *
 * A reader fills a soup with arrays from fct_allocate; fct_soup_mesh checks it, cuts polygons into triangles
 * and moves the arrays into a mesh. A soup of triangles alone (starts == NULL) is moved without a copy.
 */
#ifndef FCT_MESH_SOUP_H
#define FCT_MESH_SOUP_H

#include "base/env.h"
#include "facetree/mesh.h"

/* More vertices or faces than this are refused, so that ids fit an int and FCT_NONE stays free. */
#define FCT_MESH_LIMIT ((uint64_t)INT32_MAX - 1)

typedef struct fct_soup {
    uint32_t vertex_count, polygon_count;
    size_t corner_count;
    float *positions;      /* vertex_count x 3 */
    float *colors;         /* vertex_count x 3, linear, or NULL */
    float *normals;        /* vertex_count x 3 or NULL */
    uint32_t *corners;     /* corner_count vertex indices, possibly out of range */
    uint32_t *starts;      /* polygon_count + 1 places in corners, or NULL: three corners each */
    float *texcoords;      /* corner_count x 2 or NULL */
    float *polygon_colors; /* polygon_count x 3, linear, or NULL */
    uint32_t *materials;   /* polygon_count, or NULL */
    uint32_t material_count;
    char **material_names; /* material_count strings, or NULL */
} fct_soup;

void fct_soup_release(const fct_env *env, fct_soup *soup);

/* Checks indices and floats, triangulates and moves. The soup is empty afterwards, whatever the result.
 * Polygons have at least three corners. `name` begins every message. Errors: DATA, MEMORY. */
fct_result fct_soup_mesh(const fct_env *env, const char *name, fct_soup *soup, fct_mesh *out);

/* fct_mesh_validate with a name before its messages (NULL: none). */
fct_result fct_mesh_check(const fct_env *env, const char *name, const fct_mesh *mesh);

/* A copy of `length` bytes of text with a zero behind, or NULL. */
char *fct_copy_text(const fct_env *env, const char *text, size_t length);

void fct_names_release(const fct_env *env, char **names, uint32_t count);

#endif
