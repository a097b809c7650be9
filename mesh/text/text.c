/* mesh/text/text.c: see text.h. */
#include "mesh/text/text.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

fct_text fct_text_begin(const fct_env *env, const char *name, const void *data, size_t size) {
    const char *begin = data;
    size_t mark = size >= 3 && !memcmp(begin, "\xef\xbb\xbf", 3) ? 3 : 0;
    return (fct_text){begin + mark, begin + size, env, name, 1};
}

void fct_text_next_line(fct_text *t) {
    const char *p = t->p;
    while (p < t->end && !fct_text_is_line_end(*p)) ++p;
    if (p < t->end) {
        p += *p == '\r' && p + 1 < t->end && p[1] == '\n' ? 2 : 1;
        ++t->line;
    }
    t->p = p;
}

bool fct_text_skip_lines(fct_text *t, char comment) {
    while (t->p < t->end) {
        if (fct_text_is_line_end(*t->p) || (comment && *t->p == comment))
            fct_text_next_line(t);
        else if (fct_text_is_blank(*t->p))
            ++t->p;
        else
            return true;
    }
    return false;
}

static bool ends_word(const char *p, const char *end) {
    return p == end || fct_text_is_line_end(*p) || fct_text_is_blank(*p);
}

const char *fct_text_word(fct_text *t, size_t *length) {
    fct_text_skip_blanks(t);
    const char *word = t->p;
    while (!ends_word(t->p, t->end)) ++t->p;
    *length = (size_t)(t->p - word);
    return word;
}

bool fct_text_word_is(const char *word, size_t length, const char *expected) {
    return strlen(expected) == length && !memcmp(word, expected, length);
}

static char lower_letter(char c) {
    return c >= 'A' && c <= 'Z' ? (char)(c - 'A' + 'a') : c;
}

bool fct_text_begins_any_case(const char *word, size_t length, const char *expected) {
    size_t i = 0;
    while (expected[i] && i < length && lower_letter(word[i]) == expected[i]) ++i;
    return !expected[i];
}

bool fct_text_word_is_any_case(const char *word, size_t length, const char *expected) {
    return strlen(expected) == length && fct_text_begins_any_case(word, length, expected);
}

const char *fct_text_rest(fct_text *t, size_t *length) {
    fct_text_skip_blanks(t);
    const char *begin = t->p, *end;
    while (t->p < t->end && !fct_text_is_line_end(*t->p)) ++t->p;
    for (end = t->p; end > begin && fct_text_is_blank(end[-1]);) --end;
    *length = (size_t)(end - begin);
    return begin;
}

/* 10^0 .. 10^27 are exact in a long double of 64 bits, 10^0 .. 10^22 in a double. */
static const long double powers[] = {1e0L,  1e1L,  1e2L,  1e3L,  1e4L,  1e5L,  1e6L,  1e7L,  1e8L,  1e9L,
                                     1e10L, 1e11L, 1e12L, 1e13L, 1e14L, 1e15L, 1e16L, 1e17L, 1e18L, 1e19L,
                                     1e20L, 1e21L, 1e22L, 1e23L, 1e24L, 1e25L, 1e26L, 1e27L};

static double scale_by_power(uint64_t digits, int exponent) {
    if (digits < (uint64_t)1 << 53 && exponent >= -22 && exponent <= 22) {
        double power = (double)powers[exponent < 0 ? -exponent : exponent];
        return exponent < 0 ? (double)digits / power : (double)digits * power;
    }
    if (digits == 0 || exponent < -400) return 0;
    if (exponent > 400) return INFINITY;
    long double value = (long double)digits;
    for (; exponent > 27; exponent -= 27) value *= powers[27];
    for (; exponent < -27; exponent += 27) value /= powers[27];
    return (double)(exponent < 0 ? value / powers[-exponent] : value * powers[exponent]);
}

static bool is_digit(const char *p, const char *end) {
    return p < end && (unsigned char)(*p - '0') < 10;
}

