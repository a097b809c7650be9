/* cluster/file/file.h: writing the hierarchy file piece by piece, and reading it from memory. */
#ifndef FCT_CLUSTER_FILE_H
#define FCT_CLUSTER_FILE_H

#include "cluster/tree/tree.h"

/* The sections in the order of the file; docs/hierarchy-file.md gives sizes and meanings. */
typedef enum fct_section {
    FCT_SECTION_ROOTS,
    FCT_SECTION_CUT_IDS, /* the writer makes these two from the nodes */
    FCT_SECTION_CUT,
    FCT_SECTION_NODES,
    FCT_SECTION_FACE_IDS,
    FCT_SECTION_VERTEX_IDS,
    FCT_SECTION_TRIANGLES,
    FCT_SECTION_POSITIONS,
    FCT_SECTION_COLORS,
    FCT_SECTION_MATERIALS,
    FCT_SECTION_COUNT
} fct_section;

/* A hierarchy file that is being written, as a temporary file beside the target. */
typedef struct fct_tree_writer fct_tree_writer;

/* Takes from the view the counts of faces, vertices, nodes, roots and materials, the names of materials, the
 * source and the options, but no array. `arrays` says which optional sections follow: FCT_MESH_COLORS,
 * FCT_MESH_MATERIALS. Reserves the space on the disk. Errors: OUTPUT, MEMORY; then *out is NULL. */
fct_result fct_tree_writer_open(const fct_env *env, const char *path, const fct_tree_view *view,
                                unsigned arrays, fct_tree_writer **out);
/* Appends `size` bytes to a section. Sections may grow in any order and by turns, each from its beginning to
 * its end. One thread at a time. Errors: OUTPUT, MEMORY. */
fct_result fct_tree_writer_put(fct_tree_writer *writer, fct_section section, const void *data, size_t size);
/* Completes the file once all other sections are complete: writes the cut, the checksums and the header with
 * the depth, mean depth, counts of edges and components, and bounds of the view; then syncs and renames the
 * file. Always destroys the writer. After an error the old file is as it was. Errors: OUTPUT, MEMORY. */
fct_result fct_tree_writer_finish(fct_tree_writer *writer, const fct_tree_view *view);
/* Destroys the writer and removes the temporary file. NULL is allowed. */
void fct_tree_writer_abandon(fct_tree_writer *writer);

/* Reads a whole hierarchy file of `size` bytes at `data`, which it copies. `name` is used in messages.
 * Errors: DATA, MEMORY. */
fct_result fct_tree_parse(const fct_env *env, const char *name, const void *data, size_t size,
                          fct_tree **out);

#endif
