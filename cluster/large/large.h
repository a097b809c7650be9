/* cluster/large/large.h: the tree of a mesh that does not fit into memory, in six steps. Spools (temporary
 * files) hold the data between the steps. Before them, weld.c joins vertices of equal position.
 *
 * 1. cut.c cuts the mesh along a space-filling curve into parts.
 * 2. piece.c contracts and describes one part after another. Merges that depend on another part wait. The
 *    clusters that remain are the part's tops: single faces near the cut, larger clusters farther inside.
 * 3. seam.c finds the edges of the dual graph between the tops of different parts.
 * 4. contract.c contracts the tops of all parts to one tree, in memory.
 * 5. describe.c computes the attributes of the nodes above the tops ("upper nodes").
 * 6. write.c numbers all nodes by cost and writes the file; mesh.c writes its faces and vertices.
 */
#ifndef FCT_CLUSTER_LARGE_H
#define FCT_CLUSTER_LARGE_H

#include "base/io/spool.h"
#include "cluster/file/file.h"
#include "cluster/merge/work.h"
#include "cluster/tree/describe/outline.h"
#include "cluster/tree/describe/single.h"
#include "cluster/tree/tree.h"
#include "mesh/stream.h"

/* A cluster that remains after the contraction of its part. */
typedef struct fct_top {
    uint32_t part;
    uint32_t node;  /* of its part's tree: an inner node, or node_count + the place of a face */
    uint32_t first; /* its faces are places [first, first + count) of the part */
    uint32_t count;
    uint32_t material; /* FCT_NONE: several materials, or a mesh without materials */
    float cost;        /* of its last merge; 0 for a face */
    uint8_t phase;     /* of its last merge: index in fct_work.phase_ends */
    uint8_t height;
    float lower[3], upper[3]; /* in the unit model */
    fct_record record;
} fct_top;

/* Consecutive faces of one part in the spool of faces. */
typedef struct fct_face_run {
    uint64_t offset;
    uint32_t part, count;
} fct_face_run;

/* A part. Places and node ids count within it. Each spool holds the arrays of part 0, then of part 1, ... */
typedef struct fct_part {
    uint32_t face_count, node_count;
    uint32_t phase_counts[3]; /* nodes per phase; the nodes of the last phase have the smallest ids */
    uint64_t first_node;      /* in the spools of nodes and costs, in nodes */
    uint64_t first_face;      /* in the spools of face ids, triangles and materials, in faces */
    uint32_t first_top, top_count;
} fct_part;

/* A side of a face on the cut. */
typedef struct fct_seam_side {
    uint32_t low, high; /* vertices */
    uint32_t face, top, part;
    float length;
} fct_seam_side;

/* An edge between two tops. */
typedef struct fct_top_edge {
    uint32_t a, b;
    float shared; /* length of the common border in the unit model */
} fct_top_edge;

/* A root. Its faces have the places [first, first + count) in the tree with one root, and `to` onwards in the
 * file. */
typedef struct fct_large_root {
    uint32_t first, count, to;
    uint32_t id;
} fct_large_root;

typedef struct fct_large {
    const fct_env *env;
    const fct_tree_def *def;
    const char *folder, *path; /* for temporary files; of the output */
    fct_stream *stream;
    fct_stream_info info;
    size_t budget;         /* bytes that may be allocated */
    uint32_t part_faces;   /* faces per part; a part has at most a quarter more */
    uint32_t top_limit;    /* tops of all parts together */
    fct_bounds bounds;     /* of the vertices that faces use */
    fct_bounds all_bounds; /* of all vertices */
    uint32_t *shared;      /* one bit per vertex: faces of several parts use it */
    fct_spool welded;      /* u32 x 3 per face in the order of the input; not open: no vertex is joined */
    bool joined;           /* some vertices are: the triangles of the parts are not those of the input */
    fct_spool faces;       /* u32 per face: id, three vertices, those of the input if some are joined, and the
                              material if the mesh has materials */
    fct_face_run *runs;    /* in order of writing */
    size_t run_count, run_capacity;
    fct_part *parts;
    size_t part_count, part_capacity;
    fct_spool nodes, costs, face_ids, triangles, materials;
    fct_spool corners; /* u32 x 3 per face: vertices of the input; only if some are joined */
    fct_spool tops, sums, means, edges, sides;
    uint32_t top_count;
    uint32_t loose_joins; /* merges inside parts of clusters that no edge connects */
    int64_t boundary_edges, nonmanifold_edges;
    fct_enclosed enclosed;
    uint32_t component_count;
    double seconds_dual, seconds_contract, seconds_boxes;
    /* The tops of all parts and the tree above them. The child of an upper node is an upper node, or
     * upper_count + the number of a top. Upper nodes are in the order of falling (phase, cost). Their first
     * and count are those of the whole tree. */
    fct_top *all_tops;
    fct_cluster *upper;
    uint32_t upper_count, upper_phase_counts[3];
    uint32_t *top_order;  /* tops by place */
    uint32_t *top_places; /* per entry of top_order: place of its first face; then the number of faces */
} fct_large;

/* u32 per row of the spool of faces. */
static inline uint32_t fct_large_row_words(const fct_large *large) {
    return 4 + (large->joined ? 3 : 0) + (large->info.materials ? 1 : 0);
}

enum { FCT_CURVE_BITS = 10 };
/* Number on a Hilbert curve through 2^30 cells of the cell with the coordinates x[k] < 2^10. Overwrites x. */
uint32_t fct_curve_code(uint32_t x[3]);

/* Joins vertices of equal position; opens large->welded if there are some. Errors: INPUT, DATA, OUTPUT,
 * MEMORY, CANCELLED. */
fct_result fct_large_weld(fct_large *large);
/* Finds bounds, parts and shared vertices, and spools the faces of each part. Errors: INPUT, DATA, OUTPUT,
 * MEMORY, CANCELLED. */
fct_result fct_large_cut(fct_large *large);
/* Contracts and describes one part after another. Errors: INPUT, DATA, OUTPUT, MEMORY, CANCELLED. */
fct_result fct_large_pieces(fct_large *large);
/* Appends the edges between tops of different parts to those inside parts, and corrects the counts of edges
 * with one face and with three or more. Errors: OUTPUT, MEMORY. */
fct_result fct_large_seams(fct_large *large);
/* Contracts the tops to one tree and numbers its upper nodes. Errors: OUTPUT, MEMORY, CANCELLED. */
fct_result fct_large_contract(fct_large *large);
/* Computes the attributes of the upper nodes. Errors: INPUT, OUTPUT, MEMORY, CANCELLED. */
fct_result fct_large_describe(fct_large *large);
/* Writes the hierarchy file; *out receives the values of its header. Errors: INPUT, OUTPUT, MEMORY,
 * CANCELLED. */
fct_result fct_large_write(fct_large *large, fct_tree_view *out);

/* Merges all `count` clusters to one by proximity of their boxes. Merge m < count - 1 has children[m] (a top,
 * or count + an earlier merge) and costs[m]. means: per cluster, NULL for the cost INCREMENT. Errors: MEMORY,
 * CANCELLED. */
fct_result fct_large_join(const fct_env *env, const fct_metric *metric, const fct_top *tops,
                          const fct_mean_record *means, uint32_t count, uint32_t (*children)[2],
                          float *costs);

/* Writes the sections of faces and vertices. roots: in the order of their ids. Errors: INPUT, OUTPUT, MEMORY,
 * CANCELLED. */
fct_result fct_large_write_mesh(fct_large *large, fct_tree_writer *out, const fct_large_root *roots,
                                uint32_t root_count);

#endif
