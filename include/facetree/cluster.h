/* facetree/cluster.h: the tree of face clusters and its file.
 *
 * Source: Garland, "Quadric-Based Polygonal Surface Simplification", CMU 1999, chapter 8.
 *
 * Node ids. A tree over F faces with R roots has N = F - R inner nodes. Id 0 is the last merge, id N - 1 the
 * first. Id N + p is the leaf of the face at place p of the tree's face order. A child has a larger id than
 * its parent. Therefore the partition into K clusters consists of the nodes with id >= K - R whose parent,
 * if they have one, has an id < K - R.
 */
#ifndef FACETREE_CLUSTER_H
#define FACETREE_CLUSTER_H

#include "facetree/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct fct_tree fct_tree;

/* One cluster: 132 bytes, in memory as in the file. All in the coordinates of the mesh. Areas outside the
 * range of a float become FLT_MAX (S and M scale with them) or 0; then the cone is pi where S is 0, and the
 * other members are not affected. */
typedef struct fct_cluster {
    float area;            /* sum of A_k over the faces k; w of (8.12) */
    float area_vector[3];  /* S = sum A_k n_k; -e of (8.14), weighted as in (8.13) */
    float moment[6];       /* M = sum A_k n_k n_k^T, xx xy xz yy yz zz; D of (8.14), weighted as in (8.13) */
    float centroid[3];     /* of the surface */
    float cone_angle;      /* every face normal is within this angle (radians) of S; pi where S is 0 */
    float plane[4];        /* n, d of the plane n.x + d = 0 with the least E_fit (8.1); n.S >= 0 */
    float box_center[3];   /* oriented box (section 8.3.1) */
    float box_rotation[4]; /* unit quaternion x y z w; fct_cluster_box makes axes of it */
    float box_half[3];     /* half extents */
    float cost;            /* of the merge; does not fall with the order of merges */
    uint32_t child[2];     /* node ids; FCT_NONE in a leaf */
    uint32_t first;        /* the faces of the cluster are places [first, first + count) */
    uint32_t count;
} fct_cluster;

/* The oriented box of a cluster. Every vertex of its faces satisfies |(v - center).axis| <= half, in double,
 * for the axes that this function returns. */
FCT_API void fct_cluster_box(const fct_cluster *cluster, fct_box *out);

/* GREEDY contracts the cheapest edge of the dual graph, again and again (section 8.2). ROUNDS, the default,
 * merges all pairs of clusters at once that are each other's cheapest neighbour, or nearly so. */
typedef enum fct_cluster_method { FCT_CLUSTER_GREEDY, FCT_CLUSTER_ROUNDS } fct_cluster_method;

/* The cost of merging clusters a and b. S = sum A_k n_k, w = sum A_k and E_shape (8.17) are those of the
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
    double fit_weight, direction_weight, shape_weight; /* at most 1e30; negative: the default of the cost */
    uint32_t root_count; /* merging stops at this many clusters; default 1; 0 means 1 */
    bool weld; /* vertices of equal position count as one for the dual graph (fct_weld_build); default true */
    double max_cost;      /* no merge costs more; default INFINITY; clusters that cannot merge become roots */
    const char *source;   /* name of the mesh, recorded in the file; NULL: none */
    uint64_t source_hash; /* fct_mesh_file_hash of the mesh file, recorded in the file; 0: unknown */
} fct_tree_def;
FCT_API fct_tree_def fct_tree_def_default(void);

/* Wall-clock time of the phases. */
typedef struct fct_tree_stats {
    double seconds_dual, seconds_contract, seconds_boxes;
} fct_tree_stats;

/* Builds the tree of a valid mesh with at least one face. Parts that no edge connects are joined by proximity
 * under one root. Where mesh->materials is present, all merges along edges within a material come first. The
 * depth of a tree with one root is at most 3 log2 F. The tree copies the mesh. env must outlive the tree. def
 * may be NULL (the defaults), and stats too. Errors: DATA (no faces, invalid mesh, options out of range),
 * MEMORY, CANCELLED. */
FCT_API fct_result fct_tree_build(const fct_env *env, const fct_mesh *mesh, const fct_tree_def *def,
                                  fct_tree_stats *stats, fct_tree **out);
/* NULL is allowed. */
FCT_API void fct_tree_destroy(fct_tree *tree);

/* Counts of a tree, and pointers into it that are valid while it lives. "Place" and "tree vertex" are ids in
 * the tree's order. */
typedef struct fct_tree_view {
    uint32_t face_count, vertex_count, node_count, root_count;
    uint32_t depth;    /* edges from a root to the deepest leaf */
    double mean_depth; /* mean over the leaves */
    /* Edges of the mesh with one face, with three or more, and the parts that edges connect (dual.h). */
    uint32_t boundary_edges, nonmanifold_edges, component_count;
    bool inward;              /* closed (no such edges), its faces wind alike, and the volume inside is < 0 */
    fct_bounds bounds;        /* of all vertices; empty if there are none */
    const uint32_t *roots;    /* root_count node ids, ascending */
    const uint32_t *face_ids; /* face_count: place -> input face */
    const uint32_t *vertex_ids; /* vertex_count: tree vertex -> input vertex */
    const float *positions;     /* vertex_count x 3, by tree vertex */
    const uint32_t *triangles;  /* face_count x 3, by place: tree vertices, those of the input */
    const float *colors;        /* vertex_count x 3, by tree vertex; or NULL */
    const uint32_t *materials;  /* face_count, by place; or NULL */
    uint32_t material_count;
    const char *const *material_names; /* material_count strings; or NULL */
    const char *source;                /* name of the mesh; never NULL */
    uint64_t source_hash;
    double origin[3]; /* of the mesh: a vertex is at origin + position; all coordinates of the tree are
                         relative */
    fct_tree_def def; /* the options of the build, with the weights that it used; def.source is NULL */
} fct_tree_view;
FCT_API fct_tree_view fct_tree_get(const fct_tree *tree);

