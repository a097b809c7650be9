/* tools/kit/options.h: parsers of option values. Each returns 0, or prints one line on stderr and returns the
 * value that an argp parser must return. `name` is the option as the user wrote it. */
#ifndef FCT_TOOLS_OPTIONS_H
#define FCT_TOOLS_OPTIONS_H

#include <argp.h>

#include "facetree/bvh.h"

/* Prints a usage error. */
error_t tool_usage(struct argp_state *state, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* A whole number in [least, most]. */
error_t tool_parse_count(struct argp_state *state, const char *name, const char *text, uint64_t least,
                         uint64_t most, uint64_t *value);
error_t tool_parse_count32(struct argp_state *state, const char *name, const char *text, uint32_t least,
                           uint32_t most, uint32_t *value);
/* A number in [least, most]; "inf" if most is INFINITY. */
error_t tool_parse_real(struct argp_state *state, const char *name, const char *text, double least,
                        double most, double *value);

/* A number above 0 and at most 1. */
error_t tool_parse_ratio(struct argp_state *state, const char *name, const char *text, double *value);

/* A length of at least 0 in the mesh's unit; with % a share of the diagonal of the bounds. */
typedef struct tool_length {
    double value; /* negative: not given */
    bool percent;
} tool_length;
error_t tool_parse_length(struct argp_state *state, const char *name, const char *text, tool_length *length);

/* `names` ends with NULL. *index receives the position of `text` in it. */
error_t tool_parse_choice(struct argp_state *state, const char *name, const char *text,
                          const char *const *names, int *index);
/* obb or embree. */
error_t tool_parse_backend(struct argp_state *state, const char *name, const char *text,
                           fct_backend *backend);

/* "64M", "1.5G", "1000000". False for any other text. */
bool tool_size(const char *text, size_t *bytes);
/* The entry of `names` (ends with NULL) that a mistyped word is nearest to; NULL if none is near. */
const char *tool_nearest(const char *word, const char *const *names);

#endif
