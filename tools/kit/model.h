/* tools/kit/model.h: opens a mesh file or a hierarchy file, as a tree or as a mesh. All return exit codes. */
#ifndef FCT_TOOLS_MODEL_H
#define FCT_TOOLS_MODEL_H

#include "tools/kit/env.h"
#include "tools/kit/options.h"

/* The hierarchy of a .fct file, or one built from a mesh file with `def` (NULL: the default), and with
 * --no-weld if the command got it. */
int tool_open_tree(tool *t, const char *path, const fct_tree_def *def, fct_tree **tree);
/* The same, and the mesh with all its attributes, in the order of the file; a .fct has only colours. The
 * caller releases it. mesh may be NULL. */
int tool_open_tree_mesh(tool *t, const char *path, const fct_tree_def *def, fct_tree **tree, fct_mesh *mesh);
/* Warns if the surface is closed and wound inwards. */
void tool_warn_inward(tool *t, const char *path, bool inward);
/* The mesh of a tree with the triangles that connect its faces: with --no-weld those of the input, else
 * vertices of equal position are one. */
int tool_tree_mesh(tool *t, const fct_tree *tree, fct_mesh *mesh);
/* The mesh of a mesh file or of a .fct file, turned if the command got --flip-inward. */
int tool_load_mesh(tool *t, const char *path, fct_mesh *mesh);
/* The triangles of a glTF file, and the file for tool_save_gltf. */
int tool_open_gltf(tool *t, const char *path, fct_gltf **gltf, fct_mesh *mesh);
int tool_save_gltf(tool *t, fct_gltf *gltf, const char *path, const fct_mesh *mesh);
/* Saves a mesh. */
int tool_save_mesh_as(tool *t, const char *path, const fct_mesh *mesh, const fct_mesh_save_def *def);
/* Saves a mesh. exposure: a factor on its colours for display. */
int tool_save_mesh(tool *t, const char *path, const fct_mesh *mesh, double exposure);

/* The diagonal of the bounds of the tree's mesh. */
double tool_diagonal(const fct_tree *tree);
/* A length option in the unit of the mesh. */
double tool_length_of(const fct_tree *tree, tool_length length);

#endif
