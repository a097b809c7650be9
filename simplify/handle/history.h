/* simplify/handle/history.h: the way back of a handle: its runs, and snapshots before some of them.
 *
 *     snapshot 100k --run--> 80k --run--> 60k        A run keeps a snapshot if the mesh has at most half the
 *     snapshot 45k  --run--> 20k                     faces of the snapshot before, or if paint or constraints
 *                                                    have changed. So all snapshots together are about twice
 *     as large as the first one. A way back repeats the runs since a snapshot.
 */
#ifndef FCT_SIMPLIFY_HISTORY_H
#define FCT_SIMPLIFY_HISTORY_H

#include "simplify/handle/live.h"

/* A run. */
typedef struct fct_history_entry {
    uint32_t faces, target_faces; /* before the run, and its target */
    double max_error;
    unsigned char *snapshot; /* of the state before the run; NULL: repeat the runs since an earlier one */
    size_t size;
} fct_history_entry;

typedef struct fct_history {
    fct_history_entry *entries;
    size_t count, capacity;
    bool broken; /* paint or constraints have changed: the next run keeps a snapshot */
} fct_history;

/* Releases the entries from `first` on. */
void fct_history_cut(const fct_env *env, fct_history *history, size_t first);
/* NULL is allowed. */
void fct_history_destroy(const fct_env *env, fct_history *history);
/* Appends a run, for which there is room, and moves the snapshot into it if it is worth keeping. */
void fct_history_add(fct_history *history, fct_history_entry run, fct_sink *snapshot);

/* A way back to the state at its opening, which needs no memory then. */
typedef struct fct_guard {
    fct_sink bytes;
    fct_live_room room;
} fct_guard;

/* Errors: MEMORY. Close the guard also then. */
fct_result fct_guard_open(fct_simplifier *s, fct_guard *guard);
void fct_guard_restore(fct_simplifier *s, fct_guard *guard);
void fct_guard_close(const fct_env *env, fct_guard *guard);

#endif
