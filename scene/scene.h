/* scene/scene.h: the scene itself, and how readers add models to it. */
#ifndef FCT_SCENE_SCENE_H
#define FCT_SCENE_SCENE_H

#include "bvh/near/mapped.h"
#include "cluster/tree/coarse.h"
#include "scene/attributes.h"
#include "scene/texture/image.h"
#include "scene/volume.h"

/* A model's tree is at most this deep, or the model is refused. The trees that facetree builds have a depth
 * below 3 log2 F < 96. */
enum { FCT_SCENE_TREE_DEPTH = 254 };

/* Patches of all coarse forms together. A patch takes some 400 bytes with its part of the ray structure, so
 * all take less than the elements of a usual solution. With fewer patches, contacts and thin parts of large
 * models block light too widely. */
#define FCT_SCENE_PATCHES 32768

/* Readers of files clamp reflectances to this. With a reflectance of 1, light would never be absorbed. */
#define FCT_SCENE_MOST_REFLECTANCE .9f

/* The fields of an instance that a ray needs, close together in memory. */
typedef struct fct_scene_frame {
    double to_model[12];
    float linear[9]; /* of to_model */
    bool identity;
    bool emits, two_sided; /* of the material */
    const fct_bvh *bvh;
    double at[3];            /* the model's local origin in the file's coordinates */
    fct_mapped_frame mapped; /* for closest points, if the scale is not uniform */
} fct_scene_frame;

typedef struct fct_scene_model {
    fct_tree *tree;
    fct_bvh *bvh;
    fct_bvh *points;   /* answers closest points if bvh cannot (Embree), else NULL */
    fct_coarse coarse; /* of a large model in a scene of several resolutions; its tree is NULL otherwise */
    fct_bvh *coarse_bvh;
    uint32_t *source_faces, *source_vertices, *loose_vertices;
    float *loose_positions;
    fct_attributes attributes;
    double origin[3];      /* the tree's positions are relative to it */
    bool colors_are_light; /* or may be: they do not paint */
} fct_scene_model;

/* How a material is painted. */
typedef struct fct_scene_paint {
    fct_paint def;
    uint32_t pyramid; /* FCT_NONE: no texture */
    float scale[3];   /* times the texels of the pyramid */
    bool painted;
} fct_scene_paint;

/* Instances [first, first + count) are the parts of one object. */
typedef struct fct_scene_object {
    uint32_t first, count;
    int64_t node, mesh; /* of the glTF file that the scene was read from, or -1 */
} fct_scene_object;

struct fct_scene {
    const fct_env *env;
    fct_backend backend;
    bool committed;

    fct_material *materials;
    fct_scene_paint *paints; /* of the materials */
    fct_texture *textures;
    fct_image *images;             /* of the textures */
    struct fct_pyramid **pyramids; /* of the textures that materials have */
    fct_model *models;             /* public part; own[m] is the private part of models[m] */
    fct_scene_model *own;          /* model_count */
    fct_instance *instances;       /* public part; frames[i] is the private part of instances[i] */
    fct_scene_frame *frames;       /* instance_count */
    fct_scene_object *objects;
    char **light_groups;
    size_t material_capacity, paint_capacity, texture_capacity, image_capacity, pyramid_capacity,
        model_capacity, own_capacity, instance_capacity, frame_capacity, object_capacity,
        light_group_capacity;
    uint32_t material_count, texture_count, pyramid_count, model_count, instance_count, object_count,
        light_group_count;

    fct_volume *volumes; /* 2 instance_count - 1 */
    fct_scene_node *nodes;
    fct_bounds bounds;
    fct_camera camera;
    uint64_t face_count;
    double origin[3];

    struct fct_scene *coarse; /* this scene with the coarse forms of its models, whose other arrays it shares;
                                 NULL if no model has one */
    bool is_coarse;
    uint32_t patches; /* of all coarse forms together, about; default FCT_SCENE_PATCHES */
};

/* The bounds of a model. Those of a tree hold all vertices, those of a ray structure only vertices of faces;
 * bvh may be NULL. */
static inline fct_bounds fct_scene_model_bounds(const fct_tree *tree, const fct_bvh *bvh) {
    return bvh ? fct_bvh_bounds(bvh) : fct_tree_get(tree).bounds;
}

/* Sets the transform (NULL: identity) of an instance and of its frame. Errors: DATA (singular, not finite).
 */
fct_result fct_scene_set_transform(const fct_env *env, const char *name, const float transform[12],
                                   fct_instance *instance, fct_scene_frame *frame);
/* 0, or a point near the middle of bounds that lie too far from 0 for floats. */
void fct_scene_choose_origin(const double lower[3], const double upper[3], double origin[3]);

/* The texture of that name, or FCT_NONE. */
uint32_t fct_scene_find_texture(const fct_scene *scene, const char *name);
/* Adds an image, which the scene owns from here on, also after a failure. Errors: MEMORY. */
fct_result fct_scene_own_texture(fct_scene *scene, const char *name, fct_image image, uint32_t *id);
void fct_scene_release_textures(fct_scene *scene);
/* Warns of instances that have a texture but no texture coordinates. */
void fct_scene_note_bare_textures(const fct_scene *scene);

/* Models [first, first + count) of one mesh, one per label, in ascending order of the labels. */
typedef struct fct_scene_parts {
    uint32_t first, count;
    uint32_t *labels; /* count; the caller releases them */
} fct_scene_parts;

/* Adds the mesh as models, one per distinct label. `labels` has mesh->face_count numbers below label_count;
 * NULL means that every label is 0. With NULL labels the caller may give `tree`, the tree of the whole mesh;
 * then `mesh` may be NULL; if it is not, the model keeps its texture coordinates and normals. The scene owns
 * `tree` from here on, also after a failure. Errors: DATA, MEMORY, CANCELLED. */
fct_result fct_scene_split(fct_scene *scene, const char *name, const fct_mesh *mesh, fct_tree *tree,
                           const uint32_t *labels, uint32_t label_count, fct_scene_parts *parts);
/* Notes in the models from `first` on that they are the parts of `mesh`: its counts, and in the first one the
 * vertices that no part has. Errors: MEMORY. */
fct_result fct_scene_note_loose(fct_scene *scene, uint32_t first, const fct_mesh *mesh);
/* Adds an object of models [first, first + count); `materials` has `count` ids. Errors: DATA, MEMORY. */
fct_result fct_scene_place(fct_scene *scene, const char *name, uint32_t first, uint32_t count,
                           const uint32_t *materials, const float transform[12]);

/* Sorts faces by label; faces of one label stay in ascending order. The faces of label k are faces[starts[k]]
 * up to faces[starts[k + 1]]; `starts` has label_count + 1 entries. */
void fct_scene_sort_faces(const uint32_t *labels, uint32_t face_count, uint32_t label_count, uint32_t *starts,
                          uint32_t *faces);

#endif
