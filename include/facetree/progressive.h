/* facetree/progressive.h: progressive meshes: every level of a simplification in one object and one file.
 *
 *     fct_simplify_progressive(&env, &mesh, &def, &small, NULL, &progressive);
 *     fct_progressive_save(progressive, "mesh.fpm");
 *     fct_progressive_go(progressive, 10000);
 *     fct_progressive_mesh(progressive, &level);
 *
 * A progressive mesh is the reversed log of a simplification: a base mesh, and vertex splits that undo the
 * contractions one by one (Garland, "Quadric-Based Polygonal Surface Simplification", CMU 1999, section
 * 7.1.2). docs/progressive-file.md describes the file.
 */
#ifndef FACETREE_PROGRESSIVE_H
#define FACETREE_PROGRESSIVE_H

#include "facetree/simplify.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A progressive mesh at one of its levels. One thread at a time may use it. */
typedef struct fct_progressive fct_progressive;

/* fct_simplify, and the progressive mesh of its contractions, at its coarsest level (the base mesh).
 *
 * A level has the positions and attributes that the contractions gave, before the refit. The finest level is
 * what the simplifier makes of the input before its first contraction: the same faces with the same
 * positions; equal vertices are one; normals have unit length, except those of locked points. Faces are in
 * the order in which the splits add them. The arrays source_faces, source_uv, irradiance, direct, indirect
 * and error are left out; for the last four a warning says so. Every thread count gives the same bits. env
 * must outlive *progressive. Errors: those of fct_simplify, with *progressive = NULL. */
FCT_API fct_result fct_simplify_progressive(const fct_env *env, const fct_mesh *mesh,
                                            const fct_simplify_def *def, fct_mesh *out,
                                            fct_simplify_stats *stats, fct_progressive **progressive);

/* Writes a progressive mesh. Replaces the file as a whole. Does not change the level. Errors: OUTPUT, MEMORY,
 * CANCELLED; DATA, if a level has values that a file cannot have: infinite ones, or errors that fall. */
FCT_API fct_result fct_progressive_save(fct_progressive *progressive, const char *path);
/* Reads a file, at its coarsest level. Of a file that ends too early, the complete blocks of splits are read,
 * and a warning says so; an incomplete base mesh is an error. "-" is standard input. Errors: INPUT, DATA,
 * MEMORY, CANCELLED. */
FCT_API fct_result fct_progressive_load(const fct_env *env, const char *path, fct_progressive **out);
/* NULL is allowed. */
FCT_API void fct_progressive_destroy(fct_progressive *progressive);

typedef struct fct_progressive_info {
    uint32_t least_faces, most_faces; /* of the coarsest level, and of the finest one that was read */
    uint32_t split_count;             /* number of levels, less one */
    uint32_t total_faces; /* of the finest level; more than most_faces if the file was truncated */
    uint32_t faces;       /* of the current level */
    double error;         /* the largest error of a contraction that the current level has, as
                             fct_simplify_def.max_error measures it */
} fct_progressive_info;
FCT_API void fct_progressive_inspect(const fct_progressive *progressive, fct_progressive_info *out);

/* Goes to the finest level of at most `faces` faces, or to the coarsest level if all have more. Returns the
 * number of faces. Cost: proportional to the splits in between. */
FCT_API uint32_t fct_progressive_go(fct_progressive *progressive, uint32_t faces);
/* Goes to the coarsest level whose error is at most `error`, or to the finest level. Returns the number of
 * faces. */
FCT_API uint32_t fct_progressive_go_error(fct_progressive *progressive, double error);

/* The mesh of the current level. Cost: proportional to its size. Errors: MEMORY. */
FCT_API fct_result fct_progressive_mesh(fct_progressive *progressive, fct_mesh *out);
/* A geomorph between the current level and the coarser one that fct_progressive_go would choose for `faces`:
 * the faces of the current level, with vertices at (1 - t) a + t b, where b is the vertex of the current
 * level and a the vertex of the coarser level that it belongs to. Attributes follow likewise, and normals get
 * unit length. t is in [0, 1]. At 0 the surface is that of the coarser level. A body that the coarser level
 * does not have keeps its place. Cost: proportional to the size of the current level, plus the splits in
 * between. Errors: DATA (t), MEMORY. */
