/* mesh/text/text.h: reads numbers and words from text in memory, and counts lines for messages.
 *
 * A line ends with LF, CR LF or CR.
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

/* Text of `size` bytes. Skips a byte order mark of UTF-8. */
fct_text fct_text_begin(const fct_env *env, const char *name, const void *data, size_t size);

static inline bool fct_text_is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\v' || c == '\f';
}

static inline bool fct_text_is_line_end(char c) {
    return c == '\n' || c == '\r';
}

/* Skips blanks but stops at a line end. */
static inline void fct_text_skip_blanks(fct_text *t) {
    while (t->p < t->end && fct_text_is_blank(*t->p)) ++t->p;
}

/* Skips blanks. Returns whether p is then at the end of the line or file. */
static inline bool fct_text_at_line_end(fct_text *t) {
    fct_text_skip_blanks(t);
    return t->p == t->end || fct_text_is_line_end(*t->p);
}

/* Moves to the start of the next line, or to the end of the file. */
void fct_text_next_line(fct_text *t);
/* Skips blanks, line ends and lines that begin with `comment` (0: none). False at the end of the file. */
bool fct_text_skip_lines(fct_text *t, char comment);

/* Returns the next word of the line and moves p behind it. The length is 0 at the end of the line. */
const char *fct_text_word(fct_text *t, size_t *length);
bool fct_text_word_is(const char *word, size_t length, const char *expected);
/* These ignore the case of ASCII letters. `expected` is in lower case. */
bool fct_text_begins_any_case(const char *word, size_t length, const char *expected);
bool fct_text_word_is_any_case(const char *word, size_t length, const char *expected);

/* Returns the rest of the line without blanks at its ends, and moves p to the line end. */
const char *fct_text_rest(fct_text *t, size_t *length);

/* Reads a number on this line. Skips blanks before it. Returns false, with p behind the blanks, if no number
 * follows or if the number does not end at a blank or line end. An overflowing double becomes infinity. */
bool fct_text_double(fct_text *t, double *value);
bool fct_text_integer(fct_text *t, int64_t *value);

/* Reads a finite number that fits a float. `what` names it in messages. Errors: DATA, with the line and the
 * word found. */
fct_result fct_text_float(fct_text *t, const char *what, float *value);
/* The same, with the digits of a double. */
fct_result fct_text_coordinate(fct_text *t, const char *what, double *value);

/* Reads a number that may be infinite or no number: "nan", "inf" or "1.#IND" in any case, with a sign or
 * letters behind. *value is then not finite. Errors: DATA, as fct_text_float. */
fct_result fct_text_any_double(fct_text *t, const char *what, double *value);

enum { FCT_TEXT_SHOWN = 48 };
/* Copies a word for a message: at most 40 bytes, `?` instead of bytes that are not printable. Returns
 * `shown`. */
const char *fct_text_show(const char *word, size_t length, char shown[FCT_TEXT_SHOWN]);
/* Fails with "name:line: expected WHAT, found 'word'". */
fct_result fct_text_expected(fct_text *t, const char *what);
/* Fails with "name:line: ...". */
fct_result fct_text_fail(const fct_text *t, const char *format, ...) __attribute__((format(printf, 2, 3)));

#endif
