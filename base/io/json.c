/* base/io/json.c: see json.h.
 *
 * Jansson collects a token in a buffer, ignores that the buffer cannot grow, and then reads behind its end.
 * Therefore it gets the text behind a number that is longer than every token of the text:
 *
 *     [0.000000000000000,
 *     the text
 *     ]
 *
 * The buffer grows within the zeros. When malloc sets ENOMEM there, the input ends. Later tokens fit.
 */
#include "base/io/json.h"

#include <errno.h>
#include <string.h>

/* Bytes of jansson 2.14 on 64-bit machines, with the overhead of malloc. Tables double when they are full, so
 * a slot counts three times: the old table and the new one exist together. */
enum {
    ARRAY_BYTES = 144,  /* the struct and its first table */
    OBJECT_BYTES = 320, /* the struct and its first buckets */
    VALUE_BYTES = 64,   /* a number, and its slot in an array */
    PAIR_BYTES = 160,   /* a member of an object without its key and value */
    STRING_BYTES = 80,  /* a string without its bytes */
    TOKEN_FACTOR = 4    /* the buffer of the longest token, its growth, and the copy of the string */
};

/* The length of the string that begins behind a quote, up to the closing quote or the end of the text. */
static size_t measure_string(const char *text, size_t size) {
    size_t i = 0;
    while (i < size && text[i] != '"') i += text[i] == '\\' && i + 1 < size ? 2 : 1;
    return i;
}

/* Returns the bound of fct_json_need. *longest receives at least the length of the longest token, without
 * quotes. The text need not be valid. */
static size_t measure_text(const char *text, size_t size, size_t *longest) {
    size_t need = 4096;
    *longest = 0;
    for (size_t i = 0, token = 0; i < size; ++i) {
        size_t length = 0;
        switch (text[i]) {
        case '[':
            need += ARRAY_BYTES + VALUE_BYTES;
            break;
        case '{':
            need += OBJECT_BYTES + VALUE_BYTES;
            break;
        case ',':
            need += VALUE_BYTES;
            break;
        case ':':
            need += PAIR_BYTES;
            break;
        case '"':
            length = measure_string(text + i + 1, size - i - 1);
            need += STRING_BYTES + length;
            i += length + 1;
            break;
        case ' ':
        case '\t':
        case '\r':
        case '\n':
        case ']':
        case '}':
            break;
        default: /* a number or a word */
            length = ++token;
        }
        if (length != token) token = 0;
        if (length > *longest) *longest = length;
    }
    return need + TOKEN_FACTOR * *longest;
}

size_t fct_json_need(const char *text, size_t size) {
    size_t longest;
    return measure_text(text, size, &longest);
}

/* The input of jansson: the number, the text, the end. */
typedef struct feed {
    const char *text;
    size_t size, zeros;
    enum { ZEROS, COMMA, TEXT, END } stage;
    size_t done; /* bytes of the stage that jansson has */
    bool starved;
} feed;

static const char before[] = "[0.", comma[] = ",\n", end[] = "]";

/* The next part of the input, at most `room` bytes; 0 at the end. The comma ends the number, so it comes
 * after the last check of its zeros. */
static size_t feed_jansson(void *buffer, size_t room, void *user) {
    feed *f = user;
    f->starved = f->starved || errno == ENOMEM;
    if (f->starved) return 0;
    size_t count = 0;
    if (f->stage == ZEROS) {
        size_t head = f->done ? 0 : sizeof before - 1;
        count = f->zeros - f->done < room - head ? f->zeros - f->done : room - head;
        memcpy(buffer, before, head);
        memset((char *)buffer + head, '0', count);
        f->done += count;
        if (f->done == f->zeros) f->stage = COMMA;
        return head + count;
    }
    if (f->stage == COMMA) {
        memcpy(buffer, comma, sizeof comma - 1);
        f->stage = f->size ? TEXT : END, f->done = 0;
        return sizeof comma - 1;
    }
    if (f->stage == TEXT) {
        count = f->size - f->done < room ? f->size - f->done : room;
        memcpy(buffer, f->text + f->done, count);
        f->done += count;
        if (f->done == f->size) f->stage = END, f->done = 0;
        return count;
    }
    if (f->done) return 0;
    memcpy(buffer, end, sizeof end - 1);
    f->done = 1;
    return sizeof end - 1;
}

/* Zeros for tokens of `longest` bytes and two quotes. The size of the buffer is a power of two, and it grows
 * when a token of size - 1 bytes gets another byte. The comma must not make it grow. */
static size_t count_zeros(size_t longest) {
    size_t zeros = longest + 16, length = sizeof "0." - 1 + zeros + 1; /* with the comma */
    return (length & (length - 1)) ? zeros : zeros + 1;
}

static fct_result fail_parse(const fct_env *env, const char *name, const feed *f, json_error_t *error) {
    if (f->starved || errno == ENOMEM || !error->text[0] ||
        json_error_code(error) == json_error_out_of_memory)
        return fct_fail_memory(env, "a JSON document");
    size_t head = sizeof before - 1 + f->zeros + sizeof comma - 1;
    bool too_short = (size_t)error->position > head + f->size && strncmp(error->text, "end of file", 11) != 0;
    for (char *c = error->text; *c; ++c)
        if ((unsigned char)*c < ' ') *c = ' ';
    return fct_fail(env, FCT_ERROR_DATA, "%s:%d:%d: %s", name, error->line - 1, error->column,
                    too_short ? "unexpected end of the text" : error->text);
}

fct_result fct_json_load(const fct_env *env, const char *name, const char *text, size_t size, size_t flags,
                         json_t **out) {
    *out = NULL;
    if (size > INT32_MAX)
        return fct_fail(env, FCT_ERROR_DATA, "%s: found %zu bytes of JSON, expected less than 2^31", name,
                        size);
    size_t longest, need = measure_text(text, size, &longest);
    void *memory = fct_allocate(env, need, 1);
    if (!memory)
        return fct_fail(env, FCT_ERROR_MEMORY,
                        "%s: out of memory for a JSON text of %zu bytes, which needs %zu", name, size, need);
    fct_release(env, memory);
    json_error_t error = {.line = 1};
    feed f = {.text = text, .size = size, .zeros = count_zeros(longest)};
    errno = 0;
    json_t *all = json_load_callback(feed_jansson, &f, flags, &error);
    if (!all) return fail_parse(env, name, &f, &error);
    fct_result result = FCT_OK;
    if (json_array_size(all) == 2)
        *out = json_incref(json_array_get(all, 1));
    else
        result = fct_fail(env, FCT_ERROR_DATA, "%s: found %zu JSON values, expected 1", name,
                          json_array_size(all) - 1);
    json_decref(all);
    return result;
}
