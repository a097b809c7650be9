/* mesh/glb/document/glb.h: the JSON document of a glTF 2.0 file (.gltf or .glb), and its objects. */
#ifndef FCT_MESH_GLB_H
#define FCT_MESH_GLB_H

#include <jansson.h>

#include "base/io/file.h"
#include "mesh/soup.h"

enum { FCT_GLB_ABSENT = -1 };

/* A buffer: the BIN chunk, a data URI or a file. */
typedef struct fct_glb_buffer {
    const unsigned char *data;
    size_t size;
    fct_file file;
    unsigned char *own; /* the bytes of a data URI */
    bool open;
} fct_glb_buffer;

/* A buffer view. */
typedef struct fct_glb_view {
    const unsigned char *data;
    size_t size;
    size_t stride;      /* bytes between elements; 0: they are packed */
    unsigned char *own; /* decompressed bytes */
    bool open;
} fct_glb_view;

/* An accessor. All its elements lie within `data`. */
typedef struct fct_glb_array {
    const unsigned char *data;
    size_t stride, count;
    int component; /* 5120 byte .. 5126 float */
    int width;     /* components in an element */
    bool normalized;
    unsigned char *own; /* the elements of a sparse accessor */
    bool open;
} fct_glb_array;

typedef struct fct_glb {
    const fct_source *source;
    json_t *root;
    const unsigned char *binary; /* BIN chunk, NULL: the file has none */
    size_t binary_size;
    size_t byte_count;                   /* of the file and of all opened buffers */
    size_t dense_count;                  /* elements of sparse accessors so far */
    uint64_t vertex_count, corner_count; /* of all meshes that were read, also repeated ones */

    /* The buffers, views and accessors that are open. Each has the index that it has in the document. */
    fct_glb_buffer *buffers;
    fct_glb_view *views;
    fct_glb_array *arrays;
    size_t buffer_count, view_count, array_count;
} fct_glb;

/* Reads the document. Bytes that begin with "glTF" are a GLB, other bytes are JSON. A byte order mark is
 * skipped. Bytes after the end of a GLB give a warning. Errors: DATA (syntax, glTF 1.0, a required extension
 * that is not supported), MEMORY. Call fct_glb_close even after an error. */
fct_result fct_glb_open(const fct_source *source, fct_glb *out);
void fct_glb_close(fct_glb *glb);

/* Sends the message "file: ..." and returns DATA. */
fct_result fct_glb_fail(const fct_glb *glb, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* Sends the warning "file: ...". */
void fct_glb_warn(const fct_glb *glb, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* The number of objects of the root's array `name`. */
size_t fct_glb_count(const fct_glb *glb, const char *name);
/* Finds object number `index` of the root's array `name`. Errors: DATA (no such object). */
fct_result fct_glb_item(const fct_glb *glb, const char *name, int64_t index, json_t **out);
/* Reads the index object[key]. *out = FCT_GLB_ABSENT if the object has no such key. Errors: DATA (not an
 * integer, or negative). */
fct_result fct_glb_index(const fct_glb *glb, json_t *object, const char *key, int64_t *out);
/* The member extensions.NAME of an object, or NULL. */
json_t *fct_glb_extension(json_t *object, const char *name);
/* Whether the reader supports the extension: files that require it are read. */
bool fct_glb_supports(const char *extension);

#endif
