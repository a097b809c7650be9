/* tools/bake/probes.h: the light at points of a text file. */
#ifndef FCT_TOOLS_BAKE_PROBES_H
#define FCT_TOOLS_BAKE_PROBES_H

#include "tools/kit/rows.h"

typedef struct bake_probes {
    size_t count;
    tool_rows rows; /* x y z nx ny nz */
    float *points;  /* count x 3, relative to the origin of the scene */
    float *normals; /* count x 3, unit */
} bake_probes;

/* Reads rows "x y z nx ny nz"; "-" is standard input. Returns an exit code. */
int bake_read_probes(tool *t, const char *path, bake_probes *set);
/* Computes and prints the light at the probes. *out receives probes[] of --json. Returns an exit code. */
int bake_run_probes(tool *t, fct_bake *bake, const fct_scene_view *scene, const bake_probes *set,
                    json_t **out);
void bake_release_probes(tool *t, bake_probes *set);

#endif
