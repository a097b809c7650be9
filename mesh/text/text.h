/* mesh/text/text.h: reads numbers and words from text in memory, and counts lines for messages.
 *
 * Numbers do not depend on the locale. The first 19 digits form an integer, which is scaled by a power of
 * ten. With at most 15 digits and a power within 10^22, the double is the nearest one. A float that was
 * printed with 9 digits or more reads back as the same float.
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

/* Skips blanks but stops at a line end. */
static inline void fct_text_skip_blanks(fct_text *t) {
    while (t->p < t->end && fct_text_is_blank(*t->p)) ++t->p;
}

/* Skips blanks. Returns whether p is then at the end of the line or file. */
static inline bool fct_text_at_line_end(fct_text *t) {
    fct_text_skip_blanks(t);
    return t->p == t->end || *t->p == '\n';
}

/* Moves to the start of the next line, or to the end of the file. */
void fct_text_next_line(fct_text *t);
/* Skips blanks, line ends and lines that begin with `comment` (0: none). False at the end of the file. */
bool fct_text_skip_lines(fct_text *t, char comment);

/* Returns the next word of the line and moves p behind it. The length is 0 at the end of the line. */
const char *fct_text_word(fct_text *t, size_t *length);
bool fct_text_word_is(const char *word, size_t length, const char *expected);

/* Reads a number on this line. Skips blanks before it. Returns false, with p behind the blanks, if no number
 * follows or if the number does not end at a blank or line end. An overflowing double becomes infinity. */
bool fct_text_double(fct_text *t, double *value);
bool fct_text_integer(fct_text *t, int64_t *value);

/* Reads a finite number that fits a float. `what` names it in messages. Errors: DATA, with the line and the
 * word found. */
fct_result fct_text_float(fct_text *t, const char *what, float *value);

/* Fails with "name:line: expected WHAT, found 'word'". */
fct_result fct_text_expected(fct_text *t, const char *what);
/* Fails with "name:line: ...". */
fct_result fct_text_fail(const fct_text *t, const char *format, ...) __attribute__((format(printf, 2, 3)));

#endif