/* Checks the whole structure of a tree from a file: links, ranges, indices, permutations, finite numbers. The
 * first check takes O(F); the tree remembers that it passed. fct_tree_open reads only the head of a file.
 * After that:
 * - fct_tree_cluster, fct_tree_children and fct_tree_partition check each node that they read;
 * - functions that read the whole tree call fct_tree_check first;
 * - a caller that reads the arrays of a view must call fct_tree_check first.
 * After the check has passed, no walk leaves the arrays or runs in circles, and no call on this tree returns
 * DATA. A tree from fct_tree_build needs no check. Several threads may call this. Errors: DATA, MEMORY. */
FCT_API fct_result fct_tree_check(const fct_env *env, const fct_tree *tree);

/* The record of a node, id < node_count + face_count. Records of leaves are computed from the triangle, and a
 * later version may compute those of other small clusters too: ask again rather than keep many records.
 * Errors: DATA (damaged file: *out is all zero with FCT_NONE for children, and the message goes to the env
 * that the tree was opened with). */
FCT_API fct_result fct_tree_cluster(const fct_tree *tree, uint32_t node, fct_cluster *out);
/* The records of the two children of an inner node. The first child has the first places of the node's range,
 * the second child the rest. Walking down from the roots with this function visits each node once, whatever
 * the file contains. Errors: DATA, as above. */
FCT_API fct_result fct_tree_children(const fct_tree *tree, uint32_t node, fct_cluster out[2]);

/* A copy of the mesh in the order of the input: positions, triangles, colours, materials. The caller releases
 * it with fct_mesh_release. Errors: DATA, MEMORY. */
FCT_API fct_result fct_tree_mesh(const fct_env *env, const fct_tree *tree, fct_mesh *out);

/* --- Files --- */

/* Writes the hierarchy file (docs/hierarchy-file.md) to a temporary file, syncs and renames it. After an
 * error the old file is as it was. Errors: OUTPUT, MEMORY, CANCELLED, DATA (damaged tree). */
FCT_API fct_result fct_tree_save(const fct_env *env, const fct_tree *tree, const char *path);
/* Maps a hierarchy file read-only and checks its header and the names; see fct_tree_check for the rest. The
 * time does not depend on the number of faces. env must outlive the tree. Nobody may shorten the file while
 * the tree lives. Errors: INPUT, DATA, MEMORY. */
FCT_API fct_result fct_tree_open(const fct_env *env, const char *path, fct_tree **out);
/* Reads everything: checksums, structure, the counts and bounds of the view, and for every node the box,
 * cone, area, area vector, moment, centroid and plane against its triangles. O(F log F). Errors: DATA (the
 * message names the node and what is wrong), MEMORY, CANCELLED. */
FCT_API fct_result fct_tree_verify(const fct_env *env, const fct_tree *tree);

/* --- From file to file --- */

/* Estimates of the bytes that a build takes: in memory (mesh and tree), and the least max_memory with which
 * fct_tree_build_file works. def may be NULL. */
typedef struct fct_build_need {
    uint64_t in_memory, in_parts;
} fct_build_need;
FCT_API fct_build_need fct_tree_build_need(uint32_t face_count, uint32_t vertex_count,
                                           const fct_tree_def *def);

typedef struct fct_large_def {
    uint32_t size;
    uint64_t max_memory;          /* bytes allocated at the same time; default 4 GiB */
    const char *temporary_folder; /* NULL, the default: the folder of the hierarchy file */
    uint32_t part_faces;          /* faces per part; 0, the default: as many as the memory allows */
} fct_large_def;
FCT_API fct_large_def fct_large_def_default(void);

typedef struct fct_large_stats {
    uint32_t face_count, vertex_count, root_count, depth;
    double mean_depth;
    uint32_t part_count; /* parts that the mesh was cut into */
    uint32_t top_count;  /* clusters that the parts left for the last contraction */
    double seconds_read, seconds_dual, seconds_contract, seconds_boxes, seconds_write;
    bool inward; /* as in fct_tree_view */
} fct_large_stats;

/* Builds a hierarchy file from a mesh file while neither is in memory:
 * 1. A space-filling curve cuts the mesh into parts.
 * 2. Each part is clustered alone, except for clusters that depend on faces of other parts.
 * 3. Those clusters are merged together in memory.
 * Temporary files have no names and take about as much disk as the hierarchy file. Binary PLY files of
 * triangles are read in place; other files are loaded once. The bytes do not depend on the number of threads,
 * but they differ from those of fct_tree_build and fct_tree_save. def, large and stats may be NULL. Errors:
 * INPUT, DATA, OUTPUT, MEMORY (also if max_memory is too small), CANCELLED. */
FCT_API fct_result fct_tree_build_file(const fct_env *env, const char *mesh_path, const char *tree_path,
                                       const fct_tree_def *def, const fct_large_def *large,
                                       fct_large_stats *stats);

#ifdef __cplusplus
}
#endif
#endif
