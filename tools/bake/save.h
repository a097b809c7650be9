/* tools/bake/save.h: writes a lit mesh in any format. */
#ifndef FCT_TOOLS_BAKE_SAVE_H
#define FCT_TOOLS_BAKE_SAVE_H

#include "tools/kit/env.h"

/* Saves the mesh. Colours of faces become colours of vertices where the format has no place for them; then
 * each face gets its own vertices. Returns an exit code. */
int bake_save_mesh(tool *t, const char *path, const fct_mesh *mesh, const fct_mesh_save_def *def);

#endif
