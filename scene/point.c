/* scene/point.c: attributes at a point of an instance. */
#include "mesh/point.h"
#include "scene/scene.h"
#include "scene/transform.h"

void fct_scene_point(const fct_scene *scene, uint32_t instance, uint32_t place, float u, float v,
                     fct_surface_point *out) {
    const fct_instance *placed = scene->instances + instance;
    const fct_model *model = scene->models + placed->model;
    const fct_tree_view tree = fct_tree_get(model->tree);
    const fct_attribute_arrays arrays = {.normals = model->normals,
                                         .colors = tree.colors,
                                         .corner_normals = model->corner_normals,
                                         .texcoords = model->texcoords,
                                         .face_colors = model->face_colors};
    v3 normal;
    fct_interpolate_face(&arrays, tree.triangles + 3 * (size_t)place, place, u, v, &normal, out);
    /* The cofactors of R are its inverse transpose times its determinant. */
    normal = fct_transform_normal(placed->normal_matrix, v3_unit(normal));
    v3_store(out->normal, v3_unit(placed->mirrored ? v3_scale(normal, -1) : normal));
}
