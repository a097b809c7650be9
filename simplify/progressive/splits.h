/* simplify/progressive/splits.h: writes and reads the steps of a progressive mesh, one after the other.
 *
 * docs/progressive-file.md describes the stream. Writer and reader keep the same lists of corners, so that a
 * step names points, corners and handles by their place in a list. One function describes both directions
 * (coder.h). A damaged stream cannot lead out of the arrays: values have a range, or are checked.
 */
#ifndef FCT_SIMPLIFY_SPLITS_H
#define FCT_SIMPLIFY_SPLITS_H

#include "simplify/progressive/coder.h"
#include "simplify/progressive/progressive.h"

enum {
    STREAM_LIST = 64, /* the places of a longer list of corners are not named: corners or points are */
    STREAM_MEMBERS = 4 * STREAM_LIST,
};

/* A point, numbered in the order of appearance. */
typedef struct stream_point {
    uint32_t first, last, count; /* its corners */
    float at[3];
} stream_point;

/* A node of a split at one of its two ends. */
typedef struct stream_member {
    uint32_t group; /* the handle that its corners have in the coarser level; FCT_NONE: it has none there */
    uint32_t node;
    bool second; /* at the new point */
} stream_member;

/* A listed corner of the point that splits. */
typedef struct stream_corner {
    uint32_t corner, member;
} stream_corner;

typedef struct fct_splits {
    fct_progressive *m;
    fct_coder coder;
    fct_result result; /* DATA: the stream is damaged */
    stream_point *points;
    uint32_t point_count;
    uint32_t *names;           /* a writer's: per point of m its number in `points`; NULL: this is a reader */
    bool *coded;               /* a writer's: per node */
    uint32_t *next, *previous; /* per corner: in the list of its point */
    /* Room of the arrays that grow while reading. */
    struct {
        size_t step_nodes, step_faces, errors, parents, handles, points, first_corners, positions, values,
            corners, triangles, materials, face_colors, nodes, list, next, previous, ring;
    } room;

    bool has_pairs; /* a split may have no faces */
    uint32_t step;  /* the next one */
    uint32_t last_point;

    /* The current step. */
    uint32_t split, born; /* the point that splits and the new one; FCT_NONE: none */
    stream_corner *ring;
    uint32_t ring_count;
    stream_member members[STREAM_MEMBERS];
    uint32_t member_count;
    uint32_t groups[STREAM_LIST], group_count; /* handles of the point that splits, in the coarser level */
    uint32_t group_parents[STREAM_LIST];       /* a reader's: their nodes there */
    uint32_t neighbours[2 * STREAM_LIST], neighbour_faces[2 * STREAM_LIST], neighbour_count;

    struct {
        fct_model split, side[2], another, turned, neighbour, new_point, new_handle, first_handle, new_member,
            first_member, material, face_color;
        fct_number_models faces, distance, list, error, position[3][3], value[2][PROGRESSIVE_VALUES], color;
    } models;
} fct_splits;

/* Whether a split of m has no faces: it undoes the contraction of a pair. Cost: linear in the steps. */
bool fct_splits_have_pairs(const fct_progressive *m);
/* A writer of m, which is at its coarsest level. Errors: MEMORY. */
fct_result fct_splits_write(fct_progressive *m, fct_splits **out);
/* A reader, which adds what it reads to m. m has no steps, but the members of the head. Errors: MEMORY. */
fct_result fct_splits_read(fct_progressive *m, bool has_materials, bool has_face_colors, bool has_pairs,
                           fct_splits **out);
void fct_splits_close(fct_splits *splits);
/* Codes the next step. The coder must have begun. A reader then has m at the level after it. Errors: MEMORY;
 * DATA without a message, if the stream is damaged. */
fct_result fct_splits_step(fct_splits *splits);

#endif
