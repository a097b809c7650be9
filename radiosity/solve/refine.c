/* radiosity/solve/refine.c: see refine.h.
 *
 * Refinement starts from the links of the previous pass, at first the pair (root, root). Each round
 *   1. judges all open pairs in parallel, visibility rays included;
 *   2. carries out the verdicts in the order of the pairs, so that elements and links do not depend on the
 *      number of threads. The children of a split element form the pairs of the next round.
 * Cost: linear in the number of pairs judged, which follows the light and not the number of triangles.
 *
 * With a limit on the number of links, a pass that would exceed it starts again. Now pairs that shall be
 * split wait, and each round splits those whose error is at least half the largest one, while there is room.
 * So the links that the limit leaves coarse are those with the smallest errors.
 */
#include "radiosity/solve/refine.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/math/elementary.h"
#include "radiosity/solve/oracle.h"

/* First rays of a link. With one ray, a chance zero stops refinement and the result is 12 % too dark; with 4
 * rays, and 16 where they disagree, it is not. */
#define FIRST_RAYS 4
/* A link is near if its centroids are closer than this multiple of the typical radii: then one sample has an
 * error above 7 % (docs/notes/radiosity.md), and 16 point pairs replace it. */
#define NEAR_RADII 2
/* Two triangles that meet at a concave angle below this, in radians, count as a plane. */
#define FLAT_EDGE 1e-5
/* With a limit, a round splits the pairs whose error is at least this share of the largest one. Smaller
 * values need fewer rounds, and let small errors take room from the children of large ones. */
#define LIMITED_SHARE .5

typedef enum verdict { KEEP, DROP, SPLIT_RECEIVER, SPLIT_SOURCE } verdict;

