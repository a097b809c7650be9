/* simplify/handle/history.c: see history.h. */
#include "simplify/handle/history.h"

/* A state without attributes has 110 to 117 bytes per face that is left. */
#define BYTES_PER_FACE 120

void fct_history_cut(const fct_env *env, fct_history *history, size_t first) {
    while (history->count > first) fct_release(env, history->entries[--history->count].snapshot);
}

void fct_history_destroy(const fct_env *env, fct_history *history) {
    if (!history) return;
    fct_history_cut(env, history, 0);
    fct_release(env, history->entries);
    fct_release(env, history);
}

void fct_history_add(fct_history *history, fct_history_entry run, fct_sink *snapshot) {
    uint32_t last = 0; /* faces of the last snapshot */
    for (size_t i = 0; i < history->count; ++i)
        if (history->entries[i].snapshot) last = history->entries[i].faces;
    if (history->broken || history->count == 0 || run.faces <= last / 2) {
        run.snapshot = snapshot->data, run.size = snapshot->count;
        snapshot->data = NULL;
        history->broken = false;
    }
    history->entries[history->count++] = run;
}

fct_result fct_guard_open(fct_simplifier *s, fct_guard *guard) {
    *guard = (fct_guard){.bytes = {.env = s->env}};
    size_t usual = (size_t)s->point_count * sizeof(uint32_t) + BYTES_PER_FACE * (size_t)s->live_faces;
    fct_result result = fct_grow(s->env, (void **)&guard->bytes.data, &guard->bytes.capacity, usual, 1);
    if (result == FCT_OK) result = fct_live_write(s, &guard->bytes);
    if (result != FCT_OK) return fct_fail_memory(s->env, "a way back");
    return fct_live_reserve(s, &guard->room);
}

void fct_guard_restore(fct_simplifier *s, fct_guard *guard) {
    const char *fault;
    fct_source source = {guard->bytes.data, guard->bytes.data + guard->bytes.count};
    (void)fct_live_read(s, &source, &guard->room, &fault); /* its own bytes have no fault */
}

void fct_guard_close(const fct_env *env, fct_guard *guard) {
    fct_release(env, guard->bytes.data);
    fct_live_release(env, &guard->room);
}
