/* scene/read/json/scene_json.h: reads scene.json into a scene. */
#ifndef FCT_SCENE_SCENE_JSON_H
#define FCT_SCENE_SCENE_JSON_H

#include "scene/scene.h"

/* Adds the contents of a scene.json to an empty scene. `name` is for messages, `base` is the folder of
 * relative paths ("" or ending in '/'). Errors: DATA, INPUT, MEMORY, CANCELLED. */
fct_result fct_scene_read_json(fct_scene *scene, const char *name, const char *text, size_t size,
                               const char *base);

#endif
