/* radiosity/solve/link.c: which pairs exchange light directly.
 *
 * Input: elements with the radiosities known so far. Output: links so fine that none is uncertain by more
 * than epsilon. Pairs are worked through in rounds: each round judges all its pairs in parallel (visibility
 * rays included) and then splits in order, so that the result does not depend on threads. Derived in
 * docs/radiosity.md; Hanrahan, Salzman, Aupperle 1991 for the scheme.
 */
#include "radiosity/solve/link.h"

#include <string.h>

#include "radiosity/solve/transfer.h"

/* The surface of an element lies within this part of its bounding ball, most of it. */
#define TYPICAL .55

typedef enum verdict { KEEP, DROP, SPLIT_RECEIVER, SPLIT_SOURCE } verdict;

typedef struct judging {
    const fct_elements *set;
    fct_link *pairs;
    uint8_t *verdicts;
    uint32_t *rays;
    double epsilon;
} judging;

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

/* Visibility between point k of the receiver and point m of the source: cosines at both ends, 0 when turned
 * away. */
static double pair_cosines(const fct_element_point *p, const fct_element_point *q, v3 *direction,
                           double *distance2) {
    v3 d = v3_sub(v3_load(q->position), v3_load(p->position));
    *distance2 = v3_norm2(d);
    *direction = d;
    if (*distance2 <= 0) return 0;
    double a = v3_dot(v3_load(p->normal), d), b = -v3_dot(v3_load(q->normal), d);
    return a > 0 && b > 0 ? a * b / *distance2 : 0;
}

static bool pair_visible(const fct_elements *set, const fct_element_point *p, const fct_element_point *q) {
    fct_ray ray = {.t_min = 0, .t_max = 1};
    for (int k = 0; k < 3; ++k) {
        double a = (double)p->position[k] + (double)p->offset * p->normal[k];
        double b = (double)q->position[k] + (double)q->offset * q->normal[k];
        ray.origin[k] = (float)a;
        ray.direction[k] = (float)(b - a);
    }
    return !fct_scene_any_hit(set->scene, &ray, NULL);
}

/* Sends rays `from` to `to` of the pair's sequence; adds kernel sums with and without blockers. */
static uint32_t shoot(const fct_elements *set, const fct_link *link, uint32_t from, uint32_t to,
                      double *clear, double *seen) {
    const fct_element_point *ps = set->points + (size_t)link->receiver * FCT_ELEMENT_POINTS;
    const fct_element_point *qs = set->points + (size_t)link->source * FCT_ELEMENT_POINTS;
    double floor2 = set->items[link->source].area / FCT_ELEMENT_POINTS;
    uint32_t turn = (uint32_t)fct_hash2(link->receiver, link->source), rays = 0;
    for (uint32_t k = from; k < to; ++k) {
        /* bit-reversed order: the first four pairs are spread over both elements */
        uint32_t i = ((k & 1) << 3 | (k & 2) << 1 | (k & 4) >> 1 | (k & 8) >> 3), j = (i * 5 + turn) & 15;
        if (link->receiver == link->source && i == j) j = (j + 8) & 15;
        v3 d;
        double r2, cosines = pair_cosines(&ps[i], &qs[j], &d, &r2);
        if (cosines <= 0) continue;
        double kernel = cosines / (FCT_PI * r2 + floor2);
        *clear += kernel;
        ++rays;
        if (pair_visible(set, &ps[i], &qs[j])) *seen += kernel;
    }
    return rays;
}

/* Largest power that could flow over the pair were nothing in the way, times the receiver's reflectance. */
static double flow_bound(const fct_element *i, const fct_element *j, v3 u, double r, bool overlap) {
    double form = 1;
    if (!overlap) {
        double spread = TYPICAL * (i->radius + j->radius) / r;
        double pj = fct_projected_bound(j, v3_scale(u, -1), .5 * spread);
        double pi = i->area > 0 ? fct_projected_bound(i, u, .5 * spread) / i->area : 0;
        form = fmin(1, pj * pi * fct_distance_factor(r * r, pj));
    } else if (i->kind != FCT_ELEMENT_VOLUME && j->kind != FCT_ELEMENT_VOLUME) {
        /* two patches exchange no more than their union is bent */
        v3 s = i == j ? i->vector : v3_add(i->vector, j->vector);
        double area = i == j ? i->area : i->area + j->area;
        double bend = fmax(area - v3_norm(s), 0);
        form = i->area > 0 ? fmin(1, fmin(bend, fmin(i->area, j->area)) / i->area) : 0;
    }
    double flow = 0;
    for (int c = 0; c < 3; ++c) {
        double rho = i->kind == FCT_ELEMENT_VOLUME ? .7 : i->reflectance[c];
        flow += fmax(rho, .05) * j->radiosity[c];
    }
    return flow * form * i->area;
}

