/* mesh/ply/read.h: the reader of PLY. */
#ifndef FCT_MESH_PLY_READ_H
#define FCT_MESH_PLY_READ_H

#include "mesh/soup.h"

/* Layout 0: each record of a text file is one line. Layout 1: line ends mean nothing, and all of the text is
 * used. */
enum { FCT_PLY_LAYOUTS = 2 };

/* Errors: DATA, MEMORY. */
fct_result fct_read_ply(const fct_source *source, fct_soup *out);

#endif
