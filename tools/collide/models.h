/* tools/collide/models.h: the two models of a question; with --self both are one. */
#ifndef FCT_TOOLS_COLLIDE_MODELS_H
#define FCT_TOOLS_COLLIDE_MODELS_H

#include "tools/kit/env.h"

typedef struct collide_models {
    fct_tree *tree_a, *tree_b; /* tree_b and b: NULL if there is one model */
    fct_bvh *a, *b;
} collide_models;

/* Opens the inputs of the command. parts: FCT_BVH_SIGN or 0, beside FCT_BVH_PAIRS. Returns an exit code. */
int collide_models_open(tool *t, uint32_t parts, collide_models *out);
void collide_models_close(collide_models *models);

#endif
