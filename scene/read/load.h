/* scene/read/load.h: readers of scene files; each adds to an empty scene, and fct_scene_load commits it. */
#ifndef FCT_SCENE_LOAD_H
#define FCT_SCENE_LOAD_H

#include "scene/scene.h"

/* A whole scene from the text of a scene.json; `name` is for messages, `base` the folder of relative paths
 * ("" or ending in '/'). For scene files and for fuzzers. */
fct_result fct_scene_parse_json(const fct_env *env, const char *name, const char *text, size_t size,
                                const char *base, fct_backend backend, fct_scene **out);

fct_result fct_scene_read_json(fct_scene *scene, const char *name, const char *text, size_t size,
                               const char *base);

/* An OBJ with materials (fct_scene_obj_names_materials) and their MTL. */
fct_result fct_scene_read_obj(fct_scene *scene, const char *name, const char *text, size_t size,
                              const char *base);
bool fct_scene_obj_names_materials(const char *text, size_t size);

/* A .gltf with its buffers, or a GLB. */
fct_result fct_scene_read_gltf(fct_scene *scene, const char *name, const unsigned char *data, size_t size,
                               const char *base);

/* What a model file holds: a hierarchy, or a mesh (the other is empty). */
typedef struct fct_model_file {
    fct_tree *tree;
    fct_mesh mesh;
} fct_model_file;
/* Opens a .fct; or a mesh file, of which the hierarchy beside it is opened instead when its recorded hash is
 * that of the mesh file. want_mesh: never a hierarchy unless `path` is one. A file without faces is an error.
 * Errors: INPUT, DATA, MEMORY, CANCELLED. */
fct_result fct_model_open(const fct_env *env, const char *path, bool want_mesh, fct_model_file *out);
void fct_model_close(const fct_env *env, fct_model_file *file);

/* "folder/" of a path, "" where there is none; base + relative unless that is absolute. To be released. */
char *fct_path_folder(const fct_env *env, const char *path);
char *fct_path_join(const fct_env *env, const char *base, const char *relative);
/* The name ends in `ending` (lower case, with its dot), in any case. */
bool fct_path_ends(const char *path, const char *ending);

#endif
