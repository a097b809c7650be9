/* mesh/obj/read.h: the reader of Wavefront OBJ. */
#ifndef FCT_MESH_OBJ_READ_H
#define FCT_MESH_OBJ_READ_H

#include "mesh/soup.h"

/* Errors: DATA, MEMORY. */
fct_result fct_read_obj(const fct_source *source, fct_soup *out);

#endif
