/* radiosity/solve/refine.c: see refine.h.
 *
 * Refinement starts from the links of the previous pass, at first the pair (root, root). Each round
 *   1. judges all open pairs in parallel, visibility rays included;
 *   2. carries out the verdicts in the order of the pairs, so that elements and links do not depend on the
 *      number of threads. The children of a split element form the pairs of the next round.
 * Cost: linear in the number of pairs judged, which follows the light and not the number of triangles.
 */
#include "radiosity/solve/refine.h"

#include "base/math/elementary.h"
#include "radiosity/solve/oracle.h"

/* First rays of a link. With one ray, a chance zero stops refinement and the result is 12 % too dark; with 4
 * rays, and 16 where they disagree, it is not. */
#define FIRST_RAYS 4
/* A link is near if its centroids are closer than this multiple of the typical radii: then one sample has an
 * error above 7 % (docs/notes/radiosity.md), and 16 point pairs replace it. */
#define NEAR_RADII 2

typedef enum verdict { KEEP, DROP, SPLIT_RECEIVER, SPLIT_SOURCE } verdict;

typedef struct judging {
    const fct_elements *set;
    fct_link *pairs;
    uint8_t *verdicts;
    uint32_t *rays; /* per chunk */
    double epsilon;
} judging;

/* Product of the cosines at both points, 0 if one faces away from the other. */
static double multiply_cosines(const fct_element_point *p, const fct_element_point *q, double *distance2) {
    v3 d = v3_sub(v3_load(q->position), v3_load(p->position));
    *distance2 = v3_norm2(d);
    if (*distance2 <= 0) return 0;
    double a = v3_dot(v3_load(p->normal), d), b = -v3_dot(v3_load(q->normal), d);
    return a > 0 && b > 0 ? a * b / *distance2 : 0;
}

static bool points_see_each_other(const fct_elements *set, const fct_element_point *p,
                                  const fct_element_point *q) {
    fct_ray ray = {.t_min = 0, .t_max = 1};
    for (int k = 0; k < 3; ++k) {
        double a = (double)p->position[k] + (double)p->offset * p->normal[k];
        double b = (double)q->position[k] + (double)q->offset * q->normal[k];
        ray.origin[k] = (float)a;
        ray.direction[k] = (float)(b - a);
    }
    return !fct_scene_any_hit(set->scene, &ray, NULL);
}

/* Sends rays [from, to) of the pair's sequence. Adds the kernel cos cos' / (pi r^2 + A_j / 16) to *clear, and
 * to *seen where the ray arrives; A_j / 16 bounds the kernel where surfaces touch. Returns the number of
 * rays: point pairs that face away send none. */
static uint32_t send_pair_rays(const fct_elements *set, const fct_link *link, uint32_t from, uint32_t to,
                               double *clear, double *seen) {
    double floor2 = set->items[link->source].area / FCT_ELEMENT_POINTS;
    uint32_t turn = (uint32_t)fct_hash2(link->receiver, link->source), rays = 0;
    for (uint32_t k = from; k < to; ++k) {
        /* i is k with its bits reversed: the first four pairs spread over both elements. */
        uint32_t i = ((k & 1) << 3 | (k & 2) << 1 | (k & 4) >> 1 | (k & 8) >> 3), j = (i * 5 + turn) & 15;
        if (link->receiver == link->source && i == j) j = (j + 8) & 15;
        fct_element_point p, q;
        fct_element_point_at(set, link->receiver, i, &p);
        fct_element_point_at(set, link->source, j, &q);
        double r2, cosines = multiply_cosines(&p, &q, &r2);
        if (cosines <= 0) continue;
        double kernel = cosines / (FCT_PI * r2 + floor2);
        *clear += kernel;
        ++rays;
        if (points_see_each_other(set, &p, &q)) *seen += kernel;
    }
    return rays;
}

/* Sets weight, near and rays of a link that has sent no rays yet. Returns the number of rays. */
static uint32_t sample_link(const fct_elements *set, fct_link *link, const fct_pair *pair) {
    double clear = 0, seen = 0;
    link->near = pair->distance < NEAR_RADII * pair->radii;
    uint32_t sent = send_pair_rays(set, link, 0, FIRST_RAYS, &clear, &seen), tried = FIRST_RAYS;
    if (link->near || sent == 0 || (seen > 0 && seen < clear)) {
        sent += send_pair_rays(set, link, FIRST_RAYS, FCT_ELEMENT_POINTS, &clear, &seen);
        tried = FCT_ELEMENT_POINTS;
    }
    link->rays = (uint8_t)tried;
    if (link->near)
        link->weight = (float)(seen * set->items[link->source].area / tried);
    else
        link->weight = clear > 0 ? (float)(seen / clear) : 0;
    /* If all point pairs face away, the moments alone decide. */
    if (sent == 0 && !link->near) link->weight = 1;
    return sent;
}

/* True if every normal of one element turns away from the ball of the other. */
static bool pair_faces_away(const fct_element *i, const fct_element *j, const fct_pair *pair) {
    if (pair->overlap) return false;
    double angle = fct_asin(fct_min((i->radius + j->radius) / pair->distance, 1));
    return fct_faces_away(i, pair->toward, angle) || fct_faces_away(j, v3_scale(pair->toward, -1), angle);
}

