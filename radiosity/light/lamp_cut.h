/* radiosity/light/lamp_cut.h: one lamp as a receiver sees it: the light without blockers, as a cut through
 * the lamp's cluster tree, and points on the lamp for shadow rays.
 *
 * All computations happen in the lamp's model space, because form factors do not change under rotation,
 * reflection and uniform scaling. A lamp under any other transform gets a tree of its own in world space.
 */
#ifndef FCT_RADIOSITY_LAMP_CUT_H
#define FCT_RADIOSITY_LAMP_CUT_H

#include "base/math/vec.h"
#include "facetree/scene.h"

/* Table of a bent lamp's projected area over all directions: the corners of FCT_LAMP_CELLS^2 squares per side
 * of a cube. */
#define FCT_LAMP_CELLS 16
#define FCT_LAMP_TABLE (6 * (FCT_LAMP_CELLS + 1) * (FCT_LAMP_CELLS + 1))
#define FCT_CUT_SIZE   1024 /* items of a cut */

typedef struct fct_lamp {
    uint32_t instance;
    bool two_sided;
    double emission[3];
    double strength;      /* sum of the emission */
    fct_tree *own;        /* tree of a world-space copy, or NULL */
    const fct_tree *tree; /* the model's, or `own` */
    fct_tree_view view;   /* of `tree` */
    double to_world[12];  /* rows of R|t, a similarity */
    double to_model[12];
    double scale;
    v3 center, vector;   /* area centroid; area vector */
    double radius, rms2; /* of a sphere about center; upper estimate of the mean squared distance from it */
    double area;         /* model space */
    double rounding;     /* error of a coordinate, model space */
    double *table;       /* projected area x length, in FCT_LAMP_TABLE directions; NULL: planar lamp */
} fct_lamp;

typedef struct fct_receiver {
    v3 x, n;
    double slack; /* a face whose plane is nearer than this contains x and sends it nothing */
} fct_receiver;

/* A node, or a part of a leaf: `part` 1 is the whole triangle, each further base-4 digit a quarter of it. */
typedef struct fct_cut_item {
    uint32_t node, part;
    double light;
} fct_cut_item;

typedef struct fct_cut {
    uint32_t count;
    double light; /* irradiance over exitance, the sum over the items */
    fct_cut_item items[FCT_CUT_SIZE];
} fct_cut;

typedef struct fct_lamp_point {
    v3 y;          /* model space */
    double weight; /* irradiance over exitance, divided by the point's probability; 0: the point faces away or
                      lies below the horizon */
    uint32_t place;
} fct_lamp_point;

/* A lamp without area sends no light. Errors: MEMORY, CANCELLED. */
fct_result fct_lamp_init(const fct_env *env, const fct_scene_view *scene, uint32_t instance, fct_lamp *out);
void fct_lamp_release(const fct_env *env, fct_lamp *lamp);

/* Takes a world-space point and unit normal to the lamp's space. */
fct_receiver fct_lamp_receiver(const fct_lamp *lamp, const double point[3], const double normal[3]);
/* Rough irradiance over exitance for the choice of rays: about the true value or more, and 0 only if no light
 * arrives. */
double fct_lamp_estimate(const fct_lamp *lamp, const fct_receiver *receiver);
/* The light to about half a per cent, and the nodes that send it, in the order of the tree. */
void fct_lamp_cut(const fct_lamp *lamp, const fct_receiver *receiver, fct_cut *cut);
/* The point of the cut that (u, v) in [0, 1)^2 chooses, with a density roughly in proportion to the light.
 * The mean of its weight over (u, v) is the light. */
fct_lamp_point fct_cut_point(const fct_lamp *lamp, const fct_receiver *receiver, const fct_cut *cut, double u,
                             double v);

#endif
