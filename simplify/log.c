/* simplify/log.c: see log.h. Cost of a record: O(valence + wedges^2).
 *
 * Keys: the key of a contraction is the bucket of its cost, but at least the key of every earlier contraction
 * that changed the faces around its ends. So a sort by key moves no contraction before one on which it
 * depends. One queue for all edges gives buckets in ascending order, and then the sort changes nothing.
 */
#include "simplify/log.h"

#include "simplify/cost/constraint.h"
#include "simplify/topology/ring.h"

fct_result fct_log_create(fct_simplifier *s) {
    fct_log *log = s->log = fct_allocate_zero(s->env, 1, sizeof *log);
    if (!log) return fct_fail_memory(s->env, "a log");
    /* A contraction takes a point, a wall takes a face. */
    size_t records = (size_t)s->point_count + (s->next_pairs ? s->face_count : 0);
    const fct_array arrays[] = {FCT_ARRAY(log->records, records), FCT_ARRAY_ZERO(log->keys, s->point_count),
                                FCT_ARRAY(log->locked, s->point_count)};
    fct_result result = fct_allocate_all(s->env, arrays, FCT_LENGTH(arrays), "a log");
    for (uint32_t p = 0; p < s->point_count && result == FCT_OK; ++p) log->locked[p] = point_is_locked(s, p);
    return result;
}

void fct_log_destroy(const fct_env *env, fct_log *log) {
    if (!log) return;
    void *arrays[] = {log->records, log->wedges, log->values, log->keys, log->locked, log};
    for (size_t i = 0; i < FCT_LENGTH(arrays); ++i) fct_release(env, arrays[i]);
}

/* Room for `more` wedges. */
static fct_result grow_wedges(fct_simplifier *s, size_t more) {
    fct_log *log = s->log;
    size_t needed = log->wedge_count + more;
    if (needed > FCT_NONE) return fct_fail_memory(s->env, "a log of more than 2^32 wedges");
    fct_result result =
        fct_grow(s->env, (void **)&log->wedges, &log->wedge_capacity, needed, sizeof *log->wedges);
    return result != FCT_OK ? result
                            : fct_grow(s->env, (void **)&log->values, &log->value_capacity,
                                       needed * s->channel_count, sizeof *log->values);
}

fct_result fct_log_reserve(fct_simplifier *s) {
    return s->channel_count ? grow_wedges(s, SIMPLIFY_MAX_WEDGES) : FCT_OK;
}

static uint16_t find_highest_key(const fct_simplifier *s, uint32_t corner, uint16_t key) {
    for (uint32_t k = 0; k < 3; ++k) {
        uint32_t p = s->triangles[corner - corner % 3 + k];
        if (s->log->keys[p] > key) key = s->log->keys[p];
    }
    return key;
}

/* Whether a face that remains joins x to the point that replaces a and b. */
static bool stays_joined(const fct_simplifier *s, uint32_t x, uint32_t a, uint32_t b) {
    for (uint32_t c = point_at(s, x)->first_corner; c != FCT_NONE; c = s->next_corners[c]) {
        const uint32_t *t = s->triangles + (c - c % 3);
        if (corner_dead(s, c)) continue;
        bool at_a = t[0] == a || t[1] == a || t[2] == a, at_b = t[0] == b || t[1] == b || t[2] == b;
        if (at_a != at_b) return true;
    }
    return false;
}

/* The apexes of the faces between a and b lose these faces. Those that stay joined to the new point meet its
 * key later; the others need the key themselves. */
static void raise_apexes(fct_simplifier *s, uint32_t a, uint32_t b, uint32_t count_b, uint16_t key) {
    for (uint32_t i = 0; i < count_b; ++i) {
        uint32_t x = fct_simplify_find_apex(s, s->ring_b[i], a);
        if (x != FCT_NONE && s->log->keys[x] < key && !stays_joined(s, x, a, b)) s->log->keys[x] = key;
    }
}

void fct_log_begin(fct_simplifier *s, uint32_t a, uint32_t b, uint32_t count_b) {
    fct_log *log = s->log;
    uint16_t key = (uint16_t)s->queue->current;
    for (uint32_t i = 0; i < count_b; ++i) key = find_highest_key(s, s->ring_b[i], key);
    /* A hub does not move, so the faces at it that b does not share stay as they are. */
    if (point_at(s, a)->valence <= SIMPLIFY_HUB)
        for (uint32_t c = point_at(s, a)->first_corner; c != FCT_NONE; c = s->next_corners[c])
            if (!corner_dead(s, c)) key = find_highest_key(s, c, key);
    log->keys[a] = key;
    raise_apexes(s, a, b, count_b, key);
    log->records[log->count] =
        (fct_record){.kept = a, .gone = b, .key = key, .first_wedge = (uint32_t)log->wedge_count};
}

