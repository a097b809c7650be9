/* cluster/merge/graft.h: puts clusters that are too tall to merge into the trees of their neighbours. */
#ifndef FCT_CLUSTER_GRAFT_H
#define FCT_CLUSTER_GRAFT_H

#include "cluster/merge/work.h"

/* Puts clusters that still have edges, but may not merge because of their heights, into the trees of their
 * neighbours. Does nothing for a mesh with materials. Adds the clusters that found no place to
 * work->stranded. Errors: MEMORY, CANCELLED. */
fct_result fct_work_graft(fct_work *work, const fct_mesh *mesh);

#endif
