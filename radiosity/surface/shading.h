/* radiosity/surface/shading.h: the normals that an instance is shaded with.
 *
 * A model may come with a normal per vertex. Inside a triangle the shading normal is the normalised mean of
 * those of its corners, weighted by the barycentrics, as renderers interpolate it. The geometry stays what it
 * is: it decides where rays start and what they meet.
 */
#ifndef FCT_RADIOSITY_SHADING_H
#define FCT_RADIOSITY_SHADING_H

#include "base/math/vec.h"
#include "facetree/radiosity.h"

/* Degrees: without normals of a file, sharper edges are creases. Larger angles shade boxes as if they were
 * round; smaller ones break coarse spheres into facets. */
#define FCT_CREASE_DEGREES 40

typedef struct fct_shading {
    const fct_scene *scene; /* NULL is allowed where the rule is not FILE */
    uint32_t instance;
    fct_normals rule;     /* FILE only if the model has normals */
    double crease_cosine; /* faces whose normals have a larger cosine are smooth at their edge */
    bool back;            /* the back of the surface is lit. Normals are those of the front all the same */
} fct_shading;

/* The shading of an instance by a rule of fct_bake_def. crease: degrees, in (0, 180]. */
fct_shading fct_shading_make(const fct_scene *scene, uint32_t instance, fct_normals rule, double crease,
                             bool back);

/* A triangle of the model in the world, wound so that its front is outside. In a mirrored instance its second
 * and third corner are exchanged. */
typedef struct fct_shaded_face {
    v3 positions[3];
    v3 normal;     /* unit, zero without area */
    v3 normals[3]; /* of the file, unit; `normal` where the file's is unusable */
    bool given[3]; /* the file's is usable: not zero, and at most 88 degrees from `normal` */
    bool mirrored;
} fct_shaded_face;

/* The rule must be FILE. */
void fct_shading_face(const fct_shading *shading, uint32_t place, fct_shaded_face *out);
/* The unit shading normal at weights of the second and third corner of the model's triangle; zero if no
 * corner that has a weight has a usable normal. It is in front of the face. */
v3 fct_shaded_normal(const fct_shaded_face *face, const float uv[2]);
/* The same for corners [0, count) of faces whose sources are given, which meet in one point: the mean of
 * their normals; zero without the rule FILE or if no corner has a usable normal. face_places: per face;
 * source_uv: per corner x 2. */
v3 fct_shading_mean(const fct_shading *shading, const uint32_t *corners, size_t count,
                    const uint32_t *face_places, const float *source_uv);
/* True if two unit normals count as the same. */
bool fct_shading_same(v3 a, v3 b);

/* The place above a point of the triangle from which its rays start. On a convex surface of few triangles, a
 * lamp just above the horizon of the shading normal is hidden by the triangle itself: the shadow terminator.
 * So the point moves to the curved surface that the normals describe (Hanika 2021, Hacking the shadow
 * terminator, Ray Tracing Gems II, chapter 4): with the weights w_i, positions p_i and normals n_i,
 *     p' = p - sum w_i min(0, (p - p_i) . n_i) n_i.
 * It stays where the surface is flat or hollow, where a corner's normal is more than 45 degrees from that of
 * the triangle, or where something lies between p and p'. Without the rule FILE the point is returned. */
v3 fct_shading_lift(const fct_shading *shading, uint32_t place, v3 point);

/* Corners of the instance, at faces with area, whose normal of the file is unusable. *corners: of all. */
uint64_t fct_shading_count_unusable(const fct_shading *shading, uint64_t *corners);

#endif
