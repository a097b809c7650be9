/* mesh/write.h: one writer a format. Each puts a checked mesh into a stream, whose errors the caller looks
 * at; the numbers of text are those of the C locale. */
#ifndef FCT_MESH_WRITE_H
#define FCT_MESH_WRITE_H

#include <stdio.h>

#include "facetree/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct fct_sink {
    const fct_env *env;
    const char *name; /* of the file, for messages */
    const fct_mesh *mesh;
    const fct_mesh_save_def *def;
} fct_sink;

fct_result fct_write_ply(const fct_sink *sink, FILE *stream);
fct_result fct_write_obj(const fct_sink *sink, FILE *stream);
fct_result fct_write_off(const fct_sink *sink, FILE *stream);
fct_result fct_write_stl(const fct_sink *sink, FILE *stream);
fct_result fct_write_glb(const fct_sink *sink, FILE *stream);
/* Through OpenMesh. */
fct_result fct_write_om(const fct_sink *sink, FILE *stream);

/* Tells in one note which of the arrays the mesh has (FCT_MESH_ bits) the format has no place for. */
void fct_note_left_out(const fct_sink *sink, unsigned arrays);

#ifdef __cplusplus
}
#endif
#endif
