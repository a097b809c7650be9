/* simplify/sweep.h: contracts the cheapest edges block by block, on all threads.
 *
 * A block holds points that follow each other on the curve of the input, so its data stay in the cache. A
 * sweep contracts only edges up to a cost, of which all points around both ends lie in one block. Therefore
 * blocks do not depend on each other, and every thread count gives the same result. The blocks of the next
 * sweep begin elsewhere.
 */
#ifndef FCT_SIMPLIFY_SWEEP_H
#define FCT_SIMPLIFY_SWEEP_H

#include "simplify/state.h"

/* Contracts the edges in the queue of a block until it is empty. s is the block's own copy. */
typedef void fct_block_body(fct_simplifier *s);

/* Sweeps while they pay: the last contractions are left to one queue for all edges. Only an edge of more than
 * four faces can leave fewer than target_faces. Errors: CANCELLED, MEMORY. */
fct_result fct_simplify_sweep(fct_simplifier *s, fct_block_body *body);

#endif
