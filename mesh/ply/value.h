/* mesh/ply/value.h: loads scalars of any PLY type and byte order. */
#ifndef FCT_MESH_PLY_VALUE_H
#define FCT_MESH_PLY_VALUE_H

#include <string.h>

#include "mesh/ply/header.h"

static inline uint16_t fct_ply_16(const unsigned char *p, bool swap) {
    uint16_t x;
    memcpy(&x, p, sizeof x);
    return swap ? __builtin_bswap16(x) : x;
}

static inline uint32_t fct_ply_32(const unsigned char *p, bool swap) {
    uint32_t x;
    memcpy(&x, p, sizeof x);
    return swap ? __builtin_bswap32(x) : x;
}

static inline double fct_ply_float(const unsigned char *p, bool swap) {
    uint32_t bits = fct_ply_32(p, swap);
    float x;
    memcpy(&x, &bits, sizeof x);
    return (double)x;
}

static inline double fct_ply_double(const unsigned char *p, bool swap) {
    uint64_t bits;
    double x;
    memcpy(&bits, p, sizeof bits);
    if (swap) bits = __builtin_bswap64(bits);
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* Every integer type fits a double. */
static inline double fct_ply_load(const unsigned char *p, fct_ply_type type, bool swap) {
    switch (type) {
    case FCT_PLY_INT8:
        return (int8_t)*p;
    case FCT_PLY_UINT8:
        return *p;
    case FCT_PLY_INT16:
        return (int16_t)fct_ply_16(p, swap);
    case FCT_PLY_UINT16:
        return fct_ply_16(p, swap);
    case FCT_PLY_INT32:
        return (int32_t)fct_ply_32(p, swap);
    case FCT_PLY_UINT32:
        return fct_ply_32(p, swap);
    case FCT_PLY_FLOAT:
        return fct_ply_float(p, swap);
    case FCT_PLY_DOUBLE:
        return fct_ply_double(p, swap);
    case FCT_PLY_NONE:
        break;
    }
    return 0;
}

/* Converts a value to an id. FCT_NONE if it is not an integer in the range of ids. */
static inline uint32_t fct_ply_id(double value) {
    return value >= 0 && value < 4294967295.0 && value == (double)(uint32_t)value ? (uint32_t)value
                                                                                  : FCT_NONE;
}

#endif