typedef struct judging {
    const fct_elements *set;
    fct_link *pairs;
    uint8_t *verdicts;
    float *errors;  /* per pair that shall be split: what it carries, power */
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

/* True if every corner of triangle j lies in the plane of triangle i or behind it. The balls of two triangles
 * with a common edge always reach in front of each other. */
static bool triangle_lies_behind(const fct_elements *set, const fct_element *i, const fct_element *j) {
    const float *p = set->corners + 9 * (size_t)i->triangle, *q = set->corners + 9 * (size_t)j->triangle;
    double largest = 0, slack = FLAT_EDGE * fct_min(i->radius, j->radius) * i->area;
    for (int k = 0; k < 9; ++k) largest = fct_max(largest, fct_max(fabs(p[k]), fabs(q[k])));
    slack += 4 * FLT_EPSILON * largest * i->area;
    for (int k = 0; k < 3; ++k)
        if (v3_dot(i->vector, v3_sub(v3_load(q + 3 * k), i->center)) > slack) return false;
    return true;
}

static bool triangles_face_away(const fct_elements *set, const fct_element *i, const fct_element *j) {
    return i->kind == FCT_ELEMENT_TRIANGLE && j->kind == FCT_ELEMENT_TRIANGLE &&
           (triangle_lies_behind(set, i, j) || triangle_lies_behind(set, j, i));
}

/* Judges one pair. May send rays and write the link's weight, near and rays. *carried: the error of a pair
 * that shall be split, power. */
static verdict judge_pair(const fct_elements *set, fct_link *link, double epsilon, float *carried,
                          uint32_t *rays) {
    const fct_element *i = &set->items[link->receiver], *j = &set->items[link->source];
    if (i->area <= 0 || j->area <= 0) return DROP;
    fct_pair pair = fct_pair_place(i, j);
    bool self = link->receiver == link->source;
    if (self && i->kind == FCT_ELEMENT_TRIANGLE) return DROP;
    if (pair_faces_away(i, j, &pair) || triangles_face_away(set, i, j)) return DROP;
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
    *carried = (float)(flow * error);
    if (may_split && flow * error > epsilon) {
        if (!pair.overlap && can_i && can_j) return source > receiver ? SPLIT_SOURCE : SPLIT_RECEIVER;
        return larger;
    }
    if (i->kind == FCT_ELEMENT_VOLUME && pair.overlap && may_split) return larger;
    if (link->rays == 0) *rays += sample_link(set, link, &pair);
    if (!may_split || link->near) return KEEP;
    double v = link->weight, shadow = flow * sqrt(v * (1 - v));
    *carried = (float)shadow;
    return shadow > epsilon ? larger : KEEP;
}

static void judge_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    judging *r = user;
    uint32_t rays = 0;
    (void)thread;
    for (size_t k = begin; k < end; ++k)
        r->verdicts[k] = (uint8_t)judge_pair(r->set, &r->pairs[k], r->epsilon, &r->errors[k], &rays);
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

static fct_result append_pair(const fct_env *env, pair_list *list, fct_link pair) {
    fct_result result =
        fct_grow(env, (void **)&list->items, &list->capacity, list->count + 1, sizeof *list->items);
    if (result == FCT_OK) list->items[list->count++] = pair;
    return result;
}

/* Splits a pair: opens the element `id` if it is closed. */
static fct_result split_pair(fct_elements *set, const fct_link *pair, uint32_t id, pair_list *next) {
    fct_result result = FCT_OK;
    if (fct_element_is_leaf(&set->items[id])) result = fct_elements_split(set, id);
    return result == FCT_OK ? append_split(set, pair, id, next) : result;
}

static uint32_t find_opened(const fct_link *pair, uint8_t decision) {
    return decision == SPLIT_RECEIVER ? pair->receiver : pair->source;
}

/* Judges all pairs. r->verdicts and r->errors are the caller's to release, also after a failure. */
static fct_result judge_pairs(fct_elements *set, const pair_list *pairs, double epsilon, judging *r,
                              uint64_t *rays) {
    const fct_env *env = set->env;
    const size_t chunks = fct_chunk_count(pairs->count, 256);
    *r = (judging){.set = set, .pairs = pairs->items, .epsilon = epsilon};
    const fct_array arrays[] = {FCT_ARRAY(r->verdicts, pairs->count), FCT_ARRAY(r->errors, pairs->count),
                                FCT_ARRAY(r->rays, chunks)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "the links");
    if (result != FCT_OK) return result;
    fct_elements_make_points(set);
    fct_parallel_for(env, pairs->count, 256, judge_chunk, r);
    for (size_t c = 0; c < chunks; ++c) *rays += r->rays[c];
    fct_release(env, r->rays);
    return FCT_OK;
}

static void release_verdicts(const fct_env *env, judging *r) {
    fct_release(env, r->verdicts);
    fct_release(env, r->errors);
}

/* --- Without a limit in the way --- */

/* Carries out the verdicts: kept pairs go to `kept`, the children of split ones to `next`. *over: there would
 * be more than `most` links and open pairs. */
static fct_result apply_verdicts(fct_elements *set, pair_list *kept, const judging *r, size_t count,
                                 pair_list *next, size_t most, bool *over) {
    fct_result result = FCT_OK;
    for (size_t k = 0; k < count && result == FCT_OK && !*over; ++k) {
        const fct_link *pair = &r->pairs[k];
        if (r->verdicts[k] == KEEP) result = append_pair(set->env, kept, *pair);
        if (r->verdicts[k] == SPLIT_RECEIVER || r->verdicts[k] == SPLIT_SOURCE)
            result = split_pair(set, pair, find_opened(pair, r->verdicts[k]), next);
        *over = kept->count + next->count > most;
    }
    return result;
}

static fct_result show_links(const fct_elements *set, const fct_refine_def *def) {
    return fct_progress(set->env, def->phase, def->done);
}

/* Refines all pairs of `start`, which stays. *over: the limit is too small; then `kept` is of no use. */
static fct_result refine_freely(fct_elements *set, const pair_list *start, const fct_refine_def *def,
                                pair_list *kept, uint64_t *rays, bool *over) {
    const fct_env *env = set->env;
    pair_list pairs = *start;
    fct_result result = FCT_OK;
    while (pairs.count > 0 && result == FCT_OK && !*over) {
        if ((result = show_links(set, def)) != FCT_OK) break;
        judging r;
        pair_list next = {0};
        result = judge_pairs(set, &pairs, def->epsilon, &r, rays);
        if (result == FCT_OK) {
            result = apply_verdicts(set, kept, &r, pairs.count, &next, def->most, over);
            release_verdicts(env, &r);
        }
        if (pairs.items != start->items) fct_release(env, pairs.items);
        pairs = next;
    }
    if (pairs.items != start->items) fct_release(env, pairs.items);
    return result;
}

/* --- At the limit --- */

/* A pair that shall be split. */
typedef struct waiting {
    fct_link pair;
    uint32_t opened; /* the end that a split opens */
    float error;     /* power */
} waiting;

typedef struct waiting_list {
    waiting *items;
    size_t count, capacity;
} waiting_list;

/* Kept pairs go to `kept`, those that shall be split wait. */
static fct_result sort_verdicts(const fct_elements *set, const judging *r, size_t count, pair_list *kept,
                                waiting_list *list) {
    fct_result result =
        fct_grow(set->env, (void **)&list->items, &list->capacity, list->count + count, sizeof *list->items);
    for (size_t k = 0; k < count && result == FCT_OK; ++k) {
        const fct_link *pair = &r->pairs[k];
        if (r->verdicts[k] == KEEP) result = append_pair(set->env, kept, *pair);
        if (r->verdicts[k] == SPLIT_RECEIVER || r->verdicts[k] == SPLIT_SOURCE)
            list->items[list->count++] = (waiting){*pair, find_opened(pair, r->verdicts[k]), r->errors[k]};
    }
    return result;
}

/* Largest error first; no two pairs are equal. */
static int compare_waiting(const void *a, const void *b) {
    const waiting *x = a, *y = b;
    if (x->error != y->error) return x->error < y->error ? 1 : -1;
    if (x->pair.receiver != y->pair.receiver) return x->pair.receiver < y->pair.receiver ? -1 : 1;
    return x->pair.source < y->pair.source ? -1 : 1;
}

static float find_largest_error(const waiting_list *list) {
    float largest = 0;
    for (size_t k = 0; k < list->count; ++k) largest = fmaxf(largest, list->items[k].error);
    return largest;
}

/* The number of pairs that replace this one, before it is split. */
static size_t count_parts(const fct_elements *set, const waiting *w) {
    const fct_element *e = &set->items[w->opened];
    const size_t n = e->child_count ? e->child_count : e->kind == FCT_ELEMENT_TRIANGLE ? 4 : 2;
    return w->pair.receiver == w->pair.source ? n * n : n;
}

/* Moves the pairs with errors of at least `least` to the front, each part in its order. Returns their number.
 */
static size_t choose_waiting(const fct_env *env, waiting_list *list, float least, fct_result *result) {
    waiting *others = fct_allocate(env, list->count, sizeof *others);
    size_t chosen = 0, rest = 0;
    if (!others) {
        *result = fct_fail_memory(env, "the links");
        return 0;
    }
    for (size_t k = 0; k < list->count; ++k)
        if (list->items[k].error >= least)
            list->items[chosen++] = list->items[k];
        else
            others[rest++] = list->items[k];
    memcpy(list->items + chosen, others, rest * sizeof *others);
    fct_release(env, others);
    return chosen;
}

/* Splits the pairs with the largest errors. Where there is no room for the parts of all, half of the room is
 * left for these parts, which may have larger errors than the pairs that wait. */
static fct_result split_largest(fct_elements *set, waiting_list *list, size_t room, pair_list *next) {
    fct_result result = FCT_OK;
    const float least = (float)LIMITED_SHARE * find_largest_error(list);
    const size_t chosen = choose_waiting(set->env, list, least, &result);
    size_t wanted = 0, split = 0;
    for (size_t k = 0; k < chosen; ++k) wanted += count_parts(set, &list->items[k]) - 1;
    const size_t left = wanted > room ? room / 2 : 0;
    if (wanted > room) qsort(list->items, chosen, sizeof *list->items, compare_waiting);
    for (; split < chosen && result == FCT_OK; ++split) {
        const waiting *w = &list->items[split];
        const size_t more = count_parts(set, w) - 1;
        if (more > room || (split > 0 && more + left > room)) break;
        room -= more;
        result = split_pair(set, &w->pair, w->opened, next);
    }
    memmove(list->items, list->items + split, (list->count - split) * sizeof *list->items);
    list->count -= split;
    return result;
}

static void sample_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    judging *r = user;
    (void)thread;
    r->rays[chunk] = 0;
    for (size_t k = begin; k < end; ++k) {
        fct_link *link = &r->pairs[k];
        const fct_element *items = r->set->items;
        if (link->rays) continue;
        const fct_pair pair = fct_pair_place(&items[link->receiver], &items[link->source]);
        r->rays[chunk] += sample_link(r->set, link, &pair);
    }
}

