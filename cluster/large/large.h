/* cluster/large/large.h: a tree of a mesh that does not fit into memory, step by step.
 *
 * The mesh is cut along a space-filling curve into parts (large_cut.c). Each part is contracted alone, but
 * for the faces on its cut and what would rather merge with them, so that it makes only merges that the whole
 * model would make, too (large_piece.c); what it leaves are its tops, single faces near the cut and larger
 * clusters further away. Edges across cuts are found by their vertices (large_seam.c), the tops of all parts
 * are contracted in memory to one tree (large_contract.c) and described (large_describe.c), all nodes are
 * numbered by cost, and the file is written from front to back (large_write.c). Spools hold what is not at
 * work.
 */
#ifndef FCT_CLUSTER_LARGE_H
#define FCT_CLUSTER_LARGE_H

#include "base/io/spool.h"
#include "cluster/file/file.h"
#include "cluster/merge/work.h"
#include "cluster/tree/describe/outline.h"
#include "cluster/tree/describe/single.h"
#include "mesh/stream.h"

/* A cluster that its part leaves to the whole. */
typedef struct fct_top {
    uint32_t part;
    uint32_t node;  /* of its part's tree: an inner node, or its node_count + the place of a face */
    uint32_t first; /* its faces are places [first, first + count) of the part */
    uint32_t count;
    uint32_t material; /* FCT_NONE: several, or none at all */
    float cost;        /* of its last merge; 0 for a face */
    uint8_t phase;     /* of its last merge, 0 to 2 */
    uint8_t height;
    float lower[3], upper[3];
    fct_record record;
} fct_top;

/* A run of faces of one part in the spool of faces. */
typedef struct fct_face_run {
    uint64_t offset;
    uint32_t part, count;
} fct_face_run;

/* A part; places and node ids count within it. Its arrays lie in the spools one after another. */
typedef struct fct_part {
    uint32_t face_count, node_count;
    uint32_t phase_counts[3]; /* of its nodes; ids run from the last phase to the first */
    uint64_t first_node;      /* in the spools of nodes and costs, counted in nodes */
    uint64_t first_face;      /* in the spools of face ids, triangles and materials, counted in faces */
    uint32_t first_top, top_count;
} fct_part;

/* A side of a face on the cut. */
typedef struct fct_seam_side {
    uint32_t low, high; /* vertices */
    uint32_t face, top, part;
    float length;
} fct_seam_side;

/* An edge between tops; border in the unit model. */
typedef struct fct_top_edge {
    uint32_t a, b;
    float shared;
} fct_top_edge;

/* A root's faces: places [first, first + count) of the one tree come to `to` in the file. */
typedef struct fct_large_root {
    uint32_t first, count, to;
    uint32_t id;
} fct_large_root;

typedef struct fct_large {
    const fct_env *env;
    const fct_tree_def *def;
    const char *folder, *path; /* of temporary files; the output */
    fct_stream *stream;
    fct_stream_info info;
    size_t budget;       /* bytes that may be allocated */
    uint32_t part_faces; /* a part's size */
    uint32_t top_limit;  /* tops of all parts */
    fct_bounds bounds;   /* of vertices that faces use */
    fct_bounds all_bounds;
    uint32_t *shared;   /* bits: vertices of faces of several parts */
    fct_spool faces;    /* id, three vertices, and the material where there are any */
    fct_face_run *runs; /* in order of writing */
    size_t run_count, run_capacity;
    fct_part *parts;
    size_t part_count, part_capacity;
    fct_spool nodes, costs, face_ids, triangles, materials;
    fct_spool tops, sums, means, edges, sides;
    uint32_t top_count;
    uint32_t loose_joins; /* merges without an edge inside parts */
    int64_t boundary_edges, nonmanifold_edges;
    uint32_t component_count;
    double seconds_dual, seconds_contract, seconds_boxes;
    /* the tops of all parts, and the tree above them: an upper node's child is an upper node, or upper_count
     * + the number of a top. Ids fall with (phase, cost), first and count are those of the whole tree. */
    fct_top *all_tops;
    fct_cluster *upper;
    uint32_t upper_count, upper_phase_counts[3];
    uint32_t *top_order;  /* tops by place */
    uint32_t *top_places; /* per entry of top_order: its first face's place; one more: the number of faces */
} fct_large;

enum { FCT_CURVE_BITS = 10 };
/* Place on a Hilbert curve of 2^30 cells of the cell x, whose coordinates are below 2^10; x is used up. */
uint32_t fct_curve_code(uint32_t x[3]);

/* The parts and their faces; bounds; shared vertices. Errors: INPUT, DATA, OUTPUT, MEMORY, CANCELLED. */
fct_result fct_large_cut(fct_large *large);
/* Contracts and describes one part after another. Errors: the same. */
fct_result fct_large_pieces(fct_large *large);
/* Edges across cuts as edges between tops, added to those inside parts; corrects the counts of edges. Errors:
 * OUTPUT, MEMORY. */
fct_result fct_large_seams(fct_large *large);
/* Contracts the tops to one tree and numbers its nodes. Errors: OUTPUT, MEMORY, CANCELLED. */
fct_result fct_large_contract(fct_large *large);
/* Fills the upper nodes. Errors: INPUT, OUTPUT, MEMORY, CANCELLED. */
fct_result fct_large_describe(fct_large *large);
/* Writes the hierarchy file; *out receives what its header has. Errors: INPUT, OUTPUT, MEMORY, CANCELLED. */
fct_result fct_large_write(fct_large *large, fct_tree_view *out);

/* Joins clusters by proximity: with children as for upper_children, count - 1 merges. boxes: lower and upper
 * corner of each in the unit model. Errors: MEMORY, CANCELLED. */
fct_result fct_large_join(const fct_env *env, const fct_metric *metric, const fct_top *tops,
                          const fct_mean_record *means, uint32_t count, uint32_t (*children)[2],
                          float *costs);

/* The sections of faces and vertices; roots in order of ids. Errors: INPUT, OUTPUT, MEMORY, CANCELLED. */
fct_result fct_large_write_mesh(fct_large *large, fct_tree_writer *out, const fct_large_root *roots,
                                uint32_t root_count);

#endif
