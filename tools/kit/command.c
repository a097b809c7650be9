/* tools/kit/command.c: see command.h. argp reads the options and stays silent; the messages about words that
 * it cannot parse are one line each and come from here. */
#define _GNU_SOURCE
#include "tools/kit/command.h"

#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "tools/kit/file.h"
#include "tools/kit/options.h"
#include "tools/manual/manual.h"

enum {
    KEY_JSON = 256,
    KEY_PROGRESS,
    KEY_THREADS,
    KEY_SEED,
    KEY_MAX_MEMORY,
    KEY_IN_PLACE,
    KEY_FORMAT,
    KEY_OUTSIDE,
    KEY_NO_WELD,
    KEY_FLIP_INWARD,
    KEY_USAGE,
    KEY_MAN,
    KEY_BASH,
    KEY_ZSH
};

static const struct argp_option common_options[] = {
    {"output", 'o', "FILE", 0, "Write to FILE; - is standard output", 0},
    {"in-place", KEY_IN_PLACE, NULL, 0, "Allow an output that replaces an input", 0},
    {NULL, 0, NULL, 0, "Common to all commands:", -2},
    {"format", KEY_FORMAT, "NAME", 0,
     "Format of an input whose name has no ending, such as - (standard input): ply (default), obj, off, stl, "
     "om, "
     "glb, gltf, json or fct",
     -2},
    {"json", KEY_JSON, NULL, 0, "Print one JSON object on standard output and nothing else there", -2},
    {"progress", KEY_PROGRESS, NULL, 0, "Show progress on standard error, even if it is not a terminal", -2},
    {"quiet", 'q', NULL, 0, "Print only errors", -2},
    {"threads", KEY_THREADS, "N", 0,
     "Use N threads, 1 to 256 (default: all cores); the result does not depend on N", -2},
    {"seed", KEY_SEED, "N", 0, "Seed of random samples (default 0)", -2},
    {"max-memory", KEY_MAX_MEMORY, "SIZE", 0,
     "Stop with exit code 75 if more memory than SIZE is needed, such as 500M or 2G (default: no limit)", -2},
    {"allow-outside", KEY_OUTSIDE, NULL, 0,
     "Also read buffers that a glTF file names outside of its own folder", -2},
    {"help", 'h', NULL, 0, "Print this help", -1},
    {"usage", KEY_USAGE, NULL, OPTION_HIDDEN, NULL, -1},
    {"man", KEY_MAN, NULL, OPTION_HIDDEN, NULL, -1},
    {"bash", KEY_BASH, NULL, OPTION_HIDDEN, NULL, -1},
    {"zsh", KEY_ZSH, NULL, OPTION_HIDDEN, NULL, -1},
    {0}};

static const struct argp_option tree_options[] = {{"no-weld", KEY_NO_WELD, NULL, 0,
                                                   "Keep vertices of equal position apart: faces are "
                                                   "neighbours only if they have the same vertices. A .fct "
                                                   "file keeps the choice of its build",
                                                   0},
                                                  {0}};

static const struct argp_option flip_options[] = {
    {"flip-inward", KEY_FLIP_INWARD, NULL, 0,
     "Turn closed bodies that are wound inwards, so that their fronts are outside", 0},
    {0}};

enum { OUTPUT_OPTIONS = 2 }; /* the first common options are about -o */

typedef struct arguments {
    tool *tool;
    const tool_command *command;
    void *options;
    int action; /* 'h', KEY_USAGE, KEY_MAN, KEY_BASH, KEY_ZSH, or 0 to run */
    int next;   /* index of the word after the one that argp could not parse */
} arguments;

static bool takes_output(const tool_command *command) {
    return command->output != TOOL_OUTPUT_UNUSED;
}

static error_t parse_positional(arguments *a, char *text, struct argp_state *state) {
    if (a->tool->input_count >= a->command->inputs_max)
        return tool_usage(state, "unexpected argument '%s'", text);
    a->tool->inputs[a->tool->input_count++] = text;
    return 0;
}

static error_t check_arguments(const arguments *a, struct argp_state *state) {
    const tool *t = a->tool;
    if (a->action) return 0;
    if (t->input_count < a->command->inputs_min)
        return tool_usage(state, "expected %s %s, found %d argument%s", a->command->name,
                          a->command->synopsis, t->input_count, t->input_count == 1 ? "" : "s");
    if (a->command->output == TOOL_OUTPUT_REQUIRED && !t->output)
        return tool_usage(state, "expected -o FILE, found none");
    if (t->json && t->output && tool_is_standard_output(t->output))
        return tool_usage(state, "--json and -o - cannot both write to standard output");
    return 0;
}

