/* mesh/ply/header.h: parses the header of a PLY file. */
#ifndef FCT_MESH_PLY_HEADER_H
#define FCT_MESH_PLY_HEADER_H

#include "mesh/text/text.h"

typedef enum fct_ply_type {
    FCT_PLY_NONE,
    FCT_PLY_INT8,
    FCT_PLY_UINT8,
    FCT_PLY_INT16,
    FCT_PLY_UINT16,
    FCT_PLY_INT32,
    FCT_PLY_UINT32,
    FCT_PLY_FLOAT,
    FCT_PLY_DOUBLE
} fct_ply_type;

typedef enum fct_ply_format { FCT_PLY_ASCII, FCT_PLY_LITTLE, FCT_PLY_BIG } fct_ply_format;

/* Names point into the file and have no zero at their end. */
typedef struct fct_ply_property {
    const char *name;
    size_t name_length;
    fct_ply_type count_type; /* NONE: a scalar; else a list */
    fct_ply_type type;
} fct_ply_property;

typedef struct fct_ply_element {
    const char *name;
    size_t name_length;
    uint64_t count;
    size_t first_property, property_count;
} fct_ply_element;

typedef struct fct_ply_header {
    fct_ply_format format;
    fct_ply_element *elements;
    fct_ply_property *properties;
    size_t element_count, property_count;
    char **material_names; /* of "comment facetree material NAME" lines */
    size_t material_count;
    size_t element_capacity, property_capacity, material_capacity;
} fct_ply_header;

/* Bytes per scalar. */
static inline size_t fct_ply_size(fct_ply_type type) {
    static const unsigned char sizes[] = {0, 1, 1, 2, 2, 4, 4, 4, 8};
    return sizes[type];
}

/* Returns the first byte after the header of the file that begins with `text`, or NULL if no header ends
 * within `size` bytes. Lines end with LF, CR LF or CR, as the first line does. */
const char *fct_ply_find_body(const char *text, size_t size);

/* Reads the header. t is then at the first byte after the line "end_header". Errors: DATA, MEMORY. Release
 * the header even after an error. */
fct_result fct_ply_read_header(fct_text *t, fct_ply_header *out);
void fct_ply_release_header(const fct_env *env, fct_ply_header *header);

#endif
