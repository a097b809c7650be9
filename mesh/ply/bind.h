/* mesh/ply/bind.h: assigns the properties of a PLY element to the arrays of the soup. */
#ifndef FCT_MESH_PLY_BIND_H
#define FCT_MESH_PLY_BIND_H

#include "mesh/ply/header.h"
#include "mesh/soup.h"

typedef enum fct_ply_kind { FCT_PLY_OTHER, FCT_PLY_VERTICES, FCT_PLY_FACES, FCT_PLY_STRIPS } fct_ply_kind;

/* Property number `property`, a scalar, is stored at to[record * stride]. */
typedef struct fct_ply_column {
    size_t property;
    float *to;
    size_t stride;
    double origin; /* to subtract */
    bool color;    /* integers are sRGB */
} fct_ply_column;

enum { FCT_PLY_COLUMNS = 24, FCT_PLY_NOWHERE = -1 };

typedef struct fct_ply_target {
    fct_ply_kind kind;
    fct_ply_column columns[FCT_PLY_COLUMNS];
    size_t column_count;
    ptrdiff_t positions[3]; /* property numbers, or NOWHERE */
    bool any_scale;         /* the colours are floats, which may be linear or sRGB from 0 to 255 */
    ptrdiff_t indices, texcoords, material; /* property numbers or NOWHERE */
} fct_ply_target;

/* The kind that the element's name stands for. */
fct_ply_kind fct_ply_kind_of(const fct_ply_element *element);

/* Assigns the element's properties to arrays, relative to soup->origin, and allocates the arrays that have a
 * fixed size per record. *vertex_texcoords receives an array V x 2 if vertices have texture coordinates. The
 * caller must have checked the element's count against the size of the file. Errors: DATA, MEMORY. */
fct_result fct_ply_bind(const fct_text *t, const fct_ply_header *header, const fct_ply_element *element,
                        fct_soup *soup, float **vertex_texcoords, fct_ply_target *out);

/* Adds the positions of `count` records to the extent, unless their type has no more digits than a float. The
 * arguments are those of fct_ply_fill_columns. */
void fct_ply_extend(const fct_ply_target *target, const fct_ply_property *properties,
                    const unsigned char *base, size_t size, const size_t *offsets, bool swap, bool as_double,
                    size_t count, fct_extent *extent);

/* Fills every column for records [begin, end). Record i begins at base + i * size; its property k begins
 * offsets[k] bytes later. as_double: the values are native doubles, whatever their declared type. */
void fct_ply_fill_columns(const fct_ply_target *target, const fct_ply_property *properties,
                          const unsigned char *base, size_t size, const size_t *offsets, bool swap,
                          bool as_double, size_t begin, size_t end);

#endif
