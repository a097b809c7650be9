/* mesh/text/write.h: the writers of OBJ, OFF and STL. */
#ifndef FCT_MESH_TEXT_WRITE_H
#define FCT_MESH_TEXT_WRITE_H

#include "mesh/sink.h"

/* Errors: DATA (a material name that OBJ cannot hold). */
fct_result fct_write_obj(const fct_sink *sink, FILE *stream);
fct_result fct_write_off(const fct_sink *sink, FILE *stream);
fct_result fct_write_stl(const fct_sink *sink, FILE *stream);

#endif
