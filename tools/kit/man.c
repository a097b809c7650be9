/* tools/kit/man.c: a man page (roff) from the same tables that --help prints. */
#include "tools/kit/tool.h"

#include <ctype.h>
#include <string.h>

/* Text with roff's own characters escaped; `start` when it begins a line. */
static void print_roff(const char *text, bool start) {
    for (; *text; ++text) {
        if (start && (*text == '.' || *text == '\'')) fputs("\\&", stdout);
        start = *text == '\n';
        if (*text == '\\')
            fputs("\\e", stdout);
        else if (*text == '-')
            fputs("\\-", stdout);
        else
            putchar(*text);
    }
}

/* An empty line in the text begins a paragraph, a line with leading spaces stands alone. */
static void print_paragraphs(const char *text) {
    while (*text) {
        const char *end = strchr(text, '\n');
        size_t length = end ? (size_t)(end - text) : strlen(text);
        char line[512];
        snprintf(line, sizeof line, "%.*s", (int)length, text);
        if (!length) {
            puts(".PP");
        } else {
            if (line[0] == ' ') puts(".br");
            print_roff(line + strspn(line, " "), true);
            putchar('\n');
        }
        text += length + (end != NULL);
    }
}

static void print_options(const struct argp_option *options) {
    for (; options && (options->name || options->key || options->doc); ++options) {
        if (options->flags & OPTION_HIDDEN) continue;
        bool letter = options->key > 0 && options->key < 256 && isgraph(options->key);
        if (!options->name && !letter) continue;
        fputs(".TP\n\\fB", stdout);
        if (letter) printf("\\-%c", options->key);
        if (letter && options->name) fputs("\\fR, \\fB", stdout);
        if (options->name) {
            fputs("\\-\\-", stdout);
            print_roff(options->name, false);
        }
        fputs("\\fR", stdout);
        if (options->arg) {
            fputs(options->name ? "=\\fI" : " \\fI", stdout);
            print_roff(options->arg, false);
            fputs("\\fR", stdout);
        }
        putchar('\n');
        print_roff(options->doc ? options->doc : "", true);
        putchar('\n');
    }
}

void tool_print_man(const tool_command *command, const struct argp_option *common) {
    printf(".TH FACETREE\\-");
    for (const char *c = command->name; *c; ++c) putchar(toupper((unsigned char)*c));
    printf(" 1 \"\" \"facetree %s\"\n.SH NAME\nfacetree\\-%s \\- ", fct_version(), command->name);
    print_roff(command->summary, false);
    printf("\n.SH SYNOPSIS\n\\fBfacetree %s\\fR [\\fIOPTION\\fR...] ", command->name);
    print_roff(command->synopsis, false);
    puts("\n.SH DESCRIPTION");
    print_paragraphs(command->text ? command->text : command->summary);
    puts(".SH OPTIONS");
    print_options(command->options);
    print_options(common + (command->output == TOOL_OUTPUT_UNUSED));
    puts(
        ".SH EXIT STATUS\n0 done; 1 the answer is no; 64 usage; 65 bad data; 66 input missing or unreadable; "
        "70 internal error; 73 output cannot be written; 75 out of memory; 130 interrupted.\n"
        ".SH SEE ALSO\n.BR facetree (1)");
}
