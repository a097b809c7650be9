/* simplify/progressive/coder.c: see coder.h. Cost: constant per bit. */
#include "simplify/progressive/coder.h"

#include "base/key.h"

enum {
    PROBABILITY_BITS = 12,
    RATE = 5,        /* a model moves by 1/32 of its distance to the bit */
    CLASS_BITS = 6,  /* of a count of bits, 0 to 32 */
    CHUNK_BITS = 16, /* of a uniform value at once, so that range / total stays large */
    LAST_SHIFTS = 5  /* four move `low` out, one more the pending byte */
};
#define LEAST_RANGE ((uint32_t)1 << 24)

void fct_models_begin(fct_model *models, size_t count) {
    for (size_t i = 0; i < count; ++i) models[i] = CODER_HALF;
}

static void put_byte(fct_coder *c, unsigned char byte) {
    if (c->result == FCT_OK) c->result = fct_grow(c->env, (void **)&c->bytes, &c->capacity, c->count + 1, 1);
    if (c->result == FCT_OK) c->bytes[c->count++] = byte;
}

/* Moves the highest byte of `low` out. It waits while a carry may still change it. */
static void shift_low(fct_coder *c) {
    if (c->low < 0xff000000u || c->low > UINT32_MAX) {
        unsigned char carry = (unsigned char)(c->low >> 32);
        if (c->started) put_byte(c, (unsigned char)(c->pending + carry));
        for (; c->waiting > 0; --c->waiting) put_byte(c, (unsigned char)(0xff + carry));
        c->pending = (unsigned char)(c->low >> 24);
        c->started = true;
    } else
        ++c->waiting;
    c->low = (c->low & 0x00ffffffu) << 8;
}

static unsigned char take_byte(fct_coder *c) {
    if (c->at < c->end) return *c->at++;
    c->overrun = true;
    return 0;
}

/* Keeps the range large. */
static void normalise(fct_coder *c) {
    while (c->range < LEAST_RANGE) {
        c->range <<= 8;
        if (c->reads)
            c->code = c->code << 8 | take_byte(c);
        else
            shift_low(c);
    }
}

void fct_coder_begin_writing(fct_coder *c, const fct_env *env) {
    unsigned char *bytes = c->bytes;
    size_t capacity = c->capacity;
    *c = (fct_coder){.env = env, .range = UINT32_MAX, .bytes = bytes, .capacity = capacity};
}

fct_result fct_coder_end_writing(fct_coder *c) {
    for (int i = 0; i < LAST_SHIFTS; ++i) shift_low(c);
    return c->result;
}

void fct_coder_release(fct_coder *c) {
    fct_release(c->env, c->bytes);
    c->bytes = NULL;
}

void fct_coder_begin_reading(fct_coder *c, const unsigned char *bytes, size_t count) {
    *c = (fct_coder){.reads = true, .range = UINT32_MAX, .at = bytes, .end = bytes + count};
    for (int i = 0; i < 4; ++i) c->code = c->code << 8 | take_byte(c);
}

bool fct_coder_end_reading(const fct_coder *c) {
    return !c->overrun && c->at == c->end;
}

bool fct_code_bit(fct_coder *c, fct_model *model, bool bit) {
    uint32_t split = (c->range >> PROBABILITY_BITS) * *model;
    if (c->reads) bit = c->code >= split;
    if (!bit) {
        c->range = split;
        *model = (fct_model)(*model + (((1 << PROBABILITY_BITS) - *model) >> RATE));
    } else {
        if (c->reads)
            c->code -= split;
        else
            c->low += split;
        c->range -= split;
        *model = (fct_model)(*model - (*model >> RATE));
    }
    normalise(c);
    return bit;
}

static uint32_t code_chunk(fct_coder *c, uint32_t total, uint32_t value) {
    uint32_t share = c->range / total;
    if (c->reads) {
        value = c->code / share;
        if (value >= total) value = total - 1;
        c->code -= value * share;
    } else
        c->low += (uint64_t)value * share;
    c->range = share;
    normalise(c);
    return value;
}

uint32_t fct_code_uniform(fct_coder *c, uint32_t total, uint32_t value) {
    if (total <= 1) return 0;
    if (total <= 1u << CHUNK_BITS) return code_chunk(c, total, value);
    uint32_t last = total - 1, shift = 0;
    while (last >> shift >> CHUNK_BITS) ++shift;
    uint32_t low_bits = (1u << shift) - 1;
    uint32_t high = code_chunk(c, (last >> shift) + 1, value >> shift);
    uint32_t low_total = high == last >> shift ? (last & low_bits) + 1 : low_bits + 1;
    return high << shift | code_chunk(c, low_total, value & low_bits);
}

uint32_t fct_code_number(fct_coder *c, fct_number_models *models, uint32_t value) {
    uint32_t bits = 0, node = 1;
    while (bits < 32 && value >> bits) ++bits;
    for (int i = CLASS_BITS; i-- > 0;)
        node = 2 * node | fct_code_bit(c, &models->classes[node], bits >> i & 1);
    bits = node - CODER_CLASSES;
    if (bits > 32) bits = 32; /* only in a damaged stream */
    if (bits <= 1) return bits;
    uint32_t top = 1u << (bits - 1), rest = value & (top - 1);
    return top | fct_code_uniform(c, top, rest);
}

float fct_code_float(fct_coder *c, fct_number_models *models, float guess, float value) {
    uint32_t base = fct_float_key(guess), difference = fct_float_key(value) - base;
    uint32_t folded = difference >> 31 ? ~(difference << 1) : difference << 1;
    folded = fct_code_number(c, models, folded);
    return fct_float_of_key(base + (folded & 1 ? ~(folded >> 1) : folded >> 1));
}
