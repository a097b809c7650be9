/* simplify/classes.h: the classes of wedges: the wedges of a point that share an output vertex.
 *
 *      x1 | x2      A vertex on a texture seam is one class of two wedges. A vertex on a crease has two
 *      ---x---      classes. The wedges of a class differ only in texture coordinates.
 */
#ifndef FCT_SIMPLIFY_CLASSES_H
#define FCT_SIMPLIFY_CLASSES_H

#include "simplify/cost/groups.h"

/* The class of each group (group_count entries) after the contraction: the first wedge of one of its groups.
 * A group joins the class of an earlier one if they share a class at an end, and if at no end a group
 * of the class has another one. So a crease of one end stays a crease. */
void fct_classes_find(const fct_simplifier *s, const fct_groups *g, uint32_t *classes);
/* Makes the colours and normals of each class at a point equal: the mean over its corners, or with SUBSET
 * those of the wedge with the most corners. Equal ones keep their bits. Cost: O(wedges^2). */
void fct_classes_unify(fct_simplifier *s, uint32_t point);

#endif
