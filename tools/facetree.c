/* tools/facetree.c: the program: finds the subcommand and runs it. */
#include <stdlib.h>
#include <string.h>

#include "tools/commands.h"
#include "tools/guard/signals.h"
#include "tools/kit/command.h"
#include "tools/kit/options.h"

static const struct {
    const char *name, *summary;
    int (*run)(int argc, char **argv);
} commands[] = {
    {"make", "make an example scene or mesh", tool_make},
    {"info", "count what a file holds; check a hierarchy file", tool_info},
    {"cluster", "build the hierarchy of face clusters of a mesh", tool_cluster},
    {"partition", "cut a mesh into clusters, flat pieces or charts", tool_partition},
    {"meshlets", "cut a mesh into meshlets for mesh shaders", tool_meshlets},
    {"boxes", "write the oriented boxes of clusters", tool_boxes},
    {"raycast", "shoot rays; compare both backends", tool_raycast},
    {"closest", "find the nearest surface points", tool_closest},
    {"collide", "find where two meshes touch, or how far apart they are", tool_collide},
    {"bake", "compute the radiosity of a scene as vertex colours", tool_bake},
    {"simplify", "reduce a mesh, keeping its shape and colours", tool_simplify},
    {"level", "write a level of a progressive mesh", tool_level},
    {"convert", "write a mesh in another format", tool_convert},
    {"compare", "measure the distance between two meshes", tool_compare},
    {"render", "draw a mesh, a scene, its clusters or its boxes", tool_render},
};
enum { COMMANDS = sizeof commands / sizeof *commands };

static int run_command(int index, int argc, char **argv) {
    char name[64];
    snprintf(name, sizeof name, "facetree %s", commands[index].name);
    argv[0] = name;
    return commands[index].run(argc, argv);
}

static int find_command(const char *name) {
    for (int i = 0; i < COMMANDS; ++i)
        if (!strcmp(name, commands[i].name)) return i;
    return -1;
}

static int reject_command(const char *name) {
    const char *names[COMMANDS + 2] = {"help"};
    for (int i = 0; i < COMMANDS; ++i) names[i + 1] = commands[i].name;
    const char *nearest = tool_nearest(name, names);
    if (nearest)
        tool_complain("facetree: unknown command '%s'; did you mean '%s'?", name, nearest);
    else
        tool_complain("facetree: unknown command '%s'; 'facetree help' lists them", name);
    return TOOL_USAGE;
}

static int print_overview(void) {
    puts("Usage: facetree COMMAND [OPTION...] ...\n"
         "Groups the triangles of a mesh into a tree of face clusters, for rays, radiosity and "
         "simplification.\n");
    for (int i = 0; i < COMMANDS; ++i) printf("  %-10s %s\n", commands[i].name, commands[i].summary);
    puts("  help       explain a command: facetree help COMMAND\n\n"
         "      --help     print this\n"
         "      --version  print the version and the SIMD variant in use");
    return fflush(stdout) ? TOOL_OUTPUT : TOOL_DONE;
}

static int print_overview_page(void) {
    printf(".TH FACETREE 1 \"\" \"facetree %s\"\n"
           ".SH NAME\nfacetree \\- trees of face clusters of triangle meshes\n"
           ".SH SYNOPSIS\n\\fBfacetree\\fR \\fICOMMAND\\fR [\\fIOPTION\\fR...] ...\n"
           ".SH DESCRIPTION\nGroups the triangles of a mesh into a tree of nearly flat, compact face "
           "clusters, and "
           "uses it for rays, for radiosity and for simplification.\n.SH COMMANDS\n",
           fct_version());
    for (int i = 0; i < COMMANDS; ++i)
        printf(".TP\n.BR facetree\\-%s (1)\n%s\n", commands[i].name, commands[i].summary);
    return fflush(stdout) ? TOOL_OUTPUT : TOOL_DONE;
}

/* Runs a command with one hidden option, such as --man. */
static int ask_command(int index, const char *option) {
    char action[8];
    snprintf(action, sizeof action, "%s", option);
    char *words[] = {NULL, action, NULL};
    return run_command(index, 2, words);
}

