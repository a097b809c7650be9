/* simplify/refit/search.h: the nearest remaining faces of samples. */
#ifndef FCT_SIMPLIFY_SEARCH_H
#define FCT_SIMPLIFY_SEARCH_H

#include "base/variant.h"
#include "simplify/refit/samples.h"

/* Sets the landings of the samples [begin, end): the nearest point of the faces around the points that the
 * sample's corners were contracted to, or further on while the distance decreases. Faces on the sample's side
 * of a seam take precedence over nearer faces on another side. Hubs are skipped. point_parents and
 * wedge_parents name roots. */
#define fct_refit_search FCT_KERNEL(fct_refit_search)
FCT_DECLARE_KERNEL(void, fct_refit_search, (const fct_refit *r, size_t begin, size_t end));

#endif
