/* tools/bake/outputs.h: the quantities that a bake writes. */
#ifndef FCT_TOOLS_BAKE_OUTPUTS_H
#define FCT_TOOLS_BAKE_OUTPUTS_H

#include <argp.h>

#include "facetree/radiosity.h"
#include "tools/kit/env.h"

/* FCT_MESH_ bits; FCT_MESH_COLORS is the radiosity. Neither normals nor the error are the first. */
typedef struct bake_outputs {
    unsigned lights;
    unsigned first; /* the one that makes the colours */
} bake_outputs;

/* Reads a list such as "radiosity,irradiance". */
error_t bake_parse_outputs(struct argp_state *state, const char *text, bake_outputs *out);
/* The names of the outputs, the first one first. */
json_t *bake_list_outputs(const bake_outputs *outputs);
/* What fct_mesh_save writes. */
void bake_set_save(const bake_outputs *outputs, fct_mesh_save_def *def);

#endif
