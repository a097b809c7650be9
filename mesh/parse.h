/* mesh/parse.h: readers of files that lie in memory. Each fills an empty soup, or fails and leaves it for
 * fct_soup_release. No reader allocates more than a small multiple of `size`, whatever the file declares. */
#ifndef FCT_MESH_PARSE_H
#define FCT_MESH_PARSE_H

#include "mesh/soup.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What a reader gets. */
typedef struct fct_source {
    const fct_env *env;
    const char *name; /* begins every message */
    const void *data;
    size_t size;
} fct_source;

fct_result fct_read_obj(const fct_source *source, fct_soup *out);
fct_result fct_read_ply(const fct_source *source, fct_soup *out);
fct_result fct_read_off(const fct_source *source, fct_soup *out);
fct_result fct_read_stl(const fct_source *source, fct_soup *out);
fct_result fct_read_glb(const fct_source *source, fct_soup *out);
/* Through OpenMesh. */
fct_result fct_read_om(const fct_source *source, fct_soup *out);

/* format: "obj", "ply", "off", "stl", "glb" or "om", in any case. Errors: DATA (an unknown format too),
 * MEMORY, CANCELLED. */
fct_result fct_mesh_parse(const fct_env *env, const char *name, const void *data, size_t size,
                          const char *format, fct_mesh *out);

#ifdef __cplusplus
}
#endif
#endif
