/* radiosity/solve/link.c: see link.h.
 *
 * Each leaf gathers over its own links and over those of all its ancestors, at its own centroid and with its
 * own moments. This clamps every link by itself: a sum of irradiance vectors that is pushed down the tree is
 * wrong where some normals face the source and others do not (2.7 % RMS after this gather, 4.1 % with vectors
 * that are pushed down).
 */
#include "radiosity/solve/link.h"

#include <string.h>

#include "radiosity/solve/iterate.h"
#include "radiosity/solve/transfer.h"

fct_result fct_links_create(const fct_env *env, fct_links *out) {
    *out = (fct_links){0};
    fct_result r = fct_grow(env, (void **)&out->items, &out->capacity, 1, sizeof *out->items);
    if (r != FCT_OK) return r;
    out->items[0] = (fct_link){.receiver = 0, .source = 0};
    out->count = 1;
    return FCT_OK;
}

void fct_links_release(const fct_env *env, fct_links *links) {
    fct_release(env, links->items);
    fct_release(env, links->first);
    fct_release(env, links->rows);
    *links = (fct_links){0};
}

fct_result fct_links_sort(const fct_elements *set, fct_links *links) {
    fct_result r =
        fct_grow(set->env, (void **)&links->first, &links->first_capacity, set->count + 2, sizeof(uint32_t));
    if (r == FCT_OK)
        r = fct_grow(set->env, (void **)&links->rows, &links->row_capacity, set->count, sizeof(double));
    if (r != FCT_OK) return r;
    fct_link *sorted = fct_allocate(set->env, links->count, sizeof *sorted);
    if (!sorted) return fct_fail_memory(set->env, "the links");
    /* Counting sort. Counts start two places late, so that first[id + 1] is the next free place of id. */
    memset(links->first, 0, (set->count + 2) * sizeof(uint32_t));
    for (size_t k = 0; k < links->count; ++k) ++links->first[links->items[k].receiver + 2];
    for (size_t k = 2; k < set->count + 2; ++k) links->first[k] += links->first[k - 1];
    for (size_t k = 0; k < links->count; ++k)
        sorted[links->first[links->items[k].receiver + 1]++] = links->items[k];
    fct_release(set->env, links->items);
    links->items = sorted;
    links->capacity = links->count;
    links->element_count = set->count;
    return FCT_OK;
}

/* The place that gathers: a leaf element with its mean cosine, or a point with a normal if leaf is NULL. */
typedef struct gather_site {
    const fct_element *leaf;
    v3 point, normal;
} gather_site;

/* Adds the irradiance over one link, with r and u from the site to the source's centroid:
 *   far:  V c fct_sent_power / (pi r^2 + P_j(-u)), c = P_i(u) / A_i for a leaf, max(0, n.u) for a point;
 *   near: F_ij b_j.
 * Returns the form factor. */
static double add_link(const fct_elements *set, const fct_link *link, const gather_site *site,
                       double irradiance[3]) {
    const fct_element *j = &set->items[link->source];
    if (link->rays == 0 || link->weight <= 0) return 0;
    if (link->near) {
        for (int c = 0; c < 3; ++c) irradiance[c] += link->weight * j->radiosity[c];
        return link->weight;
    }
    v3 d = v3_sub(j->center, site->point);
    double r2 = v3_norm2(d);
    if (r2 <= 0) return 0;
    v3 u = v3_scale(d, 1 / sqrt(r2)), back = v3_scale(u, -1);
    double cosine = site->leaf ? fct_projected_area(site->leaf, u) / site->leaf->area
                               : fct_max(v3_dot(site->normal, u), 0);
    if (cosine <= 0) return 0;
    double projected = fct_projected_area(j, back);
    double factor = link->weight * cosine * fct_distance_factor(r2, projected);
    for (int c = 0; c < 3; ++c) irradiance[c] += factor * fct_sent_power(j, back, projected, c);
    return factor * projected;
}

