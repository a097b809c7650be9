/* partition/units.h: the units that a refinement moves: faces, or clusters of a finer cut of the tree, as a
 * graph with the lengths of their borders. */
#ifndef FCT_PARTITION_UNITS_H
#define FCT_PARTITION_UNITS_H

#include "base/math/vec.h"
#include "facetree/dual.h"

/* Faces take vectors and perimeters from mesh and dual, and lengths are floats. Clusters have arrays of
 * doubles, so that sums over them equal sums over their faces. */
typedef struct fct_units {
    uint32_t count;
    uint32_t *first, *neighbours; /* neighbours of unit i: entries [first[i], first[i + 1]) */
    const fct_mesh *mesh;
    fct_dual dual;       /* of the faces: only perimeters stay */
    float *face_lengths; /* per entry of neighbours: length of the border */
    double *lengths, *perimeters;
    v3 *vectors;              /* area vectors; NULL: units are faces */
    uint32_t *materials;      /* of clusters; FCT_NONE: it never moves */
    const uint32_t *of_faces; /* of faces, or NULL */
} fct_units;

static inline v3 fct_unit_vector(const fct_units *units, uint32_t i) {
    if (units->vectors) return units->vectors[i];
    const uint32_t *t = units->mesh->triangles + 3 * (size_t)i;
    const float *p = units->mesh->positions;
    v3 a = v3_load(p + 3 * (size_t)t[0]), b = v3_load(p + 3 * (size_t)t[1]),
       c = v3_load(p + 3 * (size_t)t[2]);
    return v3_scale(v3_cross(v3_sub(b, a), v3_sub(c, a)), 0.5);
}
static inline double fct_unit_perimeter(const fct_units *units, uint32_t i) {
    return units->perimeters ? units->perimeters[i] : (double)units->dual.perimeters[i];
}
/* Length of the border with an entry of `neighbours`. */
static inline double fct_unit_length(const fct_units *units, size_t place) {
    return units->lengths ? units->lengths[place] : (double)units->face_lengths[place];
}
/* A unit in several pieces or of several materials. It never moves, and a search must not pass through it. */
static inline bool fct_unit_fixed(const fct_units *units, uint32_t i) {
    return units->vectors && units->materials[i] == FCT_NONE;
}
/* Whether a move may bring two neighbours into one cluster: they have the same material. */
static inline bool fct_units_alike(const fct_units *units, uint32_t a, uint32_t b) {
    const uint32_t *m = units->materials ? units->materials : units->of_faces;
    return !m || (m[a] == m[b] && m[a] != FCT_NONE);
}

/* The dual graph of a mesh, with lengths in units of *unit: a power of two, and 1 unless floats are too
 * coarse or too small for the lengths in the mesh's unit. Errors: MEMORY, CANCELLED. */
fct_result fct_units_dual(const fct_env *env, const fct_mesh *mesh, fct_dual *out, double *unit);
/* The faces of a mesh, which must outlive *out. If numbers is not NULL, unit numbers[f] is face f of the
 * mesh, and `numbered` is the mesh with its faces in the order of the numbers; vectors and materials come
 * from it. The graph always comes from `mesh`, because the order of ids decides which faces an edge of three
 * faces connects. Errors: DATA (over 2^32 - 1 neighbours), MEMORY, CANCELLED; then *out is all zero. */
fct_result fct_units_of_faces(const fct_env *env, const fct_mesh *mesh, const uint32_t *numbers,
                              const fct_mesh *numbered, fct_units *out);
/* Units that are runs of faces: unit_of does not decrease and ends with count - 1. scratch holds two numbers
 * per face. Errors: MEMORY. */
fct_result fct_units_of_runs(const fct_env *env, const fct_units *faces, const uint32_t *unit_of,
                             uint32_t count, uint32_t *scratch, fct_units *out);
/* Accepts a zeroed struct. */
void fct_units_release(const fct_env *env, fct_units *units);

#endif
