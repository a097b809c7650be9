/* radiosity/output/solution.h: a finished solution, and the light that all outputs take from it. */
#ifndef FCT_RADIOSITY_SOLUTION_H
#define FCT_RADIOSITY_SOLUTION_H

#include "facetree/radiosity.h"
#include "radiosity/output/anchor.h"
#include "radiosity/solve/link.h"
#include "radiosity/solve/transport.h"
#include "radiosity/surface/shading.h"

/* The longest reach of an anchor over the default edge of the scene: an eighth of the diagonal of most
 * scenes. */
#define FCT_LONGEST_REACH 9

typedef struct fct_solution {
    const fct_env *env;
    const fct_scene *scene;
    fct_bake_def def;
    fct_lamps *lamps;
    fct_elements elements;
    fct_links links;
    fct_transport transport;
    fct_guides guides;
    double max_edge;       /* def.max_edge, or the default of the scene */
    double longest_reach;  /* of anchors: FCT_LONGEST_REACH times the default edge */
    double fineness;       /* sqrt(default error / error), in [.25, 16]: numbers of rays grow with it */
    double mean_radiosity; /* rho E over the scene's area and channels: the scale of visible differences */
    bool unchecked;        /* no error estimate of the output: the bake was stopped */
} fct_solution;

/* Rays per lamp: `least` at the default error and above, more for smaller errors, at most 64. */
uint32_t fct_solution_lamp_rays(const fct_solution *s, uint32_t least);

/* Direct irradiance (RGB) at a point with a unit normal; 0 for def.indirect_only. goal, sight (may be NULL):
 * as in fct_lamps_direct. *rays grows. */
void fct_solution_direct(const fct_solution *s, const float point[3], const float normal[3], float offset,
                         uint64_t seed, uint32_t rays_each, const fct_lamp_goal *goal, fct_sight *sight,
                         double irradiance[3], uint64_t *rays);

/* The shading of an instance by the rule of the def. */
fct_shading fct_solution_shading(const fct_solution *s, uint32_t instance, bool back);

/* The stored solution for gathers. */
fct_source fct_solution_source(const fct_solution *s);

/* Radiosity b = e + rho E of a point of an instance; rho E for def.indirect_only. */
void fct_solution_radiosity(const fct_solution *s, uint32_t instance, const float reflectance[3],
                            const double irradiance[3], float radiosity[3]);

#endif
