/* Whatever the bytes are, with a corrected checksum: an error, or a state of a simplification that goes on.
 */
#include "fuzz/fuzz.h"
#include "simplify/mend_state.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    fuzz_limit limit;
    fct_env env = fuzz_env(&limit, size);
    uint8_t *copy = malloc(size + 1);
    if (!copy) return 0;
    memcpy(copy, data, size);
    mend_state(copy, size);
    mend_try_state(&env, copy, size, fuzz_require);
    free(copy);
    fuzz_end();
    return 0;
}
