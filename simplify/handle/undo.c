/* simplify/handle/undo.c: runs of a handle with a way back, and the way back.
 *
 * 1. Find the run that passed the wanted number of faces.
 * 2. Restore the last snapshot before it, and repeat the runs up to it.
 * 3. Repeat this run, but only to the wanted number.
 * 4. Paint and constrain as the caller did since the snapshot.
 * Runs depend on nothing but the state, so each repetition gives the same bits. Cost: that of the runs since
 * the snapshot.
 */
#include "simplify/handle/handle.h"
#include "simplify/handle/history.h"
#include "simplify/handle/wish.h"

/* Contracts, and notes the run. A failure takes it back. */
static fct_result run_noted(fct_simplifier *s, uint32_t target_faces, double max_error, fct_stop *stop) {
    fct_history *h = s->history;
    fct_guard guard;
    const fct_history_entry run = {s->live_faces, target_faces, max_error, NULL, 0};
    fct_result result = fct_guard_open(s, &guard);
    if (result == FCT_OK)
        result = fct_grow(s->env, (void **)&h->entries, &h->capacity, h->count + 1, sizeof *h->entries);
    if (result == FCT_OK) {
        result = fct_handle_contract(s, target_faces, max_error, stop);
        if (result == FCT_OK)
            fct_history_add(h, run, &guard.bytes);
        else
            fct_guard_restore(s, &guard);
    }
    fct_guard_close(s->env, &guard);
    return result;
}

static fct_result run_handle(fct_simplifier *s, uint32_t target_faces, double max_error, fct_stop *stop) {
    *stop = FCT_STOP_FACES;
    if (s->live_faces <= target_faces) return FCT_OK;
    return s->history ? run_noted(s, target_faces, max_error, stop)
                      : fct_handle_contract(s, target_faces, max_error, stop);
}

fct_result fct_simplifier_run(fct_simplifier *s, uint32_t target_faces, double max_error,
                              fct_simplify_stats *stats) {
    double start = fct_seconds();
    fct_simplify_stats found = {.faces_before = s->live_faces};
    if (!(max_error >= 0))
        return fct_fail(s->env, FCT_ERROR_DATA, "max_error is %g, expected at least 0", max_error);
    fct_result result = run_handle(s, target_faces, max_error, &found.stopped_because);
    if (result != FCT_OK) return result;
    found.faces_after = s->live_faces;
    found.max_cost = sqrt(s->max_error2) * s->extent;
    found.seconds_contract = fct_seconds() - start;
    if (stats) *stats = found;
    return FCT_OK;
}

/* Restores the snapshot of entry `first`, and repeats the runs up to entry `last`. */
static fct_result repeat_runs(fct_simplifier *s, size_t first, size_t last) {
    const fct_history_entry *e = s->history->entries;
    const char *fault;
    fct_stop stop;
    fct_source source = {e[first].snapshot, e[first].snapshot + e[first].size};
    fct_result result = fct_live_read(s, &source, NULL, &fault);
    for (size_t i = first; i < last && result == FCT_OK; ++i)
        result = fct_handle_contract(s, e[i].target_faces, e[i].max_error, &stop);
    return result;
}

/* Goes back to the beginning of entry `last` or, if that has more, to `faces`, with the current paint and
 * constraints. */
static fct_result go_back(fct_simplifier *s, size_t last, uint32_t faces, const fct_wishes *wishes) {
    fct_history *h = s->history;
    fct_stop stop;
    size_t first = last;
    while (!h->entries[first].snapshot) --first;
    fct_result result = repeat_runs(s, first, last);
    if (result == FCT_OK && s->live_faces > faces)
        result = fct_handle_contract(s, faces, h->entries[last].max_error, &stop);
    return result == FCT_OK ? fct_wishes_apply(s, wishes) : result;
}

fct_result fct_simplifier_undo(fct_simplifier *s, uint32_t faces) {
    fct_history *h = s->history;
    fct_guard guard;
    fct_wishes wishes;
    if (!h) return fct_fail(s->env, FCT_ERROR_DATA, "the simplifier has forgotten its runs");
    if (h->count == 0 || faces <= s->live_faces) return FCT_OK;
    size_t last = h->count - 1;
    while (last > 0 && h->entries[last].faces < faces) --last;
    bool partly = h->entries[last].faces > faces;
    fct_result result = fct_guard_open(s, &guard);
    if (result == FCT_OK) result = fct_wishes_copy(s, &wishes);
    if (result == FCT_OK) {
        result = go_back(s, last, faces, &wishes);
        if (result != FCT_OK) fct_guard_restore(s, &guard);
        fct_wishes_release(s->env, &wishes);
    }
    if (result == FCT_OK) {
        if (partly) h->entries[last].target_faces = faces;
        fct_history_cut(s->env, h, last + partly);
        h->broken = true;
    }
    fct_guard_close(s->env, &guard);
    return result;
}

void fct_simplifier_forget(fct_simplifier *s) {
    fct_history_destroy(s->env, s->history);
    s->history = NULL;
}
