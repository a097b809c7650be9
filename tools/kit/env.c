/* tools/kit/env.c: see env.h.
 *
 * --max-memory counts the program itself and the library's allocations, but not mapped files. A data limit of
 * the process, somewhat higher, stops wrapped C++ libraries that allocate by themselves.
 */
#define _GNU_SOURCE
#include "tools/kit/env.h"

#include "tools/guard/signals.h"

#include <malloc.h>
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

/* Bytes beside the counted memory: data of the code, buffers of C and C++, and stack and heap per thread. */
enum { DATA_SLACK = 64 << 20, DATA_SLACK_THREAD = 16 << 20 };

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
    /* Released memory is counted by its usable size, so allocated memory must be too. */
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

/* Sanitizers map terabytes of data, which no limit allows. */
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

/* A line of /proc/self/status, in bytes. */
static size_t read_status_bytes(const char *format) {
    size_t kilobytes = 0;
    FILE *file = fopen("/proc/self/status", "re");
    char line[256];
    while (file && fgets(line, sizeof line, file))
        if (sscanf(line, format, &kilobytes) == 1) break;
    if (file) fclose(file);
    return kilobytes * 1024;
}

/* VmHWM counts this program alone; getrusage would include the memory from before exec. */
size_t tool_peak_bytes(void) {
    size_t peak = read_status_bytes("VmHWM: %zu");
    if (peak) return peak;
    struct rusage usage;
    return getrusage(RUSAGE_SELF, &usage) ? 0 : (size_t)usage.ru_maxrss * 1024;
}

/* --- Progress --- */

/* The progress hook. False cancels the library call. */
static bool show_progress(void *user, const char *phase, double done) {
    tool *t = user;
    if (t->refused || guard_signal() == SIGHUP || (guard_signal() && !t->soft)) return false;
    tool_progress_show(&t->bar, phase, done, tool_seconds());
    return true;
}

/* --- Messages --- */

void tool_clean_text(char *text) {
    for (unsigned char *c = (unsigned char *)text; *c; ++c) {
        bool pair = c[0] == 0xC2 && c[1] >= 0x80 && c[1] < 0xA0; /* a control character in UTF-8 */
        if (*c < 32 || *c == 127 || pair) *c = '?';
        if (pair) *++c = '?';
    }
}

/* Prints a line without control characters. */
static void print_line(FILE *stream, const char *before, const char *format, va_list values) {
    char text[2048];
    vsnprintf(text, sizeof text, format, values);
    tool_clean_text(text);
    fprintf(stream, "%s%s\n", before, text);
}

void tool_complain(const char *format, ...) {
    va_list values;
    va_start(values, format);
    print_line(stderr, "", format, values);
    va_end(values);
}

/* Appends to the recorded error. The error stays one line. */
static void record_error(tool *t, const char *format, va_list values) {
    char text[1024];
    vsnprintf(text, sizeof text, format, values);
    tool_clean_text(text);
    size_t used = strlen(t->error);
    if (used && strstr(t->error, text)) return;
    snprintf(t->error + used, sizeof t->error - used, "%s%s", used ? "; " : "", text);
}