static void write_wedge(const fct_simplifier *s, uint32_t wedge, float *to) {
    const double *from = s->attributes + (size_t)s->channel_count * wedge;
    for (uint32_t i = 0; i < s->channel_count; ++i) to[i] = (float)(from[i] / s->channels[i].factor);
}

void fct_log_end(fct_simplifier *s, double error) {
    fct_log *log = s->log;
    fct_record *record = &log->records[log->count];
    write_point(s, record->kept, record->at);
    record->error = (float)fct_min(error * s->extent, (double)FLT_MAX); /* a file has no infinite errors */
    for (uint32_t w = s->channel_count ? s->first_wedges[record->kept] : FCT_NONE; w != FCT_NONE;
         w = s->next_wedges[w]) {
        write_wedge(s, w, log->values + s->channel_count * log->wedge_count);
        log->wedges[log->wedge_count++] = w;
        ++record->wedge_count;
    }
    ++log->count;
}

/* The points of the faces get the key, so that later contractions of these points come after the wall. */
void fct_log_wall(fct_simplifier *s, uint32_t first, uint32_t second) {
    fct_log *log = s->log;
    const fct_record *last = &log->records[log->count - 1];
    log->records[log->count] = (fct_record){.kept = first == FCT_NONE ? FCT_NONE : first / 3,
                                            .gone = second / 3,
                                            .key = last->key,
                                            .error = last->error,
                                            .first_wedge = (uint32_t)log->wedge_count,
                                            .wall = true};
    for (uint32_t k = 0; k < 3; ++k) {
        uint16_t *key = &log->keys[s->triangles[second - second % 3 + k]];
        if (*key < last->key) *key = last->key;
    }
    ++log->count;
}

fct_result fct_log_split(fct_simplifier *s, uint32_t blocks, uint32_t records, uint32_t wedges,
                         fct_log **out) {
    *out = NULL;
    if (!s->log) return FCT_OK;
    if (!s->channel_count) wedges = 0;
    size_t wedge_room = (size_t)blocks * wedges;
    fct_log all = {0}, *logs;
    const fct_array arrays[] = {FCT_ARRAY(logs, blocks), FCT_ARRAY(all.records, (size_t)blocks * records),
                                FCT_ARRAY(all.wedges, wedge_room),
                                FCT_ARRAY(all.values, wedge_room * s->channel_count)};
    fct_result result = fct_allocate_all(s->env, arrays, FCT_LENGTH(arrays), "the logs of a sweep");
    if (result != FCT_OK) return result;
    for (size_t b = 0; b < blocks; ++b)
        logs[b] = (fct_log){.records = all.records + b * records,
                            .wedges = all.wedges + b * wedges,
                            .values = all.values + b * wedges * s->channel_count,
                            .keys = s->log->keys};
    *out = logs;
    return FCT_OK;
}

fct_result fct_log_join(fct_simplifier *s, fct_log *logs, uint32_t blocks) {
    if (!logs) return FCT_OK;
    fct_log *to = s->log;
    fct_result result = FCT_OK;
    for (uint32_t b = 0; b < blocks && result == FCT_OK; ++b) {
        const fct_log *from = &logs[b];
        if (s->channel_count) result = grow_wedges(s, from->wedge_count);
        if (result != FCT_OK) break;
        for (uint32_t i = 0; i < from->count; ++i) {
            to->records[to->count] = from->records[i];
            to->records[to->count++].first_wedge += (uint32_t)to->wedge_count;
        }
        if (from->wedge_count) {
            size_t n = s->channel_count;
            memcpy(to->wedges + to->wedge_count, from->wedges, from->wedge_count * sizeof *to->wedges);
            memcpy(to->values + n * to->wedge_count, from->values,
                   n * from->wedge_count * sizeof *to->values);
            to->wedge_count += from->wedge_count;
        }
    }
    void *arrays[] = {logs->records, logs->wedges, logs->values, logs};
    for (size_t i = 0; i < FCT_LENGTH(arrays); ++i) fct_release(s->env, arrays[i]);
    return result;
}
