/* tools/kit/tool.h: what a subcommand of `facetree` is made of.
 *
 * A subcommand is one file with one function, `int tool_NAME(int argc, char **argv)`, that describes itself
 * in a tool_command and calls tool_main. tool_main reads the options (the common ones here, the command's own
 * through its argp table), sets up the environment (threads, memory limit, progress bar, messages), calls
 * `run`, says what went wrong in one line on stderr, and returns the exit code. The same table makes --help
 * and the man page. Commands use the public headers of the library only.
 */
#ifndef FCT_TOOLS_TOOL_H
#define FCT_TOOLS_TOOL_H

#include <argp.h>
#include <jansson.h>
#include <stdio.h>

#include "facetree/facetree.h"

typedef enum tool_exit {
    TOOL_DONE = 0,
    TOOL_NO = 1, /* the answer is no: differences found, not converged */
    TOOL_USAGE = 64,
    TOOL_DATA = 65,
    TOOL_INPUT = 66,
    TOOL_INTERNAL = 70,
    TOOL_OUTPUT = 73,
    TOOL_MEMORY = 75,
    TOOL_CANCELLED = 130
} tool_exit;

typedef struct tool {
    const char *name; /* of the command */
    char **inputs;    /* the arguments that are no options */
    int input_count;
    const char *output; /* -o, or NULL */
    bool json, quiet, progress;
    uint32_t threads; /* 0: all cores */
    uint64_t seed;
    size_t max_memory; /* 0: no limit */
    fct_env env;       /* for every call into the library */
    double start;      /* tool_seconds() at the start */
    double items;      /* what progress = 1 stands for in the bar's rate, 0: unknown */
    const char *unit;  /* of items */

    /* The rest belongs to tool_env.c. */
    size_t memory_now, memory_peak;
    bool memory_refused, cancelled;
    char error[1536];
    bool error_told; /* there is nothing to add */
    char phase[64];
    double phase_start, drawn;
    bool bar_visible, bar_off;
} tool;

typedef enum tool_output_use {
    TOOL_OUTPUT_UNUSED,
    TOOL_OUTPUT_OPTIONAL,
    TOOL_OUTPUT_REQUIRED
} tool_output_use;

typedef struct tool_command {
    const char *name;
    const char *synopsis; /* after the name: "IN -o OUT" */
    const char *summary;  /* one sentence, for `facetree help` and the man page */
    const char *text;     /* paragraphs, separated by an empty line; NULL for none */
    const struct argp_option
        *options; /* ends with {0}; keys without a letter start at TOOL_KEY; may be NULL */
    /* As an argp parser for these options alone; state->input is the `options` of tool_main. Returns 0,
     * tool_usage(...) or ARGP_ERR_UNKNOWN; ARGP_KEY_END may check combinations. NULL without options. */
    error_t (*parse)(int key, char *argument, struct argp_state *state);
    int (*run)(tool *t, void *options); /* returns an exit code */
    int inputs_min, inputs_max;
    tool_output_use output;
    bool output_folder; /* -o may name a folder: the command checks it itself */
} tool_command;

/* First key of options without a letter. Common letters: -o -q -h. */
enum { TOOL_KEY = 512 };

int tool_main(const tool_command *command, int argc, char **argv, void *options);

/* --- options (tool_options.c). Each returns 0, or prints one line and returns what parse is to return. ---
 */
error_t tool_usage(struct argp_state *state, const char *format, ...) __attribute__((format(printf, 2, 3)));
error_t tool_parse_count(struct argp_state *state, const char *name, const char *text, uint64_t least,
                         uint64_t most, uint64_t *value);
error_t tool_parse_count32(struct argp_state *state, const char *name, const char *text, uint32_t least,
                           uint32_t most, uint32_t *value);
/* A finite number in [least, most]; "inf" where most is INFINITY. */
error_t tool_parse_real(struct argp_state *state, const char *name, const char *text, double least,
                        double most, double *value);
/* A length of at least 0, or with % a share of the diagonal. */
typedef struct tool_length {
    double value; /* negative: not given */
    bool percent;
} tool_length;
error_t tool_parse_length(struct argp_state *state, const char *name, const char *text, tool_length *length);
/* `names` ends with NULL; *index receives the place of `text` in it. */
error_t tool_parse_choice(struct argp_state *state, const char *name, const char *text,
                          const char *const *names, int *index);
/* The nearest of `names` (ends with NULL) to a mistyped word, or NULL. */
const char *tool_nearest(const char *word, const char *const *names);
/* "64M", "1.5G", "1000000". */
bool tool_size(const char *text, size_t *bytes);

