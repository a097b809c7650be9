/* bvh/pair/bodies.c: all pairs of bodies that touch.
 *
 * Broad phase: the root box of each body has bounds in the world. Bodies are sorted by the lower end of their
 * bounds along the axis on which their centres spread most, and each is compared with those that begin before
 * it ends. Narrow phase: the pairs that are left are ordered by the bodies' numbers, take their hints from
 * the last frame, and run on all threads.
 */
#include <stddef.h>
#include <string.h>

#include "base/key.h"
#include "base/parallel.h"
#include "base/sort.h"
#include "bvh/model.h"
#include "bvh/pair/pose.h"

enum { PAIR_CHUNK = 8 /* pairs per task */ };

typedef struct world_bounds {
    double lower[3], upper[3];
} world_bounds;

/* A pair of bodies whose bounds meet. */
typedef struct body_candidate {
    uint32_t body_a, body_b;
    fct_face_pair faces; /* FCT_NONE if the bodies do not touch */
} body_candidate;

typedef struct candidate_list {
    size_t count, capacity;
    body_candidate *list;
    fct_pair_hint *hints; /* of the candidates; NULL without a tracker */
} candidate_list;

struct fct_body_tracker {
    const fct_env *env;
    candidate_list last; /* of the last frame, ordered by bodies */
};

typedef struct touch_job {
    const fct_body *bodies;
    candidate_list candidates;
} touch_job;

static void release_candidates(const fct_env *env, candidate_list *candidates) {
    fct_release(env, candidates->list);
    fct_release(env, candidates->hints);
}

static fct_result check_bodies(const fct_env *env, uint32_t count, const fct_body *bodies) {
    for (uint32_t i = 0; i < count; ++i) {
        double sum = 0, size = 0;
        for (int r = 0; r < 3; ++r) {
            sum += fabs(bodies[i].pose.translation[r]);
            for (int c = 0; c < 3; ++c) size += fabs(bodies[i].pose.rotation[r][c]);
        }
        if (!bodies[i].bvh->pairs) return fct_fail(env, FCT_ERROR_DATA, "body %u has no FCT_BVH_PAIRS", i);
        if (!(sum + size < INFINITY))
            return fct_fail(env, FCT_ERROR_DATA, "the pose of body %u is not finite", i);
        if (!fct_has_inverse(bodies[i].pose.rotation))
            return fct_fail(env, FCT_ERROR_DATA, "the rotation of body %u has no inverse", i);
    }
    return FCT_OK;
}

/* Bounds of the body's bounds under its pose, wider than rounding. */
static world_bounds bound_body(const fct_body *body) {
    const fct_bounds *b = &body->bvh->bounds;
    world_bounds out;
    for (int r = 0; r < 3; ++r) {
        double middle = body->pose.translation[r], half = 0, size = fabs(middle);
        for (int c = 0; c < 3; ++c) {
            double lower = (double)b->lower[c], upper = (double)b->upper[c], m = body->pose.rotation[r][c];
            middle += m * (lower + upper) / 2;
            half += fabs(m) * (upper - lower) / 2;
            size += fabs(m) * (fabs(lower) + fabs(upper));
        }
        half += 0x1p-40 * size;
        out.lower[r] = middle - half, out.upper[r] = middle + half;
    }
    return out;
}

static int find_widest_axis(uint32_t count, const world_bounds *bounds) {
    double widest = -1;
    int axis = 0;
    for (int k = 0; k < 3; ++k) {
        double sum = 0, square = 0;
        for (uint32_t i = 0; i < count; ++i) {
            double at = (bounds[i].lower[k] + bounds[i].upper[k]) / 2 - bounds[0].lower[k];
            sum += at, square += at * at;
        }
        double spread = square - sum * sum / count;
        if (spread > widest) widest = spread, axis = k;
    }
    return axis;
}

static bool bounds_meet(const world_bounds *a, const world_bounds *b) {
    for (int k = 0; k < 3; ++k)
        if (a->lower[k] > b->upper[k] || b->lower[k] > a->upper[k]) return false;
    return true;
}

