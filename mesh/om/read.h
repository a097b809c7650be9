/* mesh/om/read.h: the reader of OM, OpenMesh's own format. */
#ifndef FCT_MESH_OM_READ_H
#define FCT_MESH_OM_READ_H

#include "mesh/soup.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Errors: DATA, MEMORY, INTERNAL (OpenMesh failed). */
fct_result fct_read_om(const fct_source *source, fct_soup *out);

#ifdef __cplusplus
}
#endif
#endif
