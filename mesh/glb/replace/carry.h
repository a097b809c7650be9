/* mesh/glb/replace/carry.h: what a document keeps when its geometry is written anew. */
#ifndef FCT_MESH_GLB_CARRY_H
#define FCT_MESH_GLB_CARRY_H

#include "mesh/glb/replace/document.h"
#include "mesh/glb/write/export.h"

/* Opens a document without reading its meshes. Errors: INPUT, DATA, MEMORY. */
fct_result fct_gltf_open_document(const fct_env *env, const char *path, fct_gltf **out);

/* A copy of the root without geometry, animations and skins, and without the extensions that encode geometry;
 * nodes keep their mesh. The caller calls json_decref. Errors: MEMORY. */
fct_result fct_gltf_copy_root(const fct_gltf *gltf, json_t **root);
/* Removes an extension from an object, and its list of extensions if it was the last. */
void fct_gltf_remove_extension(json_t *object, const char *name);

/* The bytes of images, to be written behind the geometry. */
typedef struct fct_gltf_images {
    fct_glb_blob *blobs;
    size_t count;
    fct_glb_buffer *buffers; /* that keep the bytes */
    size_t buffer_count;
} fct_gltf_images;

/* Opens the images of `root`, a copy of the document's root, and makes them refer to buffer views from number
 * `view` on. An image whose file cannot be read stays a name, with a warning. Release *out also after a
 * failure. Errors: DATA, MEMORY. */
fct_result fct_gltf_store_images(fct_gltf *gltf, json_t *root, size_t view, fct_gltf_images *out);
void fct_gltf_release_images(const fct_env *env, fct_gltf_images *images);

/* Prints an object without its last brace. Returns whether it has members. *failed is set if it is NULL or
 * memory is exhausted. (json_dumps of jansson 2.14 can lose a key without an error when memory is exhausted.)
 */
bool fct_gltf_print_open(const json_t *object, FILE *json, bool *failed);

#endif
