/* tools/kit/model.c: what commands open: a mesh file or a hierarchy file, as a tree or as a mesh. */
#include "tools/kit/tool.h"

#include <math.h>
#include <string.h>

bool tool_is_scene_name(const char *path) {
    return tool_ends(path, "json") || tool_ends(path, "gltf");
}

int tool_open_tree(tool *t, const char *path, const fct_tree_def *def, fct_tree **tree) {
    *tree = NULL;
    if (tool_ends(path, "fct")) return tool_result(t, fct_tree_open(&t->env, path, tree));
    fct_tree_def usual = fct_tree_def_default();
    fct_mesh mesh;
    int code = tool_result(t, fct_mesh_load(&t->env, path, &mesh));
    if (code != TOOL_DONE) return code;
    t->items = mesh.face_count;
    t->unit = "faces";
    if (mesh.face_count == 0)
        code = tool_fail(t, TOOL_DATA, "%s: expected at least one face, found none", path);
    else
        code = tool_result(t, fct_tree_build(&t->env, &mesh, def ? def : &usual, NULL, tree));
    fct_mesh_release(&t->env, &mesh);
    return tool_context(t, code, path);
}

double tool_diagonal(const fct_tree *tree) {
    fct_bounds b = fct_tree_get(tree).bounds;
    double squared = 0;
    for (int i = 0; i < 3; ++i) squared += pow((double)b.upper[i] - (double)b.lower[i], 2);
    return sqrt(squared);
}

double tool_length_of(const fct_tree *tree, tool_length length) {
    return length.percent ? length.value / 100 * tool_diagonal(tree) : length.value;
}

int tool_load_mesh(tool *t, const char *path, fct_mesh *mesh) {
    if (!tool_ends(path, "fct")) return tool_result(t, fct_mesh_load(&t->env, path, mesh));
    fct_tree *tree;
    int code = tool_result(t, fct_tree_open(&t->env, path, &tree));
    if (code != TOOL_DONE) return code;
    code = tool_result(t, fct_tree_mesh(&t->env, tree, mesh));
    fct_tree_destroy(tree);
    return code;
}

int tool_save_mesh(tool *t, const char *path, const fct_mesh *mesh, double exposure) {
    fct_mesh_save_def def = fct_mesh_save_def_default();
    def.exposure = (float)exposure;
    return tool_result(t, fct_mesh_save(&t->env, path, mesh, &def));
}

error_t tool_parse_backend(struct argp_state *state, const char *name, const char *text,
                           fct_backend *backend) {
    static const char *const names[] = {"obb", "embree", NULL};
    int index;
    error_t error = tool_parse_choice(state, name, text, names, &index);
    if (!error) *backend = index ? FCT_BACKEND_EMBREE : FCT_BACKEND_OBB;
    return error;
}

/* A walk through the 192^3 colours from byte 64 to 255 by a step that is prime to their number and near the
 * golden section of it, so that close indices lie far apart. */
void tool_palette(uint32_t index, float color[3]) {
    const uint64_t side = 192, count = side * side * side, step = 4373987;
    uint64_t place = ((index + 1) * step) % count;
    for (int c = 0; c < 3; ++c, place /= side) {
        double s = (double)(64 + place % side) / 255;
        color[c] = (float)pow((s + 0.055) / 1.055, 2.4);
    }
}