/* Lists the pairs of bodies whose bounds meet. */
static fct_result list_candidates(const fct_env *env, uint32_t count, const world_bounds *bounds,
                                  const uint32_t *order, int axis, candidate_list *out) {
    for (uint32_t i = 0; i < count; ++i) {
        const world_bounds *a = &bounds[order[i]];
        for (uint32_t j = i + 1; j < count && bounds[order[j]].lower[axis] <= a->upper[axis]; ++j) {
            if (!bounds_meet(a, &bounds[order[j]])) continue;
            fct_result result =
                fct_grow(env, (void **)&out->list, &out->capacity, out->count + 1, sizeof *out->list);
            if (result != FCT_OK) return result;
            uint32_t first = order[i] < order[j] ? order[i] : order[j], second = order[i] ^ order[j] ^ first;
            out->list[out->count++] =
                (body_candidate){.body_a = first, .body_b = second, .faces = fct_face_pair_none()};
        }
    }
    return FCT_OK;
}

static uint64_t candidate_key(const body_candidate *c) {
    return fct_pair_key(c->body_a, c->body_b);
}

/* Orders the candidates by their bodies. */
static fct_result sort_candidates(const fct_env *env, candidate_list *candidates) {
    size_t count = candidates->count;
    if (count > UINT32_MAX) return fct_fail_memory(env, "pairs of bodies");
    uint64_t *keys = fct_allocate(env, count, sizeof *keys);
    uint32_t *order = fct_allocate(env, count, sizeof *order);
    body_candidate *sorted = fct_allocate(env, count, sizeof *sorted);
    fct_result result = keys && order && sorted ? FCT_OK : fct_fail_memory(env, "pairs of bodies");
    for (size_t i = 0; i < count && result == FCT_OK; ++i)
        keys[i] = candidate_key(&candidates->list[i]), order[i] = (uint32_t)i;
    if (result == FCT_OK) result = fct_sort_pairs(env, keys, order, count);
    if (result == FCT_OK) {
        for (size_t i = 0; i < count; ++i) sorted[i] = candidates->list[order[i]];
        body_candidate *list = candidates->list;
        *candidates = (candidate_list){count, count, sorted, NULL};
        sorted = list;
    }
    fct_release(env, sorted);
    fct_release(env, keys);
    fct_release(env, order);
    return result;
}

/* The pairs of a front that are not used need no copy. */
static void copy_hint(const fct_pair_hint *from, fct_pair_hint *to) {
    uint32_t used = from->touching ? 1 : from->front_count;
    memcpy(to, from, offsetof(fct_pair_hint, front) + used * sizeof from->front[0]);
}

/* Hints for all candidates: those of the last frame, or new ones. Both lists are ordered. */
static fct_result take_hints(const fct_env *env, const candidate_list *last, candidate_list *out) {
    const fct_pair_hint none = fct_pair_hint_none();
    out->hints = fct_allocate(env, out->count, sizeof *out->hints);
    if (!out->hints) return fct_fail_memory(env, "hints of bodies");
    for (size_t i = 0, j = 0; i < out->count; ++i) {
        uint64_t key = candidate_key(&out->list[i]);
        while (j < last->count && candidate_key(&last->list[j]) < key) ++j;
        bool known = j < last->count && candidate_key(&last->list[j]) == key;
        copy_hint(known ? &last->hints[j] : &none, &out->hints[i]);
    }
    return FCT_OK;
}

