/* tools/kit/options.c: see options.h. */
#include "tools/kit/options.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "tools/kit/env.h"

error_t tool_usage(struct argp_state *state, const char *format, ...) {
    char text[1024];
    va_list values;
    va_start(values, format);
    vsnprintf(text, sizeof text, format, values);
    va_end(values);
    tool_clean_text(text);
    fprintf(stderr, "%s: %s\n", state->name, text);
    return ECANCELED;
}

error_t tool_parse_count(struct argp_state *state, const char *name, const char *text, uint64_t least,
                         uint64_t most, uint64_t *value) {
    char *end = NULL;
    errno = 0;
    unsigned long long number = isdigit((unsigned char)*text) ? strtoull(text, &end, 10) : 0;
    if (!end || *end || errno || number < least || number > most)
        return tool_usage(state, "%s: expected a whole number from %" PRIu64 " to %" PRIu64 ", found '%s'",
                          name, least, most, text);
    *value = number;
    return 0;
}

error_t tool_parse_count32(struct argp_state *state, const char *name, const char *text, uint32_t least,
                           uint32_t most, uint32_t *value) {
    uint64_t wide = 0;
    error_t error = tool_parse_count(state, name, text, least, most, &wide);
    if (!error) *value = (uint32_t)wide;
    return error;
}

error_t tool_parse_real(struct argp_state *state, const char *name, const char *text, double least,
                        double most, double *value) {
    char *end = NULL;
    double number = *text && !isspace((unsigned char)*text) ? strtod(text, &end) : 0;
    if (!end || *end || !(number >= least && number <= most)) {
        if (isinf(most) && isinf(least))
            return tool_usage(state, "%s: expected a number, found '%s'", name, text);
        if (isinf(most))
            return tool_usage(state, "%s: expected a number of at least %g, found '%s'", name, least, text);
        return tool_usage(state, "%s: expected a number from %g to %g, found '%s'", name, least, most, text);
    }
    *value = number;
    return 0;
}

error_t tool_parse_ratio(struct argp_state *state, const char *name, const char *text, double *value) {
    error_t error = tool_parse_real(state, name, text, 0, 1, value);
    if (!error && *value == 0)
        return tool_usage(state, "%s: expected a number above 0, found '%s'", name, text);
    return error;
}

error_t tool_parse_length(struct argp_state *state, const char *name, const char *text, tool_length *length) {
    char number[64];
    size_t size = strlen(text);
    length->percent = size > 1 && size < sizeof number && text[size - 1] == '%';
    if (!length->percent) return tool_parse_real(state, name, text, 0, INFINITY, &length->value);
    snprintf(number, sizeof number, "%.*s", (int)size - 1, text);
    return tool_parse_real(state, name, number, 0, INFINITY, &length->value);
}

error_t tool_parse_choice(struct argp_state *state, const char *name, const char *text,
                          const char *const *names, int *index) {
    char list[256] = "";
    for (int i = 0; names[i]; ++i) {
        if (!strcmp(text, names[i])) {
            *index = i;
            return 0;
        }
        size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", i ? (names[i + 1] ? ", " : " or ") : "", names[i]);
    }
    return tool_usage(state, "%s: expected %s, found '%s'", name, list, text);
}

error_t tool_parse_backend(struct argp_state *state, const char *name, const char *text,
                           fct_backend *backend) {
    static const char *const names[] = {"obb", "embree", NULL};
    int index;
    error_t error = tool_parse_choice(state, name, text, names, &index);
    if (!error) *backend = index ? FCT_BACKEND_EMBREE : FCT_BACKEND_OBB;
    return error;
}

bool tool_size(const char *text, size_t *bytes) {
    char *end = NULL;
    double number = isdigit((unsigned char)*text) || *text == '.' ? strtod(text, &end) : -1;
    if (!end || !(number >= 0)) return false;
    const char *letters = "KMGT", *letter = *end ? strchr(letters, toupper((unsigned char)*end)) : NULL;
    if (letter) {
        number *= pow(1024, (double)(letter - letters + 1));
        ++end;
        if (*end == 'i') ++end;
    }
    if (*end == 'B') ++end;
    if (*end || number > 9e18) return false;
    *bytes = (size_t)number;
    return true;
}

/* The Levenshtein distance of two words of fewer than 32 letters. */
static int measure_distance(const char *a, const char *b) {
    int row[33];
    int columns = (int)strlen(b);
    for (int j = 0; j <= columns; ++j) row[j] = j;
    for (int i = 1; a[i - 1]; ++i) {
        int diagonal = row[0];
        row[0] = i;
        for (int j = 1; j <= columns; ++j) {
            int change = diagonal + (a[i - 1] != b[j - 1]);
            diagonal = row[j];
            int best = row[j] < row[j - 1] ? row[j] + 1 : row[j - 1] + 1;
            row[j] = change < best ? change : best;
        }
    }
    return row[columns];
}

const char *tool_nearest(const char *word, const char *const *names) {
    if (strlen(word) > 31) return NULL;
    const char *best = NULL;
    int best_distance = 3;
    for (; *names; ++names) {
        if (strlen(*names) > 31) continue;
        int d = measure_distance(word, *names);
        if (d < best_distance && d < (int)strlen(*names)) best = *names, best_distance = d;
    }
    return best;
}
