/* mesh/text/stl_read.h: the reader of STL. */
#ifndef FCT_MESH_TEXT_STL_READ_H
#define FCT_MESH_TEXT_STL_READ_H

#include "mesh/soup.h"

/* Errors: DATA, MEMORY. */
fct_result fct_read_stl(const fct_source *source, fct_soup *out);

#endif