/* Judges one pair. May send rays and write the link's weight, near and rays. */
static verdict judge_pair(const fct_elements *set, fct_link *link, double epsilon, uint32_t *rays) {
    const fct_element *i = &set->items[link->receiver], *j = &set->items[link->source];
    if (i->area <= 0 || j->area <= 0) return DROP;
    fct_pair pair = fct_pair_place(i, j);
    bool self = link->receiver == link->source;
    if (self && i->kind == FCT_ELEMENT_TRIANGLE) return DROP;
    if (pair_faces_away(i, j, &pair)) return DROP;
    double flow = fct_pair_flow(i, j, &pair);
    bool can_i = i->child_count > 0 || fct_elements_can_split(set, link->receiver);
    bool can_j = j->child_count > 0 || fct_elements_can_split(set, link->source);
    if (i->kind == FCT_ELEMENT_VOLUME && pair.overlap && !can_j && !can_i) return DROP;
    if (flow <= 0 && !link->rays) return KEEP; /* a dark source needs no rays yet */

    double source = 1, receiver = 1, error = 1;
    if (!pair.overlap) {
        source = fct_pair_source_error(j, &pair), receiver = fct_pair_receiver_error(i, &pair);
        error = fct_min(source + receiver, 1);
    }
    verdict larger = can_i && (!can_j || i->radius >= j->radius) ? SPLIT_RECEIVER : SPLIT_SOURCE;
    bool may_split = (can_i || can_j) && !(self && !can_i);
    if (may_split && flow * error > epsilon) {
        if (!pair.overlap && can_i && can_j) return source > receiver ? SPLIT_SOURCE : SPLIT_RECEIVER;
        return larger;
    }
    if (i->kind == FCT_ELEMENT_VOLUME && pair.overlap && may_split) return larger;
    if (link->rays == 0) *rays += sample_link(set, link, &pair);
    if (!may_split || link->near) return KEEP;
    double v = link->weight;
    return flow * sqrt(v * (1 - v)) > epsilon ? larger : KEEP;
}

static void judge_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    judging *r = user;
    uint32_t rays = 0;
    (void)thread;
    for (size_t k = begin; k < end; ++k)
        r->verdicts[k] = (uint8_t)judge_pair(r->set, &r->pairs[k], r->epsilon, &rays);
    r->rays[chunk] = rays;
}

/* A growing list of pairs. */
typedef struct pair_list {
    fct_link *items;
    size_t count, capacity;
} pair_list;

/* Appends the pairs that replace `link` when element `id`, one of its ends, is opened. */
static fct_result append_split(const fct_elements *set, const fct_link *link, uint32_t id, pair_list *next) {
    bool self = link->receiver == link->source, receiver = id == link->receiver;
    uint32_t first = set->items[id].child, n = set->items[id].child_count;
    size_t needed = next->count + (self ? (size_t)n * n : n);
    fct_result result =
        fct_grow(set->env, (void **)&next->items, &next->capacity, needed, sizeof *next->items);
    if (result != FCT_OK) return result;
    for (uint32_t a = first; a < first + n; ++a) {
        if (!self)
            next->items[next->count++] =
                (fct_link){.receiver = receiver ? a : link->receiver, .source = receiver ? link->source : a};
        for (uint32_t b = first; self && b < first + n; ++b)
            next->items[next->count++] = (fct_link){.receiver = a, .source = b};
    }
    return FCT_OK;
}

/* Carries out the verdicts: kept pairs become links, the children of split ones go to `next`. */
static fct_result apply_verdicts(fct_elements *set, fct_links *links, const judging *r, size_t count,
                                 pair_list *next) {
    fct_result result = FCT_OK;
    for (size_t k = 0; k < count && result == FCT_OK; ++k) {
        const fct_link link = r->pairs[k];
        if (r->verdicts[k] == DROP) continue;
        if (r->verdicts[k] == KEEP) {
            result =
                fct_grow(set->env, (void **)&links->items, &links->capacity, links->count + 1, sizeof link);
            if (result == FCT_OK) links->items[links->count++] = link;
            continue;
        }
        uint32_t id = r->verdicts[k] == SPLIT_RECEIVER ? link.receiver : link.source;
        if (fct_element_is_leaf(&set->items[id])) result = fct_elements_split(set, id);
        if (result == FCT_OK) result = append_split(set, &link, id, next);
    }
    return result;
}

/* Judges all pairs and carries out the verdicts. */
static fct_result refine_round(fct_elements *set, fct_links *links, double epsilon, const pair_list *pairs,
                               pair_list *next) {
    const fct_env *env = set->env;
    size_t chunks = fct_chunk_count(pairs->count, 256);
    judging r = {.set = set, .pairs = pairs->items, .epsilon = epsilon};
    r.verdicts = fct_allocate(env, pairs->count, 1);
    r.rays = fct_allocate(env, chunks, sizeof *r.rays);
    fct_result result = FCT_OK;
    if (r.verdicts && r.rays) {
        fct_elements_place_points(set);
        fct_parallel_for(env, pairs->count, 256, judge_chunk, &r);
        for (size_t c = 0; c < chunks; ++c) links->rays += r.rays[c];
        result = apply_verdicts(set, links, &r, pairs->count, next);
    } else {
        result = fct_fail_memory(env, "the links");
    }
    fct_release(env, r.verdicts);
    fct_release(env, r.rays);
    return result;
}

fct_result fct_links_refine(fct_elements *set, fct_links *links, double epsilon, const char *phase,
                            double done) {
    pair_list pairs = {.items = links->items, .count = links->count};
    links->items = NULL;
    links->count = links->capacity = 0;
    fct_result result = FCT_OK;
    while (pairs.count > 0 && result == FCT_OK) {
        if ((result = fct_progress(set->env, phase, done)) != FCT_OK) break;
        pair_list next = {0};
        result = refine_round(set, links, epsilon, &pairs, &next);
        fct_release(set->env, pairs.items);
        pairs = next;
    }
    fct_release(set->env, pairs.items);
    return result == FCT_OK ? fct_links_sort(set, links) : result;
}
