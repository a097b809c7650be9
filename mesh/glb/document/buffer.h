/* mesh/glb/document/buffer.h: the bytes of buffers and buffer views. */
#ifndef FCT_MESH_GLB_BUFFER_H
#define FCT_MESH_GLB_BUFFER_H

#include "mesh/glb/document/glb.h"

/* Finds the bytes of a buffer view. The first call opens its buffer (the BIN chunk, a data URI in base64, or
 * a file in the folder of the document) and decompresses EXT_meshopt_compression. *out belongs to `glb`.
 * Errors: DATA, INPUT (a file that cannot be read), MEMORY. */
fct_result fct_glb_view_of(fct_glb *glb, int64_t index, const fct_glb_view **out);

#endif