/* Sorts the bodies along an axis, and lists the candidates. */
static fct_result run_broad_phase(const fct_env *env, uint32_t count, touch_job *job) {
    world_bounds *bounds = fct_allocate(env, count, sizeof *bounds);
    uint64_t *keys = fct_allocate(env, count, sizeof *keys);
    uint32_t *order = fct_allocate(env, count, sizeof *order);
    fct_result result = bounds && keys && order ? FCT_OK : fct_fail_memory(env, "the bounds of bodies");
    if (result == FCT_OK) {
        for (uint32_t i = 0; i < count; ++i) bounds[i] = bound_body(&job->bodies[i]), order[i] = i;
        int axis = find_widest_axis(count, bounds);
        for (uint32_t i = 0; i < count; ++i) keys[i] = fct_double_key(bounds[i].lower[axis]);
        result = fct_sort_pairs(env, keys, order, count);
        if (result == FCT_OK) result = list_candidates(env, count, bounds, order, axis, &job->candidates);
    }
    fct_release(env, bounds);
    fct_release(env, keys);
    fct_release(env, order);
    return result;
}

static void test_candidates(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const touch_job *job = user;
    for (size_t i = begin; i < end; ++i) {
        body_candidate *c = &job->candidates.list[i];
        fct_pair_hint *hint = job->candidates.hints ? &job->candidates.hints[i] : NULL;
        const fct_body *a = &job->bodies[c->body_a], *b = &job->bodies[c->body_b];
        fct_pose pose = fct_pose_relate(&a->pose, &b->pose);
        if (!hint)
            fct_bvh_pairs(a->bvh, b->bvh, &pose, 1, 1, &c->faces, NULL, NULL);
        else if (fct_bvh_overlap(a->bvh, b->bvh, &pose, hint, NULL))
            c->faces = hint->pair;
    }
}

static size_t list_touching(const candidate_list *candidates, size_t capacity, fct_body_pair *pairs) {
    size_t found = 0;
    for (size_t i = 0; i < candidates->count; ++i) {
        const body_candidate *c = &candidates->list[i];
        if (c->faces.face_a == FCT_NONE) continue;
        if (found < capacity) pairs[found] = (fct_body_pair){c->body_a, c->body_b, c->faces};
        ++found;
    }
    return found;
}

/* Fills job->candidates, which the caller releases. */
static fct_result find_touching(const fct_env *env, uint32_t count, fct_body_tracker *tracker,
                                touch_job *job) {
    fct_result result = check_bodies(env, count, job->bodies);
    if (result == FCT_OK && count) result = run_broad_phase(env, count, job);
    if (result == FCT_OK) result = sort_candidates(env, &job->candidates);
    if (result == FCT_OK && tracker) result = take_hints(env, &tracker->last, &job->candidates);
    if (result == FCT_OK)
        result = fct_parallel_for_progress(env, "pairs of bodies", job->candidates.count, PAIR_CHUNK,
                                           test_candidates, job);
    return result;
}

fct_result fct_bodies_touching(const fct_env *env, uint32_t count, const fct_body *bodies, size_t capacity,
                               fct_body_pair *pairs, size_t *found) {
    touch_job job = {.bodies = bodies};
    fct_result result = find_touching(env, count, NULL, &job);
    *found = result == FCT_OK ? list_touching(&job.candidates, capacity, pairs) : 0;
    release_candidates(env, &job.candidates);
    return result;
}

fct_result fct_body_tracker_create(const fct_env *env, fct_body_tracker **out) {
    *out = fct_allocate(env, 1, sizeof **out);
    if (!*out) return fct_fail_memory(env, "a tracker of bodies");
    **out = (fct_body_tracker){.env = env};
    return FCT_OK;
}

void fct_body_tracker_destroy(fct_body_tracker *tracker) {
    if (!tracker) return;
    release_candidates(tracker->env, &tracker->last);
    fct_release(tracker->env, tracker);
}

fct_result fct_body_tracker_touching(fct_body_tracker *tracker, uint32_t count, const fct_body *bodies,
                                     size_t capacity, fct_body_pair *pairs, size_t *found) {
    touch_job job = {.bodies = bodies};
    fct_result result = find_touching(tracker->env, count, tracker, &job);
    *found = result == FCT_OK ? list_touching(&job.candidates, capacity, pairs) : 0;
    candidate_list old = result == FCT_OK ? tracker->last : job.candidates;
    if (result == FCT_OK) tracker->last = job.candidates;
    release_candidates(tracker->env, &old);
    return result;
}
