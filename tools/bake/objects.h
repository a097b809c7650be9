/* tools/bake/objects.h: a baked scene as one file per object. */
#ifndef FCT_TOOLS_BAKE_OBJECTS_H
#define FCT_TOOLS_BAKE_OBJECTS_H

#include "tools/bake/names.h"
#include "tools/kit/env.h"

typedef struct bake_objects {
    uint32_t count;
    uint32_t *first;  /* per object: its first instance */
    char **paths;     /* per object: its file */
    bake_names names; /* that are in use */
} bake_objects;

/* Chooses a file in t->output for each object, and refuses files that the command reads. Returns an exit
 * code. Release `out` also after a failure. */
int bake_plan_objects(tool *t, const fct_scene_view *scene, bake_objects *out);
/* Writes the files. `files` receives one {object, file, faces, source} per object. Returns an exit code. */
int bake_write_objects(tool *t, fct_bake *bake, const fct_scene_view *scene, bake_objects *objects,
                       const fct_mesh_save_def *def, json_t *files);
void bake_release_objects(tool *t, bake_objects *objects);

#endif
