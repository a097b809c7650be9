/* tools/kit/progress.c: see progress.h. */
#define _GNU_SOURCE
#include "tools/kit/progress.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { WIDTH = 28 /* characters of the bar */ };
/* Seconds before a remaining time is shown, and the share of a stage before its own speed counts. */
static const double SETTLED = 1, MEASURED = .05;

void tool_progress_start(tool_progress *p, const tool_stage *stages, bool forced, double now) {
    bool terminal = isatty(STDERR_FILENO);
    *p = (tool_progress){
        .stages = stages, .shown = forced || terminal, .terminal = terminal, .stage = -1, .start = now};
}

void tool_progress_clear(tool_progress *p) {
    if (p->visible) fputs("\r\033[K", stderr);
    p->visible = false;
}

/* The place of a name in "first|second|...", or -1. */
static int find_name(const char *names, const char *name) {
    size_t length = strlen(name);
    for (int place = 0;; ++place) {
        size_t end = strcspn(names, "|");
        if (end == length && !memcmp(names, name, length)) return place;
        if (!names[end]) return -1;
        names += end + 1;
    }
}

/* Moves to the stage of a phase, if that is the present one or a later one. Returns whether the phase leads
 * the present stage. */
static bool enter_stage(tool_progress *p, const char *phase, double now) {
    for (int i = p->stage < 0 ? 0 : p->stage; p->stages && p->stages[i].phases; ++i) {
        int place = find_name(p->stages[i].phases, phase);
        if (place < 0) continue;
        if (i > p->stage) {
            if (p->stage >= 0) p->passed += p->stages[p->stage].share;
            p->stage = i, p->stage_done = 0, p->stage_start = now, p->drawn = 0;
        }
        return place == 0;
    }
    return false;
}

static double sum_later_shares(const tool_progress *p) {
    double sum = 0;
    for (int i = p->stage + 1; p->stages[i].phases; ++i) sum += p->stages[i].share;
    return sum;
}

double tool_progress_whole(const tool_progress *p) {
    if (!p->stages || p->stage < 0) return 0;
    double share = p->stages[p->stage].share;
    return (p->passed + share * p->stage_done) / (p->passed + share + sum_later_shares(p));
}

double tool_progress_left(const tool_progress *p, double now) {
    double whole = tool_progress_whole(p), done = p->stage_done;
    if (whole <= 0) return INFINITY;
    double share = p->stages[p->stage].share;
    double second = (now - p->start) / (p->passed + share * done); /* per unit of share */
    double own = done >= MEASURED ? (now - p->stage_start) * (1 - done) / done : share * (1 - done) * second;
    return own + sum_later_shares(p) * second;
}

static void format_rate(const tool_progress *p, double done, double elapsed, char *text, size_t size) {
    *text = 0;
    if (elapsed < .05 || !(p->items > 0)) return;
    double rate = p->items * done / elapsed;
    const char *scale = rate >= 1e6 ? "M " : rate >= 1e3 ? "k " : " ";
    rate /= rate >= 1e6 ? 1e6 : rate >= 1e3 ? 1e3 : 1;
    snprintf(text, size, "%.*f%s%s/s", rate < 10 ? 1 : 0, rate, scale, p->unit);
}

/* `done`: of the phase. */
static void draw(tool_progress *p, double done, double now) {
    char bar[WIDTH + 1], rate[64], left[32] = "";
    double whole = p->stages ? tool_progress_whole(p) : done, seconds = rint(tool_progress_left(p, now));
    if (now - p->start >= SETTLED && seconds < INFINITY)
        snprintf(left, sizeof left, "%.0f:%02.0f left", floor(seconds / 60), fmod(seconds, 60));
    int filled = (int)lround(whole * WIDTH);
    for (int i = 0; i < WIDTH; ++i) bar[i] = i < filled ? '#' : '.';
    bar[WIDTH] = 0;
    format_rate(p, done, now - p->phase_start, rate, sizeof rate);
    fprintf(stderr, "%s%-14s [%s] %3.0f%% %14s  %s%s", p->terminal ? "\r" : "", p->phase, bar, 100 * whole,
            rate, left, p->terminal ? "\033[K" : "\n");
    p->visible = p->terminal;
    p->drawn = now;
}

void tool_progress_show(tool_progress *p, const char *phase, double done, double now) {
    if (!p->shown) return;
    bool leads = enter_stage(p, phase, now);
    if (strncmp(phase, p->phase, sizeof p->phase - 1) != 0) {
        snprintf(p->phase, sizeof p->phase, "%s", phase);
        p->phase_start = now;
    }
    done = fmin(fmax(done, 0), 1);
    if (leads) p->stage_done = done;
    if (now - p->drawn >= (p->terminal ? .1 : 1)) draw(p, done, now);
}
