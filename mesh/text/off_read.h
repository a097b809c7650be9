/* mesh/text/off_read.h: the reader of OFF. */
#ifndef FCT_MESH_TEXT_OFF_READ_H
#define FCT_MESH_TEXT_OFF_READ_H

#include "mesh/soup.h"

/* Errors: DATA, MEMORY. */
fct_result fct_read_off(const fct_source *source, fct_soup *out);

#endif
