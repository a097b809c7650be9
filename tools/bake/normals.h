/* tools/bake/normals.h: the option --normals. */
#ifndef FCT_TOOLS_BAKE_NORMALS_H
#define FCT_TOOLS_BAKE_NORMALS_H

#include <argp.h>

#include "facetree/radiosity.h"
#include "tools/kit/env.h"

/* Reads file, crease=DEG or flat. */
error_t bake_parse_normals(struct argp_state *state, const char *text, fct_bake_def *def);
/* "file", "crease" or "flat". */
const char *bake_name_normals(fct_normals rule);
/* Warns of normals of files that are not usable. */
void bake_warn_normals(tool *t, const fct_bake_stats *stats);

#endif
