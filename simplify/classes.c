/* simplify/classes.c: see classes.h. */
#include "simplify/classes.h"

/* Per pair of groups and end: whether both have wedges there, and whether two of these share a class. */
enum { BOTH = 1, SHARE = 2 };
typedef uint8_t pair_table[SIMPLIFY_MAX_WEDGES][SIMPLIFY_MAX_WEDGES][2];

static void fill_pairs(const fct_simplifier *s, const fct_groups *g, pair_table pairs) {
    for (uint32_t i = 0; i < g->group_count; ++i) memset(pairs[i], 0, 2 * (size_t)g->group_count);
    for (uint32_t k = 0; k < g->wedge_count; ++k)
        for (uint32_t l = 0; l < g->wedge_count; ++l) {
            if (g->second[k] != g->second[l]) continue;
            bool share = s->wedge_classes[g->wedges[k]] == s->wedge_classes[g->wedges[l]];
            pairs[g->group_of[k]][g->group_of[l]][g->second[k]] |= (uint8_t)(share ? BOTH | SHARE : BOTH);
        }
}

/* Whether group i fits each of the groups before it that have a class. */
static bool fits_class(const pair_table pairs, const uint32_t *classes, uint32_t class, uint32_t i) {
    for (uint32_t j = 0; j < i; ++j)
        if (classes[j] == class && (pairs[i][j][0] == BOTH || pairs[i][j][1] == BOTH)) return false;
    return true;
}

void fct_classes_find(const fct_simplifier *s, const fct_groups *g, uint32_t *classes) {
    for (uint32_t k = g->wedge_count; k-- > 0;) classes[g->group_of[k]] = g->wedges[k];
    if (g->group_count == 1 || !s->mesh->texcoords) return; /* without texture coordinates all stay apart */
    pair_table pairs;
    fill_pairs(s, g, pairs);
    for (uint32_t i = 1; i < g->group_count; ++i)
        for (uint32_t j = 0; j < i; ++j) {
            if (!((pairs[i][j][0] | pairs[i][j][1]) & SHARE) || !fits_class(pairs, classes, classes[j], i))
                continue;
            classes[i] = classes[j];
            break;
        }
}

/* The wedge of a class whose corners are most; `total` receives the corners of all. */
static uint32_t find_largest(const fct_simplifier *s, uint32_t first, uint32_t *total) {
    uint32_t largest = first;
    *total = 0;
    for (uint32_t w = first; w != FCT_NONE; w = s->next_wedges[w]) {
        if (s->wedge_classes[w] != s->wedge_classes[first]) continue;
        *total += s->wedge_uses[w];
        if (s->wedge_uses[w] > s->wedge_uses[largest]) largest = w;
    }
    return largest;
}

/* Unifies one channel of the class of `first`, the first wedge of its point in the class. */
static void unify_channel(fct_simplifier *s, uint32_t channel, uint32_t first, uint32_t largest,
                          uint32_t total) {
    size_t n = s->channel_count;
    double value = s->attributes[n * largest + channel], sum = 0;
    for (uint32_t w = first; w != FCT_NONE && s->def->placement != FCT_PLACE_SUBSET; w = s->next_wedges[w])
        if (s->wedge_classes[w] == s->wedge_classes[first])
            sum += s->wedge_uses[w] * (s->attributes[n * w + channel] - value);
    if (sum != 0 && total > 0) value += sum / total;
    for (uint32_t w = first; w != FCT_NONE; w = s->next_wedges[w])
        if (s->wedge_classes[w] == s->wedge_classes[first]) s->attributes[n * w + channel] = value;
}

static bool is_first_of_class(const fct_simplifier *s, uint32_t point, uint32_t wedge) {
    uint32_t w = s->first_wedges[point];
    while (s->wedge_classes[w] != s->wedge_classes[wedge]) w = s->next_wedges[w];
    return w == wedge;
}

void fct_classes_unify(fct_simplifier *s, uint32_t point) {
    if (!s->mesh->texcoords) return;
    uint32_t w = s->first_wedges[point];
    for (; w != FCT_NONE && s->next_wedges[w] != FCT_NONE; w = s->next_wedges[w]) {
        if (!is_first_of_class(s, point, w)) continue;
        uint32_t total, largest = find_largest(s, w, &total);
        for (uint32_t i = 0; i < s->channel_count; ++i)
            if (s->channels[i].source != CHANNEL_TEXCOORD) unify_channel(s, i, w, largest, total);
    }
}
