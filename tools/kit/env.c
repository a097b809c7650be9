/* tools/kit/env.c: the environment of a command: memory under a limit, the bar, messages, interruption, and
 * the outcome as an exit code with one line on stderr.
 *
 * --max-memory counts the program itself and what the library allocates (not files that are mapped); the
 * process's data limit, somewhat above it, catches what wrapped C++ libraries allocate behind its back.
 */
#define _GNU_SOURCE
#include "tools/kit/tool.h"

#include <malloc.h>
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

/* Beside the counted memory: code's data, buffers of C and C++, and each thread's stack and heap. */
enum { DATA_SLACK = 64 << 20, DATA_SLACK_THREAD = 16 << 20 };

static volatile sig_atomic_t interrupted;

double tool_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* --- Memory --- */

static void *limited_allocate(void *user, size_t size) {
    tool *t = user;
    size_t now = __atomic_add_fetch(&t->memory_now, size, __ATOMIC_RELAXED);
    void *memory = t->max_memory && now > t->max_memory ? NULL : aligned_alloc(64, (size + 63) & ~(size_t)63);
    if (!memory) {
        __atomic_sub_fetch(&t->memory_now, size, __ATOMIC_RELAXED);
        t->memory_refused = true;
        return NULL;
    }
    /* What is released is counted by its usable size, so what is allocated is, too. */
    size_t usable = malloc_usable_size(memory);
    now = __atomic_add_fetch(&t->memory_now, usable - size, __ATOMIC_RELAXED);
    if (now > t->memory_peak) t->memory_peak = now;
    return memory;
}

static void limited_release(void *user, void *memory) {
    tool *t = user;
    __atomic_sub_fetch(&t->memory_now, malloc_usable_size(memory), __ATOMIC_RELAXED);
    free(memory);
}

/* Sanitizers map terabytes of data for themselves, so no limit holds beside them. */
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
enum { DATA_LIMITED = 0 };
#else
enum { DATA_LIMITED = 1 };
#endif

static void limit_data(const tool *t) {
    long cores = sysconf(_SC_NPROCESSORS_ONLN);
    size_t threads = t->threads ? t->threads : (size_t)(cores > 0 ? cores : 1);
    struct rlimit limit;
    if (!DATA_LIMITED || getrlimit(RLIMIT_DATA, &limit)) return;
    rlim_t wanted = t->max_memory + DATA_SLACK + threads * DATA_SLACK_THREAD;
    if (limit.rlim_cur == RLIM_INFINITY || wanted < limit.rlim_cur) limit.rlim_cur = wanted;
    setrlimit(RLIMIT_DATA, &limit);
}

void *tool_allocate(tool *t, size_t count, size_t size) {
    size_t bytes;
    void *memory = NULL;
    if (!__builtin_mul_overflow(count, size, &bytes) && bytes < SIZE_MAX / 2)
        memory = limited_allocate(t, bytes ? bytes : 1);
    if (!memory) tool_fail(t, TOOL_MEMORY, "out of memory for %zu elements of %zu bytes", count, size);
    return memory;
}

void tool_release(tool *t, void *memory) {
    if (memory) limited_release(t, memory);
}

static size_t status_bytes(const char *format) {
    size_t kilobytes = 0;
    FILE *file = fopen("/proc/self/status", "re");
    char line[256];
    while (file && fgets(line, sizeof line, file))
        if (sscanf(line, format, &kilobytes) == 1) break;
    if (file) fclose(file);
    return kilobytes * 1024;
}

/* VmHWM is of this program alone; getrusage's figure would include what was there before exec. */
size_t tool_peak_bytes(void) {
    size_t peak = status_bytes("VmHWM: %zu");
    if (peak) return peak;
    struct rusage usage;
    return getrusage(RUSAGE_SELF, &usage) ? 0 : (size_t)usage.ru_maxrss * 1024;
}

/* --- The bar --- */

static void clear_bar(tool *t) {
    if (t->bar_visible) fputs("\r\033[K", stderr);
    t->bar_visible = false;
}

static void format_rate(const tool *t, double done, double elapsed, char *text, size_t size) {
    if (elapsed < 0.05) {
        *text = 0;
        return;
    }
    double rate = (t->items > 0 ? t->items : 100) * done / elapsed;
    const char *unit = t->items > 0 ? t->unit : "%";
    const char *scale = rate >= 1e6 ? "M " : rate >= 1e3 ? "k " : t->items > 0 ? " " : "";
    rate /= rate >= 1e6 ? 1e6 : rate >= 1e3 ? 1e3 : 1;
    snprintf(text, size, "%.*f%s%s/s", rate < 10 ? 1 : 0, rate, scale, unit);
}

static void draw_bar(tool *t, double done, double now, bool terminal) {
    enum { WIDTH = 28 };
    char bar[WIDTH + 1], rate[64], left[32] = "";
    double elapsed = now - t->phase_start;
    int filled = (int)lround(done * WIDTH);
    for (int i = 0; i < WIDTH; ++i) bar[i] = i < filled ? '#' : '.';
    bar[WIDTH] = 0;
    format_rate(t, done, elapsed, rate, sizeof rate);
    if (done > 0 && done < 1) {
        double seconds = elapsed * (1 - done) / done;
        snprintf(left, sizeof left, "%.0f:%02d left", floor(seconds / 60), (int)fmod(seconds, 60));
    }
    fprintf(stderr, "%s%-12s [%s] %3.0f%% %14s  %s%s", terminal ? "\r" : "", t->phase, bar, 100 * done, rate,
            left, terminal ? "\033[K" : "\n");
    t->bar_visible = terminal;
    t->drawn = now;
}

