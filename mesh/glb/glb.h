/* mesh/glb/glb.h: the container of a GLB file and the arrays in it. */
#ifndef FCT_MESH_GLB_H
#define FCT_MESH_GLB_H

#include <jansson.h>

#include "mesh/soup.h"

enum { FCT_GLB_ABSENT = -1 };

typedef struct fct_glb {
    const fct_source *source;
    json_t *root;
    const unsigned char *binary; /* the BIN chunk, NULL without one */
    size_t binary_size;
} fct_glb;

/* An accessor whose elements all lie within the BIN chunk. */
typedef struct fct_glb_array {
    const unsigned char *data;
    size_t stride, count;
    int component; /* 5120 byte .. 5126 float */
    int width;     /* components in an element */
    bool normalized;
} fct_glb_array;

/* Errors: DATA, MEMORY. fct_glb_close in any case. */
fct_result fct_glb_open(const fct_source *source, fct_glb *out);
void fct_glb_close(fct_glb *glb);

/* Element `index` of the root's array `name`, an object. Errors: DATA. */
fct_result fct_glb_item(const fct_glb *glb, const char *name, int64_t index, json_t **out);
/* An index in the object, ABSENT when it is not there. Errors: DATA (not a whole number from 0). */
fct_result fct_glb_index(const fct_glb *glb, json_t *object, const char *key, int64_t *out);
/* Accessor `index`, which has `least` to `most` components. Errors: DATA (external or sparse data, out of
 * bounds, another type). */
fct_result fct_glb_array_of(const fct_glb *glb, int64_t index, int least, int most, fct_glb_array *out);

/* Component k of element i; normalized integers are divided by their range. */
double fct_glb_value(const fct_glb_array *array, size_t i, int k);

#endif