/* The pairs that still wait become links. */
static fct_result keep_waiting(const fct_elements *set, const waiting_list *list, pair_list *kept,
                               uint64_t *rays) {
    const fct_env *env = set->env;
    const size_t first = kept->count, chunks = fct_chunk_count(list->count, 256);
    fct_result result = FCT_OK;
    for (size_t k = 0; k < list->count && result == FCT_OK; ++k)
        result = append_pair(env, kept, list->items[k].pair);
    if (result != FCT_OK || chunks == 0) return result;
    judging r = {.set = set, .pairs = kept->items + first};
    r.rays = fct_allocate(env, chunks, sizeof *r.rays);
    if (!r.rays) return fct_fail_memory(env, "the links");
    fct_parallel_for(env, list->count, 256, sample_chunk, &r);
    for (size_t c = 0; c < chunks; ++c) *rays += r.rays[c];
    fct_release(env, r.rays);
    return FCT_OK;
}

/* Refines the pairs of `start` in the order of their errors, up to the limit. */
static fct_result refine_limited(fct_elements *set, const pair_list *start, const fct_refine_def *def,
                                 pair_list *kept, fct_refine_result *out, uint64_t *rays) {
    const fct_env *env = set->env;
    pair_list pairs = *start;
    waiting_list list = {0};
    fct_result result = FCT_OK;
    while (result == FCT_OK) {
        if ((result = show_links(set, def)) != FCT_OK) break;
        judging r;
        result = judge_pairs(set, &pairs, def->epsilon, &r, rays);
        if (result != FCT_OK) break;
        result = sort_verdicts(set, &r, pairs.count, kept, &list);
        release_verdicts(env, &r);
        if (pairs.items != start->items) fct_release(env, pairs.items);
        pairs = (pair_list){0};
        const size_t used = kept->count + list.count;
        if (result == FCT_OK && used < def->most)
            result = split_largest(set, &list, def->most - used, &pairs);
        if (pairs.count == 0) break;
    }
    if (pairs.items != start->items) fct_release(env, pairs.items);
    if (result == FCT_OK) result = keep_waiting(set, &list, kept, rays);
    out->limited = list.count > 0;
    out->epsilon = fct_max(def->epsilon, find_largest_error(&list));
    fct_release(env, list.items);
    return result;
}

fct_result fct_links_refine(fct_elements *set, fct_links *links, const fct_refine_def *def,
                            fct_refine_result *out) {
    const pair_list start = {.items = links->items, .count = links->count};
    const size_t count = set->count;
    pair_list kept = {0};
    bool over = def->limited;
    *out = (fct_refine_result){.epsilon = def->epsilon};
    fct_result result = FCT_OK;
    if (!over) result = refine_freely(set, &start, def, &kept, &links->rays, &over);
    if (result == FCT_OK && over) {
        fct_elements_truncate(set, count);
        kept.count = 0;
        result = refine_limited(set, &start, def, &kept, out, &links->rays);
    }
    if (result != FCT_OK) { /* as before the call */
        fct_release(set->env, kept.items);
        fct_elements_truncate(set, count);
        return result;
    }
    fct_release(set->env, start.items);
    links->items = kept.items, links->count = kept.count, links->capacity = kept.capacity;
    return fct_links_sort(set, links);
}
