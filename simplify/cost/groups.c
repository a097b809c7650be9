/* simplify/cost/groups.c: see groups.h. Cost: O(valence) plus O(wedges^2) with at most 64 wedges. */
#include "simplify/cost/groups.h"

static uint32_t find_wedge(const fct_groups *g, uint32_t wedge) {
    for (uint32_t i = 0; i < g->wedge_count; ++i)
        if (g->wedges[i] == wedge) return i;
    return FCT_NONE;
}

static bool list_wedges(fct_simplifier *s, uint32_t point, bool second, fct_groups *g) {
    for (uint32_t w = s->first_wedges[point]; w != FCT_NONE; w = s->next_wedges[w]) {
        if (g->wedge_count == SIMPLIFY_MAX_WEDGES) return false;
        g->group_of[g->wedge_count] = g->wedge_count;
        g->second[g->wedge_count] = second;
        g->wedges[g->wedge_count++] = w;
    }
    return true;
}

static void join_groups(fct_groups *g, uint32_t i, uint32_t j) {
    uint32_t low = g->group_of[i], high = g->group_of[j];
    if (low == high) return;
    if (low > high) {
        uint32_t swap = low;
        low = high, high = swap;
    }
    for (uint32_t k = 0; k < g->wedge_count; ++k)
        if (g->group_of[k] == high) g->group_of[k] = low;
}

bool fct_groups_fit(const fct_simplifier *s, uint32_t a, uint32_t b) {
    uint32_t count = 0;
    for (uint32_t w = s->first_wedges[a]; w != FCT_NONE; w = s->next_wedges[w]) ++count;
    for (uint32_t w = s->first_wedges[b]; w != FCT_NONE; w = s->next_wedges[w]) ++count;
    return count <= SIMPLIFY_MAX_WEDGES;
}

bool fct_groups_find(fct_simplifier *s, uint32_t a, uint32_t b, fct_groups *g) {
    g->wedge_count = 0;
    if (!list_wedges(s, a, false, g) || !list_wedges(s, b, true, g)) return false;
    /* The ends of an edge have a common face, those of a pair do not. */
    if (g->wedge_count == 2 && !s->next_pairs) {
        g->group_of[0] = g->group_of[1] = 0;
        g->group_count = 1;
        return true;
    }
    uint32_t from = point_at(s, a)->valence <= point_at(s, b)->valence ? a : b, to = from == a ? b : a;
    for (uint32_t c = point_at(s, from)->first_corner; c != FCT_NONE; c = s->next_corners[c]) {
        if (corner_dead(s, c)) continue;
        uint32_t other = s->triangles[corner_next(c)] == to ? corner_next(c) : corner_previous(c);
        if (s->triangles[other] == to)
            join_groups(g, find_wedge(g, corner_wedge(s, c)), find_wedge(g, corner_wedge(s, other)));
    }
    /* Number the groups 0, 1, ... by their lowest member. */
    uint32_t numbers[SIMPLIFY_MAX_WEDGES];
    g->group_count = 0;
    for (uint32_t i = 0; i < g->wedge_count; ++i) {
        if (g->group_of[i] == i) numbers[i] = g->group_count++;
        g->group_of[i] = numbers[g->group_of[i]];
    }
    return true;
}

void fct_groups_sum(const fct_simplifier *s, const fct_groups *g, uint32_t group, double *sum, double *mean) {
    uint32_t members = 0;
    memset(sum, 0, s->quadric_size * sizeof *sum);
    memset(mean, 0, s->channel_count * sizeof *mean);
    for (uint32_t i = 0; i < g->wedge_count; ++i) {
        if (g->group_of[i] != group) continue;
        ++members;
        const double *q = wedge_quadric(s, g->wedges[i]);
        const double *a = s->attributes + (size_t)s->channel_count * g->wedges[i];
        for (uint32_t k = 0; k < s->quadric_size; ++k) sum[k] += q[k];
        for (uint32_t k = 0; k < s->channel_count; ++k) mean[k] += a[k];
    }
    for (uint32_t k = 0; k < s->channel_count; ++k) mean[k] /= members;
}

const double *fct_groups_end(const fct_simplifier *s, const fct_groups *g, uint32_t group, uint32_t end) {
    uint32_t chosen = FCT_NONE;
    for (uint32_t i = 0; i < g->wedge_count; ++i)
        if (g->group_of[i] == group &&
            (chosen == FCT_NONE || (g->second[i] == end && g->second[chosen] != end)))
            chosen = i;
    return s->attributes + (size_t)s->channel_count * g->wedges[chosen];
}
