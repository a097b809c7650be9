/* facetree/scene.h: instances of models in a world, their materials and light groups, queries on all of them,
 * and a volume hierarchy over their boxes. docs/scene.md is the guide.
 *
 * World coordinates of a committed scene are relative to fct_scene_view.origin. It is 0 unless the scene lies
 * more than 512 times its size away from the origin of its files, where floats have few digits left: then it
 * is near the scene, and rays, points, bounds, transforms and the camera are relative to it.
 *
 * Lengths have the unit of the scene file. Emission is a radiance, linear RGB, as in glTF; docs/radiosity.md,
 * "Units", says how it relates to power.
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

/* An image whose texels multiply the reflectance of materials. */
typedef struct fct_texture {
    const char *name; /* of its file, or "images[3]" of a glTF file */
    uint32_t width, height;
    const uint8_t *pixels; /* height x width x 3 sRGB bytes, rows from the top */
} fct_texture;

/* The texel of a coordinate outside of [0, 1]: of the repeated image, of its border, or of the mirrored
 * image. */
typedef enum fct_wrap { FCT_WRAP_REPEAT, FCT_WRAP_CLAMP, FCT_WRAP_MIRROR } fct_wrap;

/* How the reflectance of a material varies over a surface. The reflectance of a point is
 *     min(factor * texel, .9) * colour    with a texture
 *     min(factor * colour, .9)            without
 * with the colour of the vertices, at most 1. Texels are interpolated between their centres, vertices inside
 * triangles. A model without texture coordinates takes the factor instead of the texture. */
typedef struct fct_paint {
    uint32_t size;
    float factor[3];  /* each >= 0; default 1 */
    uint32_t texture; /* FCT_NONE, the default: none */
    fct_wrap wrap[2];
    float transform[6]; /* rows of a 2 x 3 matrix: image point = transform * (u, v, 1); default: identity */
    bool vertex_colors; /* default false */
} fct_paint;
FCT_API fct_paint fct_paint_default(void);

/* A model is one tree of one material. A mesh with several materials becomes one model per material. */
typedef struct fct_model {
    char name[128];
    const fct_tree *tree;
    const fct_bvh *bvh; /* NULL for a large model of a FCT_BACKEND_MULTIRES scene until fct_scene_complete */
    /* Input face of the tree -> face of the mesh that was added; NULL if they are the same. */
    const uint32_t *source_faces;
    const uint32_t *source_vertices;                 /* likewise for vertices */
    uint32_t source_face_count, source_vertex_count; /* of the mesh that was added */
    /* Vertices of that mesh which no face uses, and their positions (x 3) in the model's space. Only the
     * first part of a mesh of several materials has them; the tree of a whole mesh has all vertices. */
    const uint32_t *loose_vertices;
    const float *loose_positions;
    uint32_t loose_count;
    /* Of the mesh, in the order of the tree, which holds its colours; NULL if the mesh has none, or if the
     * model comes from a hierarchy file, which stores neither. v of a texture coordinate counts from the top
     * of the image, as in glTF; readers of other files turn it. */
    const float *texcoords;      /* faces x 3 x 2, per place and corner */
    const float *normals;        /* vertices x 3, per tree vertex */
    const float *corner_normals; /* faces x 3 x 3, per place and corner: instead of `normals` */
    const float *face_colors;    /* faces x 3, per place; NULL if the tree has colours */
    bool inward; /* closed and wound inwards, as rooms are: the tree is, or the mesh before it was split */
} fct_model;

typedef struct fct_instance {
    char name[128]; /* of the object; its parts share it */
    uint32_t model;
    uint32_t material;
    uint32_t object;    /* number of the object; its parts share it */
    float to_world[12]; /* rows of R|t: world = to_world * (x, y, z, 1) */
    float to_model[12]; /* its inverse */
    float
        normal_matrix[9]; /* cofactors of R, by rows: takes an area vector to the world. Under a mirrored
                             transform an outward vector of a closed model becomes an inward one: negate it */
    float uniform_scale;  /* the factor if R is a factor times a rotation or reflection, else 0 */
    bool mirrored;        /* det R < 0: the transform reverses the winding */
    fct_bounds bounds;    /* world */
} fct_instance;