static int print_bash_completion(void) {
    puts("# bash completion of facetree\n"
         "_facetree() {\n"
         "    local word=${COMP_WORDS[COMP_CWORD]} options=\n"
         "    COMPREPLY=()");
    printf("    local commands='help");
    for (int i = 0; i < COMMANDS; ++i) printf(" %s", commands[i].name);
    puts("'\n"
         "    if [ \"$COMP_CWORD\" = 1 ] || { [ \"$COMP_CWORD\" = 2 ] && [ \"${COMP_WORDS[1]}\" = help ]; }; "
         "then\n"
         "        COMPREPLY=($(compgen -W \"$commands --help --version\" -- \"$word\"))\n"
         "        return\n"
         "    fi\n"
         "    case ${COMP_WORDS[1]} in");
    int code = TOOL_DONE;
    for (int i = 0; i < COMMANDS && code == TOOL_DONE; ++i) code = ask_command(i, "--bash");
    puts("    esac\n"
         "    case $word in\n"
         "    -*) COMPREPLY=($(compgen -W \"$options\" -- \"$word\")) ;;\n"
         "    esac\n"
         "}\n"
         "complete -o default -F _facetree facetree");
    return code;
}

static int print_zsh_completion(void) {
    puts("#compdef facetree\n"
         "_facetree() {\n"
         "    local -a commands\n"
         "    commands=(");
    for (int i = 0; i < COMMANDS; ++i) printf("        '%s:%s'\n", commands[i].name, commands[i].summary);
    puts("        'help:explain a command'\n"
         "    )\n"
         "    if ((CURRENT == 2)) || { ((CURRENT == 3)) && [[ $words[2] = help ]]; }; then\n"
         "        _describe command commands\n"
         "        return\n"
         "    fi\n"
         "    local command=$words[2]\n"
         "    shift words\n"
         "    ((CURRENT -= 1))\n"
         "    case $command in");
    int code = TOOL_DONE;
    for (int i = 0; i < COMMANDS && code == TOOL_DONE; ++i) code = ask_command(i, "--zsh");
    puts("    esac\n"
         "}\n"
         "_facetree \"$@\"");
    return code;
}

/* help [COMMAND]; the build also calls help --man [COMMAND], help --bash and help --zsh. */
static int run_help(int argc, char **argv) {
    if (argc == 2 && !strcmp(argv[1], "--bash")) return print_bash_completion();
    if (argc == 2 && !strcmp(argv[1], "--zsh")) return print_zsh_completion();
    bool man = argc > 1 && !strcmp(argv[1], "--man");
    const char *name = argc > 1 + man ? argv[1 + man] : NULL;
    if (argc > 2 + man) {
        tool_complain("facetree help: expected one command, found %d", argc - 1 - man);
        return TOOL_USAGE;
    }
    if (!name) return man ? print_overview_page() : print_overview();
    int index = find_command(name);
    return index < 0 ? reject_command(name) : ask_command(index, man ? "--man" : "--help");
}

typedef struct top {
    int argc;
    char **argv;
    int code;
} top;

/* The first word that is not an option is the command; the remaining words belong to it. */
static error_t parse_word(int key, char *text, struct argp_state *state) {
    top *t = state->input;
    int first = state->next - 1, index;
    switch (key) {
    case 'h':
        t->code = print_overview();
        break;
    case 'V':
        printf("facetree %s (%s)\n", fct_version(), fct_simd_variant());
        t->code = fflush(stdout) ? TOOL_OUTPUT : TOOL_DONE;
        break;
    case ARGP_KEY_ARG:
        if (!strcmp(text, "help"))
            t->code = run_help(t->argc - first, t->argv + first);
        else if ((index = find_command(text)) >= 0)
            t->code = run_command(index, t->argc - first, t->argv + first);
        else
            t->code = reject_command(text);
        break;
    case ARGP_KEY_NO_ARGS:
        t->code = TOOL_USAGE;
        tool_complain("facetree: expected a command; 'facetree help' lists them");
        break;
    default:
        return ARGP_ERR_UNKNOWN;
    }
    return ECANCELED; /* the command line is done */
}

static void print_message(void *user, fct_severity severity, const char *text) {
    (void)user, (void)severity;
    tool_complain("facetree: %s", text);
}

int main(int argc, char **argv) {
    guard_open_streams();
    fct_env env = fct_env_default();
    env.message = print_message;
    if (fct_simd_check(&env) != FCT_OK) return TOOL_USAGE;
    static const struct argp_option options[] = {
        {"help", 'h', NULL, 0, NULL, 0}, {"version", 'V', NULL, 0, NULL, 0}, {0}};
    const struct argp argp = {.options = options, .parser = parse_word};
    top t = {argc, argv, TOOL_USAGE};
    error_t error =
        argp_parse(&argp, argc, argv, ARGP_IN_ORDER | ARGP_NO_ERRS | ARGP_NO_HELP | ARGP_NO_EXIT, NULL, &t);
    if (error != ECANCELED)
        tool_complain("facetree: unknown option; 'facetree help' lists commands and options");
    return t.code;
}