/* Judges one pair; may send rays and write link->weight, near, rays. */
static verdict judge(const fct_elements *set, fct_link *link, double epsilon, uint32_t *rays) {
    const fct_element *i = &set->items[link->receiver], *j = &set->items[link->source];
    if (i->area <= 0 || j->area <= 0) return DROP;
    v3 d = v3_sub(j->center, i->center);
    double r = v3_norm(d), ball = i->radius + j->radius, radii = TYPICAL * ball;
    bool overlap = r <= radii, self = link->receiver == link->source;
    v3 u = r > 0 ? v3_scale(d, 1 / r) : v3_make(0, 0, 0);
    if (self && i->kind == FCT_ELEMENT_TRIANGLE) return DROP;
    if (!overlap) {
        double angle = asin(fmin(ball / r, 1));
        if (fct_faces_away(i, u, angle) || fct_faces_away(j, v3_scale(u, -1), angle)) return DROP;
    }
    double flow = flow_bound(i, j, u, r, overlap);
    bool inner_i = i->child_count > 0, inner_j = j->child_count > 0;
    bool can_i = inner_i || fct_elements_can_split(set, link->receiver);
    bool can_j = inner_j || fct_elements_can_split(set, link->source);
    if (i->kind == FCT_ELEMENT_VOLUME && overlap && !can_j && !can_i) return DROP;
    if (flow <= 0 && !link->rays) return KEEP; /* a dark source: nothing to know yet */

    /* relative uncertainty of one sample for the pair, then of its visibility */
    double error = 1;
    double source = TYPICAL * j->radius / r, spread = .25 * TYPICAL * i->radius / r;
    if (!overlap) error = fmin(1, source * source + spread);
    verdict larger = can_i && (!can_j || i->radius >= j->radius) ? SPLIT_RECEIVER : SPLIT_SOURCE;
    bool may_split = can_i || can_j;
    if (self && !can_i) may_split = false;
    if (may_split && flow * error > epsilon) {
        if (!overlap && can_i && can_j) larger = source * source > spread ? SPLIT_SOURCE : SPLIT_RECEIVER;
        return larger;
    }
    if (i->kind == FCT_ELEMENT_VOLUME && overlap && may_split) return larger;
    if (link->rays == 0) {
        double clear = 0, seen = 0;
        link->near = r < 2 * radii;
        uint32_t sent = shoot(set, link, 0, 4, &clear, &seen), tried = 4;
        if (link->near || sent == 0 || (seen > 0 && seen < clear)) {
            sent += shoot(set, link, 4, FCT_ELEMENT_POINTS, &clear, &seen);
            tried = FCT_ELEMENT_POINTS;
        }
        *rays += sent;
        link->rays = (uint8_t)tried;
        if (link->near)
            link->weight = (float)(seen * j->area / tried);
        else
            link->weight = clear > 0 ? (float)(seen / clear) : 0;
        if (sent == 0 && !link->near)
            link->weight = 1; /* all sampled pairs turned away: leave it to the moments */
    }
    if (!may_split || link->near) return KEEP;
    double v = link->weight;
    if (flow * sqrt(v * (1 - v)) > epsilon) return larger;
    return KEEP;
}

static void judge_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    judging *r = user;
    uint32_t rays = 0;
    (void)thread;
    for (size_t k = begin; k < end; ++k)
        r->verdicts[k] = (uint8_t)judge(r->set, &r->pairs[k], r->epsilon, &rays);
    r->rays[chunk] = rays;
}

