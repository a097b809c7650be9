/* base/variant.h: functions compiled once per SIMD variant, and the choice among them.
 *
 * A kernel file is a .c file that includes base/math/simd.h or simd_d8.h. The build compiles it for the
 * baseline of the architecture and, on x86-64, once more for AVX2. Its external functions are declared like
 * this:
 *
 *     #define fct_sums_join FCT_KERNEL(fct_sums_join)
 *     FCT_DECLARE_KERNEL(void, fct_sums_join, (const fct_sums *a, const fct_sums *b, fct_sums *out));
 *
 * In a kernel file the name fct_sums_join then means fct_sums_join_baseline or fct_sums_join_avx2. In any
 * other file it means the one of the two that suits the processor; it can be called or used as a function
 * pointer.
 */
#ifndef FCT_BASE_VARIANT_H
#define FCT_BASE_VARIANT_H

#include <stdbool.h>

#if defined(FCT_KERNEL_FILE) && defined(FCT_VARIANT_AVX2)
#define FCT_KERNEL(name) name##_avx2
#elif defined(FCT_KERNEL_FILE) || !defined(FCT_HAS_AVX2)
#define FCT_KERNEL(name) name##_baseline
#else
#define FCT_KERNEL(name) (fct_use_avx2 ? name##_avx2 : name##_baseline)
#endif

#define FCT_DECLARE_KERNEL(type, name, parameters)                                                           \
    type name##_baseline parameters;                                                                         \
    type name##_avx2 parameters

/* Set once when the library is loaded, before main. False until then. */
extern bool fct_use_avx2;

#endif