/* Reads an exponent such as "e-12" at p. Returns p if there is none. */
static const char *read_exponent(const char *p, const char *end, int *exponent) {
    if (p == end || (*p != 'e' && *p != 'E')) return p;
    const char *q = p + 1;
    bool negative = q < end && *q == '-';
    if (q < end && (*q == '-' || *q == '+')) ++q;
    if (!is_digit(q, end)) return p;
    int value = 0;
    for (; is_digit(q, end); ++q)
        if (value < 100000) value = 10 * value + (*q - '0');
    *exponent += negative ? -value : value;
    return q;
}

bool fct_text_double(fct_text *t, double *value) {
    fct_text_skip_blanks(t);
    const char *p = t->p, *end = t->end;
    bool negative = p < end && *p == '-';
    if (p < end && (*p == '-' || *p == '+')) ++p;
    uint64_t digits = 0;
    int exponent = 0, count = 0, kept = 0;
    for (; is_digit(p, end); ++p, ++count) {
        if (kept < 19)
            digits = 10 * digits + (uint64_t)(*p - '0'), kept += digits != 0;
        else if (exponent < 100000)
            ++exponent;
    }
    if (p < end && *p == '.') {
        for (++p; is_digit(p, end); ++p, ++count) {
            if (kept == 19) continue;
            digits = 10 * digits + (uint64_t)(*p - '0'), kept += digits != 0;
            if (exponent > -100000) --exponent;
        }
    }
    if (!count) return false;
    p = read_exponent(p, end, &exponent);
    if (!ends_word(p, end)) return false;
    double magnitude = scale_by_power(digits, exponent);
    *value = negative ? -magnitude : magnitude;
    t->p = p;
    return true;
}

bool fct_text_integer(fct_text *t, int64_t *value) {
    fct_text_skip_blanks(t);
    const char *p = t->p, *end = t->end;
    bool negative = p < end && *p == '-';
    if (p < end && (*p == '-' || *p == '+')) ++p;
    if (!is_digit(p, end)) return false;
    int64_t number = 0;
    for (; is_digit(p, end); ++p)
        if (number < INT64_MAX / 16) number = 10 * number + (*p - '0');
    if (!ends_word(p, end)) return false;
    *value = negative ? -number : number;
    t->p = p;
    return true;
}

fct_result fct_text_coordinate(fct_text *t, const char *what, double *value) {
    const char *begin = t->p;
    if (!fct_text_double(t, value)) return fct_text_expected(t, what);
    if (isfinite((float)*value)) return FCT_OK;
    t->p = begin;
    return fct_text_expected(t, "a number that fits a float");
}

fct_result fct_text_float(fct_text *t, const char *what, float *value) {
    double number = 0;
    fct_result result = fct_text_coordinate(t, what, &number);
    *value = (float)number;
    return result;
}

fct_result fct_text_any_double(fct_text *t, const char *what, double *value) {
    if (fct_text_double(t, value)) return FCT_OK;
    const char *begin = t->p;
    size_t length;
    const char *word = fct_text_word(t, &length);
    bool sign = length && (*word == '-' || *word == '+');
    word += sign, length -= sign;
    *value = NAN;
    if (fct_text_begins_any_case(word, length, "nan") || fct_text_begins_any_case(word, length, "inf") ||
        fct_text_begins_any_case(word, length, "1.#"))
        return FCT_OK;
    t->p = begin;
    return fct_text_expected(t, what);
}

fct_result fct_text_fail(const fct_text *t, const char *format, ...) {
    char text[512];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return fct_fail(t->env, FCT_ERROR_DATA, "%s:%llu: %s", t->name, (unsigned long long)t->line, text);
}

const char *fct_text_show(const char *word, size_t length, char shown[FCT_TEXT_SHOWN]) {
    size_t count = length < 40 ? length : 40;
    for (size_t i = 0; i < count; ++i) shown[i] = word[i] < ' ' || word[i] > '~' ? '?' : word[i];
    strcpy(shown + count, length > count ? "..." : "");
    return shown;
}

fct_result fct_text_expected(fct_text *t, const char *what) {
    size_t length;
    const char *word = fct_text_word(t, &length);
    if (!length)
        return fct_text_fail(t, "expected %s, found the end of the %s", what,
                             t->p == t->end ? "file" : "line");
    char shown[FCT_TEXT_SHOWN];
    return fct_text_fail(t, "expected %s, found '%s'", what, fct_text_show(word, length, shown));
}
