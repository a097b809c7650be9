/* facetree/cluster.h: the tree of face clusters and its file.
 *
 * Source: Garland, "Quadric-Based Polygonal Surface Simplification", CMU 1999, chapter 8.
 *
 * Node ids. A tree over F faces with R roots has F - R inner nodes, numbered in the order in which a reader
 * opens them: node 0 is the merge that was made last. Ids below `node_count` are inner nodes; id node_count +
 * p is the leaf of the face at place p of the tree's face order. Because ids run backwards through the
 * merges, the partition into K clusters is: the nodes with id >= K - R that are a root or a child of a node
 * with id < K - R.
 */
#ifndef FACETREE_CLUSTER_H
#define FACETREE_CLUSTER_H

#include "facetree/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct fct_tree fct_tree;

/* One cluster; 132 bytes, as in the file. All in the mesh's own coordinates. Areas beyond a float's range end
 * at its largest value, with S and M scaled alike, below it at 0; the rest does not depend on them, but for
 * the cone, which is pi where S is 0. */
typedef struct fct_cluster {
    float area;           /* sum A_k */
    float area_vector[3]; /* S = sum A_k n_k */
    float moment[6];      /* M = sum A_k n_k n_k^T: xx xy xz yy yz zz */
    float centroid[3];    /* of the surface */
    float cone_angle;     /* every face normal is within this angle (radians) of S; pi where S cancels */
    float plane[4];       /* least-squares plane n.x + d = 0 (8.1), n along S */
    float box_center[3];
    float box_rotation[4]; /* unit quaternion x y z w: fct_cluster_box expands it */
    float box_half[3];
    float cost;        /* of the merge, not decreasing with merge order */
    uint32_t child[2]; /* node ids; FCT_NONE in a leaf */
    uint32_t first;    /* the cluster's faces are places [first, first + count) */
    uint32_t count;
} fct_cluster;

/* The oriented box, whose extents hold every vertex for exactly these axes. */
FCT_API void fct_cluster_box(const fct_cluster *cluster, fct_box *out);

/* GREEDY contracts the cheapest edge of the dual graph, again and again (section 8.2). ROUNDS, the default,
 * merges all pairs of clusters at once that are each other's cheapest neighbour, or nearly so. */
typedef enum fct_cluster_method { FCT_CLUSTER_GREEDY, FCT_CLUSTER_ROUNDS } fct_cluster_method;

/* What the merge of clusters a and b costs. S = sum A_k n_k, w = sum A_k and E_shape (8.17) are those of the
 * union, D(x) is x of the union less x of both parts. Lengths are those of the mesh scaled to a bounding-box
 * diagonal of 1.
 * INCREMENT, the default: the growth of the total error. Default weights 1e4, 1, .002.
 *     C = a1 D(w E_fit) + a2 2 (|Sa| + |Sb| - |S|) + a3 w E_shape f
 *     f = (1 - |S| / w) / .001, held between .05 (flat ground) and 1 (bent ground)
 * MEAN: the dissertation's cost (8.18), computed in double. With GREEDY borders are in double too. Default
 * weights 1e6, 1, 1, where 1e6 is the weight 1 on a mesh of diagonal 1000.
 *     E = a1 E_fit + a2 E_dir + a3 E_shape
 * Ties: the union with the smaller log2 of its faces comes first, then a hash of the pair decides. */
typedef enum fct_cluster_cost { FCT_COST_INCREMENT, FCT_COST_MEAN } fct_cluster_cost;
/* The points of E_fit (8.1). POINTS: each face adds its three corners (8.3). AREA, the default: the surface
 * integral over the triangles, which does not depend on the tessellation. */
typedef enum fct_fit_measure { FCT_FIT_AREA, FCT_FIT_POINTS } fct_fit_measure;

