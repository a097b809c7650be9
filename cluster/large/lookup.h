/* cluster/large/lookup.h: reads single nodes, triangles and vertices of a large mesh from the spools and the
 * mesh file, through a cache of blocks. */
#ifndef FCT_CLUSTER_LARGE_LOOKUP_H
#define FCT_CLUSTER_LARGE_LOOKUP_H

#include "cluster/large/large.h"

typedef struct fct_lookup {
    fct_large *large;
    fct_cache nodes, triangles, vertices;
} fct_lookup;

/* The caches take about `bytes` bytes. Errors: MEMORY. */
fct_result fct_lookup_open(fct_large *large, size_t bytes, fct_lookup *out);
/* The lookup may be all zeros. */
void fct_lookup_close(fct_lookup *lookup);
/* The error after a function below returned NULL or false. */
fct_result fct_lookup_result(const fct_lookup *lookup);

/* An inner node of a part, valid until the next call. */
const fct_cluster *fct_lookup_node(fct_lookup *lookup, const fct_part *part, uint32_t node);
/* Position of a vertex of the input, valid until the next call. */
const float *fct_lookup_vertex(fct_lookup *lookup, uint32_t vertex);
/* Corners of the face at a place of a part: 3 x 3. */
bool fct_lookup_face(fct_lookup *lookup, const fct_part *part, uint32_t place, float corners[9]);

#endif
