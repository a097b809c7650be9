/* radiosity/light/lamp_cut.h: one lamp as a receiver sees it: its light without blockers, as a cut through
 * its cluster tree, and points on it for shadow rays. All in the lamp's own (model) space: form factors do
 * not change under rotation, reflection and uniform scaling; a lamp under any other transform gets a tree of
 * its own in the world.
 */
#ifndef FCT_RADIOSITY_LAMP_CUT_H
#define FCT_RADIOSITY_LAMP_CUT_H

#include "base/math/vec.h"
#include "facetree/scene.h"

/* Directions for which a bent lamp's projected area is stored: FCT_LAMP_CELLS^2 squares a side of a cube. */
#define FCT_LAMP_CELLS 16
#define FCT_LAMP_TABLE (6 * (FCT_LAMP_CELLS + 1) * (FCT_LAMP_CELLS + 1))
#define FCT_CUT_SIZE   1024

typedef struct fct_lamp {
    uint32_t instance;
    bool two_sided;
    double emission[3];
    double strength;      /* sum of the emission */
    fct_tree *own;        /* of a world-space copy, or NULL */
    const fct_tree *tree; /* the model's, or the copy's */
    fct_tree_view view;   /* of it */
    double to_world[12];  /* rows of R|t, a similarity */
    double to_model[12];
    double scale;
    v3 center, vector;   /* area centroid; area vector */
    double radius, rms2; /* of a sphere about the centre; mean squared distance from it, an upper estimate */
    double area;         /* model space */
    double rounding;     /* what coordinates are off by, model space */
    double *table;       /* projected area in FCT_LAMP_TABLE directions, times their length; NULL: planar */
} fct_lamp;

typedef struct fct_receiver {
    v3 x, n;
    double slack; /* a face whose plane is nearer than this is taken to hold x and sends it nothing */
} fct_receiver;

/* A node, or a part of a leaf: `part` 1 is the whole triangle, each further base-4 digit a quarter of it. */
typedef struct fct_cut_item {
    uint32_t node, part;
    double light;
} fct_cut_item;

typedef struct fct_cut {
    uint32_t count;
    double light; /* irradiance over exitance: the sum over the items */
    fct_cut_item items[FCT_CUT_SIZE];
} fct_cut;

typedef struct fct_lamp_point {
    v3 y;          /* model space */
    double weight; /* irradiance over exitance per probability; 0: faces away or lies below the horizon */
    uint32_t place;
} fct_lamp_point;

/* Fills the lamp; *out is left without light where nothing of it has area. Errors: MEMORY, CANCELLED. */
fct_result fct_lamp_init(const fct_env *env, const fct_scene_view *scene, uint32_t instance, fct_lamp *out);
void fct_lamp_release(const fct_env *env, fct_lamp *lamp);

fct_receiver fct_lamp_receiver(const fct_lamp *lamp, const double point[3], const double normal[3]);
/* A rough figure for irradiance over exitance, not below about the truth; 0 only where nothing arrives. */
double fct_lamp_estimate(const fct_lamp *lamp, const fct_receiver *receiver);
/* The light within half a per cent, and the nodes it comes from in the order of the tree. */
void fct_lamp_cut(const fct_lamp *lamp, const fct_receiver *receiver, fct_cut *cut);
/* A point of the cut chosen by (u, v) in [0, 1)^2, roughly in proportion to the light. */
fct_lamp_point fct_cut_point(const fct_lamp *lamp, const fct_receiver *receiver, const fct_cut *cut, double u,
                             double v);

#endif
