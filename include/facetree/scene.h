/* facetree/scene.h: models placed in a world, with materials and light; rays through the whole; a volume
 * hierarchy above.
 *
 * Units: lengths are the scene file's; emission is radiant exitance (power leaving per area), RGB, linear.
 */
#ifndef FACETREE_SCENE_H
#define FACETREE_SCENE_H

#include "facetree/bvh.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct fct_scene fct_scene;

typedef struct fct_material {
    char name[64];
    float reflectance[3]; /* diffuse, each in [0, 1) */
    float emission[3];    /* each >= 0 */
    bool two_sided;       /* reflects and emits on both sides; otherwise the back side is black but opaque */
    uint32_t light_group; /* index; 0 unless the scene file names groups */
} fct_material;

/* A model is one tree with one material throughout: a mesh with several is cut into one model per material
 * when it is added. */
typedef struct fct_model {
    char name[128];
    const fct_tree *tree;
    const fct_bvh *bvh;
    const uint32_t
        *source_faces; /* face of the tree's input -> face of the mesh as it was added, or NULL: the same */
    const uint32_t *source_vertices; /* likewise for vertices */
} fct_model;

typedef struct fct_instance {
    char name[128]; /* the object's name; parts of one object cut by material share it */
    uint32_t model;
    uint32_t material;
    uint32_t object;        /* parts of one object share the number */
    float to_world[12];     /* rows of R|t: world = to_world * (x, y, z, 1) */
    float to_model[12];     /* its inverse */
    float normal_matrix[9]; /* rows; takes area vectors to the world: cofactors of R, |normal_matrix S| is the
                               area. Under a mirrored transform what pointed out of a closed model then points
                               into it: negate */
    float uniform_scale;    /* the factor when R is a rotation times a factor (reflections too), else 0 */
    bool mirrored;          /* det R < 0: the winding of transformed corners runs the other way round */
    fct_bounds bounds;      /* world */
} fct_instance;

/* Nodes of a binary hierarchy over the instances: node 0 is the root when there is one; leaf nodes name an
 * instance. */
typedef struct fct_volume {
    fct_bounds bounds;
    uint32_t child[2]; /* nodes; FCT_NONE in a leaf */
    uint32_t instance; /* FCT_NONE in an inner node */
} fct_volume;

typedef struct fct_camera {
    float position[3], target[3], up[3];
    float vertical_fov; /* degrees */
    bool given;         /* false: the scene names none, and the fields hold a view of the whole */
} fct_camera;

typedef struct fct_scene_view {
    uint32_t material_count, model_count, instance_count, volume_count, light_group_count, object_count;
    const fct_material *materials;
    const fct_model *models;
    const fct_instance *instances;
    const fct_volume *volumes;
    const char *const *light_groups;
    fct_bounds bounds;
    fct_camera camera;
    uint64_t face_count; /* over all instances */
} fct_scene_view;

/* An empty scene whose models will use `backend` for rays. */
FCT_API fct_result fct_scene_create(const fct_env *env, fct_backend backend, fct_scene **out);
FCT_API void fct_scene_destroy(fct_scene *scene);

/* Adds a material; *id receives its number. Errors: DATA (reflectance outside [0, 1), negative or not finite
 * emission), MEMORY. */
FCT_API fct_result fct_scene_add_material(fct_scene *scene, const fct_material *material, uint32_t *id);
/* Adds an object: a mesh under a transform (3 x 4, rows of R|t; NULL: identity), with one material, or, when
 * face_materials (mesh->face_count material ids) is not NULL, one per face. The mesh is clustered here unless
 * `tree` is given (of this very mesh, under one material: face_materials is NULL; `mesh` may be NULL too);
 * the scene owns it from here on, and destroys it when the call fails. The mesh is not kept. Objects are
 * numbered in the order in which they are added, instances of them included. Errors: DATA (singular
 * transform, invalid mesh), MEMORY, CANCELLED. */
FCT_API fct_result fct_scene_add_object(fct_scene *scene, const char *name, const fct_mesh *mesh,
                                        fct_tree *tree, const float transform[12], uint32_t material,
                                        const uint32_t *face_materials);
/* Another instance of everything that object `object` consists of, with the same materials (material
 * FCT_NONE) or another. */
FCT_API fct_result fct_scene_add_instance(fct_scene *scene, const char *name, uint32_t object,
                                          const float transform[12], uint32_t material);
/* Names a light group; groups are numbered in the order in which they are added. A scene that names none has
 * one, "all". Errors: MEMORY. */
FCT_API fct_result fct_scene_add_light_group(fct_scene *scene, const char *name, uint32_t *id);
FCT_API void fct_scene_set_camera(fct_scene *scene, const fct_camera *camera);
/* Builds ray structures and the volume hierarchy; to be called once, after which the scene is immutable;
 * bounds, face_count and the default camera are known from here on. After a failure only destroy remains.
 * Errors: DATA (nothing in the scene, a light group that is not there), MEMORY, CANCELLED, INTERNAL. */
FCT_API fct_result fct_scene_commit(fct_scene *scene);

/* Reads scene.json (documented in docs/scene.md), OBJ with its MTL (Kd, Ke; one object per group or `o`),
 * glTF 2.0
 * (.gltf, .glb), or any mesh file (grey, no light), and commits. Model paths are relative to the scene file.
 * A model mesh.ply with an up-to-date hierarchy mesh.fct beside it (recorded source hash equal) is opened
 * instead of clustered. Errors carry file, line and column where the format is text. Errors: INPUT, DATA,
 * MEMORY, CANCELLED. */
FCT_API fct_result fct_scene_load(const fct_env *env, const char *path, fct_backend backend, fct_scene **out);

FCT_API fct_scene_view fct_scene_get(const fct_scene *scene);

typedef struct fct_scene_hit {
    float t, u, v;
    uint32_t instance;
    uint32_t face;  /* input face id of the instance's tree */
    uint32_t place; /* its place in the tree's order */
    float
        normal[3]; /* unit, world, by the winding: outwards for a closed model, mirrored instances included */
} fct_scene_hit;

/* World-space rays; t is measured along the given direction. */
FCT_API bool fct_scene_closest_hit(const fct_scene *scene, const fct_ray *ray, fct_scene_hit *hit,
                                   fct_visits *visits);
FCT_API bool fct_scene_any_hit(const fct_scene *scene, const fct_ray *ray, fct_visits *visits);
/* The nearest surface point over all instances within max_distance, in world distance whatever the
 * transforms; equal distances: the lower instance. u, v, face as in fct_closest. Works with either backend;
 * exact under transforms that are not uniform too, but slower there. */
FCT_API bool fct_scene_closest_point(const fct_scene *scene, const float point[3], float max_distance,
                                     uint32_t *instance, fct_closest *out);

#ifdef __cplusplus
}
#endif
#endif
