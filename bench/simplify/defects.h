/* bench/simplify/defects.h: defects of a mesh, and which of them another mesh does not have.
 *
 * Independent of the simplifier, and the same for all libraries: only the coordinates of triangles count.
 * Vertices at one place are one point, so seams are no borders.
 */
#ifndef FCT_BENCH_SIMPLIFY_DEFECTS_H
#define FCT_BENCH_SIMPLIFY_DEFECTS_H

#include "bench/cluster/bench.h"

typedef enum bench_defect {
    BENCH_DUPLICATE,   /* face with the same three points as an earlier face */
    BENCH_FLAT,        /* face without area */
    BENCH_FOLD,        /* edge with less than 26 degrees between two of its faces */
    BENCH_NONMANIFOLD, /* edge of three or more faces */
    BENCH_BORDER,      /* edge of one face; not a defect if the input is open */
    BENCH_DEFECTS
} bench_defect;

/* Vertices of the mesh, three per defect; an edge repeats its second end. */
typedef struct bench_places {
    uint32_t *corners[BENCH_DEFECTS];
    uint32_t count[BENCH_DEFECTS];
} bench_places;
bench_places bench_find_defects(const fct_mesh *mesh);
void bench_free_places(bench_places *places);

/* The defects of `mesh` that are not near one of the same kind in `input`: whose middle is farther from it
 * than half of their longest side, or than 2 % of the diagonal of `input`. */
uint32_t bench_count_new(const fct_env *env, const fct_mesh *input, const bench_places *before,
                         const fct_mesh *mesh, const bench_places *after, bench_defect kind);

/* The largest distance between the borders of two meshes, from the ends of either: how far borders moved.
 * Infinity if only one mesh has borders. */
double bench_border_drift(const fct_env *env, const fct_mesh *a, const bench_places *at_a, const fct_mesh *b,
                          const bench_places *at_b);
#endif
