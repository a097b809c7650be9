/* bvh/pair/bodies.c: all pairs of bodies that touch.
 *
 * Broad phase: the root box of each body has bounds in the world. Bodies are sorted by the lower end of their
 * bounds along the axis on which their centres spread most, and each is compared with those that begin before
 * it ends. Narrow phase: the pairs that are left run on all threads. The order of the result is that of the
 * bodies' numbers.
 */
#include "base/key.h"
#include "base/parallel.h"
#include "base/sort.h"
#include "bvh/model.h"
#include "bvh/pair/pose.h"

enum { PAIR_CHUNK = 8 /* pairs per task */ };

typedef struct world_bounds {
    double lower[3], upper[3];
} world_bounds;

typedef struct touch_job {
    const fct_body *bodies;
    size_t count;
    fct_body_pair *candidates;
} touch_job;

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
                                  const uint32_t *order, int axis, touch_job *job) {
    size_t capacity = 0;
    for (uint32_t i = 0; i < count; ++i) {
        const world_bounds *a = &bounds[order[i]];
        for (uint32_t j = i + 1; j < count && bounds[order[j]].lower[axis] <= a->upper[axis]; ++j) {
            if (!bounds_meet(a, &bounds[order[j]])) continue;
            fct_result result =
                fct_grow(env, (void **)&job->candidates, &capacity, job->count + 1, sizeof *job->candidates);
            if (result != FCT_OK) return result;
            uint32_t first = order[i] < order[j] ? order[i] : order[j], second = order[i] ^ order[j] ^ first;
            job->candidates[job->count++] = (fct_body_pair){.body_a = first, .body_b = second};
        }
    }
    return FCT_OK;
}

/* Sorts the bodies, and lists the candidates ordered by their numbers. */
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
        if (result == FCT_OK) result = list_candidates(env, count, bounds, order, axis, job);
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
        fct_body_pair *pair = &job->candidates[i];
        const fct_body *a = &job->bodies[pair->body_a], *b = &job->bodies[pair->body_b];
        fct_pose pose = fct_pose_relate(&a->pose, &b->pose);
        pair->faces = fct_face_pair_none();
        fct_bvh_overlap(a->bvh, b->bvh, &pose, &pair->faces, NULL);
    }
}

/* Moves the pairs that touch to `pairs`, in order. */
static fct_result sort_touching(const fct_env *env, const touch_job *job, size_t capacity,
                                fct_body_pair *pairs, size_t *found) {
    uint64_t *keys = fct_allocate(env, job->count, sizeof *keys);
    uint32_t *order = fct_allocate(env, job->count, sizeof *order);
    fct_result result = keys && order ? FCT_OK : fct_fail_memory(env, "pairs of bodies");
    size_t count = 0;
    for (size_t i = 0; i < job->count && result == FCT_OK; ++i) {
        if (job->candidates[i].faces.face_a == FCT_NONE) continue;
        keys[count] = fct_pair_key(job->candidates[i].body_a, job->candidates[i].body_b);
        order[count++] = (uint32_t)i;
    }
    if (result == FCT_OK) result = fct_sort_pairs(env, keys, order, count);
    for (size_t i = 0; i < count && i < capacity && result == FCT_OK; ++i)
        pairs[i] = job->candidates[order[i]];
    *found = result == FCT_OK ? count : 0;
    fct_release(env, keys);
    fct_release(env, order);
    return result;
}

fct_result fct_bodies_touching(const fct_env *env, uint32_t count, const fct_body *bodies, size_t capacity,
                               fct_body_pair *pairs, size_t *found) {
    *found = 0;
    fct_result result = check_bodies(env, count, bodies);
    if (result != FCT_OK || count == 0) return result;
    touch_job job = {.bodies = bodies};
    result = run_broad_phase(env, count, &job);
    if (result == FCT_OK && job.count > UINT32_MAX) result = fct_fail_memory(env, "pairs of bodies");
    if (result == FCT_OK)
        result =
            fct_parallel_for_progress(env, "pairs of bodies", job.count, PAIR_CHUNK, test_candidates, &job);
    if (result == FCT_OK) result = sort_touching(env, &job, capacity, pairs, found);
    fct_release(env, job.candidates);
    return result;
}
