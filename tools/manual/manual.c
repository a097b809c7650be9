/* tools/manual/manual.c: see manual.h. */
#include "tools/manual/manual.h"

#include <ctype.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

/* --- Man page --- */

/* Prints text with roff's special characters escaped. start: the text begins a line. */
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

/* An empty line in the text begins a paragraph; a line with leading spaces stays a line of its own. */
static void print_roff_paragraphs(const char *text) {
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

static void print_roff_options(const struct argp_option *options) {
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

/* A word of the synopsis: options are bold, placeholders in capitals are italic. */
static void print_roff_word(const char *word, size_t length) {
    size_t begin = strcspn(word, "-ABCDEFGHIJKLMNOPQRSTUVWXYZ");
    if (begin > length) begin = length;
    size_t end = begin;
    while (end < length && !strchr("[]()|", word[end])) ++end;
    char part[64];
    snprintf(part, sizeof part, "%.*s", (int)begin, word);
    print_roff(part, false);
    if (end > begin) {
        fputs(word[begin] == '-' ? "\\fB" : "\\fI", stdout);
        snprintf(part, sizeof part, "%.*s", (int)(end - begin), word + begin);
        print_roff(part, false);
        fputs("\\fR", stdout);
    }
    snprintf(part, sizeof part, "%.*s", (int)(length - end), word + end);
    print_roff(part, false);
}

/* One line per way to call the command. */
static void print_roff_synopsis(const char *name, const char *text) {
    bool first = true;
    while (*text) {
        size_t line = strcspn(text, "\n");
        printf("%s\\fBfacetree %s\\fR", first ? "" : ".br\n", name);
        for (size_t at = 0; at < line;) {
            size_t length = strcspn(text + at, " \n");
            putchar(' ');
            print_roff_word(text + at, length);
            at += length + 1;
        }
        puts(" [\\fIOPTION\\fR...]");
        text += line + (text[line] == '\n');
        first = false;
    }
}

static void print_roff_examples(const char *text) {
    if (!text) return;
    puts(".SH EXAMPLES\n.nf");
    print_roff(text, true);
    puts("\n.fi");
}

void manual_print_page(const manual_command *command, const char *version) {
    printf(".TH FACETREE\\-");
    for (const char *c = command->name; *c; ++c) putchar(toupper((unsigned char)*c));
    printf(" 1 \"\" \"facetree %s\"\n.SH NAME\nfacetree\\-%s \\- ", version, command->name);
    print_roff(command->summary, false);
    puts("\n.SH SYNOPSIS");
    print_roff_synopsis(command->name, command->synopsis);
    puts(".SH DESCRIPTION");
    print_roff_paragraphs(command->text ? command->text : command->summary);
    puts(".SH OPTIONS");
    for (int i = 0; i < 4; ++i) print_roff_options(command->tables[i]);
    print_roff_examples(command->examples);
    puts(
        ".SH EXIT STATUS\n0 done; 1 the answer is no; 64 usage; 65 bad data; 66 input missing or unreadable; "
        "70 internal error; 73 output cannot be written; 75 out of memory or over --max-memory; "
        "128 + N ended by the signal N.\n"
        ".SH SEE ALSO\n.BR facetree (1)");
}

/* --- Completion --- */

/* Whether the table goes on; skips headings and hidden options. */
static bool find_visible(const struct argp_option **option) {
    const struct argp_option *o = *option;
    while (o && (o->name || o->key || o->doc) && (!o->name || (o->flags & OPTION_HIDDEN))) ++o;
    *option = o;
    return o && o->name;
}

void manual_print_bash(const manual_command *command) {
    printf("    %s) options='", command->name);
    for (int i = 0; i < 4; ++i)
        for (const struct argp_option *o = command->tables[i]; find_visible(&o); ++o)
            printf(" --%s", o->name);
    puts("' ;;");
}

/* The beginning of a description, up to a parenthesis or a semicolon, without characters that zsh reads. */
static void print_zsh_text(const char *text) {
    for (const char *c = text; *c && *c != '(' && *c != ';'; ++c) putchar(strchr("[]':\\", *c) ? ' ' : *c);
}

void manual_print_zsh(const manual_command *command) {
    printf("    %s) _arguments", command->name);
    for (int i = 0; i < 4; ++i)
        for (const struct argp_option *o = command->tables[i]; find_visible(&o); ++o) {
            printf(" \\\n        '--%s%s[", o->name, o->arg ? "=" : "");
            print_zsh_text(o->doc ? o->doc : o->name);
            printf("]%s%s%s'", o->arg ? ":" : "", o->arg ? o->arg : "", o->arg ? ":_files" : "");
        }
    puts(" \\\n        '*:file:_files' ;;");
}
