/* scene/read/json/json.h: typed values of a JSON document, and errors that name the file and the place. */
#ifndef FCT_SCENE_JSON_H
#define FCT_SCENE_JSON_H

#include <jansson.h>

#include "base/env.h"

/* The place that is being read: `path` looks like instances[3].transform. */
typedef struct fct_json {
    const fct_env *env;
    const char *file;
    char path[256];
    size_t length;
} fct_json;

/* Append a member or an element to the path, and return the length to pass to fct_json_leave. */
size_t fct_json_enter(fct_json *json, const char *key);
size_t fct_json_enter_index(fct_json *json, size_t index);
void fct_json_leave(fct_json *json, size_t length);

/* Sends the message "file: path: ..." and returns DATA. */
fct_result fct_json_fail(const fct_json *json, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* Sends "expected ..., found ..." with a description of `found`, and returns DATA. */
fct_result fct_json_expected(const fct_json *json, const char *expected, const json_t *found);
/* Copies a key for a message: cut to 63 bytes, control characters replaced by '?'. */
const char *fct_json_clean(const char *text, char out[64]);

/* Checks that the value is an object and that each key is one of `allowed` (ended by NULL). Errors: DATA. */
fct_result fct_json_check_object(fct_json *json, const json_t *value, const char *const *allowed);
/* The values below. Errors: DATA. */
/* A number that fits a float. */
fct_result fct_json_number(const fct_json *json, const json_t *value, double *out);
/* An array of `count` such numbers. */
fct_result fct_json_numbers(fct_json *json, const json_t *value, size_t count, double *out);
/* The same, or one number for all. */
fct_result fct_json_spread(fct_json *json, const json_t *value, size_t count, double *out);
/* A string of 1 to size - 1 bytes. */
fct_result fct_json_string(const fct_json *json, const json_t *value, size_t size, const char **out);

#endif