typedef struct fct_tree_def {
    uint32_t size;
    fct_cluster_method method;
    fct_cluster_cost cost;
    fct_fit_measure fit_measure;
    double fit_weight, direction_weight, shape_weight; /* at most 1e30; negative: the chosen cost's default */
    uint32_t root_count;                               /* stop at this many clusters; at least 1; default 1 */
    double max_cost;      /* no merge above this cost; default infinity. What is left over are roots */
    const char *source;   /* name recorded in the file, or NULL */
    uint64_t source_hash; /* xxh3 of the source file, recorded in the file; 0: unknown */
} fct_tree_def;
FCT_API fct_tree_def fct_tree_def_default(void);

typedef struct fct_tree_stats {
    double seconds_dual, seconds_contract, seconds_boxes;
} fct_tree_stats;

/* Builds the tree. Any valid mesh with at least one face; disconnected parts are joined by proximity under
 * one root. Where mesh->materials is present, clusters of different materials are merged only after all
 * merges along edges within a material are done. Depth at most 3 log2 F for one root. The mesh is copied. def
 * may be NULL (the defaults), stats too. Errors: DATA (no faces, invalid mesh, options out of range), MEMORY,
 * CANCELLED. */
FCT_API fct_result fct_tree_build(const fct_env *env, const fct_mesh *mesh, const fct_tree_def *def,
                                  fct_tree_stats *stats, fct_tree **out);
FCT_API void fct_tree_destroy(fct_tree *tree);

/* Pointers into the tree, valid as long as it lives. */
typedef struct fct_tree_view {
    uint32_t face_count, vertex_count, node_count, root_count;
    uint32_t depth;    /* of the deepest leaf; a single root leaf has depth 0 */
    double mean_depth; /* over the leaves */
    /* Of the mesh, by its dual graph: edges with one face, with three or more, and parts that edges connect.
     */
    uint32_t boundary_edges, nonmanifold_edges, component_count;
    fct_bounds bounds;          /* of all vertices; empty where there are none */
    const uint32_t *roots;      /* root_count node ids, ascending */
    const uint32_t *face_ids;   /* place -> input face */
    const uint32_t *vertex_ids; /* vertex of the tree's order -> input vertex */
    const float *positions;     /* vertex_count x 3, in the tree's vertex order */
    const uint32_t *triangles;  /* face_count x 3, by place, indices in the tree's vertex order */
    const float *colors;        /* vertex_count x 3 or NULL, in the tree's vertex order */
    const uint32_t *materials;  /* face_count or NULL, by place */
    uint32_t material_count;
    const char *const *material_names; /* material_count strings or NULL */
    const char *source;                /* never NULL */
    uint64_t source_hash;
    fct_tree_def def; /* the options of the build; def.source is NULL */
} fct_tree_view;
FCT_API fct_tree_view fct_tree_get(const fct_tree *tree);

/* Trees from files. fct_tree_open reads the file's first page; what lies behind is looked at when it is used.
 * Calls that touch few nodes (fct_tree_cluster, fct_tree_children, fct_tree_partition) check each node as
 * they read it. Calls that read all of a tree check its whole structure first, once, which the tree
 * remembers; do so yourself before you walk the arrays of a view of a tree from a file. After it has passed
 * nothing can lead out of the arrays or around in circles, no call on this tree returns DATA, and the calls
 * above cost no checks. A tree from fct_tree_build needs none. Several threads may call it. Errors: DATA,
 * MEMORY. */
FCT_API fct_result fct_tree_check(const fct_env *env, const fct_tree *tree);

/* The cluster of any node id below node_count + face_count, leaves included (computed from the triangle).
 * Errors: DATA (a damaged file; *out is zero then, a leaf without faces, and the message goes to the
 * environment of the tree). */
FCT_API fct_result fct_tree_cluster(const fct_tree *tree, uint32_t node, fct_cluster *out);
/* The two children of an inner node, whose faces are the first and the last part of its own. Who walks down
 * the tree of a file by this comes to each node once. Errors as above. */
FCT_API fct_result fct_tree_children(const fct_tree *tree, uint32_t node, fct_cluster out[2]);

