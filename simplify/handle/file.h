/* simplify/handle/file.h: state files in memory (docs/state-file.md). */
#ifndef FCT_SIMPLIFY_STATE_FILE_H
#define FCT_SIMPLIFY_STATE_FILE_H

#include "simplify/state.h"

/* Reads the `size` bytes of a state file. name: for messages. Errors: DATA, MEMORY, with *out = NULL. */
fct_result fct_state_read(const fct_env *env, const char *name, const unsigned char *data, size_t size,
                          fct_simplifier **out);

#endif
