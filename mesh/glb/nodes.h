/* mesh/glb/nodes.h: visits the nodes of the scene of a glTF file. */
#ifndef FCT_MESH_GLB_NODES_H
#define FCT_MESH_GLB_NODES_H

#include "mesh/glb/document/glb.h"

typedef struct fct_glb_transform {
    double m[12];  /* rows of R|t */
    bool identity; /* no node on the way has a transform */
} fct_glb_transform;

/* A visited node. */
typedef struct fct_glb_place {
    json_t *node;  /* NULL: the file has no nodes, and each mesh is placed once */
    int64_t index; /* of the node */
    int64_t mesh;  /* FCT_GLB_ABSENT: none */
    fct_glb_transform to_world;
} fct_glb_place;

typedef fct_result fct_glb_visitor(void *user, const fct_glb_place *place);

/* Calls `visit` for each node below the roots of the scene, parents first, in the order of the file. The
 * scene is the default one, else scene 0. Without scenes, the roots are the nodes that have no parent. Stops
 * at the first error of `visit`. Errors: DATA (a node with two parents, no such node, wrong numbers), MEMORY,
 * CANCELLED. */
fct_result fct_glb_visit_nodes(fct_glb *glb, fct_glb_visitor *visit, void *user);

/* Reads the `count` numbers of object[key]. If the key is absent, the values stay. Errors: DATA; `what` names
 * the object in the message. */
fct_result fct_glb_numbers(const fct_glb *glb, json_t *object, const char *what, int64_t index,
                           const char *key, size_t count, double *values);

#endif
