/* tools/manual/manual.h: man pages, and the completion of command lines, from the tables of options. */
#ifndef FCT_TOOLS_MANUAL_H
#define FCT_TOOLS_MANUAL_H

#include <argp.h>

/* What a manual says about a command. */
typedef struct manual_command {
    const char *name, *summary;
    const char *synopsis;                /* one line per way to call it */
    const char *text, *examples;         /* NULL: none. examples: one command line per line */
    const struct argp_option *tables[4]; /* each ends with {0}; NULL: none */
} manual_command;

void manual_print_page(const manual_command *command, const char *version);
/* One branch of the shell's `case` over the commands. */
void manual_print_bash(const manual_command *command);
void manual_print_zsh(const manual_command *command);

#endif
