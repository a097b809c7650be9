/* scene/read/json/json.c: typed values of a JSON document, and error messages. */
#include "scene/read/json/json.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

size_t fct_json_enter(fct_json *json, const char *key) {
    char clean[64];
    size_t before = json->length, room = sizeof json->path - before;
    int written = snprintf(json->path + before, room, "%s%s", before ? "." : "", fct_json_clean(key, clean));
    json->length += written < 0 ? 0 : ((size_t)written < room ? (size_t)written : room - 1);
    return before;
}

size_t fct_json_enter_index(fct_json *json, size_t index) {
    size_t before = json->length, room = sizeof json->path - before;
    int written = snprintf(json->path + before, room, "[%zu]", index);
    json->length += written < 0 ? 0 : ((size_t)written < room ? (size_t)written : room - 1);
    return before;
}

void fct_json_leave(fct_json *json, size_t length) {
    json->length = length;
    json->path[length] = 0;
}

fct_result fct_json_fail(const fct_json *json, const char *format, ...) {
    char text[512];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return fct_fail(json->env, FCT_ERROR_DATA, "%s: %s%s%s", json->file, json->path, json->length ? ": " : "",
                    text);
}

const char *fct_json_clean(const char *text, char out[64]) {
    size_t k = 0;
    for (; k < 63 && text[k]; ++k) out[k] = (unsigned char)text[k] < ' ' || text[k] == 127 ? '?' : text[k];
    out[k] = 0;
    return out;
}

static const char *describe_value(const json_t *value, char *buffer, size_t size) {
    char clean[64];
    switch (value ? (int)json_typeof(value) : -1) {
    case JSON_OBJECT:
        return "an object";
    case JSON_ARRAY:
        snprintf(buffer, size, "an array of %zu", json_array_size(value));
        return buffer;
    case JSON_STRING:
        snprintf(buffer, size, "\"%s\"", fct_json_clean(json_string_value(value), clean));
        return buffer;
    case JSON_INTEGER:
        snprintf(buffer, size, "%" JSON_INTEGER_FORMAT, json_integer_value(value));
        return buffer;
    case JSON_REAL:
        snprintf(buffer, size, "%g", json_real_value(value));
        return buffer;
    case JSON_TRUE:
        return "true";
    case JSON_FALSE:
        return "false";
    case JSON_NULL:
        return "null";
    default:
        return "nothing";
    }
}

fct_result fct_json_expected(const fct_json *json, const char *expected, const json_t *found) {
    char buffer[96];
    return fct_json_fail(json, "expected %s, found %s", expected,
                         describe_value(found, buffer, sizeof buffer));
}

fct_result fct_json_check_object(fct_json *json, const json_t *value, const char *const *allowed) {
    if (!json_is_object(value)) return fct_json_expected(json, "an object", value);
    const char *key;
    json_t *member;
    json_object_foreach((json_t *)value, key, member) {
        const char *const *known = allowed;
        while (*known && strcmp(*known, key) != 0) ++known;
        if (*known) continue;
        char list[256] = "", clean[64];
        size_t length = 0;
        for (known = allowed; *known && length < sizeof list - 1; ++known)
            length +=
                (size_t)snprintf(list + length, sizeof list - length, "%s%s", length ? ", " : "", *known);
        return fct_json_fail(json, "unknown key \"%s\", expected one of %s", fct_json_clean(key, clean),
                             list);
    }
    return FCT_OK;
}

fct_result fct_json_number(const fct_json *json, const json_t *value, double *out) {
    if (!json_is_number(value)) return fct_json_expected(json, "a number", value);
    *out = json_number_value(value);
    if (!(fabs(*out) <= FLT_MAX)) return fct_json_expected(json, "a number that fits a float", value);
    return FCT_OK;
}

fct_result fct_json_numbers(fct_json *json, const json_t *value, size_t count, double *out) {
    if (!json_is_array(value) || json_array_size(value) != count) {
        char expected[48];
        snprintf(expected, sizeof expected, "an array of %zu numbers", count);
        return fct_json_expected(json, expected, value);
    }
    for (size_t k = 0; k < count; ++k) {
        size_t before = fct_json_enter_index(json, k);
        fct_result result = fct_json_number(json, json_array_get(value, k), out + k);
        if (result != FCT_OK) return result;
        fct_json_leave(json, before);
    }
    return FCT_OK;
}

fct_result fct_json_spread(fct_json *json, const json_t *value, size_t count, double *out) {
    if (!json_is_number(value)) return fct_json_numbers(json, value, count, out);
    fct_result result = fct_json_number(json, value, out);
    for (size_t k = 1; k < count; ++k) out[k] = out[0];
    return result;
}

fct_result fct_json_string(const fct_json *json, const json_t *value, size_t size, const char **out) {
    if (!json_is_string(value)) return fct_json_expected(json, "a string", value);
    *out = json_string_value(value);
    size_t length = strlen(*out);
    if (length == 0 || length >= size)
        return fct_json_fail(json, "expected a string of 1 to %zu bytes, found one of %zu", size - 1, length);
    if (json_string_length(value) != length) return fct_json_fail(json, "the string holds a zero byte");
    return FCT_OK;
}
