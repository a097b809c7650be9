/* radiosity/surface/parts.h: the parts of a model that share no vertex position, such as books on the desk of
 * one mesh. */
#ifndef FCT_RADIOSITY_PARTS_H
#define FCT_RADIOSITY_PARTS_H

#include "facetree/cluster.h"

/* A part is named by its lowest tree vertex. */
typedef struct fct_parts {
    uint32_t *faces; /* input face -> part; NULL if the model is one part */
    uint32_t *nodes; /* node of the tree, leaves included -> part, or FCT_NONE if it has faces of several */
} fct_parts;

/* The tree has passed its check. O(F). Errors: MEMORY. */
fct_result fct_parts_create(const fct_env *env, const fct_tree *tree, fct_parts *out);
void fct_parts_release(const fct_env *env, fct_parts *parts);

#endif
