/* partition/chart/merge.h: merging neighbouring charts. */
#ifndef FCT_PARTITION_CHART_MERGE_H
#define FCT_PARTITION_CHART_MERGE_H

#include "partition/chart/charter.h"

/* Merges neighbours whose union is a chart by c->def, and relabels. Errors: MEMORY, CANCELLED. */
fct_result fct_charts_merge(const fct_env *env, fct_charter *c);

#endif
