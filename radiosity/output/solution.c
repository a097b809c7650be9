/* radiosity/output/solution.c: see solution.h. */
#include "radiosity/output/solution.h"

enum { MOST_LAMP_RAYS = 64 };
uint32_t fct_solution_lamp_rays(const fct_solution *s, uint32_t least) {
    return (uint32_t)fct_min(fct_max(least * s->fineness, least), MOST_LAMP_RAYS);
}

void fct_solution_direct(const fct_solution *s, const float point[3], const float normal[3], float offset,
                         uint64_t seed, uint32_t rays_each, const fct_lamp_goal *goal, fct_sight *sight,
                         double irradiance[3], uint64_t *rays) {
    const bool first = !goal || !goal->doubt;
    if (first) irradiance[0] = irradiance[1] = irradiance[2] = 0;
    if (sight && first) *sight = (fct_sight){0};
    if (s->def.indirect_only) return;
    double p[3] = {point[0], point[1], point[2]}, n[3] = {normal[0], normal[1], normal[2]};
    fct_lamps_direct(s->lamps, s->scene, p, n, offset, seed, rays_each, goal, sight, irradiance, rays);
}

fct_shading fct_solution_shading(const fct_solution *s, uint32_t instance, bool back) {
    return fct_shading_make(s->scene, instance, s->def.normals, s->def.crease, back);
}

fct_source fct_solution_source(const fct_solution *s) {
    return (fct_source){&s->elements, &s->guides, s->transport.stored, s->longest_reach, s->lamps};
}

void fct_solution_radiosity(const fct_solution *s, uint32_t instance, const float reflectance[3],
                            const double irradiance[3], float radiosity[3]) {
    const fct_scene_view *view = &s->elements.view;
    const fct_material *m = &view->materials[view->instances[instance].material];
    for (int c = 0; c < 3; ++c)
        radiosity[c] = (float)((s->def.indirect_only ? 0 : m->emission[c]) + reflectance[c] * irradiance[c]);
}
