/* tools/bake/scene.h: a baked scene as one .glb that keeps its nodes. */
#ifndef FCT_TOOLS_BAKE_SCENE_H
#define FCT_TOOLS_BAKE_SCENE_H

#include "facetree/radiosity.h"
#include "tools/kit/env.h"

/* Writes t->output, and the merged mesh to `also` unless that is NULL. Returns an exit code. */
int bake_write_scene(tool *t, fct_bake *bake, const char *also, const fct_mesh_save_def *def);

#endif
