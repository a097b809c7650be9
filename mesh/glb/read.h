/* mesh/glb/read.h: the reader of GLB, the binary form of glTF 2. */
#ifndef FCT_MESH_GLB_READ_H
#define FCT_MESH_GLB_READ_H

#include "mesh/soup.h"

/* Errors: DATA, MEMORY. */
fct_result fct_read_glb(const fct_source *source, fct_soup *out);

#endif