/* The mesh in the input's own order (positions, triangles, colours, materials). Errors: DATA, MEMORY. */
FCT_API fct_result fct_tree_mesh(const fct_env *env, const fct_tree *tree, fct_mesh *out);

/* Node ids of the partition into `count` clusters, in order of their first place. `nodes` holds at least
 * `count`. *written: how many there are: count clamped to [root_count, face_count]; 0 on failure. Touches the
 * nodes above the partition and its own. Errors: DATA. */
FCT_API fct_result fct_tree_partition(const fct_env *env, const fct_tree *tree, uint32_t count,
                                      uint32_t *nodes, uint32_t *written);
/* How many clusters remain when all merges of cost <= max_cost are done. */
FCT_API uint32_t fct_tree_count_at_cost(const fct_tree *tree, double max_cost);
/* Cluster number (0..count-1, in the order of `nodes`) of each input face; labels holds face_count. Errors:
 * DATA, MEMORY. */
FCT_API fct_result fct_tree_labels(const fct_env *env, const fct_tree *tree, const uint32_t *nodes,
                                   uint32_t count, uint32_t *labels);

/* Area-weighted means over a partition (fit over the squared diagonal of the mesh's bounds). Errors: MEMORY.
 */
typedef struct fct_partition_quality {
    double mean_fit;          /* E_fit of each cluster to its best plane, by the surface integral */
    double mean_direction;    /* E_dir (8.12) about the plane's normal */
    double mean_irregularity; /* g (8.16) */
    double
        mean_normal_deviation; /* squared deviation of unit normals from the cluster's mean normal (L2,1) */
    double box_area;           /* sum of the boxes' surface areas over the squared diagonal */
    bool connected;            /* every cluster's faces are connected through shared edges */
} fct_partition_quality;
FCT_API fct_result fct_tree_quality(const fct_env *env, const fct_tree *tree, const uint32_t *nodes,
                                    uint32_t count, fct_partition_quality *out);

/* The same for any partition of a mesh: labels (face_count, each < count) as fct_tree_labels and
 * fct_partition_refine leave them. box_area is that of boxes fitted for the occasion. A label without faces
 * counts for nothing. Errors: DATA (invalid mesh, a label out of range), MEMORY. */
FCT_API fct_result fct_labels_quality(const fct_env *env, const fct_mesh *mesh, const uint32_t *labels,
                                      uint32_t count, fct_partition_quality *out);

/* The least-squares plane n.x + d = 0 of each label's surface, n along its area vector: planes holds count x
 * 4. All 0 for a label without faces. Errors: DATA, MEMORY. */
FCT_API fct_result fct_labels_planes(const fct_env *env, const fct_mesh *mesh, const uint32_t *labels,
                                     uint32_t count, float *planes);

typedef struct fct_refine_def {
    uint32_t size;
    uint32_t sweep_count;      /* at most this many; it ends when no face moves; default 4 */
    double perimeter_weight;   /* of the sum of squared perimeters beside the deviation of normals, each over
                                  what it is at the start; 0 to 1e6, default .1 */
    double irregularity_limit; /* mean irregularity may reach this multiple of its start; at least 1, INFINITY
                                  for no limit; default 1 */
} fct_refine_def;
FCT_API fct_refine_def fct_refine_def_default(void);

typedef struct fct_refine_stats {
    uint32_t sweeps; /* done, over all cuts */
    uint64_t moves;  /* faces, or clusters of finer cuts, that changed sides */
    double seconds_dual, seconds_sweeps;
} fct_refine_stats;

/* Refines a partition: faces on the borders between clusters change sides, those that gain most first, so
 * that the squared deviation of normals (L2,1) falls while borders stay short. No cluster loses its last face
 * or falls into more pieces than it had, and with mesh->materials a face follows only neighbours of its own
 * material. labels holds face_count entries, each < count, and is changed in place; on failure it is as it
 * was. The result is a partition and no longer a cut of a tree. def may be NULL (the defaults), stats too.
 * Same result for every thread count. Errors: DATA (invalid mesh, a label or an option out of range), MEMORY,
 * CANCELLED. */
