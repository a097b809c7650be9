/* facetree/partition.h: what a tree of face clusters is cut into: partitions by count, cost and distance,
 * their labels and quality, refinement, charts for lightmaps, meshlets for mesh shaders, neighbours.
 *
 * A cut is a list of node ids whose ranges partition the places. Labels are a number below `count` for each
 * input face. Results are the same for every thread count. Faces and vertices are those of the input unless a
 * comment says "place". Functions that take a tree check it first (fct_tree_check).
 */
#ifndef FACETREE_PARTITION_H
#define FACETREE_PARTITION_H

#include "facetree/cluster.h"

#ifdef __cplusplus
extern "C" {
#endif

/* --- Cuts --- */

/* The partition into `count` clusters, clamped to [root_count, face_count]: its node ids in order of their
 * first place. `nodes` holds that many; *written receives their number, 0 on failure. Reads only the nodes of
 * the partition and those above it, and checks them if the tree is not checked. Errors: DATA. */
FCT_API fct_result fct_tree_partition(const fct_env *env, const fct_tree *tree, uint32_t count,
                                      uint32_t *nodes, uint32_t *written);

/* The number of clusters that remain after all merges of cost <= max_cost. O(log F), unchecked. */
FCT_API uint32_t fct_tree_count_at_cost(const fct_tree *tree, double max_cost);

/* The coarsest cut of the tree in which every vertex of a cluster lies within max_distance (mesh units, at
 * least 0) of the cluster's plane: |n.v + d| of fct_cluster.plane. Vertices are measured wherever the box
 * does not decide. A leaf always passes. `nodes` holds face_count ids and receives *count of them in order of
 * their first place. *largest, which may be NULL, receives the largest distance in the cut. O(F depth) at
 * worst, about O(F) where boxes are tight. Errors: DATA (max_distance negative or NaN; damaged file), MEMORY,
 * CANCELLED; then `nodes` is undefined. */
FCT_API fct_result fct_tree_cut_at_distance(const fct_env *env, const fct_tree *tree, double max_distance,
                                            uint32_t *nodes, uint32_t *count, double *largest);

/* The labels of a cut: for each input face the index in `nodes` of its cluster. labels holds face_count.
 * Errors: DATA, MEMORY. */
FCT_API fct_result fct_tree_labels(const fct_env *env, const fct_tree *tree, const uint32_t *nodes,
                                   uint32_t count, uint32_t *labels);

/* --- Quality --- */

/* Measures of a partition. Means weigh each cluster by its area. D is the diagonal of the bounds of all used
 * vertices. All means are 0 where the mesh has no area. */
typedef struct fct_partition_quality {
    double mean_fit;              /* E_fit (8.1) of each cluster by the surface integral, over D^2 */
    double mean_direction;        /* E_dir (8.12) about the normal of the cluster's plane */
    double mean_irregularity;     /* (8.16) */
    double mean_normal_deviation; /* |n_k - S / |S||^2 of each face, by area (L2,1) */
    double box_area;              /* sum of the surface areas of the clusters' boxes, over D^2 */
    bool connected;               /* shared edges connect the faces of every cluster */
} fct_partition_quality;

/* Measures a cut. The boxes are those of the tree. O(F log F). Errors: DATA, MEMORY. */
FCT_API fct_result fct_tree_quality(const fct_env *env, const fct_tree *tree, const uint32_t *nodes,
                                    uint32_t count, fct_partition_quality *out);

/* Measures any labels, each < count. Boxes are fitted to the labels: along the principal axes of the surface,
 * turned about the normal to the best of eight angles. Labels without faces do not count. Errors: DATA
 * (invalid mesh, label out of range), MEMORY. */
FCT_API fct_result fct_labels_quality(const fct_env *env, const fct_mesh *mesh, const uint32_t *labels,
                                      uint32_t count, fct_partition_quality *out);

/* The least-squares plane n.x + d = 0 of the surface of each label, n.S >= 0. planes holds count x 4; the row
 * of a label without faces is 0. Errors: DATA, MEMORY. */
FCT_API fct_result fct_labels_planes(const fct_env *env, const fct_mesh *mesh, const uint32_t *labels,
                                     uint32_t count, float *planes);

/* --- Refinement --- */

typedef struct fct_refine_def {
    uint32_t size;
    uint32_t sweep_count;    /* upper limit; sweeps end when no face moves; default 4 */
    double perimeter_weight; /* of sum P^2 relative to the deviation of normals, both divided by their values
                                at the start; 0 to 1e6, default .1 */
    double irregularity_limit; /* sum P^2 may reach this multiple of its value at the start; at least 1,
                                  INFINITY: no limit; default 1 */
} fct_refine_def;
FCT_API fct_refine_def fct_refine_def_default(void);

typedef struct fct_refine_stats {
    uint32_t sweeps; /* done, over all cuts */
    uint64_t moves;  /* faces, or clusters of finer cuts, that changed their label */
    double seconds_dual, seconds_sweeps;
} fct_refine_stats;

/* Refines labels: moves faces across borders between clusters so that the squared deviation of normals (L2,1)
 * falls while borders stay short. A cluster keeps at least one face and does not fall into more pieces than
 * it had. A face joins only a neighbour of its own material. labels holds face_count entries, each < count;
 * on failure it is unchanged. The result is not a cut of a tree. def may be NULL (the defaults), and stats
 * too. Errors: DATA (invalid mesh, label or option out of range), MEMORY, CANCELLED. */
FCT_API fct_result fct_partition_refine(const fct_env *env, const fct_mesh *mesh, uint32_t count,
                                        const fct_refine_def *def, uint32_t *labels, fct_refine_stats *stats);

/* Refines a cut of the tree. This gives better results than fct_partition_refine, because clusters of finer
 * cuts move before single faces do, with sweep_count sweeps per cut. labels receives face_count entries, each
 * an index in `nodes`; on failure it is unchanged. Errors: DATA (damaged file, option out of range), MEMORY,
 * CANCELLED. */
FCT_API fct_result fct_tree_refine(const fct_env *env, const fct_tree *tree, const uint32_t *nodes,
                                   uint32_t count, const fct_refine_def *def, uint32_t *labels,
                                   fct_refine_stats *stats);

/* --- Charts --- */

typedef struct fct_chart_def {
    uint32_t size;
    double max_angle;   /* between the normal of a face and S of its chart, radians; default pi / 4; pi or
                           more: no limit */
    uint32_t max_faces; /* per chart; at least 1; default FCT_NONE: no limit */
    double max_area;    /* per chart of more than one face; default INFINITY */
    bool any_topology;  /* charts need not be disks; default false */
    bool keep_cuts;     /* charts are clusters of the tree: neighbours are not merged; default false */
} fct_chart_def;
FCT_API fct_chart_def fct_chart_def_default(void);

typedef struct fct_chart_stats {
    uint32_t charts;
    /* Charts that are not disks: not connected by edges, an edge with three faces, a handle, a hole, no
     * border, or a vertex where the border touches itself. Unless any_topology is set, this counts only faces
     * that use a vertex twice. */
    uint32_t non_disks;
    /* Clusters that were opened, by the first test that failed: max_angle; max_faces, max_area or materials;
     * not a disk. */
    uint32_t opened_angle, opened_limit, opened_topology;
    uint32_t merged;        /* clusters of the cut minus charts */
    uint32_t largest_faces; /* faces of the largest chart */
    double largest_angle;   /* between the normal of a face with area and S of its chart, radians */
    double seam_length;     /* of mesh edges between charts */
    double boundary_length; /* of mesh edges with one face */
} fct_chart_stats;

/* Charts for lightmaps and texture atlases. Each chart has one material, all its normals lie within max_angle
 * of its area vector S, and it is a topological disk: connected by edges, at most two faces per edge, Euler
 * characteristic 1, with a border. Two steps:
 * 1. Open nodes from the roots down until they are charts.
 * 2. Merge neighbours whose union is a chart; pairs that lose the largest share of their border come first.
 * A face without area fulfils every max_angle. labels holds face_count entries and receives the chart of each
 * input face; charts are numbered by first place. stats may be NULL. Errors: DATA (options out of range,
 * damaged file), MEMORY, CANCELLED. */
FCT_API fct_result fct_tree_charts(const fct_env *env, const fct_tree *tree, const fct_chart_def *def,
                                   uint32_t *labels, fct_chart_stats *stats);

/* --- Meshlets --- */

typedef struct fct_meshlet_def {
    uint32_t size;
    uint32_t max_vertices;  /* 3 to 256; default 64 */
    uint32_t max_triangles; /* 1 to 512; default 124 */
    double flatness; /* weight of similar normals relative to short distances, 0 to 1e6; more gives narrower
                        cones and slightly more meshlets; default 1 */
} fct_meshlet_def;
FCT_API fct_meshlet_def fct_meshlet_def_default(void);

/* The record that a mesh shader reads: 16 bytes. */
typedef struct fct_meshlet {
    uint32_t vertex_offset;   /* index in fct_meshlets.vertices */
    uint32_t triangle_offset; /* index in fct_meshlets.triangles, a multiple of 4 */
    uint32_t vertex_count, triangle_count;
} fct_meshlet;

/* Bounds for culling. They hold for the floats as stored: sphere and boxes contain every vertex, except
 * where a radius or half extent is FLT_MAX, because the true one may be larger. Every triangle faces away
 * from `eye` (its corners run clockwise) if dot(normalize(cone_apex - eye), cone_axis) >= cone_cutoff
 * evaluated in floats; the cutoff includes a margin of 1e-5 for their rounding, and the distance to the eye
 * must be one whose square is a float: 1e-18 to 1e18. If the normals span too much, the axis is 0 and the
 * cutoff is 1, and the test never passes. */
typedef struct fct_meshlet_bounds {
    float center[3], radius; /* sphere */
    float cone_apex[3], cone_axis[3], cone_cutoff;
    fct_bounds bounds; /* along the axes of the world */
    fct_box box;       /* oriented */
} fct_meshlet_bounds;

typedef struct fct_meshlets {
    uint32_t count;
    fct_meshlet *meshlets;      /* count */
    fct_meshlet_bounds *bounds; /* count */
    uint32_t *first_face;       /* count + 1: meshlet m has the faces faces[first_face[m]] ... */
    uint32_t vertex_count;      /* length of `vertices`: at most 3 F; about .65 F on smooth meshes */
    uint32_t *vertices;         /* vertex_count input vertices; a meshlet lists each of its vertices once */
    uint32_t triangle_bytes;    /* length of `triangles`, a multiple of 4: at most 3 F + 3 count */
    uint8_t *triangles; /* 3 indices into the meshlet's vertices per triangle, winding as in the input */
    uint32_t *faces;    /* F input faces, in the order of triangles */
} fct_meshlets;

/* Cuts the mesh into meshlets. They grow over the surface in the order of the tree and at the size that it
 * suggests; then small meshlets merge with neighbours, or their faces are given to neighbours, until nothing
 * fits. The faces of a meshlet have one material. Every input face is in exactly one meshlet, also a face
 * that uses a vertex twice. In a welded tree vertices of equal position are one: a meshlet names the first in
 * the tree's order, with a warning if there are others, because their attributes may differ. The caller
 * releases the arrays with fct_meshlets_release. Errors: DATA (limits out of range, damaged file), MEMORY,
 * CANCELLED; then *out is all zero. */
FCT_API fct_result fct_tree_meshlets(const fct_env *env, const fct_tree *tree, const fct_meshlet_def *def,
                                     fct_meshlets *out);
FCT_API void fct_meshlets_release(const fct_env *env, fct_meshlets *meshlets);

/* --- Neighbours --- */

/* Pairs of labels that share mesh edges. An edge with k >= 3 faces connects them as a chain in order of face
 * id; each of its k - 1 links has half the length, as in the dual graph (dual.h). */
typedef struct fct_adjacency {
    uint32_t pair_count;
    uint32_t *pairs; /* pair_count x 2: labels a < b, sorted by (a, b), each pair once */
    double *lengths; /* pair_count: length of the shared border, mesh units */
    uint32_t *edges; /* pair_count: number of shared mesh edges */
    uint32_t label_count;
    uint32_t
        *first; /* label_count + 1: the neighbours of a are others[first[a]] ... others[first[a + 1] - 1] */
    uint32_t *others;      /* 2 pair_count labels, ascending for each a */
    uint32_t *other_pairs; /* 2 pair_count: the pair of each entry of `others` */
} fct_adjacency;

/* labels holds face_count numbers, each < label_count. The caller releases *out with fct_adjacency_release.
 * O(F log F). Errors: DATA (invalid mesh, label out of range), MEMORY, CANCELLED; then *out is all zero. */
FCT_API fct_result fct_labels_adjacency(const fct_env *env, const fct_mesh *mesh, const uint32_t *labels,
                                        uint32_t label_count, fct_adjacency *out);
FCT_API void fct_adjacency_release(const fct_env *env, fct_adjacency *adjacency);

#ifdef __cplusplus
}
#endif
#endif
