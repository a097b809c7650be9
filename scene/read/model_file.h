/* scene/read/model_file.h: opens the mesh or the hierarchy of a model. */
#ifndef FCT_SCENE_MODEL_FILE_H
#define FCT_SCENE_MODEL_FILE_H

#include "base/env.h"
#include "facetree/cluster.h"

/* A hierarchy, a mesh, or a hierarchy and the mesh beside it. */
typedef struct fct_model_file {
    fct_tree *tree; /* NULL: only a mesh */
    fct_mesh mesh;  /* empty: only a hierarchy */
    bool light;     /* its colours are radiosity, or may be: a hierarchy does not tell */
} fct_model_file;

/* Opens NAME.fct, or a mesh file. Instead of mesh file NAME.ply it opens NAME.fct beside it if that file
 * records the hash of NAME.ply; want_mesh switches this off. It opens the mesh too if the mesh has normals,
 * which a hierarchy does not store, and with want_paint. A file without faces is an error. fct_model_close
 * frees *out. Errors: INPUT, DATA, MEMORY, CANCELLED. */
fct_result fct_model_open(const fct_env *env, const char *path, bool want_mesh, bool want_paint,
                          fct_model_file *out);
void fct_model_close(const fct_env *env, fct_model_file *file);

#endif
