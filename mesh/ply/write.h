/* mesh/ply/write.h: the writer of PLY. */
#ifndef FCT_MESH_PLY_WRITE_H
#define FCT_MESH_PLY_WRITE_H

#include "mesh/sink.h"

/* Errors: CANCELLED. */
fct_result fct_write_ply(const fct_sink *sink, FILE *stream);

#endif
