/* scene/scene.h: what the files of this folder share: the scene itself, and parts of models on their way into
 * it. */
#ifndef FCT_SCENE_SCENE_H
#define FCT_SCENE_SCENE_H

#include "base/env.h"
#include "facetree/scene.h"

/* Eight children side by side: bounds as lx ux ly uy lz uz; a child is a node, an instance (FCT_SCENE_LEAF
 * set), or FCT_NONE with bounds that nothing hits. */
enum { FCT_SCENE_WIDTH = 8 };
#define FCT_SCENE_LEAF 0x80000000u
typedef struct fct_scene_node {
    float bounds[6][FCT_SCENE_WIDTH];
    uint32_t child[FCT_SCENE_WIDTH];
} fct_scene_node;

/* Levels of the binary hierarchy, and with it of the wide one, never exceed this. */
enum { FCT_SCENE_DEPTH = 66 };
/* Deeper trees are refused; 3 log2 F stays below 96. */
enum { FCT_SCENE_TREE_DEPTH = 254 };

/* What a ray needs of an instance, beside one another. */
typedef struct fct_scene_frame {
    double to_model[12];
    float linear[9]; /* of to_model */
    bool identity;
    const fct_bvh *bvh;
    double shrink; /* world distance >= shrink * model distance */
} fct_scene_frame;

typedef struct fct_scene_model {
    fct_tree *tree;
    fct_bvh *bvh;
    fct_bvh *points; /* answers closest points where bvh does not; else NULL */
    uint32_t *source_faces, *source_vertices;
} fct_scene_model;

/* Instances [first, first + count) are the parts of one object. */
typedef struct fct_scene_object {
    uint32_t first, count;
} fct_scene_object;

struct fct_scene {
    const fct_env *env;
    fct_backend backend;
    bool committed;

    fct_material *materials;
    fct_model *models;       /* public face of */
    fct_scene_model *own;    /* this, by the same index */
    fct_instance *instances; /* public face of */
    fct_scene_frame *frames; /* this */
    fct_scene_object *objects;
    char **light_groups;
    size_t material_capacity, model_capacity, own_capacity, instance_capacity, frame_capacity,
        object_capacity, light_group_capacity;
    uint32_t material_count, model_count, instance_count, object_count, light_group_count;

    fct_volume *volumes; /* 2 instance_count - 1 */
    fct_scene_node *nodes;
    fct_bounds bounds;
    fct_camera camera;
    uint64_t face_count;
};

/* Models [first, first + count), in ascending order of the label that their faces carry. */
typedef struct fct_scene_parts {
    uint32_t first, count;
    uint32_t *labels; /* count, to be released by the caller */
} fct_scene_parts;

/* Adds the mesh as models, one for each distinct label (face_count numbers below label_count; NULL: all
 * zero). `tree`, of the whole mesh, may be given with NULL labels; it is the scene's from here on, whatever
 * happens; `mesh` may then be NULL. */
fct_result fct_scene_split(fct_scene *scene, const char *name, const fct_mesh *mesh, fct_tree *tree,
                           const uint32_t *labels, uint32_t label_count, fct_scene_parts *parts);
/* An object of models [first, first + count) with a material each. */
fct_result fct_scene_place(fct_scene *scene, const char *name, uint32_t first, uint32_t count,
                           const uint32_t *materials, const float transform[12]);

/* Faces in ascending order of their labels, stable: those of label k are faces[starts[k]] up to
 * faces[starts[k + 1]]; starts has label_count + 1 entries. */
void fct_scene_sort_faces(const uint32_t *labels, uint32_t face_count, uint32_t label_count, uint32_t *starts,
                          uint32_t *faces);

/* Binary hierarchy over `count` >= 1 boxes: 2 count - 1 volumes, node 0 the root, children after parents,
 * depth at most FCT_SCENE_DEPTH. */
fct_result fct_scene_build_volumes(const fct_env *env, uint32_t count, const fct_bounds *bounds,
                                   fct_volume *volumes);
/* The same, eight wide; allocates *out. */
fct_result fct_scene_build_nodes(const fct_env *env, uint32_t count, const fct_volume *volumes,
                                 fct_scene_node **out);

#endif