/* --- errors, words, time, memory (tool_env.c) --- */
void tool_env_open(tool *t);
/* Prints the error, if `code` is one; returns the code. */
int tool_env_close(tool *t, int code);
/* Records an error ("file: place: what was expected, what was found") and returns `code`. */
int tool_fail(tool *t, int code, const char *format, ...) __attribute__((format(printf, 3, 4)));
/* Names the file an error is about, where its text does not; returns `code`. */
int tool_context(tool *t, int code, const char *path);
/* The exit code of a library call; TOOL_DONE for FCT_OK. The library's message was recorded by the hook. */
int tool_result(tool *t, fct_result result);
/* A line for people: on stdout, on stderr where stdout carries data, nowhere with --quiet or --json. */
void tool_say(tool *t, const char *format, ...) __attribute__((format(printf, 2, 3)));
void tool_warn(tool *t, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* Seconds of a monotonic clock. */
double tool_seconds(void);
/* Most memory the process has had resident, in bytes. */
size_t tool_peak_bytes(void);
/* Prints the one object of --json (and frees it); without --json it only frees it. Returns an exit code. */
int tool_json(tool *t, json_t *object);
/* The same for commands whose answer is the object: as lines "key: value" for people without --json. */
int tool_print(tool *t, json_t *object);
/* Through the environment's allocator; NULL after a recorded error. */
void *tool_allocate(tool *t, size_t count, size_t size);
void tool_release(tool *t, void *memory);

/* --- files (tool_file.c) --- */
/* Whether `path` ends in `.ending`, in any case. */
bool tool_ends(const char *path, const char *ending);
bool tool_is_mesh_name(const char *path);
bool tool_is_folder(const char *path);
/* Whether a file can be made at `path` ("-" too), before long work starts. */
int tool_check_output(tool *t, const char *path);
/* Makes the folder when it is missing, and checks that files can be made in it. */
int tool_check_folder(tool *t, const char *path);
/* A text file that appears at `path` only when it is complete; "-" is stdout. */
typedef struct tool_writer {
    FILE *stream;
    const char *path;
    char *temporary; /* NULL for stdout and devices */
} tool_writer;
int tool_writer_open(tool *t, const char *path, tool_writer *writer);
/* `code` is the outcome so far: the file is kept for TOOL_DONE and TOOL_NO. Returns the outcome. */
int tool_writer_close(tool *t, tool_writer *writer, int code);
/* xxh3 of a file's bytes. */
int tool_hash_file(tool *t, const char *path, uint64_t *hash);
/* The last part of a path without its ending. */
void tool_stem(const char *path, char *stem, size_t size);

/* --- numbers in text files (tool_rows.c) --- */
typedef struct tool_rows {
    size_t count;
    float *values; /* count x columns */
} tool_rows;
/* Rows of least..columns numbers; missing ones come from `missing` (columns - least). Empty lines and what
 * follows a # are passed over. The first `least` columns must be finite. "-" is stdin. */
int tool_rows_read(tool *t, const char *path, int least, int columns, const float *missing, tool_rows *rows);
void tool_rows_release(tool *t, tool_rows *rows);

/* --- models (tool_model.c) --- */
/* A hierarchy from a .fct file or, built with `def` (NULL: the default), from a mesh file. */
int tool_open_tree(tool *t, const char *path, const fct_tree_def *def, fct_tree **tree);
/* Of the bounds of the tree's mesh; and a length where it is a share of that. */
double tool_diagonal(const fct_tree *tree);
double tool_length_of(const fct_tree *tree, tool_length length);
/* A mesh from a mesh file or a .fct file. */
int tool_load_mesh(tool *t, const char *path, fct_mesh *mesh);
/* Saves a mesh with the given factor on its colours for display. */
int tool_save_mesh(tool *t, const char *path, const fct_mesh *mesh, double exposure);
/* Whether the name is that of a scene: .json or .gltf. */
bool tool_is_scene_name(const char *path);
/* The colour of cluster `index`, linear: neighbours differ clearly, and no two of 7 million are the same. */
void tool_palette(uint32_t index, float color[3]);
/* --- labels (tool_labels.c) --- */
/* Writes a label below `count` for each input face: one a line, or, where the path is named as a mesh, the
 * mesh with a colour for each label, on the faces in .ply and .off, else on vertices, doubled along borders.
 */
int tool_save_labels(tool *t, const char *path, const fct_tree *tree, const uint32_t *labels, uint32_t count);

error_t tool_parse_backend(struct argp_state *state, const char *name, const char *text,
                           fct_backend *backend);

/* --- man pages (tool_man.c) --- */
void tool_print_man(const tool_command *command, const struct argp_option *common);

/* --- the commands --- */
int tool_bake(int argc, char **argv);
int tool_boxes(int argc, char **argv);
int tool_closest(int argc, char **argv);
int tool_cluster(int argc, char **argv);
int tool_compare(int argc, char **argv);
int tool_info(int argc, char **argv);
int tool_make(int argc, char **argv);
int tool_meshlets(int argc, char **argv);
int tool_partition(int argc, char **argv);
int tool_raycast(int argc, char **argv);
int tool_render(int argc, char **argv);
int tool_simplify(int argc, char **argv);

#endif
