/* mesh/ply/read.h: the reader of PLY. */
#ifndef FCT_MESH_PLY_READ_H
#define FCT_MESH_PLY_READ_H

#include "mesh/soup.h"

/* Errors: DATA, MEMORY. */
fct_result fct_read_ply(const fct_source *source, fct_soup *out);

#endif