/* Carries the verdicts out: kept links go to `links`, the pairs of split ones to `next`. */
static fct_result apply(fct_elements *set, fct_links *links, const judging *r, size_t count, fct_link **next,
                        size_t *next_capacity, size_t *next_count) {
    fct_result result = FCT_OK;
    for (size_t k = 0; k < count; ++k) {
        const fct_link link = r->pairs[k];
        if (r->verdicts[k] == DROP) continue;
        if (r->verdicts[k] == KEEP) {
            result =
                fct_grow(set->env, (void **)&links->items, &links->capacity, links->count + 1, sizeof link);
            if (result != FCT_OK) return result;
            links->items[links->count++] = link;
            continue;
        }
        bool self = link.receiver == link.source;
        uint32_t id = r->verdicts[k] == SPLIT_RECEIVER ? link.receiver : link.source;
        if (fct_element_is_leaf(&set->items[id]) && (result = fct_elements_split(set, id)) != FCT_OK)
            return result;
        uint32_t first = set->items[id].child, n = set->items[id].child_count;
        size_t needed = *next_count + (self ? (size_t)n * n : n);
        result = fct_grow(set->env, (void **)next, next_capacity, needed, sizeof link);
        if (result != FCT_OK) return result;
        for (uint32_t a = first; a < first + n; ++a) {
            if (!self) {
                bool receiver = id == link.receiver;
                (*next)[(*next_count)++] = (fct_link){.receiver = receiver ? a : link.receiver,
                                                      .source = receiver ? link.source : a};
                continue;
            }
            for (uint32_t b = first; b < first + n; ++b)
                (*next)[(*next_count)++] = (fct_link){.receiver = a, .source = b};
        }
    }
    return result;
}

/* Counting sort by receiver; the order of a receiver's links stays. */
static fct_result sort_by_receiver(const fct_elements *set, fct_links *links) {
    fct_result r =
        fct_grow(set->env, (void **)&links->first, &links->first_capacity, set->count + 2, sizeof(uint32_t));
    if (r == FCT_OK)
        r = fct_grow(set->env, (void **)&links->rows, &links->row_capacity, set->count, sizeof(double));
    if (r != FCT_OK) return r;
    fct_link *sorted = fct_allocate(set->env, links->count, sizeof *sorted);
    if (!sorted) return fct_fail_memory(set->env, "the links");
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

fct_result fct_links_refine(fct_elements *set, fct_links *links, double epsilon, const char *phase,
                            double done) {
    const fct_env *env = set->env;
    fct_link *pairs = links->items;
    size_t pair_count = links->count;
    links->items = NULL;
    links->count = links->capacity = 0;
    fct_result result = FCT_OK;
    while (pair_count > 0 && result == FCT_OK) {
        if ((result = fct_progress(env, phase, done)) != FCT_OK) break;
        fct_elements_make_points(set);
        size_t chunks = fct_chunk_count(pair_count, 256);
        judging r = {.set = set, .pairs = pairs, .epsilon = epsilon};
        r.verdicts = fct_allocate(env, pair_count, 1);
        r.rays = fct_allocate(env, chunks, sizeof *r.rays);
        fct_link *next = NULL;
        size_t next_capacity = 0, next_count = 0;
        if (r.verdicts && r.rays) {
            fct_parallel_for(env, pair_count, 256, judge_chunk, &r);
            for (size_t c = 0; c < chunks; ++c) links->rays += r.rays[c];
            result = apply(set, links, &r, pair_count, &next, &next_capacity, &next_count);
        } else {
            result = fct_fail_memory(env, "the links");
        }
        fct_release(env, r.verdicts);
        fct_release(env, r.rays);
        fct_release(env, pairs);
        pairs = next, pair_count = next_count;
    }
    fct_release(env, pairs);
    return result == FCT_OK ? sort_by_receiver(set, links) : result;
}

/* Adds what link brings to a receiver of mean cosine given by element `leaf`, or by `normal` at `point` when
 * leaf is NULL. */
static double add_link(const fct_elements *set, const fct_link *link, const fct_element *leaf, v3 point,
                       v3 normal, double irradiance[3]) {
    const fct_element *j = &set->items[link->source];
    if (link->rays == 0 || link->weight <= 0) return 0;
    if (link->near) {
        for (int c = 0; c < 3; ++c) irradiance[c] += link->weight * j->radiosity[c];
        return link->weight;
    }
    v3 d = v3_sub(j->center, point);
    double r2 = v3_norm2(d);
    if (r2 <= 0) return 0;
    v3 u = v3_scale(d, 1 / sqrt(r2)), back = v3_scale(u, -1);
    double cosine = leaf ? fct_projected_area(leaf, u) / leaf->area : fmax(v3_dot(normal, u), 0);
    if (cosine <= 0) return 0;
    double projected = fct_projected_area(j, back);
    double factor = link->weight * cosine * fct_distance_factor(r2, projected);
    for (int c = 0; c < 3; ++c) irradiance[c] += factor * fct_sent_power(j, back, projected, c);
    return factor * projected;
}

static double gather(const fct_elements *set, const fct_links *links, uint32_t id, const fct_element *leaf,
                     v3 point, v3 normal, double irradiance[3]) {
    double row = 0;
    while (id != FCT_NONE && id >= links->element_count) id = set->items[id].parent;
    for (; id != FCT_NONE; id = set->items[id].parent)
        for (uint32_t k = links->first[id]; k < links->first[id + 1]; ++k)
            row += add_link(set, &links->items[k], leaf, point, normal, irradiance);
    if (row > 1)
        for (int c = 0; c < 3; ++c) irradiance[c] /= row;
    return row;
}

typedef struct sweep {
    fct_elements *set;
    const fct_links *links;
    double *change, *norm;
} sweep;

static void sweep_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    sweep *s = user;
    (void)thread;
    double change = 0, norm = 0;
    for (size_t id = begin; id < end; ++id) {
        fct_element *e = &s->set->items[id];
        if (e->child_count || e->kind == FCT_ELEMENT_VOLUME || e->area <= 0) continue;
        double irradiance[3] = {0, 0, 0};
        s->links->rows[id] = gather(s->set, s->links, (uint32_t)id, e, e->center, e->vector, irradiance);
        for (int c = 0; c < 3; ++c) {
            double b = e->emission[c] + e->reflectance[c] * irradiance[c];
            double old = e->emission[c] + e->reflectance[c] * e->irradiance[c];
            change += e->area * (b - old) * (b - old);
            norm += e->area * b * b;
            /* irradiance waits for the pull: others read this element's radiosity meanwhile */
            e->irradiance[c] = irradiance[c];
        }
    }
    s->change[chunk] = change;
    s->norm[chunk] = norm;
}

