/* mesh/stream.h: a mesh file read range by range, for meshes that are larger than memory.
 *
 * A binary PLY of triangles is read in place. Any other file is loaded once and copied to a temporary file.
 * The stream has positions, triangles, vertex colours and materials, the arrays of a hierarchy file. Reading
 * checks that indices are in range and floats are finite.
 */
#ifndef FCT_MESH_STREAM_H
#define FCT_MESH_STREAM_H

#include "base/io/spool.h"
#include "facetree/mesh.h"

typedef struct fct_stream fct_stream;

typedef struct fct_stream_info {
    uint32_t vertex_count, face_count;
    bool colors, materials;
    uint32_t material_count;     /* of names; without names the caller takes the greatest number */
    char *const *material_names; /* or NULL */
    double origin[3];            /* as in fct_mesh */
} fct_stream_info;

/* folder and beside as for fct_spool_open. Errors: INPUT, DATA, MEMORY, OUTPUT, CANCELLED. */
fct_result fct_stream_open(const fct_env *env, const char *path, const char *folder, const char *beside,
                           fct_stream **out);
/* NULL is allowed. */
void fct_stream_close(fct_stream *stream);
fct_stream_info fct_stream_get(const fct_stream *stream);

/* Vertices [first, first + count): positions (count x 3) and colours (count x 3, or NULL). Errors: INPUT,
 * DATA. */
fct_result fct_stream_vertices(fct_stream *stream, uint32_t first, uint32_t count, float *positions,
                               float *colors);
/* Faces [first, first + count): triangles (count x 3) and materials (count, or NULL). Errors: INPUT, DATA. */
fct_result fct_stream_faces(fct_stream *stream, uint32_t first, uint32_t count, uint32_t *triangles,
                            uint32_t *materials);

#endif