/* Node of the binary hierarchy over the instances; node 0 is the root. */
typedef struct fct_volume {
    fct_bounds bounds;
    uint32_t child[2]; /* nodes; FCT_NONE in a leaf */
    uint32_t instance; /* FCT_NONE in an inner node */
} fct_volume;

typedef struct fct_camera {
    float position[3], target[3], up[3];
    float vertical_fov; /* degrees */
    bool given;         /* false if the scene has no camera; then the fields show the whole scene */
} fct_camera;

typedef struct fct_scene_view {
    uint32_t material_count, model_count, instance_count, volume_count, light_group_count, object_count,
        texture_count;
    const fct_material *materials;
    const fct_texture *textures;
    const fct_model *models;
    const fct_instance *instances;
    const fct_volume *volumes;
    const char *const *light_groups;
    fct_bounds bounds; /* of the instances' bounds, which may be larger than the instances */
    fct_camera camera;
    uint64_t face_count; /* over all instances */
    double origin[3];    /* in the coordinates of the files: theirs are origin + world */
} fct_scene_view;

/* An empty scene. `backend` answers its rays. Errors: MEMORY. */
FCT_API fct_result fct_scene_create(const fct_env *env, fct_backend backend, fct_scene **out);
FCT_API void fct_scene_destroy(fct_scene *scene);

/* Adds a material; *id receives its number. Errors: DATA (a reflectance outside [0, 1), a negative or
 * infinite emission), MEMORY. */
FCT_API fct_result fct_scene_add_material(fct_scene *scene, const fct_material *material, uint32_t *id);
/* Adds an image of width x height x 3 sRGB bytes; *id receives its number. Copies everything. Errors: DATA
 * (an empty image), MEMORY. */
FCT_API fct_result fct_scene_add_texture(fct_scene *scene, const fct_texture *texture, uint32_t *id);
/* Adds the image of a PNG or JPEG file, unless a texture has this name already. Errors: INPUT, DATA, MEMORY.
 */
FCT_API fct_result fct_scene_read_texture(fct_scene *scene, const char *path, uint32_t *id);
/* Paints a material, once. Its reflectance becomes min(factor, .9), a bound of that of all its points. The
 * models of its instances should have texture coordinates, or colours. Errors: DATA (a negative or infinite
 * factor, a texture that does not exist, a transform that is not finite), MEMORY. */
FCT_API fct_result fct_scene_paint_material(fct_scene *scene, uint32_t material, const fct_paint *paint);
/* Adds an object: a mesh under a transform (3 x 4, rows of R|t; NULL: identity). It has one material, or one
 * per face if face_materials (mesh->face_count ids) is not NULL. The call clusters the mesh and does not keep
 * it.
 *
 * If `tree`, the tree of this mesh, is not NULL, the call does not cluster; then face_materials must be NULL,
 * and `mesh` may be NULL; if it is not, the model keeps its texture coordinates and normals. The scene owns
 * the tree from here on, and destroys it if the call fails.
 *
 * Objects are numbered in the order of fct_scene_add_object and fct_scene_add_instance calls. Errors: DATA
 * (singular transform, invalid mesh), MEMORY, CANCELLED. */
FCT_API fct_result fct_scene_add_object(fct_scene *scene, const char *name, const fct_mesh *mesh,
                                        fct_tree *tree, const float transform[12], uint32_t material,
                                        const uint32_t *face_materials);
/* Adds another instance of object `object`, with one material, or with the object's own materials if
 * `material` is FCT_NONE. Errors: DATA (singular transform), MEMORY. */
FCT_API fct_result fct_scene_add_instance(fct_scene *scene, const char *name, uint32_t object,
                                          const float transform[12], uint32_t material);
/* Adds a light group; *id receives its number. A scene without light groups gets one, "all", when it is
 * committed. Errors: MEMORY. */
FCT_API fct_result fct_scene_add_light_group(fct_scene *scene, const char *name, uint32_t *id);
FCT_API void fct_scene_set_camera(fct_scene *scene, const fct_camera *camera);
/* Builds the ray structures and the volume hierarchy, and sets bounds, face_count and the default camera.
 * Call it once; afterwards the scene is immutable and answers queries. After a failure, only
 * fct_scene_destroy is allowed. Errors: DATA (no instance, or a light group that does not exist), MEMORY,
 * CANCELLED, INTERNAL. */
FCT_API fct_result fct_scene_commit(fct_scene *scene);

