/* scene/point.c: attributes at a point of an instance. */
#include "mesh/point.h"
#include "scene/scene.h"
#include "scene/transform.h"

void fct_scene_point(const fct_scene *scene, uint32_t instance, uint32_t place, float u, float v,
                     fct_surface_point *out) {
    const fct_instance *placed = scene->instances + instance;
    const fct_model *model = scene->models + placed->model;
    const fct_tree_view tree = fct_tree_get(model->tree);
    const uint32_t *triangle = tree.triangles + 3 * (size_t)place;
    fct_face_attributes a = {0};
    v3 normal;
    if (model->normals)
        fct_take_vertices(model->normals, triangle, a.normals);
    else if (model->corner_normals)
        fct_take_corners(model->corner_normals + 9 * (size_t)place, 3, a.normals);
    if (model->texcoords) fct_take_corners(model->texcoords + 6 * (size_t)place, 2, a.texcoords);
    if (tree.colors)
        fct_take_vertices(tree.colors, triangle, a.colors);
    else if (model->face_colors)
        fct_take_corners(model->face_colors + 3 * (size_t)place, 0, a.colors);
    fct_interpolate_face(&a, u, v, &normal, out);
    /* The cofactors of R are its inverse transpose times its determinant. */
    normal = fct_transform_normal(placed->normal_matrix, v3_unit(normal));
    v3_store(out->normal, v3_unit(placed->mirrored ? v3_scale(normal, -1) : normal));
}
