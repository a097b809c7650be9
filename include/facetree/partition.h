/* facetree/partition.h: what a tree of face clusters is cut into: flat pieces, charts for lightmaps, meshlets
 * for mesh shaders; and which pieces are neighbours.
 *
 * Partitions by count and by cost are look-ups on the tree (facetree/cluster.h). Everything here reads the
 * whole tree, in parallel, with the same result for every thread count. Faces and vertices are the input's
 * unless it says "place".
 */
#ifndef FACETREE_PARTITION_H
#define FACETREE_PARTITION_H

#include "facetree/cluster.h"

#ifdef __cplusplus
extern "C" {
#endif

/* --- Flat pieces --- */

/* The coarsest cut of the tree in which no vertex of a cluster lies farther than max_distance (mesh units, at
 * least 0) from the cluster's plane, |n.x + d| of fct_cluster.plane: exact, for vertices are measured
 * wherever the box does not decide. A single face is always good enough. `nodes` holds at least face_count
 * ids and receives *count of them in order of their first place; *largest, which may be NULL, receives the
 * largest distance of the cut. O(faces x depth) at worst, about O(faces) where boxes are tight. Errors: DATA
 * (not a distance, damaged file), MEMORY, CANCELLED; `nodes` is undefined then. */
FCT_API fct_result fct_tree_cut_at_distance(const fct_env *env, const fct_tree *tree, double max_distance,
                                            uint32_t *nodes, uint32_t *count, double *largest);

/* --- Charts --- */

typedef struct fct_chart_def {
    uint32_t size;
    double max_angle; /* between a face's normal and the chart's mean normal, radians; default pi / 4; from pi
                         on any */
    uint32_t max_faces; /* a chart; at least 1; default FCT_NONE, no limit */
    double max_area;    /* a chart, unless it is one face; default infinity */
    bool any_topology;  /* charts need not be disks; default false */
    bool keep_cuts;     /* charts are clusters of the tree: do not merge neighbours; default false */
} fct_chart_def;
FCT_API fct_chart_def fct_chart_def_default(void);

typedef struct fct_chart_stats {
    uint32_t charts;
    /* Charts that are no disk: not connected through edges, an edge with three faces, a handle, a hole, no
     * border, or a vertex where the border touches itself. Unless any topology is allowed, only a face with a
     * vertex twice is left to be counted. */
    uint32_t non_disks;
    uint32_t opened_angle, opened_limit, opened_topology; /* clusters that were no chart, by first reason:
                                                             normals; faces, area or materials; no disk */
    uint32_t merged;        /* how many fewer charts there are than clusters in the cut */
    uint32_t largest_faces; /* of any chart */
    double largest_angle;   /* of any face with area to its chart's mean normal, radians */
    double seam_length;     /* of mesh edges with faces of two charts or more */
    double boundary_length; /* of mesh edges with one face */
} fct_chart_stats;

/* Charts for lightmaps and texture atlases: every chart is a topological disk (connected through edges, at
 * most two faces an edge, Euler characteristic 1 with a border) whose faces lie within max_angle of the
 * chart's mean normal S, and of one material. Tree nodes are opened from the roots until they are; then
 * neighbours whose union still is are merged, those first that lose most of their border. A face without area
 * has no normal to be wrong. labels holds face_count and receives each input face's chart, numbered by first
 * place; stats may be NULL. Errors: DATA (options out of range, damaged file), MEMORY, CANCELLED. */
FCT_API fct_result fct_tree_charts(const fct_env *env, const fct_tree *tree, const fct_chart_def *def,
                                   uint32_t *labels, fct_chart_stats *stats);

/* --- Meshlets --- */

typedef struct fct_meshlet_def {
    uint32_t size;
    uint32_t max_vertices;  /* 3 to 256; default 64 */
    uint32_t max_triangles; /* 1 to 512; default 124 */
    double flatness; /* weight of like normals against short distances, 0 to 1e6: more makes narrower cones
                        and a few more meshlets; default 1 */
} fct_meshlet_def;
FCT_API fct_meshlet_def fct_meshlet_def_default(void);

/* What a mesh shader reads: 16 bytes. */
typedef struct fct_meshlet {
    uint32_t vertex_offset;   /* first of its entries of `vertices` */
    uint32_t triangle_offset; /* first of its bytes of `triangles`, a multiple of 4 */
    uint32_t vertex_count, triangle_count;
} fct_meshlet;

/* All hold for the floats as they are stored: spheres and boxes contain every vertex. Seen from `eye` the
 * whole meshlet turns its back where
 *     dot(normalize(cone_apex - eye), cone_axis) >= cone_cutoff
 * evaluated in floats: the cutoff has 1e-5 to spare. Where normals span too much the axis is 0 and the cutoff
 * 1: never. The front of a triangle is where its corners run anticlockwise. */
typedef struct fct_meshlet_bounds {
    float center[3], radius; /* sphere */
    float cone_apex[3], cone_axis[3], cone_cutoff;
    fct_bounds bounds; /* along the axes of the world */
    fct_box box;       /* oriented, frame of the meshlet's own cluster */
} fct_meshlet_bounds;

typedef struct fct_meshlets {
    uint32_t count;
    fct_meshlet *meshlets;      /* count */
    fct_meshlet_bounds *bounds; /* count */
    uint32_t *first_face;       /* count + 1: meshlet m has faces[first_face[m] ...] */
    uint32_t vertex_count;      /* entries of `vertices`: at most 3 x faces, about 0.65 on smooth meshes */
    uint32_t *vertices;         /* vertex_count, input vertex ids, each once a meshlet */
    uint32_t triangle_bytes;    /* a multiple of 4: at most 3 x faces + 3 x count */
    uint8_t *triangles;         /* triangle_bytes: 3 local indices a triangle, in the input's winding */
    uint32_t *faces;            /* face_count, input face ids in the order of triangles */
} fct_meshlets;

/* Cuts the mesh into meshlets: they grow over the surface in the order and at the scale of the tree, then
 * small ones join neighbours or are shared out among them until nothing more fits. A meshlet's faces are of
 * one material. Every input face is in one meshlet, a face with a repeated vertex too. Arrays are the
 * caller's until fct_meshlets_release. Errors: DATA (limits out of range, damaged file), MEMORY, CANCELLED;
 * *out is all zero then. */
FCT_API fct_result fct_tree_meshlets(const fct_env *env, const fct_tree *tree, const fct_meshlet_def *def,
                                     fct_meshlets *out);
FCT_API void fct_meshlets_release(const fct_env *env, fct_meshlets *meshlets);

/* --- Neighbours --- */

/* Which labels share mesh edges. An edge with k >= 3 faces connects them in a chain in order of face id, each
 * of the k - 1 links with half its length, as in the dual graph. */
typedef struct fct_adjacency {
    uint32_t pair_count;
    uint32_t *pairs; /* pair_count x 2, labels a < b, sorted by (a, b), no pair twice */
    double *lengths; /* pair_count, shared border in mesh units */
    uint32_t *edges; /* pair_count, mesh edges shared */
    uint32_t label_count;
    uint32_t *first;  /* label_count + 1: the neighbours of a are others[first[a]] to [first[a + 1] - 1] */
    uint32_t *others; /* 2 pair_count labels, ascending for each a */
    uint32_t *other_pairs; /* 2 pair_count: which pair each of `others` is */
} fct_adjacency;

/* labels: a number below label_count for each face of the mesh. O(F log F). Errors: DATA (invalid mesh,
 * a label out of range), MEMORY, CANCELLED; *out is all zero then. */
FCT_API fct_result fct_labels_adjacency(const fct_env *env, const fct_mesh *mesh, const uint32_t *labels,
                                        uint32_t label_count, fct_adjacency *out);
FCT_API void fct_adjacency_release(const fct_env *env, fct_adjacency *adjacency);

#ifdef __cplusplus
}
#endif
#endif