FCT_API fct_result fct_partition_refine(const fct_env *env, const fct_mesh *mesh, uint32_t count,
                                        const fct_refine_def *def, uint32_t *labels, fct_refine_stats *stats);

/* The same from the cut of the tree that `nodes` are, and better: clusters of finer cuts change sides before
 * faces do, with so many sweeps each. labels receives the refined cluster of each input face (0..count-1, in
 * the order of `nodes`), face_count entries, untouched on failure. Errors: DATA (a damaged file, an option
 * out of range), MEMORY, CANCELLED. */
FCT_API fct_result fct_tree_refine(const fct_env *env, const fct_tree *tree, const uint32_t *nodes,
                                   uint32_t count, const fct_refine_def *def, uint32_t *labels,
                                   fct_refine_stats *stats);

/* Writes the hierarchy file, docs/hierarchy-file.md: temporary file, fsync, rename. Errors: OUTPUT, MEMORY,
 * CANCELLED; DATA for a damaged tree. */
FCT_API fct_result fct_tree_save(const fct_env *env, const fct_tree *tree, const char *path);
/* Maps a hierarchy file read-only and validates its header, names included; nothing else is read before it is
 * used (see fct_tree_check). The file must not be shortened while the tree lives. Errors: INPUT, DATA,
 * MEMORY.
 */
FCT_API fct_result fct_tree_open(const fct_env *env, const char *path, fct_tree **out);
/* Reads everything: checksums, fct_tree_check, and of every node its box, cone, area, area vector, moment,
 * centroid and plane against its triangles; the counts and bounds of the view. O(F log F). Errors: DATA with
 * what is wrong, MEMORY, CANCELLED. */
FCT_API fct_result fct_tree_verify(const fct_env *env, const fct_tree *tree);

/* --- From file to file --- */

/* What building takes, in bytes, by estimate: a tree in memory with its mesh, and the least that
 * fct_tree_build_file can do with. def may be NULL. */
typedef struct fct_build_need {
    uint64_t in_memory, in_parts;
} fct_build_need;
FCT_API fct_build_need fct_tree_build_need(uint32_t face_count, uint32_t vertex_count,
                                           const fct_tree_def *def);

typedef struct fct_large_def {
    uint32_t size;
    uint64_t max_memory;          /* bytes to be allocated at once; default 4 GiB */
    const char *temporary_folder; /* NULL, the default: beside the hierarchy file */
    uint32_t part_faces;          /* faces clustered at once; 0, the default: as many as memory allows */
} fct_large_def;
FCT_API fct_large_def fct_large_def_default(void);

typedef struct fct_large_stats {
    uint32_t face_count, vertex_count, root_count, depth;
    double mean_depth;
    uint32_t part_count; /* parts that the mesh was cut into */
    uint32_t top_count;  /* clusters that parts left to the whole */
    double seconds_read, seconds_dual, seconds_contract, seconds_boxes, seconds_write;
} fct_large_stats;

/* From a mesh file to a hierarchy file with neither in memory: the mesh is cut along a space-filling curve
 * into parts that are clustered one by one, but for what depends on faces of other parts; that is clustered
 * last, together. Temporary files without names take about as much of the disk as the hierarchy file. Binary
 * PLY files of triangles are read where they lie, others are loaded once. The same bytes for every thread
 * count, but not those of fct_tree_build. def, large and stats may be NULL. Errors: INPUT, DATA, OUTPUT,
 * MEMORY (max_memory is too little, too), CANCELLED. */
FCT_API fct_result fct_tree_build_file(const fct_env *env, const char *mesh_path, const char *tree_path,
                                       const fct_tree_def *def, const fct_large_def *large,
                                       fct_large_stats *stats);

#ifdef __cplusplus
}
#endif
#endif
