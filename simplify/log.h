/* simplify/log.h: a record of each contraction, in an order in which they can be repeated.
 *
 * A sweep contracts in blocks. Each block has its own log, and fct_log_join appends them in the order of the
 * blocks. Blocks do not depend on each other, so this order is valid and the same for every number of
 * threads. Without a log (fct_simplifier.log is NULL) nothing is recorded.
 */
#ifndef FCT_SIMPLIFY_LOG_H
#define FCT_SIMPLIFY_LOG_H

#include "simplify/state.h"

typedef struct fct_record {
    uint32_t kept, gone; /* points; both are gone if `body`; if `wall`, faces that vanish (FCT_NONE: none) */
    /* The wedges of the kept point afterwards: entries of fct_log.wedges. None without attributes. */
    uint32_t first_wedge, wedge_count;
    float at[3];  /* the position of the kept point afterwards, as it is written */
    float error;  /* as fct_simplify_def.max_error measures it */
    uint16_t key; /* records sorted by key, equal keys in the order of the log, are in a valid order too */
    bool body;    /* all faces at the kept point vanish as well */
    bool wall;    /* no contraction: an inner wall vanishes */
} fct_record;

typedef struct fct_log {
    fct_record *records;
    uint32_t count;
    uint32_t *wedges; /* numbers of wedges */
    float *values;    /* per entry of `wedges`: its attributes, channel_count floats in their own unit */
    size_t wedge_count, wedge_capacity, value_capacity;
    /* Per point: the highest key of a contraction that changed the faces there; shared by all blocks. */
    uint16_t *keys;
    bool *locked; /* per point: locked before the first contraction; not in the logs of blocks */
} fct_log;

/* A log of the contractions of s, which receives it. Errors: MEMORY. */
fct_result fct_log_create(fct_simplifier *s);
/* NULL is allowed. */
void fct_log_destroy(const fct_env *env, fct_log *log);

/* Makes room for one more record. Errors: MEMORY. */
fct_result fct_log_reserve(fct_simplifier *s);
/* Begins a record before the contraction that moves the corners of b to a. ring_b holds the count_b corners
 * of b. */
void fct_log_begin(fct_simplifier *s, uint32_t a, uint32_t b, uint32_t count_b);
/* Completes it afterwards, when a has its new position and wedges. */
void fct_log_end(fct_simplifier *s, double error);
/* Records that the faces of two corners vanish after the last contraction, at its point; first may be
 * FCT_NONE. */
void fct_log_wall(fct_simplifier *s, uint32_t first, uint32_t second);

/* One empty log per block, with room for `records` records and `wedges` wedges each; NULL if s has no log.
 * Errors: MEMORY. */
fct_result fct_log_split(fct_simplifier *s, uint32_t blocks, uint32_t records, uint32_t wedges,
                         fct_log **out);
/* Appends the logs of the blocks to that of s and destroys them. NULL is allowed. Errors: MEMORY. */
fct_result fct_log_join(fct_simplifier *s, fct_log *logs, uint32_t blocks);

#endif
