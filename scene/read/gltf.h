/* scene/read/gltf.h: between the two halves of the glTF reader. */
#ifndef FCT_SCENE_GLTF_H
#define FCT_SCENE_GLTF_H

#include "base/env.h"

/* A .gltf with all its buffers as a GLB; *out is to be released. Errors: DATA, INPUT, MEMORY. */
fct_result fct_gltf_pack(const fct_env *env, const char *name, const char *text, size_t size,
                         const char *base, unsigned char **out, size_t *out_size);

#endif
