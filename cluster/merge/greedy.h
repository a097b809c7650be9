/* cluster/merge/greedy.h: contracts the cheapest dual edge, again and again (section 8.2). */
#ifndef FCT_CLUSTER_GREEDY_H
#define FCT_CLUSTER_GREEDY_H

#include "cluster/merge/work.h"

/* Contracts live edges, cheapest first, until no allowed edge is left. Unless `across`, only clusters of the
 * same material merge. The remaining edges stay in the work. Errors: MEMORY, CANCELLED. */
fct_result fct_work_greedy(fct_work *work, bool across);

#endif
