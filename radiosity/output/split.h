/* radiosity/output/split.h: conforming splits of triangles at the midpoints of their edges. */
#ifndef FCT_RADIOSITY_SPLIT_H
#define FCT_RADIOSITY_SPLIT_H

#include "base/env.h"

/* Marks of a face: bit k asks for a new vertex on the edge from corner k to corner k + 1. */
enum { FCT_SPLIT_MAX_FACES = 0x7ffffffe };

typedef struct fct_split {
    uint32_t face_count, vertex_count; /* vertex_count: new vertices alone */
    uint32_t *triangles;               /* face_count x 3; vertex old_count + i is new vertex i */
    uint32_t *parents;                 /* face_count: the face each one is a part of, ascending */
    uint32_t *ends;                    /* vertex_count x 2: new vertex i halves this edge */
} fct_split;

/* Splits. Both faces at an edge must mark it, or the result has a T-junction; an edge is known by its vertex
 * ids. New vertices are numbered in the order in which faces and corners come by. Quadrilaterals that arise
 * are cut along the shorter diagonal. Errors: MEMORY (also for more than FCT_SPLIT_MAX_FACES). */
fct_result fct_split_edges(const fct_env *env, uint32_t vertex_count, const float *positions,
                           uint32_t face_count, const uint32_t *triangles, const uint8_t *marks,
                           fct_split *out);
void fct_split_release(const fct_env *env, fct_split *split);

/* A table from edges (pairs of ids in either order) to numbers. */
typedef struct fct_edge_table {
    uint64_t *keys;
    uint32_t *values;
    size_t mask;
} fct_edge_table;
fct_result fct_edge_table_init(const fct_env *env, size_t count, fct_edge_table *out);
void fct_edge_table_release(const fct_env *env, fct_edge_table *table);
/* The value's place; *fresh tells that the edge was not there and the value is yours to set. */
uint32_t *fct_edge_table_insert(fct_edge_table *table, uint32_t a, uint32_t b, bool *fresh);
/* NULL where the edge is not there. */
const uint32_t *fct_edge_table_find(const fct_edge_table *table, uint32_t a, uint32_t b);

/* first[v]: the lowest vertex at the same position as v (0 and -0 are the same). Errors: MEMORY. */
fct_result fct_weld(const fct_env *env, uint32_t vertex_count, const float *positions, uint32_t *first);

#endif
