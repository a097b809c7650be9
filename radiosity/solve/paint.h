/* radiosity/solve/paint.h: the mean reflectance of elements of painted surfaces.
 *
 * Clusters and triangles take the mean of their tree node (scene/texture/reflectance.h). The means of the
 * quarters of a triangle are scaled so that their mean is exactly that of the triangle, as for the children
 * of a cluster: a refined solution reflects the same share of a uniform irradiance.
 */
#ifndef FCT_RADIOSITY_PAINT_H
#define FCT_RADIOSITY_PAINT_H

#include "base/math/vec.h"
#include "facetree/scene.h"

typedef struct fct_paints {
    const fct_env *env;
    const fct_scene *scene;
    float **means; /* per instance: of all nodes x 3, or NULL: the reflectance of the material is that of
                      every point. Instances of one model and one material share them */
    float **owned; /* each once */
    uint32_t owned_count;
} fct_paints;

/* Averages the nodes of all painted instances. Errors: MEMORY, CANCELLED. */
fct_result fct_paints_create(const fct_env *env, const fct_scene *scene, fct_paints *out);
void fct_paints_release(fct_paints *paints);

/* The mean reflectance of a tree node. */
void fct_paints_node(const fct_paints *paints, uint32_t instance, uint32_t node, float out[3]);
/* Those of four equal parts of a triangle of the mean `whole`, which lies in the face at `place`. `parts` are
 * their corners in the world, `face` those of the face. */
void fct_paints_quarters(const fct_paints *paints, uint32_t instance, uint32_t place, const v3 face[3],
                         const v3 parts[4][3], const float whole[3], float out[4][3]);

#endif
