/* cluster/tree/build.h: common code of building in memory and from file to file. */
#ifndef FCT_CLUSTER_BUILD_H
#define FCT_CLUSTER_BUILD_H

#include "base/env.h"
#include "facetree/cluster.h"

/* Checks size, weights and costs; weights above 1e30 would give costs that a float cannot hold. Errors: DATA.
 */
fct_result fct_tree_check_def(const fct_env *env, const fct_tree_def *def);

#endif
