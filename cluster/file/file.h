/* cluster/file/file.h: the hierarchy file: written piece by piece, read from memory, checked. */
#ifndef FCT_CLUSTER_FILE_H
#define FCT_CLUSTER_FILE_H

#include "cluster/tree/tree.h"

/* The sections, in the order of the file; docs/hierarchy-file.md has sizes and meanings. */
typedef enum fct_section {
    FCT_SECTION_ROOTS,
    FCT_SECTION_CUT_IDS, /* made by the writer */
    FCT_SECTION_CUT,     /* made by the writer */
    FCT_SECTION_NODES,
    FCT_SECTION_FACE_IDS,
    FCT_SECTION_VERTEX_IDS,
    FCT_SECTION_TRIANGLES,
    FCT_SECTION_POSITIONS,
    FCT_SECTION_COLORS,
    FCT_SECTION_MATERIALS,
    FCT_SECTION_COUNT
} fct_section;

/* A hierarchy file in the making, in a temporary file beside the target. */
typedef struct fct_tree_writer fct_tree_writer;

/* Takes the counts of faces, vertices, nodes, roots and materials, the material names, the source and the
 * options from the view; none of its arrays is read. `arrays`: FCT_MESH_COLORS and FCT_MESH_MATERIALS for the
 * sections that will be there. The space on the disk is taken at once. Errors: OUTPUT, MEMORY; on failure
 * *out is NULL. */
fct_result fct_tree_writer_open(const fct_env *env, const char *path, const fct_tree_view *view,
                                unsigned arrays, fct_tree_writer **out);
/* The next `size` bytes of a section. Sections may be written in any order and by turns, each from its
 * beginning to its end; not on several threads. Errors: OUTPUT, MEMORY. */
fct_result fct_tree_writer_put(fct_tree_writer *writer, fct_section section, const void *data, size_t size);
/* All sections being complete: the cut, the checksums, the header with depth, mean depth, counts of edges and
 * components and the bounds of the view, the way to the disk, the name. Destroys the writer, whatever it
 * returns; after a failure the old file is as it was. Errors: OUTPUT, MEMORY. */
fct_result fct_tree_writer_finish(fct_tree_writer *writer, const fct_tree_view *view);
/* Instead of finishing: nothing is left behind. NULL is allowed. */
void fct_tree_writer_abandon(fct_tree_writer *writer);

/* Reads a whole hierarchy file of `size` bytes at `data`, which it copies. `name` stands in messages. Errors:
 * DATA, MEMORY. */
fct_result fct_tree_parse(const fct_env *env, const char *name, const void *data, size_t size,
                          fct_tree **out);

/* Whether links, ranges, permutations and indices are such that no traversal can leave the arrays or run in
 * circles, and the depth is the one told; O(F), parallel. Errors: DATA, MEMORY. */
fct_result fct_tree_check_structure(const fct_env *env, const fct_tree *tree);

/* The sections' checksums, if the tree came from a file. Errors: DATA, MEMORY. */
fct_result fct_tree_check_sums(const fct_env *env, const fct_tree *tree);

#endif
