/* Whatever the bytes are, with corrected checksums: an error, or a progressive mesh whose levels are meshes.
 */
#include "fuzz/fuzz.h"
#include "simplify/mend_levels.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    fuzz_limit limit;
    fct_env env = fuzz_env(&limit, size);
    uint8_t *copy = malloc(size + 1);
    if (!copy) return 0;
    memcpy(copy, data, size);
    mend_levels(copy, size);
    mend_try_levels(&env, copy, size, fuzz_require);
    free(copy);
    fuzz_end();
    return 0;
}