/* In a scene of FCT_BACKEND_MULTIRES, large models have no ray structure after fct_scene_commit: a bake needs
 * none until its output. Builds them; the scene then answers queries like any other. Does nothing if they
 * exist. No other function may use the scene meanwhile. The first output of a bake calls it; bakes in several
 * threads need a call before them. Errors: DATA (a damaged hierarchy file), MEMORY, CANCELLED. */
FCT_API fct_result fct_scene_complete(const fct_scene *scene);

/* Makes every material that emits no light reflect on both sides. Allowed before and after
 * fct_scene_commit, but not while a bake of the scene exists. */
FCT_API void fct_scene_make_two_sided(fct_scene *scene);

/* Reads a scene file and commits it: scene.json (docs/scene.md), OBJ with MTL, glTF 2.0 (.gltf, .glb), or any
 * mesh or hierarchy file (one grey object without light). Paths are relative to the scene file. If mesh.fct
 * beside mesh.ply records the hash of mesh.ply, it is opened and nothing is clustered. Messages about text
 * formats name file and line. Errors: INPUT, DATA, MEMORY, CANCELLED, INTERNAL. */
FCT_API fct_result fct_scene_load(const fct_env *env, const char *path, fct_backend backend, fct_scene **out);

/* Whether the OBJ file names a material library that exists. If it names libraries and none exists, a warning
 * says so. Errors: INPUT, MEMORY. */
FCT_API fct_result fct_scene_obj_has_library(const fct_env *env, const char *path, bool *found);

FCT_API fct_scene_view fct_scene_get(const fct_scene *scene);

typedef struct fct_scene_hit {
    float t, u, v;
    uint32_t instance;
    uint32_t face;  /* input face id of the instance's tree */
    uint32_t place; /* its place in the tree's order */
    /* Unit length, in the world, by the winding: outwards for a closed model, also under a mirrored
     * transform. */
    float normal[3];
} fct_scene_hit;

/* The bounds of all vertices in the world, exact up to the rounding of doubles; view.bounds may be larger. */
FCT_API void fct_scene_bounds(const fct_scene *scene, double lower[3], double upper[3]);

/* The reflectance at barycentrics (u, v) of the face at `place` of an instance's tree. width >= 0: the mean
 * over an area of about width x width around the point; in the world. */
FCT_API void fct_scene_reflectance(const fct_scene *scene, uint32_t instance, uint32_t place, float u,
                                   float v, float width, float out[3]);
/* Whether fct_scene_reflectance depends on the point. */
FCT_API bool fct_scene_is_painted(const fct_scene *scene, uint32_t instance);

/* The attributes at barycentrics (u, v) of the face at `place` of an instance's tree, by the formula of
 * fct_mesh_point. The normal is in the world: the interpolated normal of the model times the inverse
 * transpose of R, over its length. Texture coordinates and colours are those of fct_model, without the
 * material. */
FCT_API void fct_scene_point(const fct_scene *scene, uint32_t instance, uint32_t place, float u, float v,
                             fct_surface_point *out);

/* Rays in the world; t is in units of the given direction. Equal t: the lower instance. hit->instance and
 * hit->face are FCT_NONE on a miss. visits may be NULL. */
FCT_API bool fct_scene_closest_hit(const fct_scene *scene, const fct_ray *ray, fct_scene_hit *hit,
                                   fct_visits *visits);
FCT_API bool fct_scene_any_hit(const fct_scene *scene, const fct_ray *ray, fct_visits *visits);
/* All hits of all instances in order of t, then of instances, then of face ids. `hits` receives the first
 * `capacity` of them and may be NULL if that is 0. Returns how many a complete answer has, so a result above
 * `capacity` asks for a larger array. Both backends answer, with the OBB structure. */
FCT_API size_t fct_scene_all_hits(const fct_scene *scene, const fct_ray *ray, size_t capacity,
                                  fct_scene_hit *hits, fct_visits *visits);
/* The surface point nearest to `point` over all instances, in world distance; returns whether it is within
 * max_distance, which may be infinity. Equal distances: the lower instance. *out is in the world; *instance
 * is FCT_NONE on a miss. Both backends answer. Exact under every transform. */
FCT_API bool fct_scene_closest_point(const fct_scene *scene, const float point[3], float max_distance,
                                     uint32_t *instance, fct_closest *out);

#ifdef __cplusplus
}
#endif
#endif
