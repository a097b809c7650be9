/* tools/kit/command.h: the description of a subcommand, and the function that runs it.
 *
 * A subcommand is one file with one external function, `int tool_NAME(int argc, char **argv)`. It fills a
 * tool_command and calls tool_main. tool_main
 * 1. reads the shared options itself, and those of the command through its table and parser;
 * 2. opens the environment (tools/kit/env.h) and calls `run`;
 * 3. prints an error as one line on stderr and returns the exit code.
 * --help, the man page and the completion of command lines come from the same table.
 */
#ifndef FCT_TOOLS_COMMAND_H
#define FCT_TOOLS_COMMAND_H

#include <argp.h>

#include "tools/kit/env.h"

typedef enum tool_output_use {
    TOOL_OUTPUT_UNUSED,
    TOOL_OUTPUT_OPTIONAL,
    TOOL_OUTPUT_REQUIRED
} tool_output_use;

typedef struct tool_command {
    const char *name;
    const char *synopsis; /* after the name, such as "IN -o OUT"; one line per way to call it */
    const char *summary;  /* one sentence without a period, for `facetree help` and the man page */
    const char *text;     /* paragraphs with an empty line between; NULL: none */
    const char *examples; /* command lines, one per line; NULL: none */
    const struct argp_option
        *options; /* ends with {0}; keys without a letter start at TOOL_KEY; NULL: none */
    /* An argp parser for these options. state->input is the `options` of tool_main. Returns 0,
     * tool_usage(...) or ARGP_ERR_UNKNOWN. ARGP_KEY_END may check combinations. NULL without options. */
    error_t (*parse)(int key, char *argument, struct argp_state *state);
    int (*run)(tool *t, void *options); /* returns an exit code */
    int inputs_min, inputs_max;
    tool_output_use output;
    const char *endings; /* of -o, for tool_check_kind of tools/kit/file.h; NULL: the command checks them */
    const char *other;   /* likewise */
    bool turns_bodies;   /* takes --flip-inward; tool_load_mesh follows it */
    bool builds_tree;    /* takes --no-weld; tool_open_tree and scenes follow it */
    bool output_folder;  /* -o may name a folder: the command checks it itself */
    const tool_stage *stages; /* of the progress bar; NULL: it shows each phase alone */
} tool_command;

/* The first key of options without a letter. Every command has the letters -o, -q and -h. */
enum { TOOL_KEY = 512 };

/* Runs a command. Returns its exit code. */
int tool_main(const tool_command *command, int argc, char **argv, void *options);

#endif
