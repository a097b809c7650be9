/* base/io/json.h: the memory that parsing a JSON text needs. */
#ifndef FCT_BASE_JSON_H
#define FCT_BASE_JSON_H

#include "base/env.h"

/* An upper bound of the bytes that jansson allocates for the text, at the same time. */
size_t fct_json_need(const char *text, size_t size);
/* Whether the allocator has these bytes. Call it before jansson parses, because jansson 2.14 writes out of
 * bounds after a failed malloc, and because its memory counts against no limit. Errors: MEMORY. */
fct_result fct_json_check_memory(const fct_env *env, const char *name, const char *text, size_t size);

#endif
