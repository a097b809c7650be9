/* radiosity/surface/split.h: conforming splits of triangles at the midpoints of their edges, and the tables
 * of edges and positions that they need. */
#ifndef FCT_RADIOSITY_SPLIT_H
#define FCT_RADIOSITY_SPLIT_H

#include "base/env.h"

/* Faces, and vertices, of a result. */
enum { FCT_SPLIT_MAX_FACES = 0x7ffffffe };

typedef struct fct_split {
    uint32_t face_count, vertex_count; /* vertex_count: new vertices only */
    uint32_t *triangles;               /* face_count x 3; vertex old_count + i is new vertex i */
    uint32_t *parents;                 /* face_count: the old face of each part, ascending */
    uint32_t *ends;                    /* vertex_count x 2: the edge that new vertex i halves */
    uint8_t *places;                   /* face_count x 3: corner k of the old face, or 3 + k: its new vertex
                                          between the corners k and k + 1 */
} fct_split;

/* Splits the marked edges. Bit k of marks[f] marks the edge from corner k to corner k + 1 of face f. Both
 * faces at an edge (two vertex ids) must mark it, or the result has a T-junction. New vertices are numbered
 * in the order of faces and corners. Quadrilaterals are cut along the shorter diagonal. Errors: MEMORY (also
 * above FCT_SPLIT_MAX_FACES). */
fct_result fct_split_edges(const fct_env *env, uint32_t vertex_count, const float *positions,
                           uint32_t face_count, const uint32_t *triangles, const uint8_t *marks,
                           fct_split *out);
void fct_split_release(const fct_env *env, fct_split *split);

/* Barycentrics (3 x 2) of the corners of part `face`, from those of the corners of its old face. shares[k] is
 * the share of the way from corner k to corner k + 1 at which the old face is split. */
void fct_split_uv(const fct_split *split, size_t face, const float *old_uv, const double shares[3],
                  float *uv);

/* A hash table from edges (pairs of ids in either order) to numbers. */
typedef struct fct_edge_table {
    uint64_t *keys;
    uint32_t *values;
    size_t mask;
} fct_edge_table;
fct_result fct_edge_table_init(const fct_env *env, size_t count, fct_edge_table *out);
void fct_edge_table_release(const fct_env *env, fct_edge_table *table);
/* The place of the edge's value. *fresh: the edge is new, and the caller must set the value. */
uint32_t *fct_edge_table_insert(fct_edge_table *table, uint32_t a, uint32_t b, bool *fresh);
/* NULL if the table does not contain the edge. */
const uint32_t *fct_edge_table_find(const fct_edge_table *table, uint32_t a, uint32_t b);

/* Sets first[v] to the lowest vertex at the position of v (0 equals -0). Errors: MEMORY. */
fct_result fct_weld(const fct_env *env, uint32_t vertex_count, const float *positions, uint32_t *first);

#endif
