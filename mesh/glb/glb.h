/* mesh/glb/glb.h: opens a GLB file, and reads its JSON objects and accessors. */
#ifndef FCT_MESH_GLB_H
#define FCT_MESH_GLB_H

#include <jansson.h>

#include "mesh/soup.h"

enum { FCT_GLB_ABSENT = -1 };

typedef struct fct_glb {
    const fct_source *source;
    json_t *root;
    const unsigned char *binary; /* BIN chunk, NULL: the file has none */
    size_t binary_size;
} fct_glb;

/* An accessor. All its elements lie within the BIN chunk. */
typedef struct fct_glb_array {
    const unsigned char *data;
    size_t stride, count;
    int component; /* 5120 byte .. 5126 float */
    int width;     /* components in an element */
    bool normalized;
} fct_glb_array;

/* Errors: DATA, MEMORY. Call fct_glb_close even after an error. */
fct_result fct_glb_open(const fct_source *source, fct_glb *out);
void fct_glb_close(fct_glb *glb);

/* Finds object number `index` of the root's array `name`. Errors: DATA (no such object). */
fct_result fct_glb_item(const fct_glb *glb, const char *name, int64_t index, json_t **out);
/* Reads the index object[key]. *out = FCT_GLB_ABSENT if the object has no such key. Errors: DATA (not an
 * integer, or negative). */
fct_result fct_glb_index(const fct_glb *glb, json_t *object, const char *key, int64_t *out);
/* Finds accessor `index`, which must have `least` to `most` components per element. Errors: DATA (external or
 * sparse data, out of bounds, another type). */
fct_result fct_glb_array_of(const fct_glb *glb, int64_t index, int least, int most, fct_glb_array *out);

/* Component k of element i. Normalized integers are divided by their largest value. */
double fct_glb_value(const fct_glb_array *array, size_t i, int k);

#endif
