/* scene/read/gltf_paint.h: base colour textures of a glTF file. */
#ifndef FCT_SCENE_GLTF_PAINT_H
#define FCT_SCENE_GLTF_PAINT_H

#include "mesh/glb/document/glb.h"
#include "scene/read/textures.h"

typedef struct fct_gltf_paints {
    fct_scene *scene;
    fct_glb *glb;
    uint32_t *sets;     /* per material: n of its TEXCOORD_n */
    uint32_t *textures; /* per image: of the scene; FCT_NONE: not read yet */
    uint8_t *lost;      /* per image */
    fct_texture_loss loss;
} fct_gltf_paints;

/* Errors: MEMORY. */
fct_result fct_gltf_paints_create(fct_scene *scene, fct_glb *glb, fct_gltf_paints *out);
void fct_gltf_paints_release(fct_gltf_paints *paints);

/* Paints material `id` of the scene as `material`, number `index` of the file, says: with its texture,
 * sampler, and KHR_texture_transform, and with COLOR_0. A texture that cannot be read is left out. Errors:
 * DATA, MEMORY.
 */
fct_result fct_gltf_paint(fct_gltf_paints *paints, json_t *material, size_t index, const double factor[3],
                          uint32_t id);

#endif
