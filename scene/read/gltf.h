/* scene/read/gltf.h: reads glTF 2.0 into a scene. */
#ifndef FCT_SCENE_GLTF_H
#define FCT_SCENE_GLTF_H

#include "scene/scene.h"

/* Adds the nodes of a .gltf or GLB to an empty scene. `name` is for messages, `base` is the folder of
 * relative paths ("" or ending in '/'; NULL: no file may be named). Errors: DATA, INPUT, MEMORY, CANCELLED.
 */
fct_result fct_scene_read_gltf(fct_scene *scene, const char *name, const unsigned char *data, size_t size,
                               const char *base);

#endif
