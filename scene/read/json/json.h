/* scene/read/json/json.h: typed values out of a JSON document, and errors that name the file and the place.
 */
#ifndef FCT_SCENE_JSON_H
#define FCT_SCENE_JSON_H

#include <jansson.h>

#include "base/env.h"

/* Where reading is: `path` looks like instances[3].transform. */
typedef struct fct_json {
    const fct_env *env;
    const char *file;
    char path[256];
    size_t length;
} fct_json;

/* Enter a member or an element; both return the length to hand to fct_json_leave. */
size_t fct_json_enter(fct_json *json, const char *key);
size_t fct_json_enter_index(fct_json *json, size_t index);
void fct_json_leave(fct_json *json, size_t length);

/* DATA with "file: path: ...". */
fct_result fct_json_fail(const fct_json *json, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* DATA with what was expected, and `found` described. */
fct_result fct_json_expected(const fct_json *json, const char *expected, const json_t *found);
/* Copies a key for a message: cut, and control characters replaced. */
const char *fct_json_clean(const char *text, char out[64]);

/* The document, at most 2^31 bytes. Duplicate keys are errors. Errors: DATA with line and column, MEMORY. */
fct_result fct_json_parse(fct_json *json, const char *text, size_t size, json_t **out);

/* Value has type object, and every key is one of `allowed` (ended by NULL). */
fct_result fct_json_check_object(fct_json *json, const json_t *value, const char *const *allowed);
/* A number that a float can hold. */
fct_result fct_json_number(const fct_json *json, const json_t *value, double *out);
/* Exactly `count` of them. */
fct_result fct_json_numbers(fct_json *json, const json_t *value, size_t count, double *out);
/* `count` numbers, or one for all. */
fct_result fct_json_spread(fct_json *json, const json_t *value, size_t count, double *out);
/* A string of 1 to size - 1 bytes. */
fct_result fct_json_string(const fct_json *json, const json_t *value, size_t size, const char **out);

#endif
