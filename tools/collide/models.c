/* tools/collide/models.c: see models.h. */
#include "tools/collide/models.h"

#include "tools/kit/model.h"

static int open_model(tool *t, const char *path, uint32_t parts, fct_tree **tree, fct_bvh **bvh) {
    fct_bvh_def def = fct_bvh_def_default();
    def.parts = FCT_BVH_PAIRS | parts;
    int code = tool_open_tree(t, path, NULL, tree);
    return code == TOOL_DONE ? tool_result(t, fct_bvh_build(&t->env, *tree, &def, bvh)) : code;
}

int collide_models_open(tool *t, uint32_t parts, collide_models *out) {
    *out = (collide_models){0};
    int code = open_model(t, t->inputs[0], parts, &out->tree_a, &out->a);
    if (code == TOOL_DONE && t->input_count == 2)
        code = open_model(t, t->inputs[1], parts, &out->tree_b, &out->b);
    return code;
}

void collide_models_close(collide_models *models) {
    fct_bvh_destroy(models->b);
    fct_bvh_destroy(models->a);
    fct_tree_destroy(models->tree_b);
    fct_tree_destroy(models->tree_a);
    *models = (collide_models){0};
}
