/* simplify/topology/topology.h: from an indexed mesh to points, wedges, rings and edges. */
#ifndef FCT_SIMPLIFY_TOPOLOGY_H
#define FCT_SIMPLIFY_TOPOLOGY_H

#include "simplify/state.h"

/* Fills all arrays of `s` per point, corner, edge and wedge except attributes and quadrics. Needs the
 * channels. Errors: MEMORY. */
fct_result fct_simplify_topology(fct_simplifier *s);

#endif
