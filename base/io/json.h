/* base/io/json.h: parses JSON with jansson 2.14, and never out of bounds when memory is exhausted. */
#ifndef FCT_BASE_JSON_H
#define FCT_BASE_JSON_H

#include <jansson.h>

#include "base/env.h"

/* An upper bound of the bytes that fct_json_load allocates through jansson for the text, at the same time. */
size_t fct_json_need(const char *text, size_t size);

/* Parses a text of less than 2^31 bytes; `name` begins the messages. The memory counts against the allocator
 * of env before jansson takes it, because jansson's memory counts against no limit. flags: of json_loadb. The
 * caller calls json_decref(*out). Errors: DATA with line and column, MEMORY. */
fct_result fct_json_load(const fct_env *env, const char *name, const char *text, size_t size, size_t flags,
                         json_t **out);

#endif
