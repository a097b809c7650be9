/* partition/units.h: what a refinement moves: faces, or the clusters of a finer cut of the tree, with their
 * borders. */
#ifndef FCT_CLUSTER_UNITS_H
#define FCT_CLUSTER_UNITS_H

#include "base/math/vec.h"
#include "facetree/dual.h"

/* A graph. Of faces: vectors and perimeters come from mesh and dual, lengths are floats. Of clusters: all of
 * them are arrays of doubles, so that sums over units are those over faces. */
typedef struct fct_units {
    uint32_t count;
    uint32_t *first, *neighbours; /* those of unit i are places [first[i], first[i + 1]) */
    const fct_mesh *mesh;
    fct_dual dual;       /* of the faces: perimeters alone */
    float *face_lengths; /* of the border with each neighbour */
    double *lengths, *perimeters;
    v3 *vectors;              /* area vectors; NULL: units are the faces */
    uint32_t *materials;      /* of units of clusters; FCT_NONE: it never moves */
    const uint32_t *of_faces; /* of the faces: the mesh's, or NULL */
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
/* Of the border at a place of `neighbours`. */
static inline double fct_unit_length(const fct_units *units, size_t place) {
    return units->lengths ? units->lengths[place] : (double)units->face_lengths[place];
}
/* One that never moves, and through which no way may be taken to lead: it may be in several pieces. */
static inline bool fct_unit_fixed(const fct_units *units, uint32_t i) {
    return units->vectors && units->materials[i] == FCT_NONE;
}
/* Whether two neighbours may come into one cluster by a move. */
static inline bool fct_units_alike(const fct_units *units, uint32_t a, uint32_t b) {
    const uint32_t *m = units->materials ? units->materials : units->of_faces;
    return !m || (m[a] == m[b] && m[a] != FCT_NONE);
}

/* The faces of a mesh, which outlives them. With numbers, unit numbers[f] is face f of the mesh: the graph is
 * that of the mesh as it is (what an edge of three faces connects goes by their ids), vectors and materials
 * are those of `numbered`, the same faces in the order of the numbers. Both NULL: units are as the faces.
 * Errors: DATA (more neighbours than 32 bits count), MEMORY, CANCELLED. On failure *out is all zero. */
fct_result fct_units_of_faces(const fct_env *env, const fct_mesh *mesh, const uint32_t *numbers,
                              const fct_mesh *numbered, fct_units *out);
/* The units that runs of faces make: unit_of does not decrease, and ends with count - 1. A unit in several
 * pieces or of several materials never moves. scratch holds two numbers a face. Errors: MEMORY. */
fct_result fct_units_of_runs(const fct_env *env, const fct_units *faces, const uint32_t *unit_of,
                             uint32_t count, uint32_t *scratch, fct_units *out);
/* Accepts a zeroed struct. */
void fct_units_release(const fct_env *env, fct_units *units);

#endif
