/* cluster/merge/rounds.h: what the files of contraction in rounds share: the live clusters of a round,
 * numbered anew each time, with a list of neighbours each in flat arrays.
 */
#ifndef FCT_CLUSTER_ROUNDS_H
#define FCT_CLUSTER_ROUNDS_H

#include <stdatomic.h>

#include "base/variant.h"
#include "cluster/merge/work.h"

enum {
    FCT_ROUND_GRAIN = 1 << 12, /* clusters a chunk */
    FCT_LIST_SLACK = 8,        /* entries behind each chunk's lists (and all lists) that may be overwritten */
    FCT_SHORT_LIST = 100
};

/* Costs as keys that order like them (fct_float_key), the low bits replaced by log2 of the union's faces. */
#define FCT_KEY_OPEN    UINT32_MAX  /* to be priced */
#define FCT_KEY_BLOCKED 0xFF800000u /* infinity: the merge is not allowed */

/* An edge is in the lists of both its ends; its key is right in that of the lower end alone. */
typedef struct fct_generation {
    uint32_t count;
    uint32_t *slots, *starts, *lengths; /* of live numbers */
    uint32_t *others;                   /* per entry: the live number at the other end */
    float *shared;
    uint32_t *keys;
} fct_generation;

/* What a thread joins short lists in; the union itself has place 0. */
typedef struct fct_list_scratch {
    uint32_t others[256], keys[256];
    float shared[256];
    uint8_t *places; /* per live number of the next round: where it is, if it is */
} fct_list_scratch;

typedef struct fct_rounds {
    fct_work *work;
    bool across, alone; /* alone: one thread */
    bool unbound;       /* every cluster may merge with any neighbour */
    bool fresh;         /* the first generation: no edge has a key yet */
    uint32_t round;
    uint32_t start_height; /* of the tallest cluster before the first round; each adds one at most */
    fct_generation now, next;
    /* Per live cluster: the least key << 32 | tie of its edges, of all and of those that are left; which of
     * the two arrays is which changes with every pass. */
    _Atomic uint64_t *least[2];
    uint32_t *mates;      /* per live cluster: what it merges with or FCT_NONE */
    uint32_t *limits;     /* per live cluster: keys up to which it takes less than its best */
    uint32_t *renumbered; /* in the place of limits: this round's number to the next's, | MERGED */
    uint64_t *parents;    /* in the place of least[1]: per cluster of the next round, mate << 32 | cluster */
    uint32_t *kept, *merged, *room; /* per chunk: counts, then places; kept has one more */
    fct_list_scratch *scratch;      /* one a thread */
} fct_rounds;

#define FCT_MERGED 0x80000000u

/* Chunk body over the live clusters of `now`: writes the lists of their unions. */
#define fct_rounds_join_lists FCT_KERNEL(fct_rounds_join_lists)
FCT_DECLARE_KERNEL(void, fct_rounds_join_lists,
                   (void *user, size_t begin, size_t end, size_t chunk, uint32_t thread));

#endif