/* Ten times a second on a terminal, once a second elsewhere, and at the end of a phase that was shown. */
static bool show_progress(void *user, const char *phase, double done) {
    tool *t = user;
    if (interrupted) return false;
    bool terminal = isatty(STDERR_FILENO);
    if (t->quiet || t->bar_off || !(terminal || t->progress)) return true;
    double now = tool_seconds();
    if (strncmp(phase, t->phase, sizeof t->phase - 1) != 0) {
        snprintf(t->phase, sizeof t->phase, "%s", phase);
        t->phase_start = now;
        if (t->progress && !terminal) t->drawn = 0;
    }
    done = done < 0 ? 0 : done > 1 ? 1 : done;
    if (done >= 1 || now - t->drawn >= (terminal ? 0.1 : 1.0)) draw_bar(t, done, now, terminal);
    return true;
}

static void interrupt(int signal_number) {
    interrupted = signal_number;
}

/* --- Messages --- */

/* Appends to the recorded error, with what would break the line replaced. */
static void record(tool *t, const char *format, va_list values) {
    char text[1024];
    vsnprintf(text, sizeof text, format, values);
    for (char *c = text; *c; ++c)
        if ((unsigned char)*c < 32 || *c == 127) *c = '?';
    size_t used = strlen(t->error);
    if (used && strstr(t->error, text)) return;
    snprintf(t->error + used, sizeof t->error - used, "%s%s", used ? "; " : "", text);
}

int tool_fail(tool *t, int code, const char *format, ...) {
    va_list values;
    va_start(values, format);
    record(t, format, values);
    va_end(values);
    return code;
}

int tool_context(tool *t, int code, const char *path) {
    if (code == TOOL_DONE || strstr(t->error, path)) return code;
    char text[sizeof t->error];
    snprintf(text, sizeof text, "%s", t->error);
    t->error[0] = 0;
    return tool_fail(t, code, "%s: %s", path, text);
}

/* Errors are kept for the end: the library may recover, and a failed call may be told in two steps. */
static void take_message(void *user, fct_severity severity, const char *text) {
    tool *t = user;
    if (severity == FCT_MESSAGE_ERROR) {
        tool_fail(t, TOOL_INTERNAL, "%s", text);
    } else if (!t->quiet) {
        clear_bar(t);
        fprintf(stderr, "facetree: %s%s\n", severity == FCT_MESSAGE_WARNING ? "warning: " : "", text);
    }
}

void tool_warn(tool *t, const char *format, ...) {
    if (t->quiet) return;
    clear_bar(t);
    va_list values;
    va_start(values, format);
    fputs("facetree: warning: ", stderr);
    vfprintf(stderr, format, values);
    fputc('\n', stderr);
    va_end(values);
}

void tool_say(tool *t, const char *format, ...) {
    if (t->quiet || t->json) return;
    clear_bar(t);
    FILE *stream = t->output && !strcmp(t->output, "-") ? stderr : stdout;
    va_list values;
    va_start(values, format);
    vfprintf(stream, format, values);
    fputc('\n', stream);
    va_end(values);
}

int tool_result(tool *t, fct_result result) {
    static const int codes[] = {[FCT_OK] = TOOL_DONE,
                                [FCT_ERROR_DATA] = TOOL_DATA,
                                [FCT_ERROR_INPUT] = TOOL_INPUT,
                                [FCT_ERROR_OUTPUT] = TOOL_OUTPUT,
                                [FCT_ERROR_MEMORY] = TOOL_MEMORY,
                                [FCT_ERROR_CANCELLED] = TOOL_CANCELLED,
                                [FCT_ERROR_INTERNAL] = TOOL_INTERNAL};
    if (result == FCT_OK) t->error[0] = 0;
    if (result != FCT_OK && !t->error[0]) tool_fail(t, 0, "%s", fct_result_text(result));
    return codes[result];
}

int tool_json(tool *t, json_t *object) {
    int code = TOOL_DONE;
    if (!object) return t->json ? tool_fail(t, TOOL_MEMORY, "out of memory for the JSON output") : TOOL_DONE;
    if (t->json) {
        clear_bar(t);
        if (json_dumpf(object, stdout, JSON_INDENT(2) | JSON_REAL_PRECISION(12)) ||
            fputc('\n', stdout) == EOF)
            code = tool_fail(t, TOOL_OUTPUT, "standard output cannot be written");
    }
    json_decref(object);
    return code;
}

void tool_env_open(tool *t) {
    t->env = fct_env_default();
    t->env.thread_count = t->threads;
    t->env.allocate = limited_allocate;
    t->env.release = limited_release;
    t->env.progress = show_progress;
    t->env.message = take_message;
    t->env.memory_user = t->env.progress_user = t->env.message_user = t;
    if (t->max_memory) {
        t->memory_now = status_bytes("VmRSS: %zu"); /* the program itself counts, too */
        limit_data(t);
    }
    /* The first signal lets the command clean up, the second ends it. */
    struct sigaction action = {.sa_handler = interrupt, .sa_flags = SA_RESETHAND};
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    signal(SIGPIPE, SIG_IGN);
}

int tool_env_close(tool *t, int code) {
    clear_bar(t);
    if (code == TOOL_DONE || code == TOOL_NO || t->error_told) return code;
    if (interrupted) code = TOOL_CANCELLED;
    fprintf(stderr, "facetree %s: %s", t->name, t->error[0] ? t->error : "failed");
    if (code == TOOL_MEMORY && t->max_memory && t->memory_refused)
        fprintf(stderr, " (--max-memory %zu bytes)", t->max_memory);
    fputc('\n', stderr);
    return code;
}
