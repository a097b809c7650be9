/* radiosity/solve/element.h: the elements of a solution: the opened part of the scene's hierarchies.
 *
 *     volumes over the instances          element i is volume i of the scene
 *       `- roots of each instance         front roots, then back roots of a two-sided material
 *            `- clusters                  as in the hierarchy file
 *                 `- triangles
 *                      `- quarters        of triangles with an edge above min_edge
 *
 * Only fct_elements_split adds elements, so the solution reads a hierarchy no deeper than the light needs.
 * All quantities are in world space. Garland shows such an opened hierarchy in figure 8.9.
 */
#ifndef FCT_RADIOSITY_ELEMENT_H
#define FCT_RADIOSITY_ELEMENT_H

#include <stdatomic.h>

#include "base/math/vec.h"
#include "base/parallel.h"
#include "facetree/scene.h"
#include "radiosity/sample.h"
#include "radiosity/solve/paint.h"

enum { FCT_ELEMENT_POINTS = 16 };
/* Angle of a cone that no longer bounds the side that an element shows: a right angle. */
#define FCT_ELEMENT_OPEN_CONE 1.5707963267948966

typedef enum fct_element_kind {
    FCT_ELEMENT_VOLUME,
    FCT_ELEMENT_CLUSTER,
    FCT_ELEMENT_TRIANGLE
} fct_element_kind;

typedef struct fct_element {
    v3 center;     /* centroid of the surface */
    double radius; /* of a ball about center that contains the element */
    double area;
    v3 vector;        /* S = sum A n */
    double moment[6]; /* M = sum A n n^T */
    double cone;      /* radians; every normal is within this angle of S; pi: unknown */
    uint32_t parent, child, child_count;
    uint32_t instance, node;           /* of the tree; FCT_NONE in a volume */
    uint32_t triangle;                 /* index of its corners, in a cluster of its places; FCT_NONE in a
                                          volume */
    uint8_t kind, back;                /* fct_element_kind; 1: back side of a two-sided material */
    float reflectance[3], emission[3]; /* reflectance: the mean over the surface */
    double irradiance[3];              /* leaf: mean E over the surface */
    double radiosity[3]; /* leaf: b = e + rho E; inner element: area-weighted mean of its leaves */
    v3 power[3];         /* P = sum b_k S_k over the leaves */
} fct_element;

/* A point of an element's surface, with the unit normal of its face on the element's side. */
typedef struct fct_element_point {
    float position[3], normal[3];
    float offset;   /* rays start at position + offset * normal */
    uint32_t place; /* of the face in the tree's order */
} fct_element_point;

/* The fields that fct_elements_locate reads, in an array of their own: 16 bytes instead of about 400 per
 * step. */
typedef struct fct_element_range {
    uint32_t first, count; /* places of the tree's face order */
    uint32_t child, child_count;
} fct_element_range;

typedef struct fct_elements {
    const fct_env *env;
    const fct_scene *scene;
    fct_scene_view view;
    fct_element *items;
    fct_element_range *ranges;
    size_t count, capacity, range_capacity;
    uint32_t *places; /* FCT_ELEMENT_POINTS per cluster: the faces of its points. The points themselves would
                         take two thirds of the memory of the elements, and finding the faces each time would
                         double the time of refinement */
    size_t cluster_count, place_capacity;
    size_t pointed; /* elements that have their places */
    float *corners; /* 3 x 3 per triangle element */
    size_t corner_count, corner_capacity;
    fct_paints paints;
    uint32_t *roots;        /* instance -> its first root element; front roots, then back roots */
    uint32_t *root_counts;  /* instance -> roots per side */
    double min_edge;        /* a triangle whose longest edge is at most this is not quartered */
    atomic_uchar **touched; /* per model and page of 4 KiB of its hierarchy: 1 after a read */
    size_t *touched_sizes;
    uint64_t touched_before; /* bytes that the coarse forms of models took from files */
    bool solved;             /* reads no longer count */
} fct_elements;

/* Creates the volumes and the instances' roots. The scene may be coarse (scene/coarse.h). Errors: MEMORY. */
fct_result fct_elements_create(const fct_env *env, const fct_scene *scene, double min_edge,
                               fct_elements *out);
void fct_elements_release(fct_elements *set);

static inline bool fct_element_is_leaf(const fct_element *e) {
    return e->child_count == 0;
}
/* True for a leaf that fct_elements_split can open. */
bool fct_elements_can_split(const fct_elements *set, uint32_t id);
/* Adds the children of a leaf that can be split. They start with its light. Errors: MEMORY. */
fct_result fct_elements_split(fct_elements *set, uint32_t id);
/* The point at fraction t in [0, 1) of the area. (a, b) in [0, 1)^2 chooses the point of the triangle found
 * there, uniformly. Stratified t gives points that are stratified over the surface. */
void fct_element_sample(const fct_elements *set, uint32_t id, double t, double a, double b,
                        fct_element_point *out);
/* Finds the places of all clusters that have none. */
void fct_elements_make_points(fct_elements *set);
/* Point k < FCT_ELEMENT_POINTS of an element: it lies in the k-th sixteenth of the area, and is the same in
 * each call. A cluster needs its places. */
void fct_element_point_at(const fct_elements *set, uint32_t id, uint32_t k, fct_element_point *out);
/* Removes the elements from number `count` on, which set->count was at an earlier moment. The elements whose
 * children are among them are leaves again. */
void fct_elements_truncate(fct_elements *set, size_t count);
/* The leaf that contains barycentrics (u, v) of the face at `place`; FCT_NONE on the back of a one-sided
 * material. */
uint32_t fct_elements_locate(const fct_elements *set, uint32_t instance, bool back, uint32_t place, float u,
                             float v);
/* The same for the projection of a world point onto the face, which has an area. */
uint32_t fct_elements_locate_point(const fct_elements *set, uint32_t instance, bool back, uint32_t place,
                                   v3 point);
/* Ends the solution. Makes the elements of a coarse scene refer to the nodes and places of `scene`, which it
 * belongs to, and which is complete. Elements cannot be split any more. */
void fct_elements_refer(fct_elements *set, const fct_scene *scene);
/* Sets radiosity and power of all inner elements from their leaves. */
void fct_elements_pull(fct_elements *set);
/* Size of the hierarchies' pages that were read so far, bytes. */
uint64_t fct_elements_touched(const fct_elements *set);

#endif
