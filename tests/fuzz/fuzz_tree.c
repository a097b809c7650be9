/* Whatever the bytes are, with corrected checksums: an error, or a tree that every public call can use. */
#include "cluster/file/mend.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    fuzz_limit limit;
    fct_env env = fuzz_env(&limit, size);
    uint8_t *copy = malloc(size + 1);
    if (!copy) return 0;
    memcpy(copy, data, size);
    mend_try(&env, copy, size);
    free(copy);
    fuzz_end();
    return 0;
}
