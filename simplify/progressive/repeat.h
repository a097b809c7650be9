/* simplify/progressive/repeat.h: repeats the contractions of a log on the faces of the input, and lists what
 * each one ends: the data of build.c. */
#ifndef FCT_SIMPLIFY_REPEAT_H
#define FCT_SIMPLIFY_REPEAT_H

#include "simplify/log.h"
#include "simplify/progressive/progressive.h"

/* A node that has ended, in the order of the contractions. */
typedef struct fct_ended_node {
    uint32_t node;
    uint32_t first_corner, corner_count; /* of `moved` */
} fct_ended_node;

typedef struct fct_ended_step {
    uint32_t nodes, faces; /* the number of ended nodes and faces after this contraction */
    float error;
    bool wall; /* no contraction: an inner wall ends, and no point loses its last face */
} fct_ended_step;

typedef struct fct_builder {
    const fct_simplifier *s;
    const fct_log *log;
    fct_progressive *m;
    uint32_t handle_count;
    uint32_t *order; /* records by their keys */
    /* Per corner. */
    uint32_t *points, *handles, *next_corners; /* handles of a removed face stay as they were */
    /* Per face: it was removed, or it is degenerate. */
    bool *dead;
    /* Per point. */
    bool *locked;
    uint32_t *first_corners, *last_corners, *faces;
    /* Per handle. */
    uint32_t *handle_nodes, *uses, *handle_points, *wedge_handles, *merged; /* merged: FCT_NONE: not merged */
    /* Per node, in the order of the contractions. */
    uint32_t node_count;
    uint32_t *node_parents, *node_handles, *node_points;
    float *positions, *values;
    /* Lists. */
    fct_ended_step *steps;
    uint32_t step_count;
    fct_ended_node *ended;
    uint32_t ended_count;
    uint32_t *removed, removed_count; /* faces */
    uint32_t *moved;                  /* corners */
    size_t moved_count, moved_capacity;
    uint32_t ring[2 * SIMPLIFY_HUB], ring_count;      /* the corners of the point that goes */
    uint32_t old[4 * SIMPLIFY_MAX_WEDGES], old_count; /* the handles at both points */
} fct_builder;

/* Lists the faces of the input and their nodes. */
void fct_builder_start(fct_builder *b);
/* Repeats a contraction, and appends what it ends to the lists. Cost: linear in the ring of the gone point;
 * where a handle of the kept point ends, in the ring of the kept point too. Errors: MEMORY. */
fct_result fct_builder_repeat(fct_builder *b, const fct_record *r);
/* Removes the faces of an inner wall. continues: the record before is a wall of the same pair, and both are
 * one step. Errors: MEMORY. */
fct_result fct_builder_repeat_wall(fct_builder *b, const fct_record *r, bool continues);

#endif
