/* mesh/glb/write/export.h: the geometry of a glTF file as JSON and as bytes.
 *
 * A file holds a list of geometries: vertices with their attributes, and one primitive per material over
 * them. Each attribute is a buffer view and an accessor, and so are the indices of each primitive. COLOR_0
 * holds the exposed, clamped, linear colours as normalized shorts; _RADIOSITY (or _IRRADIANCE, ...) holds
 * light as floats.
 * All data are little endian and aligned to four bytes. The JSON is made first, because its length comes
 * before it in the file.
 */
#ifndef FCT_MESH_GLB_EXPORT_H
#define FCT_MESH_GLB_EXPORT_H

#include "mesh/glb/write/layout.h"

/* A further attribute: floats per vertex of the mesh. */
typedef struct fct_glb_extra {
    char name[64];
    int width; /* 1 to 4 floats per vertex */
    float *values;
} fct_glb_extra;

enum { FCT_GLB_EXTRAS = 16 };

typedef struct fct_glb_geometry {
    const fct_mesh *mesh;
    fct_glb_layout layout;
    const float *light;     /* floats per vertex of the mesh to write beside its colours, or NULL */
    const char *light_name; /* their attribute, such as _RADIOSITY */
    const char *color_name; /* attribute of the colours; NULL: COLOR_0 */
    const fct_glb_extra *extras;
    size_t extra_count;    /* at most FCT_GLB_EXTRAS */
    size_t accessor, view; /* numbers of its first accessor and buffer view */
} fct_glb_geometry;

/* Bytes of another kind, such as an image, in a buffer view of their own. */
typedef struct fct_glb_blob {
    const void *data;
    size_t size;
} fct_glb_blob;

typedef struct fct_glb_content {
    fct_glb_geometry *geometries;
    size_t geometry_count;
    fct_glb_blob *blobs; /* their views follow those of the geometries */
    size_t blob_count;
} fct_glb_content;

/* Sets the numbers of accessors and views. Returns the number of the first blob's view. */
size_t fct_glb_number(const fct_glb_content *content);

/* The faces of a material. */
uint32_t fct_glb_primitive_faces(const fct_glb_geometry *geometry, uint32_t material);
/* Prints the members indices and attributes of a primitive that has faces. */
void fct_glb_print_primitive(const fct_glb_geometry *geometry, uint32_t material, FILE *json);
/* Prints the member attributes of a primitive of points. */
void fct_glb_print_attributes(const fct_glb_geometry *geometry, FILE *json);
/* Prints the root's members accessors, bufferViews and buffers. Returns the size of the buffer. */
size_t fct_glb_print_content(const fct_glb_content *content, FILE *json);

/* Writes a GLB. print(user, json) prints the JSON and returns the size of the buffer. Errors: DATA (more than
 * 4 GB), MEMORY. */
fct_result fct_glb_write_file(const fct_sink *sink, const fct_glb_content *content,
                              size_t (*print)(void *user, FILE *json), void *user, FILE *stream);

#endif
