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

/* The same with corner_normals, as fct_mesh_load_shaded. */
fct_result fct_mesh_parse_shaded(const fct_env *env, const char *name, const void *data, size_t size,
                                 const char *format, fct_mesh *out);

#endif
