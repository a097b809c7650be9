/* tools/bake/scene.c: see scene.h. */
#include "tools/bake/scene.h"

#include <string.h>
#include <sys/stat.h>

#include "tools/bake/save.h"
#include "tools/guard/inputs.h"
#include "tools/kit/file.h"
#include "tools/kit/model.h"

int bake_write_scene(tool *t, fct_bake *bake, const char *also, const fct_mesh_save_def *def) {
    /* A pipe can be read only once, so its nodes come from the scene. */
    const char *input = t->inputs[0];
    struct stat status;
    const bool again = strcmp(input, "-") != 0 && !stat(input, &status) && S_ISREG(status.st_mode);
    const char *document = tool_is_gltf(t, input) && again ? input : NULL;
    fct_mesh merged = {0};
    int code = tool_refuse_input(t, t->output);
    if (code == TOOL_DONE) code = tool_check_inputs(t);
    if (code == TOOL_DONE)
        code = tool_result(t, fct_bake_save_scene(bake, t->output, document, def, also ? &merged : NULL));
    t->wrote |= code == TOOL_DONE;
    if (code == TOOL_DONE && also) code = bake_save_mesh(t, also, &merged, def);
    fct_mesh_release(&t->env, &merged);
    return code;
}
