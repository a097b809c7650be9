/* radiosity/output/anchor_tree.h: the anchors of a surface in a kd-tree.
 *
 * An anchor is a point whose indirect light is known. The tree is implicit: of the anchors [begin, end) of a
 * node, the middle one splits along its axis; the lower half lies before it, the upper half after it.
 */
#ifndef FCT_RADIOSITY_ANCHOR_TREE_H
#define FCT_RADIOSITY_ANCHOR_TREE_H

#include "base/env.h"

typedef struct fct_anchor {
    float position[3], normal[3]; /* the sample point; the normal is on the side that receives the light */
    float offset;                 /* rays start at position + offset * normal */
    float reach;          /* harmonic mean distance of the hits, clamped: how far the light is valid */
    float irradiance[3];  /* RGB */
    float gradient[3][3]; /* per channel: dE/dn, across n; E(n') is about E + gradient . (n' - n) */
} fct_anchor;

typedef struct fct_anchors {
    fct_anchor *items; /* in kd-tree order */
    uint8_t *axes;     /* split axis of each item's node */
    uint32_t count;
    double turn; /* world units: the distance that counts like |n - n'| = 1 in the search */
    uint64_t rays;
} fct_anchors;

/* Anchors that a blend uses. Fewer leave more noise, more blur contacts. */
enum { FCT_NEAREST_ANCHORS = 24 };

/* |n - n'|^2 = 2 - 2 cos beyond which an anchor is not used: 37 degrees. The vertices of one group are nearer
 * (anchor.c), so each vertex finds at least its own anchor. */
#define FCT_MOST_TURN2 .4

/* Nearest anchors, nearest first. */
typedef struct fct_nearest {
    uint32_t ids[FCT_NEAREST_ANCHORS];
    double distances2[FCT_NEAREST_ANCHORS]; /* |p - p'|^2 + turn^2 |n - n'|^2 */
    int count;
} fct_nearest;

/* Sorts the items into kd-tree order and fills `axes`. O(n log n). */
void fct_anchors_order(fct_anchors *anchors);
/* The nearest anchors to a point with a unit normal, among those whose normal is within 37 degrees of it, or
 * among all if there is none. */
void fct_anchors_nearest(const fct_anchors *anchors, const float point[3], const float normal[3],
                         fct_nearest *found);
void fct_anchors_release(const fct_env *env, fct_anchors *anchors);

#endif