/* Sums over the links of element `id` and its ancestors. A sum of form factors above 1 is an error of the
 * links, because a hemisphere holds no more; the irradiance is then divided by it. Returns that sum. */
static double gather_links(const fct_elements *set, const fct_links *links, uint32_t id,
                           const gather_site *site, double irradiance[3]) {
    double row = 0;
    while (id != FCT_NONE && id >= links->element_count) id = set->items[id].parent;
    for (; id != FCT_NONE; id = set->items[id].parent)
        for (uint32_t k = links->first[id]; k < links->first[id + 1]; ++k)
            row += add_link(set, &links->items[k], site, irradiance);
    if (row > 1)
        for (int c = 0; c < 3; ++c) irradiance[c] /= row;
    return row;
}

typedef struct link_sweep {
    fct_elements *set;
    const fct_links *links;
} link_sweep;

static bool gathers_light(const fct_element *e) {
    return e->child_count == 0 && e->kind != FCT_ELEMENT_VOLUME && e->area > 0;
}

/* Other elements read this one's radiosity meanwhile; its irradiance is its own. */
static void gather_elements(void *user, size_t begin, size_t end, fct_change *sum) {
    link_sweep *s = user;
    for (size_t id = begin; id < end; ++id) {
        fct_element *e = &s->set->items[id];
        if (!gathers_light(e)) continue;
        double irradiance[3] = {0, 0, 0};
        gather_site site = {.leaf = e, .point = e->center};
        s->links->rows[id] = gather_links(s->set, s->links, (uint32_t)id, &site, irradiance);
        fct_change_add(sum, e, irradiance);
        memcpy(e->irradiance, irradiance, sizeof irradiance);
    }
}

static void publish_elements(void *user) {
    link_sweep *s = user;
    for (size_t id = 0; id < s->set->count; ++id) {
        fct_element *e = &s->set->items[id];
        if (e->child_count || e->kind == FCT_ELEMENT_VOLUME) continue;
        for (int c = 0; c < 3; ++c) e->radiosity[c] = e->emission[c] + e->reflectance[c] * e->irradiance[c];
    }
    fct_elements_pull(s->set);
}

fct_result fct_links_solve(fct_elements *set, fct_links *links, double tolerance, uint32_t most,
                           uint32_t *sweeps) {
    link_sweep s = {.set = set, .links = links};
    fct_sweep_def def = {.gather = gather_elements,
                         .publish = publish_elements,
                         .user = &s,
                         .count = set->count,
                         .grain = 128,
                         .tolerance = tolerance,
                         .most = most};
    fct_sweep_result done;
    fct_result result = fct_iterate(set, &def, &done);
    *sweeps += done.sweeps;
    return result;
}

void fct_links_irradiance(const fct_elements *set, const fct_links *links, uint32_t leaf, v3 point, v3 normal,
                          double irradiance[3]) {
    gather_site site = {.point = point, .normal = normal};
    irradiance[0] = irradiance[1] = irradiance[2] = 0;
    gather_links(set, links, leaf, &site, irradiance);
}

uint32_t fct_links_factors(const fct_elements *set, const fct_links *links, uint32_t leaf, v3 point,
                           v3 normal, uint32_t *sources, double *factors) {
    const gather_site site = {.point = point, .normal = normal};
    uint32_t count = 0, id = leaf;
    while (id != FCT_NONE && id >= links->element_count) id = set->items[id].parent;
    for (; id != FCT_NONE; id = set->items[id].parent)
        for (uint32_t k = links->first[id]; k < links->first[id + 1]; ++k) {
            double unused[3] = {0, 0, 0};
            fct_link link = links->items[k];
            link.weight = (link.weight * (float)link.rays + 1) / (float)(link.rays + 1);
            if (link.near) link.weight = links->items[k].weight;
            if (link.rays == 0) link.rays = 1;
            factors[count] = add_link(set, &link, &site, unused);
            sources[count++] = links->items[k].source;
        }
    return count;
}
