/* simplify/progressive/corners.h: the points, nodes and handles of corners in the stream of splits.h: adds
 * them to the lists, and codes which one a corner has. After a failure (fct_splits_stopped) results have no
 * meaning.
 */
#ifndef FCT_SIMPLIFY_CORNERS_H
#define FCT_SIMPLIFY_CORNERS_H

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
    uint32_t *recent;          /* a writer's: per handle a corner that had it once; FCT_NONE: none */
    uint32_t *next, *previous; /* per corner: in the list of its point */
    /* Room of the arrays that grow while reading. */
    struct {
        size_t step_nodes, step_faces, walls, errors, parents, handles, points, first_corners, positions,
            values, corners, triangles, materials, face_colors, nodes, list, next, previous, ring;
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

/* The stream is damaged: the result becomes DATA, unless it is a failure already. */
void fct_splits_fail(fct_splits *k);
bool fct_splits_stopped(fct_splits *k);

/* Grows an array to `count` entries. Returns whether that worked. */
#define GROW(k, array, room, count)                                                                          \
    fct_splits_grow((k), (void **)&(array), &(room), (size_t)(count), sizeof *(array))
bool fct_splits_grow(fct_splits *k, void **array, size_t *room, size_t count, size_t size);
/* Counts stay below 2^31, as in meshes. */
bool fct_splits_check_count(fct_splits *k, size_t count);

/* The number of a point of m in the order of appearance. */
static inline uint32_t splits_name(const fct_splits *k, uint32_t point) {
    return k->names ? k->names[point] : point;
}
static inline uint32_t splits_point(const fct_splits *k, uint32_t handle) {
    return splits_name(k, k->m->points[k->m->nodes[handle]]);
}

void fct_splits_append_corner(fct_splits *k, uint32_t point, uint32_t c);
void fct_splits_remove_corner(fct_splits *k, uint32_t point, uint32_t c);

/* Codes a position near guess; `at` is that of the writer and the result. */
void fct_splits_code_position(fct_splits *k, int context, const float guess[3], float at[3]);
/* Adds a point and codes its position. point: its number in m, and at: its position, only for a writer. */
uint32_t fct_splits_add_point(fct_splits *k, uint32_t point, int context, const float guess[3],
                              const float *at);
/* Gives a node that was read a handle: a new one if handle is FCT_NONE. */
uint32_t fct_splits_give_handle(fct_splits *k, uint32_t node, uint32_t handle);

/* Codes which member of a group, at one end, a corner goes to. node: that of the writer. */
uint32_t fct_splits_code_member(fct_splits *k, uint32_t group, bool second, uint32_t node);
/* Codes a point of corner c: a new one, or one that is near in the order of appearance. */
uint32_t fct_splits_code_point(fct_splits *k, size_t c);
/* Codes the handle of corner c of a new face, at one end of the split. */
void fct_splits_code_end_corner(fct_splits *k, size_t c, bool second);
/* Codes the handle of corner c of a new face at a point that other faces may use. */
void fct_splits_code_point_corner(fct_splits *k, size_t c, uint32_t point);

#endif
