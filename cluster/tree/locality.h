/* cluster/tree/locality.h: a mesh whose faces and vertices are in no order gets one, for the time of a build.
 */
#ifndef FCT_CLUSTER_LOCALITY_H
#define FCT_CLUSTER_LOCALITY_H

#include "base/env.h"
#include "facetree/cluster.h"

typedef struct fct_local_mesh {
    fct_mesh mesh;              /* what a tree needs of the mesh */
    uint32_t *faces, *vertices; /* the mesh's own ids of both; NULL: they are the same */
} fct_local_mesh;

/* The mesh itself where neighbours lie near each other in memory, as a rule, where it is small or loose; it
 * must outlive *out. Errors: MEMORY; then *out needs no release. */
fct_result fct_local_mesh_create(const fct_env *env, const fct_mesh *mesh, fct_local_mesh *out);
/* Turns ids into those of the mesh. */
void fct_local_mesh_restore(const fct_env *env, const fct_local_mesh *local, uint32_t *face_ids,
                            uint32_t *vertex_ids);
void fct_local_mesh_release(const fct_env *env, fct_local_mesh *local);

#endif
