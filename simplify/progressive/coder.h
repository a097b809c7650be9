/* simplify/progressive/coder.h: an adaptive range coder. The same calls write and read.
 *
 * A call with the value to write returns it; when the coder reads, it ignores the argument and returns the
 * value of the stream. So one function describes a format in both directions, and they cannot differ.
 *
 * A model is the probability that a bit is 0, and follows the bits that were coded with it. The state is an
 * interval [low, low + range): each value takes its share of the interval.
 */
#ifndef FCT_SIMPLIFY_CODER_H
#define FCT_SIMPLIFY_CODER_H

#include "base/env.h"

typedef uint16_t fct_model; /* the probability of 0, in 2^-12 */
enum { CODER_HALF = 1 << 11, CODER_CLASSES = 64 };

/* Models of a number below 2^32: of its count of bits. */
typedef struct fct_number_models {
    fct_model classes[CODER_CLASSES];
} fct_number_models;

typedef struct fct_coder {
    const fct_env *env;
    bool reads;
    uint32_t range;
    /* Writing. The bytes `pending` + 0xff ... 0xff wait for a carry. */
    uint64_t low, waiting;
    unsigned char pending;
    bool started; /* `pending` is a byte of the stream */
    unsigned char *bytes;
    size_t count, capacity;
    fct_result result; /* of the growth of `bytes` */
    /* Reading. */
    const unsigned char *at, *end;
    uint32_t code;
    bool overrun; /* the stream is shorter than its values */
} fct_coder;

void fct_coder_begin_writing(fct_coder *c, const fct_env *env);
/* Completes the stream: bytes[0] to bytes[count - 1]. The coder may then begin again. Errors: MEMORY. */
fct_result fct_coder_end_writing(fct_coder *c);
void fct_coder_release(fct_coder *c);
void fct_coder_begin_reading(fct_coder *c, const unsigned char *bytes, size_t count);
/* Whether the stream was as long as its values. */
bool fct_coder_end_reading(const fct_coder *c);

void fct_models_begin(fct_model *models, size_t count);
bool fct_code_bit(fct_coder *c, fct_model *model, bool bit);
/* A value below total, all equally likely; total is at least 1. */
uint32_t fct_code_uniform(fct_coder *c, uint32_t total, uint32_t value);
/* A number that is often small. */
uint32_t fct_code_number(fct_coder *c, fct_number_models *models, uint32_t value);
/* A float near `guess`, any bits. */
float fct_code_float(fct_coder *c, fct_number_models *models, float guess, float value);

#endif
