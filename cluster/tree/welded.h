/* cluster/tree/welded.h: the mesh of a tree with the triangles that connect its faces. */
#ifndef FCT_CLUSTER_WELDED_H
#define FCT_CLUSTER_WELDED_H

#include "facetree/cluster.h"
#include "facetree/dual.h"

/* *out is the view with the triangles of a weld, if the tree was built with one, else a copy of the view.
 * *weld owns these triangles. Errors: MEMORY, CANCELLED; then *weld is all zero. */
fct_result fct_tree_view_weld(const fct_env *env, const fct_tree_view *view, fct_tree_view *out,
                              fct_weld *weld);

#endif
