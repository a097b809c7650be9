/* simplify/pairs/list.h: the lists of pairs per point. */
#ifndef FCT_SIMPLIFY_LIST_H
#define FCT_SIMPLIFY_LIST_H

#include "simplify/state.h"

/* Appends the pairs of b to those of a, which replaces b. */
static inline void fct_simplify_join_pairs(fct_simplifier *s, uint32_t a, uint32_t b) {
    s->walled[a] |= s->walled[b];
    if (s->first_pairs[b] == FCT_NONE) return;
    if (s->first_pairs[a] == FCT_NONE)
        s->first_pairs[a] = s->first_pairs[b];
    else
        s->next_pairs[s->last_pairs[a]] = s->first_pairs[b];
    s->last_pairs[a] = s->last_pairs[b];
    s->first_pairs[b] = s->last_pairs[b] = FCT_NONE;
}

#endif
