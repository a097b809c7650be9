/* cluster/tree/locality.h: a sorted copy of a mesh in no order, which lives during a build. */
#ifndef FCT_CLUSTER_LOCALITY_H
#define FCT_CLUSTER_LOCALITY_H

#include "base/env.h"
#include "facetree/cluster.h"

typedef struct fct_local_mesh {
    fct_mesh mesh;              /* the members that a tree needs */
    uint32_t *faces, *vertices; /* ids in the original mesh; NULL: the same */
} fct_local_mesh;

/* *out is a sorted copy, or the mesh itself if it is small, loose, or already in a good order. joined: the
 * number of vertices that other vertices replace in the dual graph. The mesh must outlive *out. Errors:
 * MEMORY; then *out needs no release. */
fct_result fct_local_mesh_create(const fct_env *env, const fct_mesh *mesh, uint32_t joined,
                                 fct_local_mesh *out);
/* Replaces ids of the copy by ids of the mesh. */
void fct_local_mesh_restore(const fct_env *env, const fct_local_mesh *local, uint32_t *face_ids,
                            uint32_t *vertex_ids);
void fct_local_mesh_release(const fct_env *env, fct_local_mesh *local);

#endif
