/* tools/kit/env.h: the environment of a command: the options that all commands share, memory, progress,
 * messages, and the outcome as an exit code with one line on stderr.
 *
 * Commands use only the public headers of the library. Every call into the library takes tool.env.
 */
#ifndef FCT_TOOLS_ENV_H
#define FCT_TOOLS_ENV_H

#include <jansson.h>
#include <stdio.h>

#include "facetree/facetree.h"
#include "tools/guard/inputs.h"
#include "tools/kit/progress.h"

typedef enum tool_exit {
    TOOL_DONE = 0,
    TOOL_NO = 1, /* the answer is no: differences found, not converged */
    TOOL_USAGE = 64,
    TOOL_DATA = 65,
    TOOL_INPUT = 66,
    TOOL_INTERNAL = 70,
    TOOL_OUTPUT = 73,
    TOOL_MEMORY = 75,
    TOOL_CANCELLED = 130 /* a process that a signal cancels dies of that signal */
} tool_exit;

typedef struct tool {
    const char *name; /* of the command */
    char **inputs;    /* the arguments that are not options */
    int input_count;
    const char *format; /* of inputs without an ending, or NULL */
    const char *output; /* the value of -o, or NULL */
    bool json, quiet, progress, allow_outside;
    bool in_place;    /* an output may replace an input */
    bool flip_inward; /* loaded meshes turn closed bodies that are wound inwards */
    bool no_weld;     /* trees keep vertices of equal position apart */
    bool soft;        /* SIGINT and SIGTERM do not cancel library calls: the command looks for them */
    char ending[256]; /* what a message about a signal says of the outputs, or empty */
    bool wrote;       /* an output is complete and has its name */
    uint32_t threads; /* 0: all cores */
    uint64_t seed;
    size_t max_memory; /* bytes; 0: no limit */
    fct_env env;
    double start; /* tool_seconds() at the start of the command */
    tool_progress bar;

    /* Private to env.c. */
    char label[64];    /* "facetree NAME" */
    guard_inputs read; /* the files that the command has opened */
    bool refused;      /* an output is an input: the error is recorded */
    size_t memory_now, memory_peak;
    bool memory_refused, cancelled;
    char error[1536];
    bool error_told;  /* the error is printed already */
    json_t *warnings; /* texts of all warnings, each once */
} tool;

/* stages: of the progress bar, or NULL. */
void tool_env_open(tool *t, const tool_stage *stages);
/* Prints the recorded error if `code` is one. Returns the code. */
int tool_env_close(tool *t, int code);

/* Records an error ("file: place: expected value, found value") and returns `code`. */
int tool_fail(tool *t, int code, const char *format, ...) __attribute__((format(printf, 3, 4)));
/* Puts the path in front of the recorded error, unless the error names it already. Returns `code`. */
int tool_context(tool *t, int code, const char *path);
/* The exit code of a library call; TOOL_DONE for FCT_OK. The message hook has recorded the library's message.
 */
int tool_result(tool *t, fct_result result);
/* Prints a line for people: to stdout, or to stderr if the output of the command goes to stdout. Prints
 * nothing with
 * --quiet or --json. */
void tool_say(tool *t, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* Prints a warning, and adds it to the `warnings` of --json. A warning with a text that was printed before is
 * not repeated. */
void tool_warn(tool *t, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Prints a line on stderr, with '?' for control characters. */
void tool_complain(const char *format, ...) __attribute__((format(printf, 1, 2)));
/* Replaces control characters by '?'. */
void tool_clean_text(char *text);

/* Notes a file that the command reads. The library's inputs are noted by a hook. Returns an exit code:
 * TOOL_USAGE if -o names the same file and --in-place is absent. */
int tool_note_input(tool *t, const char *path);
/* TOOL_USAGE if `path` is a file that the command reads, by device and inode, and --in-place is absent. */
int tool_refuse_input(tool *t, const char *path);

/* TOOL_INPUT if a file that the command reads has become shorter: its bytes are not those that were opened.
 */
int tool_check_inputs(tool *t);

/* Seconds of a monotonic clock. */
double tool_seconds(void);
/* The largest resident memory of the process so far, in bytes. */
size_t tool_peak_bytes(void);

/* Prints the one object of --json, with the warnings so far as `warnings`, unless an input was shortened.
 * Frees the object in any case. Returns an exit code. */
int tool_json(tool *t, json_t *object);
/* For commands whose answer is the object: like tool_json, but without --json prints lines "key value". */
int tool_print(tool *t, json_t *object);
/* A string; bytes that are no UTF-8 become '?'. */
json_t *tool_json_text(const char *text);
json_t *tool_json_floats(const float *values, int count);
/* origin + point, three numbers. */
json_t *tool_json_point(const float *point, const double *origin);

/* Memory under --max-memory; NULL after a recorded error. */
void *tool_allocate(tool *t, size_t count, size_t size);
void tool_release(tool *t, void *memory);

#endif
