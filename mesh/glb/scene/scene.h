/* mesh/glb/scene/scene.h: a glTF document that gets the lit meshes of a scene. */
#ifndef FCT_MESH_GLB_SCENE_H
#define FCT_MESH_GLB_SCENE_H

#include "facetree/mesh.h"

typedef struct fct_glb_scene fct_glb_scene;

/* Begins an empty document, or with `document` (a .glb or .gltf) one that keeps its nodes, materials,
 * textures, cameras, lights and extras. Errors: INPUT, DATA, MEMORY. */
fct_result fct_glb_scene_create(const fct_env *env, const char *document, fct_glb_scene **out);
/* NULL is allowed. */
void fct_glb_scene_destroy(fct_glb_scene *scene);

typedef struct fct_glb_paint {
    const char *name;
    const float *reflectance, *emission; /* RGB */
    bool two_sided;
} fct_glb_paint;
/* Adds an unlit white material, so that viewers show the colours of the vertices as they are. Its members
 * emissiveFactor (with KHR_materials_emissive_strength above 1) and extras hold the emission and the
 * reflectance. Errors: MEMORY. */
fct_result fct_glb_scene_add_material(fct_glb_scene *scene, const fct_glb_paint *paint);
/* Adds a root node. transform: rows of R|t, whose columns are orthogonal, or NULL. Errors: MEMORY. */
fct_result fct_glb_scene_add_node(fct_glb_scene *scene, const char *name, const double transform[12],
                                  uint32_t *node);
/* Whether a node can have the transform: its columns are orthogonal. */
bool fct_glb_scene_can_place(const double transform[12]);
/* Adds a node with a camera that looks along `forward`. vertical_fov: degrees. Errors: MEMORY. */
fct_result fct_glb_scene_add_camera(fct_glb_scene *scene, const double position[3], const float forward[3],
                                    const float up[3], double vertical_fov);

/* What a lit mesh is. */
typedef struct fct_glb_lit {
    uint32_t node;
    const char *name;        /* of the mesh, in a new document */
    int64_t mesh;            /* of a given document, else -1 */
    uint32_t material;       /* in a new document */
    bool one_sided;          /* another surface at the same place has the light of the back */
    bool back;               /* it is the back: its normals are those of the front, negated */
    bool file_normals;       /* given document: its normals replace those of the lit mesh where it has some */
    const uint32_t *corners; /* given document: per face x 3, the vertices of the face's source, in the order
                                in which a reader joins the primitives of the mesh */
} fct_glb_lit;
/* Adds a lit mesh in the space of its node, with source_faces (faces of the mesh of the document) and
 * source_uv, and takes its arrays. In a given document it becomes one primitive per primitive of the mesh,
 * with the attributes of the file interpolated; its normals only as file_normals says. Errors: DATA (the
 * document is not that of the mesh), INPUT, MEMORY; the mesh is released then. */
fct_result fct_glb_scene_add_lit(fct_glb_scene *scene, const fct_glb_lit *lit, fct_mesh *mesh);

/* Writes the document as a .glb. Nodes without a lit mesh have none. Errors: OUTPUT, DATA, INPUT, MEMORY,
 * CANCELLED. */
fct_result fct_glb_scene_save(fct_glb_scene *scene, const char *path, const fct_mesh_save_def *def);

#endif
