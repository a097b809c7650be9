/* partition/chart/audit.h: measures of finished charts. */
#ifndef FCT_PARTITION_CHART_AUDIT_H
#define FCT_PARTITION_CHART_AUDIT_H

#include "partition/chart/charter.h"

/* Sets charts, non_disks, largest_faces, largest_angle and both lengths of *stats from labels and triangles
 * alone. Errors: MEMORY. */
fct_result fct_charts_audit(const fct_env *env, const fct_charter *c, fct_chart_stats *stats);

#endif
