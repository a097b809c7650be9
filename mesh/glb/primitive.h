/* mesh/glb/primitive.h: appends the meshes of a glTF file to a soup of triangles. */
#ifndef FCT_MESH_GLB_PRIMITIVE_H
#define FCT_MESH_GLB_PRIMITIVE_H

#include "mesh/glb/nodes.h"

/* The accessors of a primitive; FCT_GLB_ABSENT: none. */
typedef struct fct_glb_primitive {
    int64_t position, normal, color, light, error, texcoord, indices, material, mode;
    const char *light_name; /* the attribute of `light`: _RADIOSITY, or another quantity of a bake */
} fct_glb_primitive;

/* Collects triangles. Set glb, soup and the has_ members; the rest begins as zeros. */
typedef struct fct_glb_builder {
    fct_glb *glb;
    fct_soup *soup;
    /* The arrays that the soup gets. has_normals: primitives have normals; those
     * without get zeros. */
    bool has_colors, has_normals, has_errors, has_texcoords, has_materials;
    uint32_t unnamed; /* number of the material that primitives without one get */
    /* Faces get the number of their primitive of triangles instead of a material, and points are left out. */
    bool by_primitive;
    uint32_t primitive_count; /* so far */
    /* Per material of the file: n of the TEXCOORD_n that it uses; NULL: 0 for all. */
    const uint32_t *texcoord_sets;

    size_t without_color, without_texcoord; /* vertices and corners without a value in the file */
    size_t clear;                           /* vertices whose colour has an alpha below 1 */
    size_t incomplete;                      /* primitives that end with an incomplete triangle */

    size_t vertex_capacity, color_capacity, normal_capacity, error_capacity, corner_capacity,
        texcoord_capacity, material_capacity;
} fct_glb_builder;

/* The name of the light that a primitive's attributes hold: _RADIOSITY, else _IRRADIANCE, _DIRECT or
 * _INDIRECT, else NULL. */
const char *fct_glb_find_light(json_t *attributes);

/* Whether two consecutive primitives have the same vertices in the soup. */
bool fct_glb_share_vertices(const fct_glb_primitive *a, const fct_glb_primitive *b);

/* Decides which arrays the soup has: colours, texture coordinates and materials if any primitive has them,
 * normals and the error of the light if all primitives have them. *unnamed: a primitive has no material.
 * Errors: DATA. */
fct_result fct_glb_choose_arrays(fct_glb_builder *builder, bool *unnamed);

/* Reads the members of a primitive. An absent mode is 4. Errors: DATA. */
fct_result fct_glb_read_primitive(const fct_glb *glb, json_t *object, fct_glb_primitive *out);

/* Sets `texcoord` to the accessor of the set that the primitive's material uses. Errors: DATA. */
fct_result fct_glb_choose_texcoords(const fct_glb_builder *builder, json_t *object,
                                    fct_glb_primitive *primitive);

/* Appends the triangles of mesh `index` under a transform. Consecutive primitives that use the same accessors
 * share their vertices. Strips and fans become triangles; points become vertices; lines are left out. A
 * mirroring transform reverses the winding, as the specification demands. Call fct_glb_end_soup at the end.
 * Errors: DATA, INPUT, MEMORY. */
fct_result fct_glb_append_mesh(fct_glb_builder *builder, int64_t index, const fct_glb_transform *to_world);
/* Allocates arrays of length 0, so that no array of an empty soup is NULL. Errors: MEMORY. */
fct_result fct_glb_begin_soup(fct_glb_builder *builder);
/* Sets soup->polygon_count. */
void fct_glb_end_soup(const fct_glb_builder *builder);
/* Sends one warning for each kind of data that was left out or added. */
void fct_glb_report_builder(const fct_glb_builder *builder);

#endif
