/* mesh/om/write.h: the writer of OM, OpenMesh's own format. */
#ifndef FCT_MESH_OM_WRITE_H
#define FCT_MESH_OM_WRITE_H

#include "mesh/sink.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Errors: MEMORY, INTERNAL (OpenMesh failed). */
fct_result fct_write_om(const fct_sink *sink, FILE *stream);

#ifdef __cplusplus
}
#endif
#endif
