/* radiosity/solve/guide.c: see guide.h. */
#include "radiosity/solve/guide.h"

#include <string.h>

static double sum_stored(const fct_guides *g, uint32_t leaf) {
    const float *b = g->stored + 3 * (size_t)leaf;
    return (double)b[0] + (double)b[1] + (double)b[2];
}

/* Powers of leaves, then of their ancestors. Volumes have smaller numbers than the roots below them, and
 * other children larger ones than their parents, as in fct_elements_pull. */
static void sum_powers(fct_guides *g) {
    const size_t volumes = g->set->view.volume_count, count = g->set->count;
    for (size_t pass = 0; pass < 2; ++pass)
        for (size_t i = pass == 0 ? count : volumes, begin = pass == 0 ? volumes : 0; i-- > begin;) {
            const fct_element *e = &g->set->items[i];
            if (e->child_count == 0) g->powers[i] = sum_stored(g, (uint32_t)i) * e->area;
            for (uint32_t c = e->child; c < e->child + e->child_count; ++c) g->powers[i] += g->powers[c];
        }
}

/* The most links of an element and its ancestors. */
static uint32_t count_most_links(const fct_elements *set, const fct_links *links) {
    uint32_t most = 0;
    for (size_t i = 0; i < links->element_count; ++i) {
        uint32_t sum = 0;
        if (set->items[i].child_count && set->items[i].child < links->element_count) continue;
        for (size_t id = i; id != FCT_NONE; id = set->items[id].parent)
            sum += links->first[id + 1] - links->first[id];
        most = sum > most ? sum : most;
    }
    return most;
}

fct_result fct_guides_create(const fct_elements *set, const fct_links *links, const float *stored,
                             fct_guides *out) {
    *out = (fct_guides){.set = set, .links = links, .stored = stored};
    out->powers = fct_allocate_zero(set->env, set->count, sizeof *out->powers);
    if (!out->powers) return fct_fail_memory(set->env, "the solution");
    sum_powers(out);
    out->most_links = count_most_links(set, links);
    return FCT_OK;
}

void fct_guides_release(const fct_env *env, fct_guides *guides) {
    fct_release(env, guides->powers);
    *guides = (fct_guides){0};
}

fct_result fct_guide_create(const fct_guides *all, fct_guide *out) {
    size_t slots = 16;
    *out = (fct_guide){.all = all};
    while (slots < 2 * (size_t)all->most_links) slots *= 2;
    out->mask = (uint32_t)(slots - 1);
    const fct_array arrays[] = {FCT_ARRAY(out->sources, all->most_links),
                                FCT_ARRAY(out->sums, all->most_links),
                                FCT_ARRAY(out->densities, all->most_links), FCT_ARRAY(out->table, slots)};
    return fct_allocate_all(all->set->env, arrays, FCT_LENGTH(arrays), "the output");
}

void fct_guide_release(const fct_env *env, fct_guide *guide) {
    fct_release(env, guide->sources);
    fct_release(env, guide->sums);
    fct_release(env, guide->densities);
    fct_release(env, guide->table);
    *guide = (fct_guide){0};
}

static uint32_t *find_slot(const fct_guide *g, uint32_t element) {
    uint32_t slot = (uint32_t)fct_hash(element) & g->mask;
    while (g->table[slot] != FCT_NONE && g->sources[g->table[slot]] != element) slot = (slot + 1) & g->mask;
    return &g->table[slot];
}

bool fct_guide_aim(fct_guide *g, uint32_t leaf, v3 point, v3 normal) {
    const fct_guides *all = g->all;
    g->count = fct_links_factors(all->set, all->links, leaf, point, normal, g->sources, g->densities);
    double sum = 0;
    uint32_t kept = 0;
    for (uint32_t i = 0; i < g->count; ++i) {
        const uint32_t source = g->sources[i];
        const double light = g->densities[i] * all->powers[source] / all->set->items[source].area;
        if (!(light > 0)) continue;
        g->sources[kept] = source;
        g->sums[kept] = sum += light;
        g->densities[kept++] = light / all->powers[source];
    }
    g->count = kept;
    if (kept == 0) return false;
    memset(g->table, 0xff, ((size_t)g->mask + 1) * sizeof *g->table);
    for (uint32_t i = 0; i < kept; ++i) {
        g->sums[i] /= sum, g->densities[i] /= sum;
        *find_slot(g, g->sources[i]) = i;
    }
    return true;
}

uint32_t fct_guide_pick(const fct_guide *g, double *t) {
    const fct_element *items = g->all->set->items;
    uint32_t low = 0, high = g->count - 1;
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        if (*t < g->sums[middle])
            high = middle;
        else
            low = middle + 1;
    }
    const double before = low > 0 ? g->sums[low - 1] : 0;
    uint32_t id = g->sources[low];
    double rest = (*t - before) / (g->sums[low] - before) * g->all->powers[id];
    while (items[id].child_count) {
        uint32_t c = items[id].child;
        const uint32_t last = c + items[id].child_count - 1;
        while (c < last && rest >= g->all->powers[c]) rest -= g->all->powers[c++];
        id = c;
    }
    *t = fct_min(fct_max(rest / g->all->powers[id], 0), 1 - 1e-12);
    return id;
}

double fct_guide_density(const fct_guide *g, uint32_t leaf) {
    for (uint32_t id = leaf; id != FCT_NONE; id = g->all->set->items[id].parent) {
        const uint32_t at = *find_slot(g, id);
        if (at != FCT_NONE) return g->densities[at] * sum_stored(g->all, leaf);
    }
    return 0;
}
