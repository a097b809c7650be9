/* scene/read/json/instances.h: instances of scene.json. */
#ifndef FCT_SCENE_INSTANCES_H
#define FCT_SCENE_INSTANCES_H

#include "scene/read/json/document.h"

/* Reads `instances`, after materials and models. Errors: INPUT, DATA, MEMORY, CANCELLED. */
fct_result fct_document_read_instances(fct_document *d);

#endif
