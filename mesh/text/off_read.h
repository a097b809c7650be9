/* mesh/text/off_read.h: the reader of OFF. */
#ifndef FCT_MESH_TEXT_OFF_READ_H
#define FCT_MESH_TEXT_OFF_READ_H

#include "mesh/soup.h"

/* Layout 0: each vertex and each face is one line. The others: line ends mean nothing, and all of the text is
 * used. They differ in the number of colour components. */
enum { FCT_OFF_LAYOUTS = 9 };

/* Errors: DATA, MEMORY. */
fct_result fct_read_off(const fct_source *source, fct_soup *out);

#endif
