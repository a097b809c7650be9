/* tools/kit/model.c: see model.h. */
#include "tools/kit/model.h"

#include <math.h>
#include <string.h>

#include "facetree/dual.h"
#include "tools/kit/file.h"

/* Builds the tree of a mesh file. *mesh is that of the file. */
static int build_tree(tool *t, const char *path, const fct_tree_def *def, fct_tree **tree, fct_mesh *mesh) {
    fct_tree_def used = def ? *def : fct_tree_def_default();
    used.weld = !t->no_weld;
    t->bar.items = mesh->face_count;
    t->bar.unit = "faces";
    if (mesh->face_count == 0)
        return tool_fail(t, TOOL_DATA, "%s: expected at least one face, found none", path);
    return tool_context(t, tool_result(t, fct_tree_build(&t->env, mesh, &used, NULL, tree)), path);
}

int tool_open_tree(tool *t, const char *path, const fct_tree_def *def, fct_tree **tree) {
    return tool_open_tree_mesh(t, path, def, tree, NULL);
}

int tool_open_tree_mesh(tool *t, const char *path, const fct_tree_def *def, fct_tree **tree, fct_mesh *mesh) {
    fct_mesh own = {0}, *read = mesh ? mesh : &own;
    *tree = NULL;
    *read = own;
    int code;
    if (tool_has_format(t, path, "fct")) {
        code = tool_result(t, fct_tree_open(&t->env, path, tree));
        if (code == TOOL_DONE && mesh) code = tool_result(t, fct_tree_mesh(&t->env, *tree, mesh));
    } else {
        code = tool_result(t, mesh ? fct_mesh_load_shaded(&t->env, path, mesh)
                                   : fct_mesh_load(&t->env, path, read));
        if (code == TOOL_DONE) code = build_tree(t, path, def, tree, read);
    }
    if (!mesh || code != TOOL_DONE) fct_mesh_release(&t->env, read);
    if (code == TOOL_DONE) return code;
    fct_tree_destroy(*tree);
    *tree = NULL;
    return code;
}

void tool_warn_inward(tool *t, const char *path, bool inward) {
    if (inward)
        tool_warn(t,
                  "%s: the surface is closed and wound inwards; --flip-inward of cluster or convert turns it",
                  path);
}

int tool_tree_mesh(tool *t, const fct_tree *tree, fct_mesh *mesh) {
    int code = tool_result(t, fct_tree_mesh(&t->env, tree, mesh));
    if (code != TOOL_DONE || !fct_tree_get(tree).def.weld) return code;
    fct_weld weld;
    code = tool_result(t, fct_weld_build(&t->env, mesh, &weld));
    if (weld.triangles) memcpy(mesh->triangles, weld.triangles, 3 * sizeof(uint32_t) * mesh->face_count);
    fct_weld_release(&t->env, &weld);
    if (code != TOOL_DONE) fct_mesh_release(&t->env, mesh);
    return code;
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

static int load_mesh(tool *t, const char *path, fct_mesh *mesh) {
    if (!tool_has_format(t, path, "fct")) return tool_result(t, fct_mesh_load(&t->env, path, mesh));
    fct_tree *tree;
    int code = tool_result(t, fct_tree_open(&t->env, path, &tree));
    if (code != TOOL_DONE) return code;
    code = tool_result(t, fct_tree_mesh(&t->env, tree, mesh));
    fct_tree_destroy(tree);
    return code;
}

/* Follows --flip-inward. Releases the mesh after a failure. */
static int turn_bodies(tool *t, const char *path, fct_mesh *mesh) {
    uint32_t count;
    if (!t->flip_inward) return TOOL_DONE;
    int code = tool_result(t, fct_inward_flip(&t->env, mesh, &count));
    if (code == TOOL_DONE) tool_say(t, "%s: turned %u closed bod%s", path, count, count == 1 ? "y" : "ies");
    if (code != TOOL_DONE) fct_mesh_release(&t->env, mesh);
    return code;
}

int tool_load_mesh(tool *t, const char *path, fct_mesh *mesh) {
    int code = load_mesh(t, path, mesh);
    return code == TOOL_DONE ? turn_bodies(t, path, mesh) : code;
}

int tool_open_gltf(tool *t, const char *path, fct_gltf **gltf, fct_mesh *mesh) {
    int code = tool_result(t, fct_gltf_open(&t->env, path, gltf, mesh));
    if (code == TOOL_DONE) code = turn_bodies(t, path, mesh);
    if (code == TOOL_DONE) return code;
    fct_gltf_close(*gltf);
    *gltf = NULL;
    return code;
}

int tool_save_gltf(tool *t, fct_gltf *gltf, const char *path, const fct_mesh *mesh) {
    int code = tool_refuse_input(t, path);
    if (code == TOOL_DONE) code = tool_check_inputs(t);
    if (code == TOOL_DONE) code = tool_result(t, fct_gltf_save(gltf, path, mesh, NULL));
    t->wrote |= code == TOOL_DONE;
    return code;
}

int tool_save_mesh_as(tool *t, const char *path, const fct_mesh *mesh, const fct_mesh_save_def *def) {
    int code = tool_refuse_input(t, path);
    if (code == TOOL_DONE) code = tool_check_inputs(t);
    if (code == TOOL_DONE) code = tool_result(t, fct_mesh_save(&t->env, path, mesh, def));
    t->wrote |= code == TOOL_DONE;
    return code;
}

int tool_save_mesh(tool *t, const char *path, const fct_mesh *mesh, double exposure) {
    fct_mesh_save_def def = fct_mesh_save_def_default();
    def.exposure = (float)exposure;
    return tool_save_mesh_as(t, path, mesh, &def);
}