int tool_fail(tool *t, int code, const char *format, ...) {
    va_list values;
    va_start(values, format);
    record_error(t, format, values);
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

static void tool_note(tool *t, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Adds a warning to the list for --json. False if it is there already. A text that is not UTF-8 becomes
 * ASCII. */
static bool keep_warning(tool *t, const char *text) {
    size_t i;
    json_t *item, *added = json_string(text);
    char ascii[1024];
    if (!added) {
        snprintf(ascii, sizeof ascii, "%s", text);
        for (char *c = ascii; *c; ++c)
            if ((unsigned char)*c > 126) *c = '?';
        added = json_string(ascii);
    }
    if (!t->warnings) t->warnings = json_array();
    json_array_foreach(t->warnings, i, item) {
        if (json_equal(item, added)) {
            json_decref(added);
            return false;
        }
    }
    json_array_append_new(t->warnings, added);
    return true;
}

/* The message hook. Errors are kept until the end, because the library may recover, and because a failed call
 * may send two messages. */
static void take_message(void *user, fct_severity severity, const char *text) {
    tool *t = user;
    if (severity == FCT_MESSAGE_ERROR) {
        tool_fail(t, TOOL_INTERNAL, "%s", text);
    } else if (severity == FCT_MESSAGE_WARNING) {
        tool_warn(t, "%s", text);
    } else {
        tool_note(t, "%s", text);
    }
}

void tool_warn(tool *t, const char *format, ...) {
    char text[1024];
    va_list values;
    va_start(values, format);
    vsnprintf(text, sizeof text, format, values);
    va_end(values);
    tool_clean_text(text);
    if (!keep_warning(t, text) || t->quiet) return;
    tool_progress_clear(&t->bar);
    fprintf(stderr, "facetree: warning: %s\n", text);
}

static void tool_note(tool *t, const char *format, ...) {
    va_list values;
    if (t->quiet) return;
    tool_progress_clear(&t->bar);
    va_start(values, format);
    print_line(stderr, "facetree: ", format, values);
    va_end(values);
}

void tool_say(tool *t, const char *format, ...) {
    if (t->quiet || t->json || guard_stdout_was_closed()) return;
    tool_progress_clear(&t->bar);
    va_list values;
    va_start(values, format);
    print_line(t->output && !strcmp(t->output, "-") ? stderr : stdout, "", format, values);
    va_end(values);
}

int tool_check_inputs(tool *t) {
    const char *path = guard_find_shortened(&t->read);
    if (!path) return TOOL_DONE;
    t->error[0] = 0;
    return tool_fail(t, TOOL_INPUT, "%s: was shortened while it was read%s", path,
                     t->wrote ? "; outputs that exist are complete" : "");
}

int tool_result(tool *t, fct_result result) {
    static const int codes[] = {[FCT_OK] = TOOL_DONE,
                                [FCT_ERROR_DATA] = TOOL_DATA,
                                [FCT_ERROR_INPUT] = TOOL_INPUT,
                                [FCT_ERROR_OUTPUT] = TOOL_OUTPUT,
                                [FCT_ERROR_MEMORY] = TOOL_MEMORY,
                                [FCT_ERROR_CANCELLED] = TOOL_CANCELLED,
                                [FCT_ERROR_INTERNAL] = TOOL_INTERNAL};
    if (result == FCT_ERROR_CANCELLED && t->refused) return TOOL_USAGE;
    if (result == FCT_OK && !t->refused) t->error[0] = 0;
    if (result != FCT_OK && tool_check_inputs(t) != TOOL_DONE) return TOOL_INPUT;
    if (result != FCT_OK && !t->error[0]) tool_fail(t, 0, "%s", fct_result_text(result));
    return codes[result];
}

int tool_json(tool *t, json_t *object) {
    if (!object) return t->json ? tool_fail(t, TOOL_MEMORY, "out of memory for the JSON output") : TOOL_DONE;
    int code = tool_check_inputs(t);
    if (t->json && code == TOOL_DONE) {
        tool_progress_clear(&t->bar);
        if (!t->warnings) t->warnings = json_array();
        json_object_set(object, "warnings", t->warnings);
        if (json_dumpf(object, stdout, JSON_INDENT(2) | JSON_REAL_PRECISION(12)) ||
            fputc('\n', stdout) == EOF)
            code = tool_fail(t, TOOL_OUTPUT, "standard output cannot be written");
    }
    json_decref(object);
    return code;
}

/* --- Answers --- */

static void print_value(const json_t *value) {
    if (json_is_string(value)) {
        char text[1024];
        snprintf(text, sizeof text, "%s", json_string_value(value));
        tool_clean_text(text);
        fputs(text, stdout);
    } else if (json_is_boolean(value)) {
        fputs(json_is_true(value) ? "yes" : "no", stdout);
    } else if (json_is_integer(value)) {
        printf("%" JSON_INTEGER_FORMAT, json_integer_value(value));
    } else if (json_is_real(value)) {
        printf("%.6g", json_real_value(value));
    } else {
        size_t i;
        json_t *item;
        json_array_foreach(value, i, item) {
            if (i) putchar(' ');
            if (json_is_number(item)) printf("%.6g", json_number_value(item));
        }
    }
}

/* One line per member; members of an inner object print as "outer inner". Objects nest no deeper. */
static void print_lines(json_t *object) {
    const char *key, *inner;
    json_t *value, *inner_value;
    json_object_foreach(object, key, value) {
        if (!json_is_object(value)) {
            printf("%-24s", key);
            print_value(value);
            putchar('\n');
            continue;
        }
        json_object_foreach(value, inner, inner_value) {
            int used = printf("%s %s", key, inner);
            printf("%*s", used < 24 ? 24 - used : 1, "");
            print_value(inner_value);
            putchar('\n');
        }
    }
}

int tool_print(tool *t, json_t *object) {
    if (!t->json && object && tool_check_inputs(t) == TOOL_DONE) print_lines(object);
    return tool_json(t, object);
}

json_t *tool_json_text(const char *text) {
    json_t *string = json_string(text);
    char *copy = string ? NULL : strdup(text);
    for (char *c = copy; c && *c; ++c)
        if ((unsigned char)*c > 127) *c = '?';
    if (copy) string = json_string(copy);
    free(copy);
    return string;
}

json_t *tool_json_point(const float *point, const double *origin) {
    json_t *array = json_array();
    for (int i = 0; i < 3; ++i) json_array_append_new(array, json_real(origin[i] + (double)point[i]));
    return array;
}

json_t *tool_json_floats(const float *values, int count) {
    json_t *array = json_array();
    for (int i = 0; i < count; ++i) json_array_append_new(array, json_real(values[i]));
    return array;
}

/* --- Inputs and outputs --- */

static int refuse(tool *t, const char *path, const char *input) {
    if (t->refused) return TOOL_USAGE;
    t->refused = true;
    t->error[0] = 0;
    return tool_fail(t, TOOL_USAGE,
                     "%s: the output is the input %s; choose another name, or replace it with --in-place",
                     path, input);
}

int tool_refuse_input(tool *t, const char *path) {
    const char *input = t->in_place || !strcmp(path, "-") ? NULL : guard_find_input(&t->read, path);
    return input ? refuse(t, path, input) : TOOL_DONE;
}

int tool_note_input(tool *t, const char *path) {
    if (!strcmp(path, "-")) return TOOL_DONE;
    if (!guard_add_input(&t->read, path))
        return tool_fail(t, TOOL_MEMORY, "out of memory for the names of inputs");
    return t->output ? tool_refuse_input(t, t->output) : TOOL_DONE;
}

/* The hook for opened files. A refusal cancels the library call. */
static void note_opened(void *user, const char *path, uint64_t size) {
    (void)size;
    tool_note_input(user, path);
}

/* --- Open and close --- */

void tool_env_open(tool *t, const tool_stage *stages) {
    tool_progress_start(&t->bar, stages, t->progress, tool_seconds());
    if (t->quiet) t->bar.shown = false;
    t->env = fct_env_default();
    t->env.thread_count = t->threads;
    t->env.allocate = limited_allocate;
    t->env.release = limited_release;
    t->env.progress = show_progress;
    t->env.message = take_message;
    t->env.allow_outside = t->allow_outside;
    t->env.flip_inward = t->flip_inward;
    t->env.no_weld = t->no_weld;
    t->env.memory_user = t->env.progress_user = t->env.message_user = t;
    if (t->max_memory) {
        t->memory_now = read_status_bytes("VmRSS: %zu"); /* the program itself counts too */
        limit_data(t);
    }
    t->env.input_format = t->format;
    t->env.opened = note_opened;
    t->env.opened_user = t;
    snprintf(t->label, sizeof t->label, "facetree %s", t->name);
    guard_install_signals(t->label, &t->read, TOOL_INPUT);
}

int tool_env_close(tool *t, int code) {
    tool_progress_clear(&t->bar);
    guard_release_inputs(&t->read);
    json_decref(t->warnings);
    t->warnings = NULL;
    if (code == TOOL_DONE || code == TOOL_NO || t->error_told) return code;
    if (guard_signal()) {
        fprintf(stderr, "%s: ended by signal %d (%s)%s%s\n", t->label, guard_signal(),
                strsignal(guard_signal()), t->ending[0] ? "; " : "", t->ending);
        fflush(NULL);
        guard_die(guard_signal());
    }
    fprintf(stderr, "facetree %s: %s", t->name, t->error[0] ? t->error : "failed");
    if (code == TOOL_MEMORY && t->max_memory && t->memory_refused)
        fprintf(stderr, " (--max-memory %zu bytes)", t->max_memory);
    fputc('\n', stderr);
    return code;
}
