/* tools/kit/progress.h: the progress bar: one percentage and one remaining time for the whole run.
 *
 * A command lists the stages of its run in order, each with its usual share of the time. A stage that the run
 * skips does not count. The bar is drawn ten times per second on a terminal. Elsewhere it is a line per
 * second, and one at the start of each stage.
 */
#ifndef FCT_TOOLS_PROGRESS_H
#define FCT_TOOLS_PROGRESS_H

#include <stdbool.h>

/* Phases of the library that make up a stage, as "first|second". The first one tells how far the stage is;
 * the others repeat within it and are shown alone. */
typedef struct tool_stage {
    const char *phases; /* NULL ends a list */
    double share;       /* of the time, relative to the other stages */
} tool_stage;

/* The stages of a tree from a mesh file. */
#define TOOL_TREE_STAGES                                                                                     \
    {"read", 5}, {"dual graph", 10}, {"clusters", 45}, {"order", 7}, {"boxes", 15}, {                        \
        "boxes of large clusters", 2                                                                         \
    }

typedef struct tool_progress {
    const tool_stage *stages; /* NULL: no remaining time */
    double items;             /* the work that 100 % of a phase stands for; 0: unknown */
    const char *unit;         /* of items */
    bool shown, terminal;

    /* Private to progress.c. */
    int stage;                                     /* in stages; -1 before the first */
    double passed;                                 /* shares of the stages that are done */
    double stage_done;                             /* of the present stage, 0 to 1 */
    double start, stage_start, phase_start, drawn; /* seconds */
    char phase[64];
    bool visible; /* the bar stands on the terminal's last line */
} tool_progress;

/* Drawn where standard error is a terminal, and elsewhere if `forced`. */
void tool_progress_start(tool_progress *p, const tool_stage *stages, bool forced, double now);
/* A phase is done to the share `done`. */
void tool_progress_show(tool_progress *p, const char *phase, double done, double now);
/* The share of the whole run that is done. */
double tool_progress_whole(const tool_progress *p);
/* Seconds until the end, INFINITY while nothing is known: the present stage by its own speed once 5 % of it
 * are done, the later ones by the speed of the whole run. */
double tool_progress_left(const tool_progress *p, double now);
/* Removes the bar from the terminal, so that a message can be printed. */
void tool_progress_clear(tool_progress *p);

#endif
