/* mesh/glb/write/write.h: the writer of GLB, the binary form of glTF 2. */
#ifndef FCT_MESH_GLB_WRITE_H
#define FCT_MESH_GLB_WRITE_H

#include "mesh/sink.h"

/* Errors: DATA, MEMORY. */
fct_result fct_write_glb(const fct_sink *sink, FILE *stream);

#endif
