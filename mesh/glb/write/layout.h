/* mesh/glb/write/layout.h: the vertices and faces of a mesh in the order of a glTF file.
 *
 * In glTF, texture coordinates belong to vertices, so a vertex whose corners have different ones is repeated
 * after the last vertex. Faces are sorted by material, because each material makes a primitive.
 */
#ifndef FCT_MESH_GLB_LAYOUT_H
#define FCT_MESH_GLB_LAYOUT_H

#include "mesh/sink.h"

typedef struct fct_glb_layout {
    uint32_t vertex_count;
    uint32_t *origins; /* mesh vertex of each file vertex, NULL: the same */
    float *texcoords;  /* vertex_count x 2, or NULL */
    uint32_t *corners; /* 3 x face_count, NULL: the triangles of the mesh */
    uint32_t *order;   /* faces sorted by material, NULL: mesh order */
    uint32_t *firsts;  /* material_count + 1 places in `order`, NULL: one material */
} fct_glb_layout;

/* Errors: DATA (too many vertices), MEMORY. */
fct_result fct_glb_layout_build(const fct_sink *sink, fct_glb_layout *out);
void fct_glb_layout_release(const fct_env *env, fct_glb_layout *layout);

#endif
