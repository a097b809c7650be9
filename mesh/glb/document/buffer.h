/* mesh/glb/document/buffer.h: the bytes of buffers and buffer views. */
#ifndef FCT_MESH_GLB_BUFFER_H
#define FCT_MESH_GLB_BUFFER_H

#include "mesh/glb/document/glb.h"

/* Finds the bytes of a buffer view. The first call opens its buffer (the BIN chunk, a data URI in base64, or
 * a file in the folder of the document) and decompresses EXT_meshopt_compression. *out belongs to `glb`.
 * Errors: DATA, INPUT (a file that cannot be read), MEMORY. */
fct_result fct_glb_view_of(fct_glb *glb, int64_t index, const fct_glb_view **out);

/* Opens the bytes of a URI (a JSON string): a data URI in base64, or a file in the folder of the document.
 * *out is a new buffer. fct_file_close and fct_release free its file and its own bytes, also after an error.
 * Errors: DATA, INPUT, MEMORY. */
fct_result fct_glb_open_uri(const fct_glb *glb, const json_t *uri, fct_glb_buffer *out);

#endif
