/* base/variant.c: chooses the SIMD variant from the processor and from the environment variable
 * FACETREE_SIMD.
 *
 * The choice happens in a constructor: no thread can see it change, and a call pays one predictable branch.
 * Every variant gives the same results. Therefore the library ignores a value of FACETREE_SIMD that it cannot
 * obey; fct_simd_check reports it to programs that want to stop.
 */
#include "base/variant.h"

#include <stdlib.h>
#include <string.h>

#include "base/env.h"

bool fct_use_avx2;

/* True if the processor and the operating system support everything that the AVX2 variant is compiled for. */
static bool supports_avx2(void) {
#ifdef FCT_HAS_AVX2
    __builtin_cpu_init(); /* required in a constructor */
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
#else
    return false;
#endif
}

__attribute__((constructor)) static void choose_variant(void) {
    const char *wish = getenv("FACETREE_SIMD");
    fct_use_avx2 = supports_avx2() && !(wish && !strcmp(wish, "baseline"));
}

const char *fct_simd_variant(void) {
    return fct_use_avx2 ? "avx2" : "baseline";
}

fct_result fct_simd_check(const fct_env *env) {
    const char *wish = getenv("FACETREE_SIMD");
    if (!wish || !*wish || !strcmp(wish, "baseline")) return FCT_OK;
    if (strcmp(wish, "avx2") != 0)
        return fct_fail(env, FCT_ERROR_DATA, "FACETREE_SIMD: expected baseline or avx2, found '%s'", wish);
    if (!supports_avx2())
        return fct_fail(env, FCT_ERROR_DATA, "FACETREE_SIMD: this %s does not support avx2",
#ifdef FCT_HAS_AVX2
                        "processor"
#else
                        "build"
#endif
        );
    return FCT_OK;
}