static double largest_reflectance(const fct_elements *set) {
    double most = 0;
    for (uint32_t k = 0; k < set->view.material_count; ++k)
        for (int c = 0; c < 3; ++c) most = fmax(most, set->view.materials[k].reflectance[c]);
    return most;
}

fct_result fct_links_solve(fct_elements *set, fct_links *links, double tolerance, uint32_t most,
                           uint32_t *sweeps) {
    size_t chunks = fct_chunk_count(set->count, 128);
    double *sums = fct_allocate(set->env, 2 * chunks, sizeof *sums);
    if (!sums) return fct_fail_memory(set->env, "a sweep");
    double rho = largest_reflectance(set), bound = rho > 0 ? tolerance * (1 - rho) / rho : HUGE_VAL;
    sweep s = {.set = set, .links = links, .change = sums, .norm = sums + chunks};
    double change = HUGE_VAL;
    for (uint32_t k = 0; k < most && !(change <= bound); ++k, ++*sweeps) {
        fct_parallel_for(set->env, set->count, 128, sweep_chunk, &s);
        for (size_t id = 0; id < set->count; ++id) {
            fct_element *e = &set->items[id];
            if (e->child_count || e->kind == FCT_ELEMENT_VOLUME) continue;
            for (int c = 0; c < 3; ++c)
                e->radiosity[c] = e->emission[c] + e->reflectance[c] * e->irradiance[c];
        }
        fct_elements_pull(set);
        double norm = fct_sum(s.norm, chunks);
        change = norm > 0 ? sqrt(fct_sum(s.change, chunks) / norm) : 0;
    }
    fct_release(set->env, sums);
    return FCT_OK;
}

void fct_links_irradiance(const fct_elements *set, const fct_links *links, uint32_t leaf, v3 point, v3 normal,
                          double irradiance[3]) {
    irradiance[0] = irradiance[1] = irradiance[2] = 0;
    gather(set, links, leaf, NULL, point, normal, irradiance);
}
