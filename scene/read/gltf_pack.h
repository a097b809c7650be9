/* scene/read/gltf_pack.h: turns a .gltf into a GLB. */
#ifndef FCT_SCENE_GLTF_PACK_H
#define FCT_SCENE_GLTF_PACK_H

#include "base/env.h"

/* Packs a .gltf and all its buffers into one GLB in memory. `name` is for messages, `base` is the folder of
 * relative paths ("" or ending in '/'). The caller releases *out. Errors: DATA, INPUT, MEMORY. */
fct_result fct_gltf_pack(const fct_env *env, const char *name, const char *text, size_t size,
                         const char *base, unsigned char **out, size_t *out_size);

#endif
