/* simplify/attempt.h: tries one contraction of an edge or a pair: the checks, the loss, the contraction. */
#ifndef FCT_SIMPLIFY_ATTEMPT_H
#define FCT_SIMPLIFY_ATTEMPT_H

#include "simplify/cost/placement.h"
#include "simplify/topology/remain.h"

typedef enum fct_outcome {
    OUTCOME_CONTRACTED,
    OUTCOME_GONE, /* there is no such edge or pair any more; both ends are hubs; an end of the pair is a hub
                     or locked */
    OUTCOME_ELSEWHERE,  /* not inside the block of the sweep, or the block has no faces left to take */
    OUTCOME_BAD_PLACE,  /* a check refused the position; another one may be good */
    OUTCOME_REFUSED,    /* no position is good until the surroundings change */
    OUTCOME_GREW,       /* with its loss the candidate costs more than the bucket allows */
    OUTCOME_OVER_BOUND, /* its error exceeds max_error */
} fct_outcome;

typedef struct fct_attempt {
    fct_candidate candidate; /* its error and key receive the loss */
    uint32_t highest;        /* bucket; a candidate beyond it is not contracted */
    fct_move move;           /* of OUTCOME_CONTRACTED; ring_a and ring_b hold the corners from before */
} fct_attempt;

/* CONTRACTED if the candidate costs neither more than the bucket nor more than max_error; else why not. */
fct_outcome fct_attempt_judge(const fct_simplifier *s, const fct_attempt *attempt);
/* Contracts an edge. Gathers both rings, or only that of the smaller end if the larger one is a hub. */
fct_outcome fct_attempt_edge(fct_simplifier *s, const uint32_t ends[2], fct_attempt *attempt);
/* Contracts a pair. */
fct_outcome fct_attempt_pair(fct_simplifier *s, const uint32_t ends[2], fct_attempt *attempt);

#endif