static error_t parse_common(int key, char *text, struct argp_state *state) {
    arguments *a = state->input;
    tool *t = a->tool;
    static const char *const formats[] = {"ply", "obj",  "off",  "stl", "om",
                                          "glb", "gltf", "json", "fct", NULL};
    size_t bytes;
    error_t error;
    int index = 0;
    switch (key) {
    case ARGP_KEY_INIT:
        state->child_inputs[0] = a->options;
        state->child_inputs[1] = state->child_inputs[2] = a;
        return 0;
    case 'o':
        if (!*text) return tool_usage(state, "-o: expected a file name, found nothing");
        t->output = text;
        return 0;
    case 'q':
        t->quiet = true;
        return 0;
    case KEY_IN_PLACE:
        t->in_place = true;
        return 0;
    case KEY_FORMAT:
        error = tool_parse_choice(state, "--format", text, formats, &index);
        t->format = formats[index];
        return error;
    case KEY_JSON:
        t->json = true;
        return 0;
    case KEY_PROGRESS:
        t->progress = true;
        return 0;
    case KEY_THREADS:
        return tool_parse_count32(state, "--threads", text, 1, 256, &t->threads);
    case KEY_SEED:
        return tool_parse_count(state, "--seed", text, 0, UINT64_MAX, &t->seed);
    case KEY_MAX_MEMORY:
        if (!tool_size(text, &bytes) || !bytes)
            return tool_usage(state, "--max-memory: expected a size such as 500M, found '%s'", text);
        t->max_memory = bytes;
        return 0;
    case KEY_OUTSIDE:
        t->allow_outside = true;
        return 0;
    case 'h':
    case KEY_USAGE:
    case KEY_MAN:
    case KEY_BASH:
    case KEY_ZSH:
        if (!a->action) a->action = key;
        return 0;
    case ARGP_KEY_ARG:
        return parse_positional(a, text, state);
    case ARGP_KEY_END:
        return check_arguments(a, state);
    case ARGP_KEY_ERROR:
        a->next = state->next;
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static error_t parse_shared(int key, char *text, struct argp_state *state) {
    (void)text;
    arguments *a = state->input;
    if (key != KEY_NO_WELD && key != KEY_FLIP_INWARD) return ARGP_ERR_UNKNOWN;
    *(key == KEY_NO_WELD ? &a->tool->no_weld : &a->tool->flip_inward) = true;
    return 0;
}

/* The options of several commands: tables that end with {0}, or NULL. */
static const struct argp_option *get_tree_options(const tool_command *command) {
    return command->builds_tree ? tree_options : NULL;
}
static const struct argp_option *get_flip_options(const tool_command *command) {
    return command->turns_bodies ? flip_options : NULL;
}

/* --- Messages for words that argp could not parse --- */

/* Options whose long name begins with a word: the exact match, and the last prefix match. */
typedef struct lookup {
    const struct argp_option *exact;
    int prefixes;
    const struct argp_option *prefix;
} lookup;

static void look_up_option(lookup *found, const struct argp_option *options, const char *name,
                           size_t length) {
    for (; options && (options->name || options->key || options->doc); ++options) {
        if (!options->name || strncmp(options->name, name, length) != 0) continue;
        if (!options->name[length]) found->exact = options;
        found->prefix = options, ++found->prefixes;
    }
}

/* Adds the visible long names to `names`, which ends with NULL. Returns the new count. */
static int add_long_names(const struct argp_option *options, const char **names, int count, int most) {
    for (; options && (options->name || options->key || options->doc); ++options)
        if (options->name && !(options->flags & OPTION_HIDDEN) && count + 1 < most)
            names[count++] = options->name;
    names[count] = NULL;
    return count;
}

static void say_bad_long(const tool_command *command, const char *token) {
    const char *name = token + 2, *equals = strchr(name, '=');
    size_t length = equals ? (size_t)(equals - name) : strlen(name);
    lookup found = {0};
    look_up_option(&found, command->options, name, length);
    look_up_option(&found, get_tree_options(command), name, length);
    look_up_option(&found, get_flip_options(command), name, length);
    look_up_option(&found, common_options, name, length);
    const struct argp_option *option = found.exact ? found.exact : found.prefixes == 1 ? found.prefix : NULL;
    if (option && equals) {
        tool_complain("facetree %s: --%s takes no value", command->name, option->name);
    } else if (option) {
        tool_complain("facetree %s: --%s: expected a value (%s), found none", command->name, option->name,
                      option->arg ? option->arg : "");
    } else if (found.prefixes > 1) {
        tool_complain("facetree %s: '%.*s' is the beginning of several options", command->name,
                      (int)length + 2, token);
    } else {
        const char *names[64];
        char word[64];
        snprintf(word, sizeof word, "%.*s", (int)length, name);
        int count = add_long_names(command->options, names, 0, 64);
        count = add_long_names(get_tree_options(command), names, count, 64);
        count = add_long_names(get_flip_options(command), names, count, 64);
        add_long_names(common_options, names, count, 64);
        const char *nearest = tool_nearest(word, names);
        tool_complain("facetree %s: unknown option '%.*s'%s%s%s", command->name, (int)length + 2, token,
                      nearest ? "; did you mean --" : "", nearest ? nearest : "", nearest ? "?" : "");
    }
}

static bool has_letter(const struct argp_option *options, int letter) {
    for (; options && (options->name || options->key || options->doc); ++options)
        if (options->key == letter) return true;
    return false;
}

static void say_bad_option(const tool_command *command, int next, int argc, char **argv) {
    /* getopt is behind the word if that is a long option or ends with the letter, else on it. */
    const char *token = next > 1 && next <= argc ? argv[next - 1] : "";
    if (token[0] == '-' && token[1] == '-') {
        say_bad_long(command, token);
        return;
    }
    if (token[0] != '-' && next < argc) token = argv[next];
    for (const char *c = token + (*token == '-'); *c; ++c) {
        if (!has_letter(command->options, *c) && !has_letter(common_options, *c)) {
            tool_complain("facetree %s: unknown option '-%c'", command->name, *c);
            return;
        }
    }
    tool_complain("facetree %s: %s: expected a value, found none", command->name, token);
}

/* --- Help --- */

/* argp prints the part before \v, then the options, then the rest. Returns memory that the caller frees, or
 * NULL. */
static char *make_help_text(const tool_command *command) {
    char *doc = NULL;
    if (asprintf(&doc, "%s\n\v%s%s%s", command->summary, command->text ? command->text : "",
                 command->examples ? "\n\nExamples:\n" : "", command->examples ? command->examples : "") < 0)
        return NULL;
    doc[0] = (char)toupper((unsigned char)doc[0]);
    return doc;
}

/* --- The command --- */

/* Prints the help, the usage or the man page. */
static int print_answer(const tool_command *command, const struct argp *argp, int action) {
    char name[64];
    snprintf(name, sizeof name, "facetree %s", command->name);
    setenv("ARGP_HELP_FMT", "no-dup-args-note", 0);
    const manual_command manual = {command->name,
                                   command->summary,
                                   command->synopsis,
                                   command->text,
                                   command->examples,
                                   {command->options, get_tree_options(command), get_flip_options(command),
                                    common_options + (takes_output(command) ? 0 : OUTPUT_OPTIONS)}};
    if (action == KEY_MAN)
        manual_print_page(&manual, fct_version());
    else if (action == KEY_BASH)
        manual_print_bash(&manual);
    else if (action == KEY_ZSH)
        manual_print_zsh(&manual);
    else
        argp_help(argp, stdout,
                  action == 'h' ? ARGP_HELP_SHORT_USAGE | ARGP_HELP_LONG | ARGP_HELP_DOC : ARGP_HELP_USAGE,
                  name);
    return fflush(stdout) || ferror(stdout) ? TOOL_OUTPUT : TOOL_DONE;
}

static int run_command(tool *t, const tool_command *command, void *options) {
    tool_env_open(t, command->stages);
    int code = TOOL_DONE;
    if (t->output && tool_is_standard_output(t->output)) t->output = "-";
    for (int i = 0; i < t->input_count && code == TOOL_DONE; ++i) code = tool_note_input(t, t->inputs[i]);
    if (t->output && code == TOOL_DONE && command->endings)
        code = tool_check_kind(t, t->output, command->endings, command->other);
    if (t->output && code == TOOL_DONE && !command->output_folder) code = tool_check_output(t, t->output);
    if (code == TOOL_DONE) code = command->run(t, options);
    if (fflush(stdout) || ferror(stdout))
        code = tool_fail(t, TOOL_OUTPUT, "standard output cannot be written");
    return tool_env_close(t, code);
}

int tool_main(const tool_command *command, int argc, char **argv, void *options) {
    tool t = {.name = command->name, .start = tool_seconds()};
    arguments a = {.tool = &t, .command = command, .options = options};
    const struct argp own = {.options = command->options, .parser = command->parse};
    const struct argp tree = {.options = get_tree_options(command), .parser = parse_shared};
    const struct argp flip = {.options = get_flip_options(command), .parser = parse_shared};
    const struct argp_child children[] = {{&own, 0, NULL, 0}, {&tree, 0, NULL, 0}, {&flip, 0, NULL, 0}, {0}};
    char *doc = make_help_text(command);
    t.inputs = malloc(((size_t)argc + 1) * sizeof *t.inputs);
    int code = TOOL_MEMORY;
    if (!doc || !t.inputs) {
        tool_complain("facetree %s: out of memory", command->name);
        goto done;
    }
    /* A command without output has no options about it. */
    const struct argp argp = {.options = common_options + (takes_output(command) ? 0 : OUTPUT_OPTIONS),
                              .parser = parse_common,
                              .args_doc = command->synopsis,
                              .doc = doc,
                              .children = children};
    error_t error = argp_parse(&argp, argc, argv, ARGP_NO_ERRS | ARGP_NO_HELP | ARGP_NO_EXIT, NULL, &a);
    if (error && error != ECANCELED) say_bad_option(command, a.next, argc, argv);
    code = error      ? TOOL_USAGE
           : a.action ? print_answer(command, &argp, a.action)
                      : run_command(&t, command, options);
done:
    free(doc);
    free(t.inputs);
    return code;
}
