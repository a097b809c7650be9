/* mesh/glb/read.h: the reader of glTF 2: .glb and .gltf. */
#ifndef FCT_MESH_GLB_READ_H
#define FCT_MESH_GLB_READ_H

#include "mesh/soup.h"

/* Meshes are placed by their nodes. Colours are those of _RADIOSITY, else COLOR_0. Errors: DATA, INPUT (a
 * buffer in a file that cannot be read), MEMORY, CANCELLED. */
fct_result fct_read_glb(const fct_source *source, fct_soup *out);
/* Whether a primitive has _RADIOSITY. Errors: DATA, MEMORY. */
fct_result fct_glb_holds_light(const fct_source *source, bool *out);
/* XXH3-64 of the file and of the files of its buffers, without messages about them. Errors: MEMORY. */
fct_result fct_glb_hash(const fct_source *source, uint64_t *out);

#endif
