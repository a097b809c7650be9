/* mesh/glb/scene/pieces.h: the parts of a document with lit meshes. */
#ifndef FCT_MESH_GLB_PIECES_H
#define FCT_MESH_GLB_PIECES_H

#include "mesh/glb/replace/carry.h"
#include "mesh/glb/scene/scene.h"

/* A primitive of the output. */
typedef struct fct_glb_piece {
    uint32_t node;
    int64_t mesh, primitive; /* of the given document, or ABSENT */
    int64_t material;        /* FCT_GLB_ABSENT: none, or that of the primitive of the document */
    char *name;              /* of the mesh in a new document; the first piece of a node has it, or NULL */
    char color_name[16];
    fct_mesh lit;
    fct_glb_extra *extras;
    size_t extra_count;
} fct_glb_piece;

/* A primitive of triangles of the document: its vertices and faces in the joined mesh. */
typedef struct fct_glb_span {
    int64_t mesh, primitive;
    uint64_t first_vertex, vertex_count, first_face, face_count;
} fct_glb_span;

struct fct_glb_scene {
    const fct_env *env;
    fct_gltf *document; /* or NULL */
    json_t *root;
    fct_glb_piece *pieces;
    size_t piece_count, piece_capacity;
    fct_glb_span *spans; /* of the meshes that were needed, each mesh in one run */
    size_t span_count, span_capacity;
    int64_t *variants; /* per material: its copy that shows one side, or ABSENT */
    size_t variant_count, variant_capacity;
    size_t lost; /* attributes that could not be interpolated */
};

/* The spans of a mesh of the document. Errors: DATA, INPUT, MEMORY. */
fct_result fct_glb_find_spans(fct_glb_scene *scene, int64_t mesh, const fct_glb_span **spans, size_t *count);

/* Gives the piece the attributes of its primitive, interpolated. corners: face_count x 3 vertices of the
 * joined mesh. Errors: DATA, INPUT, MEMORY. */
fct_result fct_glb_fill_attributes(fct_glb_scene *scene, const fct_glb_span *span, const uint32_t *corners,
                                   const fct_glb_lit *lit, fct_glb_piece *piece);

void fct_glb_release_piece(const fct_env *env, fct_glb_piece *piece);

#endif
