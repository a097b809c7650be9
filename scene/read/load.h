/* scene/read/load.h: a committed scene from a path or from text. */
#ifndef FCT_SCENE_LOAD_H
#define FCT_SCENE_LOAD_H

#include "facetree/scene.h"

/* A committed scene from the text of a scene.json. `name` is for messages, `base` is the folder of relative
 * paths ("" or ending in '/'). The tests and fuzzers call it. Errors: as fct_scene_load. */
fct_result fct_scene_parse_json(const fct_env *env, const char *name, const char *text, size_t size,
                                const char *base, fct_backend backend, fct_scene **out);

#endif
