/* cluster/merge/rounds/rounds.h: contraction in rounds. */
#ifndef FCT_CLUSTER_ROUNDS_H
#define FCT_CLUSTER_ROUNDS_H

#include "cluster/merge/work.h"

/* As fct_work_greedy, but merges many pairs at once as long as that pays. Errors: MEMORY, CANCELLED. */
fct_result fct_work_rounds(fct_work *work, bool across);

#endif
