/* cluster/tree/welded.c: see welded.h. */
#include "cluster/tree/welded.h"

fct_result fct_tree_view_weld(const fct_env *env, const fct_tree_view *view, fct_tree_view *out,
                              fct_weld *weld) {
    const fct_mesh mesh = {.vertex_count = view->vertex_count,
                           .face_count = view->face_count,
                           .positions = (float *)view->positions,
                           .triangles = (uint32_t *)view->triangles};
    *out = *view, *weld = (fct_weld){0};
    if (!view->def.weld) return FCT_OK;
    fct_result result = fct_weld_build(env, &mesh, weld);
    if (weld->triangles) out->triangles = weld->triangles;
    return result;
}
