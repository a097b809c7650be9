/* cluster/merge/rounds/round.h: the state that the steps of contraction in rounds share.
 *
 * A round renumbers its live clusters from 0. Each live cluster has a list of its neighbours in flat arrays.
 * An edge stands in the lists of both of its ends; its key is valid only in the list of the lower end.
 */
#ifndef FCT_CLUSTER_ROUND_H
#define FCT_CLUSTER_ROUND_H

#include <stdatomic.h>

#include "base/variant.h"
#include "cluster/merge/work.h"

enum {
    FCT_ROUND_GRAIN = 1 << 12, /* clusters per chunk */
    FCT_LIST_SLACK = 8         /* entries behind the lists of a chunk that a vector may read or overwrite */
};

/* The key of an edge: the cost as an integer that sorts like it (fct_float_key), with log2 of the union's
 * faces in its low bits. */
#define FCT_KEY_OPEN      UINT32_MAX  /* not priced yet */
#define FCT_KEY_BLOCKED   0xFF800000u /* infinity: the merge is not allowed */
#define FCT_KEY_SIZE_BITS 31u         /* the bits of log2 of the union's faces */

/* The clusters of one round: live cluster i has entries starts[i] to starts[i] + lengths[i] - 1. */
typedef struct fct_generation {
    uint32_t count;
    uint32_t *slots, *starts, *lengths; /* per live cluster */
    uint32_t *others;                   /* per entry: the neighbour */
    float *shared;                      /* per entry: the length of the common border */
    uint32_t *keys;                     /* per entry */
} fct_generation;

/* The memory in which one thread joins lists of moderate length. Place 0 belongs to the union itself. */
typedef struct fct_list_scratch {
    uint32_t others[256], keys[256];
    float shared[256];
    uint8_t *places; /* per live cluster of the next round: the place where it was last put */
} fct_list_scratch;

#define FCT_MERGED 0x80000000u /* flag of a new number: the cluster is a union of this round */

typedef struct fct_rounds {
    fct_work *work;
    bool across;  /* clusters of different materials may merge */
    bool alone;   /* there is one thread */
    bool unbound; /* every cluster may merge with every neighbour */
    bool fresh;   /* no edge of the first generation has a key */
    uint32_t round;
    uint32_t start_height; /* of the tallest cluster before the first round; a round adds at most 1 */
    fct_generation now, next;
    _Atomic uint64_t *best; /* per live cluster: its least offer of all (offer.h) */
    union {                 /* the second search for pairs ends before the next round gets its parents */
        _Atomic uint64_t *second; /* per live cluster: its least offer from clusters without a mate */
        uint64_t *parents;        /* per cluster of the next round: mate << 32 | cluster */
    };
    uint32_t *mates;          /* per live cluster: the cluster that it merges with, or FCT_NONE */
    union {                   /* likewise */
        uint32_t *limits;     /* per live cluster: the largest key that the second search accepts; 0: none */
        uint32_t *renumbered; /* per live cluster: its number in the next round, | FCT_MERGED */
    };
    uint32_t *kept, *merged, *room; /* per chunk: counts, later the sums of those before; kept has one more */
    fct_list_scratch *scratch;      /* per thread */
} fct_rounds;

#endif
