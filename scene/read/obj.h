/* scene/read/obj.h: reads OBJ with MTL into a scene. */
#ifndef FCT_SCENE_OBJ_H
#define FCT_SCENE_OBJ_H

#include "scene/scene.h"

/* Adds the objects of an OBJ with materials to an empty scene. `name` is for messages, `base` is the folder
 * of relative paths ("" or ending in '/'). Errors: DATA, INPUT, MEMORY, CANCELLED. */
fct_result fct_scene_read_obj(fct_scene *scene, const char *name, const char *text, size_t size,
                              const char *base);
/* Whether the OBJ has a usemtl or mtllib statement. */
bool fct_scene_obj_names_materials(const char *text, size_t size);

#endif
