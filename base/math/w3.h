/* base/math/w3.h: vectors of three, one per lane. Define W3_LANES as d4, d8 or f8 and include simd.h or
 * simd_d8.h first. */
#define W3_JOIN_NAMES(type, name) type##name
#define W3_EXPAND(type, name)     W3_JOIN_NAMES(type, name)
#define W3_OF(name)               W3_EXPAND(W3_LANES, name)

typedef struct w3 {
    W3_LANES x, y, z;
} w3;

/* a + b c */
static inline W3_LANES W3_OF(_mad)(W3_LANES a, W3_LANES b, W3_LANES c) {
    return W3_OF(_add)(a, W3_OF(_mul)(b, c));
}
static inline w3 w3_add(w3 a, w3 b) {
    return (w3){W3_OF(_add)(a.x, b.x), W3_OF(_add)(a.y, b.y), W3_OF(_add)(a.z, b.z)};
}
static inline w3 w3_sub(w3 a, w3 b) {
    return (w3){W3_OF(_sub)(a.x, b.x), W3_OF(_sub)(a.y, b.y), W3_OF(_sub)(a.z, b.z)};
}
static inline w3 w3_scale(w3 a, W3_LANES s) {
    return (w3){W3_OF(_mul)(a.x, s), W3_OF(_mul)(a.y, s), W3_OF(_mul)(a.z, s)};
}
static inline W3_LANES w3_dot(w3 a, w3 b) {
    return W3_OF(_mad)(W3_OF(_mad)(W3_OF(_mul)(a.x, b.x), a.y, b.y), a.z, b.z);
}
static inline w3 w3_cross(w3 a, w3 b) {
    return (w3){W3_OF(_sub)(W3_OF(_mul)(a.y, b.z), W3_OF(_mul)(a.z, b.y)),
                W3_OF(_sub)(W3_OF(_mul)(a.z, b.x), W3_OF(_mul)(a.x, b.z)),
                W3_OF(_sub)(W3_OF(_mul)(a.x, b.y), W3_OF(_mul)(a.y, b.x))};
}
static inline w3 w3_load(const W3_LANES a[3]) {
    return (w3){a[0], a[1], a[2]};
}
static inline W3_LANES w3_dot_arrays(const W3_LANES a[3], const W3_LANES b[3]) {
    return w3_dot(w3_load(a), w3_load(b));
}
/* M a for M = xx xy xz yy yz zz */
static inline w3 w3_apply(const W3_LANES m[6], w3 a) {
    const w3 rows[3] = {{m[0], m[1], m[2]}, {m[1], m[3], m[4]}, {m[2], m[4], m[5]}};
    return (w3){w3_dot(rows[0], a), w3_dot(rows[1], a), w3_dot(rows[2], a)};
}
