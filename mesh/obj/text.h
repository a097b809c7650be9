/* mesh/obj/text.h: the lines and words of an OBJ file.
 *
 * A backslash at the end of a line continues the line. It counts as a blank. `#` begins a comment where a
 * word may begin. Names of objects, groups, materials and libraries take the rest of their line as it is.
 */
#ifndef FCT_MESH_OBJ_TEXT_H
#define FCT_MESH_OBJ_TEXT_H

#include <string.h>

#include "mesh/text/text.h"

static inline bool fct_obj_at_continuation(const fct_text *t) {
    return t->end - t->p > 1 && *t->p == '\\' && fct_text_is_line_end(t->p[1]);
}

static inline void fct_obj_skip_blanks(fct_text *t) {
    fct_text_skip_blanks(t);
    while (fct_obj_at_continuation(t)) {
        fct_text_next_line(t);
        fct_text_skip_blanks(t);
    }
}

/* Skips blanks. Returns whether the statement ends there: at a comment, a line end or the end of the file. */
static inline bool fct_obj_at_line_end(fct_text *t) {
    fct_obj_skip_blanks(t);
    return t->p == t->end || fct_text_is_line_end(*t->p) || *t->p == '#';
}

/* Moves to the end of the word. */
static inline void fct_obj_skip_word(fct_text *t) {
    for (; t->p < t->end; ++t->p) {
        char c = *t->p;
        if ((unsigned char)c > ' ' && c != '\\') continue; /* because most bytes are such */
        if (fct_text_is_line_end(c) || fct_text_is_blank(c) || fct_obj_at_continuation(t)) return;
    }
}

/* Returns the first word of the line and moves p behind it. The length is 0 if there is none. */
static inline const char *fct_obj_statement(fct_text *t, size_t *length) {
    *length = 0;
    if (fct_obj_at_line_end(t)) return t->p;
    const char *word = t->p;
    fct_obj_skip_word(t);
    *length = (size_t)(t->p - word);
    return word;
}

/* `fo` is the word of older files. */
static inline bool fct_obj_is_face(const char *word, size_t length) {
    return (length == 1 && *word == 'f') || (length == 2 && word[0] == 'f' && word[1] == 'o');
}

/* Whether a name follows the word. */
static inline bool fct_obj_takes_name(const char *word, size_t length) {
    return (length == 1 && (*word == 'o' || *word == 'g')) ||
           (length == 6 && (!memcmp(word, "usemtl", 6) || !memcmp(word, "mtllib", 6)));
}

/* Moves to the end of the line and returns the number of words. */
static inline size_t fct_obj_count_words(fct_text *t) {
    size_t count = 0;
    for (; !fct_obj_at_line_end(t); ++count) fct_obj_skip_word(t);
    return count;
}

#endif
