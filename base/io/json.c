/* base/io/json.c: see json.h. The text need not be valid. Cost: one pass over it. */
#include "base/io/json.h"

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

size_t fct_json_need(const char *text, size_t size) {
    size_t need = 4096, longest = 0;
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
        if (length > longest) longest = length;
    }
    return need + TOKEN_FACTOR * longest;
}

fct_result fct_json_check_memory(const fct_env *env, const char *name, const char *text, size_t size) {
    size_t need = fct_json_need(text, size);
    void *memory = fct_allocate(env, need, 1);
    if (!memory)
        return fct_fail(env, FCT_ERROR_MEMORY,
                        "%s: out of memory for a JSON text of %zu bytes, which needs %zu", name, size, need);
    fct_release(env, memory);
    return FCT_OK;
}
