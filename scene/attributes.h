/* scene/attributes.h: the data of a mesh that its tree does not hold, in the order of the tree. */
#ifndef FCT_SCENE_ATTRIBUTES_H
#define FCT_SCENE_ATTRIBUTES_H

#include "base/env.h"
#include "facetree/cluster.h"

/* The caller releases the arrays. */
typedef struct fct_attributes {
    float *texcoords;      /* per place x 3 x 2, or NULL */
    float *normals;        /* per tree vertex x 3, or NULL */
    float *corner_normals; /* per place x 3 x 3, or NULL */
    float *face_colors;    /* per place x 3, or NULL; only if the tree has no colours */
} fct_attributes;

/* Copies the attributes of the mesh from which the tree was built; NULL where the mesh has none, or only
 * zeros as normals. *out may have arrays after an error too. Errors: DATA (a damaged tree, or one of another
 * mesh), MEMORY. */
fct_result fct_attributes_copy(const fct_env *env, const fct_mesh *mesh, const fct_tree *tree,
                               fct_attributes *out);
/* Replaces v by 1 - v. Files other than glTF count v from the bottom of the image, models from the top. */
void fct_attributes_count_from_top(fct_mesh *mesh);

#endif
