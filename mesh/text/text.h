/* mesh/text/text.h: numbers and words from text in memory, with line numbers for messages.
 *
 * Numbers are read without regard to the locale: up to 19 digits into an integer, scaled by a power of ten.
 * With at most 15 digits and a power within 10^22 the double is the nearest one, and always the float rounded
 * from it is the one that was printed with 9 digits or more.
 */
#ifndef FCT_MESH_TEXT_H
#define FCT_MESH_TEXT_H

#include "base/env.h"

typedef struct fct_text {
    const char *p, *end;
    const fct_env *env;
    const char *name; /* of the file, for messages */
    uint64_t line;    /* of p, from 1 */
} fct_text;

static inline bool fct_text_is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

/* Skips blanks, but no line end. */
static inline void fct_text_skip_blanks(fct_text *t) {
    while (t->p < t->end && fct_text_is_blank(*t->p)) ++t->p;
}

/* Whether nothing but blanks is left on the line (p then stands at its end). */
static inline bool fct_text_at_line_end(fct_text *t) {
    fct_text_skip_blanks(t);
    return t->p == t->end || *t->p == '\n';
}

/* To the begin of the next line, or the end. */
void fct_text_next_line(fct_text *t);
/* Skips blanks and line ends, and whole lines that begin with `comment` (0: none). False at the end. */
bool fct_text_skip_lines(fct_text *t, char comment);

/* The next word of the line: its begin and length; length 0 at the line's end. p moves behind it. */
const char *fct_text_word(fct_text *t, size_t *length);
bool fct_text_word_is(const char *word, size_t length, const char *expected);

/* A number after blanks on this line. False, with p unmoved behind the blanks, when there is none, or when
 * letters follow it directly. Overflow gives infinity. */
bool fct_text_double(fct_text *t, double *value);
bool fct_text_integer(fct_text *t, int64_t *value);

/* A finite number that fits a float. Errors: DATA with the line and what was found. */
fct_result fct_text_float(fct_text *t, const char *what, float *value);

/* "name:line: expected WHAT, found 'word'". */
fct_result fct_text_expected(fct_text *t, const char *what);
/* "name:line: ...". */
fct_result fct_text_fail(const fct_text *t, const char *format, ...) __attribute__((format(printf, 2, 3)));

#endif