FCT_API fct_result fct_progressive_morph(fct_progressive *progressive, uint32_t faces, double t,
                                         fct_mesh *out);

/* A perspective view, and how far a mesh may be from the finest level. Coordinates are those of the mesh,
 * with its origin added. */
typedef struct fct_view {
    uint32_t size;
    uint32_t width, height;        /* of the picture, in pixels; default 1280 x 800 */
    double position[3], target[3]; /* of the eye, and what it looks at; default (0, 0, 1) and the origin */
    double up[3];                  /* roughly; default y */
    double vertical_fov;           /* degrees, 1 to 170; default 35 */
    /* Pixels between the finest level and the mesh on the screen. 0: the finest level; infinity: the base
     * mesh. Default 1. */
    double tolerance;
    /* The same for silhouettes and for surfaces with an open boundary; at most `tolerance`. Default .5. */
    double silhouette_tolerance;
    /* How much larger both may be for surfaces that are seen from behind only, and outside of the picture; at
     * least 1; infinity: nothing is refined there. Default 8. Outside of the picture an error counts as if
     * the eye looked at it. */
    double back_factor, outside_factor;
    /* Also refine where a component of a vertex colour is off by more, unless the place is smaller than the
     * tolerance; infinity: ignore colours. Default .03. */
    double color_tolerance;
} fct_view;
FCT_API fct_view fct_view_default(void);

typedef struct fct_view_stats {
    uint32_t faces;
    uint32_t splits;       /* of the cut */
    uint32_t forced;       /* of these: not wanted in this view, but needed by other splits or faces */
    uint32_t done, undone; /* splits and contractions since the cut of the last view */
    uint32_t tested;       /* splits that were compared with the view */
    double pixels; /* the largest distance on the screen from a vertex of the finest level to the mesh, where
                      it is in the picture and not seen from behind only; as the hierarchy has measured it */
    double error;  /* the largest of these distances anywhere, in the unit of the mesh */
    double seconds_hierarchy, seconds_cut, seconds_mesh;
} fct_view_stats;

/* The coarsest mesh that a view needs: a cut through the vertex hierarchy of the splits. It has the faces of
 * the base mesh and of some splits: those that the view wants, and those that these need. It is the finest
 * level with each vertex moved to its ancestor in the cut, so a closed mesh stays closed, and seams do not
 * crack. Where a face would turn by more than 45 degrees from the finest level, and by more than at any
 * level, splits around it are added until it is a face of some level. So faces do not fold over (Garland
 * 1999, section 7.3).
 *
 * A split is wanted if, without it or a split below it, a vertex of the finest level may be `tolerance`
 * pixels or more from the mesh on the screen. Its sphere and its normals decide where it may be seen. (Hoppe,
 * "View-Dependent Refinement of Progressive Meshes", SIGGRAPH 1997.) The distance is measured between levels;
 * between coarse and fine parts of a cut it can be up to a quarter larger (random views of bunny, cow and
 * rocker arm). Of a truncated file the finest level is the finest one that was read.
 *
 * The first call builds the hierarchy, which takes about twice as long as reading the file. The next ones
 * move the cut; their cost is proportional to the sizes of both cuts. The mesh depends only on the view, not
 * on the views before, and has the same bytes on every run. The level of fct_progressive_go does not change.
 * stats may be NULL. Errors: DATA (the view), MEMORY, CANCELLED. */
FCT_API fct_result fct_progressive_view(fct_progressive *progressive, const fct_view *view, fct_mesh *out,
                                        fct_view_stats *stats);

#ifdef __cplusplus
}
#endif
#endif
