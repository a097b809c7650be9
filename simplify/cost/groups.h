/* simplify/cost/groups.h: the groups of wedges that become one when an edge is contracted.
 *
 *      a1 | a2      The faces f1 and f2 between a and b vanish. Each of them joins a wedge of a with a wedge
 *         a         of b: f1 joins a1 with b1, f2 joins a2 with b2. So there are two groups, and each group
 *      f1 | f2      becomes one wedge of the new point. A wedge that no such face touches is a group by
 *         b         itself.
 *      b1 | b2
 */
#ifndef FCT_SIMPLIFY_GROUPS_H
#define FCT_SIMPLIFY_GROUPS_H

#include "simplify/state.h"

typedef struct fct_groups {
    uint32_t wedge_count, group_count;
    uint32_t wedges[SIMPLIFY_MAX_WEDGES];   /* those of the first end, then those of the second */
    uint32_t group_of[SIMPLIFY_MAX_WEDGES]; /* per entry of `wedges`: below group_count */
    bool second[SIMPLIFY_MAX_WEDGES];       /* the wedge belongs to the second end */
} fct_groups;

/* The groups of the edge a-b of a mesh with attributes. False if there are too many wedges. Reads the rings.
 */
bool fct_groups_find(fct_simplifier *s, uint32_t a, uint32_t b, fct_groups *out);
/* Whether fct_groups_find would succeed. */
bool fct_groups_fit(const fct_simplifier *s, uint32_t a, uint32_t b);
/* sum (quadric_size): the sum of the group's quadrics. mean (channel_count): the mean of its attributes. */
void fct_groups_sum(const fct_simplifier *s, const fct_groups *g, uint32_t group, double *sum, double *mean);
/* Attributes (channel_count) of the group's first wedge at the given end (0 or 1). If the group has none
 * there, those of its first wedge. */
const double *fct_groups_end(const fct_simplifier *s, const fct_groups *g, uint32_t group, uint32_t end);

#endif
