/* mesh/sink.h: the input of every writer.
 *
 * A writer puts a checked mesh into a stream. It ignores errors of the stream, because its caller checks
 * them. It runs in the C locale, so that printf writes decimal points.
 */
#ifndef FCT_MESH_SINK_H
#define FCT_MESH_SINK_H

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
    const float *radiosity; /* the floats to write beside the colours for display, which are mesh->colors */
} fct_sink;

/* The lights that stand beside the colours, and the error of the light. */
#define FCT_MESH_LIGHTS                                                                                      \
    ((unsigned)(FCT_MESH_IRRADIANCE | FCT_MESH_DIRECT | FCT_MESH_INDIRECT | FCT_MESH_ERROR))

/* Sends one note that names the arrays of the mesh which the format cannot store. arrays: FCT_MESH_ bits. */
void fct_note_left_out(const fct_sink *sink, unsigned arrays);

/* Warns that the format stores positions as floats, if the mesh has an origin. */
void fct_warn_of_origin(const fct_sink *sink);

/* fct_file_write_atomic in the C locale, because in some locales printf writes a decimal comma. */
fct_result fct_sink_write(const fct_env *env, const char *path,
                          fct_result (*produce)(void *user, FILE *stream), void *user);

#ifdef __cplusplus
}
#endif
#endif
