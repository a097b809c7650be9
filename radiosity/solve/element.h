/* radiosity/solve/element.h: the elements of a solution: the parts of the scene's hierarchies that it has
 * opened, and nothing below.
 *
 * The elements form one tree: volumes over the instances, then each instance's roots (front, and back where
 * the material has two sides), then clusters as the hierarchy file has them, single triangles at last, and
 * below a large triangle its quarters. Only split makes elements, so a hierarchy is read no deeper than the
 * light asks for. All quantities are in world space.
 */
#ifndef FCT_RADIOSITY_ELEMENT_H
#define FCT_RADIOSITY_ELEMENT_H

#include <stdatomic.h>

#include "base/math/vec.h"
#include "base/parallel.h"
#include "facetree/scene.h"
#include "radiosity/sample.h"

enum { FCT_ELEMENT_POINTS = 16 };
/* A right angle: a cone this wide says nothing about which way the element faces. */
#define FCT_ELEMENT_OPEN_CONE 1.5707963267948966

typedef enum fct_element_kind {
    FCT_ELEMENT_VOLUME,
    FCT_ELEMENT_CLUSTER,
    FCT_ELEMENT_TRIANGLE
} fct_element_kind;

typedef struct fct_element {
    v3 center;     /* centroid of the surface */
    double radius; /* of a ball about center that holds the element */
    double area;
    v3 vector;        /* S = sum A n */
    double moment[6]; /* M = sum A n n^T */
    double cone;      /* every normal lies within this angle of S; pi: nothing is known */
    uint32_t parent, child, child_count;
    uint32_t instance, node; /* of the tree; FCT_NONE in a volume */
    uint32_t triangle;       /* index of its corners, FCT_NONE unless a triangle */
    uint8_t kind, back;      /* fct_element_kind; 1 on the back of a two-sided material */
    float reflectance[3], emission[3];
    double irradiance[3]; /* leaf: mean E */
    double radiosity[3];  /* mean b = e + rho E; of an inner element the mean of its leaves */
    v3 power[3];          /* sum of b S over the leaves */
} fct_element;

/* A point of an element's surface; the normal is that of its face, on the element's side. */
typedef struct fct_element_point {
    float position[3], normal[3];
    float offset; /* how far to lift a ray's origin off the surface */
    float u, v;
    uint32_t place;
} fct_element_point;

/* What locate needs, apart from the rest to be quick. */
typedef struct fct_element_range {
    uint32_t first, count, child, child_count;
} fct_element_range;

typedef struct fct_elements {
    const fct_env *env;
    const fct_scene *scene;
    fct_scene_view view;
    fct_element *items;
    fct_element_range *ranges;
    fct_element_point *points; /* FCT_ELEMENT_POINTS for each element */
    size_t count, capacity, range_capacity, point_capacity;
    size_t pointed; /* elements whose points are made */
    float *corners; /* of triangles, 3 x 3 each */
    size_t corner_count, corner_capacity;
    uint32_t *roots; /* instance -> its first root element; front roots, then back roots */
    uint32_t *root_counts;
    double min_edge;        /* triangles with no longer edge are not quartered */
    atomic_uchar **touched; /* per model: pages of the hierarchy's arrays that were read */
    size_t *touched_sizes;
} fct_elements;

/* The volumes and the instances' roots. Errors: MEMORY. */
fct_result fct_elements_create(const fct_env *env, const fct_scene *scene, double min_edge,
                               fct_elements *out);
void fct_elements_release(fct_elements *set);

static inline bool fct_element_is_leaf(const fct_element *e) {
    return e->child_count == 0;
}
/* Whether split would make children. */
bool fct_elements_can_split(const fct_elements *set, uint32_t id);
/* Makes the children of a leaf that can be split; they inherit its light. Errors: MEMORY. */
fct_result fct_elements_split(fct_elements *set, uint32_t id);
/* Makes the points of all elements added since the last call; parallel. */
void fct_elements_make_points(fct_elements *set);
/* A point at fraction t in [0, 1) of the area, (a, b) uniform in its triangle. */
void fct_element_sample(const fct_elements *set, uint32_t id, double t, double a, double b,
                        fct_element_point *out);
/* The leaf at barycentrics (u, v) of the face at `place`; FCT_NONE on a back that has no element. */
uint32_t fct_elements_locate(const fct_elements *set, uint32_t instance, bool back, uint32_t place, float u,
                             float v);
/* Sums radiosity and power from the leaves up. */
void fct_elements_pull(fct_elements *set);
/* Bytes of the hierarchies' pages that were read so far. */
uint64_t fct_elements_touched(const fct_elements *set);

#endif
