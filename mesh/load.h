/* mesh/load.h: reads a mesh from memory. */
#ifndef FCT_MESH_LOAD_H
#define FCT_MESH_LOAD_H

#include "base/env.h"
#include "facetree/mesh.h"

/* `format` is "obj", "ply", "off", "stl", "glb", "gltf" or "om", in any case. `name` begins every message. A
 * glTF document in memory may not name other files. Errors: DATA (also for an unknown format), MEMORY,
 * CANCELLED. */
fct_result fct_mesh_parse(const fct_env *env, const char *name, const void *data, size_t size,
                          const char *format, fct_mesh *out);

/* The same, and fct_mesh_load, with corner_normals where the corners of a vertex have different normals. */
fct_result fct_mesh_parse_shaded(const fct_env *env, const char *name, const void *data, size_t size,
                                 const char *format, fct_mesh *out);
fct_result fct_mesh_load_shaded(const fct_env *env, const char *path, fct_mesh *out);

#endif
