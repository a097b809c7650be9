/* cluster/merge/join.h: joins the clusters that have no common edge into one tree. */
#ifndef FCT_CLUSTER_JOIN_H
#define FCT_CLUSTER_JOIN_H

#include "cluster/merge/work.h"

/* Joins all live clusters into one tree by proximity. Errors: MEMORY, CANCELLED. */
#define fct_work_join FCT_KERNEL(fct_work_join)
FCT_DECLARE_KERNEL(fct_result, fct_work_join, (fct_work * work, const fct_mesh *mesh));

#endif
