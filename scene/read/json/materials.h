/* scene/read/json/materials.h: light groups and materials of scene.json. */
#ifndef FCT_SCENE_MATERIALS_H
#define FCT_SCENE_MATERIALS_H

#include "scene/read/json/document.h"

/* Reads `light_groups`, then `materials`. Errors: DATA, MEMORY. */
fct_result fct_document_read_materials(fct_document *d);

#endif
