/* mesh/glb/replace/document.h: a glTF document whose triangles are replaced. */
#ifndef FCT_MESH_GLB_DOCUMENT_H
#define FCT_MESH_GLB_DOCUMENT_H

#include "facetree/mesh.h"
#include "mesh/glb/document/glb.h"

/* A primitive of triangles of the document. */
typedef struct fct_gltf_part {
    uint32_t mesh;      /* of the document */
    uint32_t primitive; /* of that mesh */
} fct_gltf_part;

/* A mesh of the document. */
typedef struct fct_gltf_group {
    double to_world[12], to_node[12];
    bool placed;            /* it has been read */
    bool identity;          /* both transforms */
    bool mirrored;          /* to_world reverses the winding */
    bool colors, texcoords; /* any of its primitives has them */
    const char *light;      /* attribute of the light of its first primitive that has one, or NULL */
    uint32_t first, count;  /* its parts */
} fct_gltf_group;

struct fct_gltf {
    const fct_env *env;
    char *name, *folder;
    fct_file file;
    fct_source source;
    fct_glb glb;
    fct_gltf_group *groups; /* per mesh of the document */
    size_t group_count;
    fct_gltf_part *parts;
    size_t part_capacity;
    uint32_t part_count;
};

#endif
