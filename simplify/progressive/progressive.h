/* simplify/progressive/progressive.h: the data of a progressive mesh.
 *
 *     corner --> handle --> node            (parent)
 *                           /  \
 *                        node  node
 *
 * - A node is a position with attributes, at some of the levels. It never changes. Its parent replaces it in
 * the coarser level.
 * - A handle is what corners refer to. It has one node at each level. So a split changes only the corners
 * that go to the new point.
 *
 * Step 0 adds the base mesh. Each further step is a vertex split: it adds nodes and faces and moves corners
 * to the handles of new nodes. The items of all arrays are in the order of the steps. So the faces of a level
 * are the first ones, and node n exists at the levels after step s if n < step_nodes[s + 1] and no child
 * does.
 */
#ifndef FCT_SIMPLIFY_PROGRESSIVE_H
#define FCT_SIMPLIFY_PROGRESSIVE_H

#include <stdio.h>

#include "base/env.h"
#include "facetree/progressive.h"

enum { PROGRESSIVE_VALUES = 8 }; /* most floats of attributes per node: colour, normal, texture coordinates */

struct fct_progressive {
    const fct_env *env;
    uint32_t level;      /* number of steps that are done, at least 1 */
    uint32_t step_count; /* at least 1 */
    uint32_t node_count, handle_count, point_count, face_count, corner_count;
    uint32_t total_faces; /* of the finest level of the file */
    /* Floats of attributes per node, and where each attribute begins; FCT_NONE: absent. */
    uint32_t value_count, color, normal, texcoord;
    double origin[3];
    uint32_t material_count;
    char **material_names; /* material_count strings, or NULL */

    /* Per step; step_nodes and step_faces have one more entry. */
    uint32_t *step_nodes, *step_faces; /* the first node and face of each step */
    bool *walls; /* the step adds an inner wall (pairs/join.h) without a new point. A caller does not get the
                    level   after it, which has the wall but not what closed it */
    float *errors; /* of the level after the step: the largest of a contraction that it has */
    /* Per node; first_corners has one more entry. */
    uint32_t *parents; /* FCT_NONE: the point is new */
    uint32_t *handles;
    uint32_t *points;        /* nodes of one level are at one place if their points are equal */
    uint32_t *first_corners; /* the corners that move to the handle are corners[first_corners[n]] to ... */
    float *positions;        /* x 3 */
    float *values;           /* x value_count */
    uint32_t *corners;
    /* Per face. */
    uint32_t
        *triangles; /* x 3, handles at the current level; for faces of finer levels those at their birth */
    uint32_t *materials; /* NULL: absent */
    float *face_colors;  /* x 3, NULL: absent */
    /* Per handle. */
    uint32_t *nodes;    /* at the current level */
    uint32_t *vertices; /* scratch: FCT_NONE between calls */
    /* Per point, only with texture coordinates. */
    uint32_t *point_vertices;        /* scratch: FCT_NONE between calls */
    struct fct_hierarchy *hierarchy; /* NULL before the first view */
};

/* The split of a step, and its contraction, in arrays like `triangles` and `nodes` above. The level does not
 * change. */
void fct_progressive_split(const fct_progressive *m, uint32_t step, uint32_t *triangles, uint32_t *nodes);
void fct_progressive_contract(const fct_progressive *m, uint32_t step, uint32_t *triangles, uint32_t *nodes);

/* One more step of splits (or of the base mesh), or one less. */
void fct_progressive_forward(fct_progressive *m);
void fct_progressive_backward(fct_progressive *m);
/* Allocates the scratch arrays, and goes to the coarsest level. Errors: MEMORY. */
fct_result fct_progressive_begin(fct_progressive *m);
/* Faces of a mesh that splits have made. */
typedef struct fct_progressive_faces {
    const uint32_t *triangles, *nodes; /* as those of fct_progressive */
    const uint32_t *faces;             /* NULL: the first ones */
    uint32_t count;
} fct_progressive_faces;
/* A mesh of these faces, in their order. Errors: MEMORY. */
fct_result fct_progressive_write_faces(fct_progressive *m, const fct_progressive_faces *from, fct_mesh *out);

/* Writes a file to a stream; the caller checks the stream. Errors: MEMORY, CANCELLED. */
fct_result fct_progressive_write(fct_progressive *m, FILE *stream);
/* Reads a file from memory; `name` begins the messages. Errors: as fct_progressive_load. */
fct_result fct_progressive_read(const fct_env *env, const char *name, const unsigned char *data, size_t size,
                                fct_progressive **out);

#endif
