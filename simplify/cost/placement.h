/* simplify/cost/placement.h: where the point of a contracted edge goes, and what that costs. */
#ifndef FCT_SIMPLIFY_PLACEMENT_H
#define FCT_SIMPLIFY_PLACEMENT_H

#include "simplify/cost/quadric.h"

/* The wedges at both ends of an edge, grouped by the faces that go with it: where such a face joins a wedge
 * of one end and a wedge of the other, these become one. */
typedef struct fct_groups {
    uint32_t wedge_count, group_count;
    uint32_t wedges[SIMPLIFY_MAX_WEDGES];
    uint32_t group_of[SIMPLIFY_MAX_WEDGES];
    bool second[SIMPLIFY_MAX_WEDGES]; /* the wedge belongs to the second end */
} fct_groups;

typedef struct fct_candidate {
    v3 at;
    uint32_t end; /* 0 or 1 when `at` is that end, else 2 */
    double error; /* quadric error, at least 0 */
    double area;
    double resistance[6]; /* of the quadric to moves: xx xy xz yy yz zz */
    double key;           /* error plus the regularisation, which decides between equals */
} fct_candidate;

/* False where too many wedges meet. Reads rings, changes nothing. */
bool fct_groups_find(fct_simplifier *s, uint32_t a, uint32_t b, fct_groups *out);
/* The candidate for contracting a and b, by the policy; ends_only tries the ends and the middle. An end that
 * is a hub stays. False where the edge cannot be contracted as things are. */
bool fct_place(fct_simplifier *s, uint32_t a, uint32_t b, bool ends_only, fct_candidate *out);
/* Best attributes of a group (all channels) for the candidate. */
void fct_place_attributes(const fct_simplifier *s, const fct_groups *groups, uint32_t group,
                          const fct_candidate *candidate, v3 pa, v3 pb, double *attributes);

#endif
