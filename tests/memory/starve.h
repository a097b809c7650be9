/* tests/memory/starve.h: makes the nth allocation fail between STARVE's begin and end.
 *
 * HOOK: allocations through fct_env. SYSTEM: those through malloc, of this thread: jansson, operator new,
 * stdio and libc. With sanitizers, whose malloc cannot be replaced, SYSTEM means jansson and operator new.
 */
#ifndef FCT_TESTS_MEMORY_STARVE_H
#define FCT_TESTS_MEMORY_STARVE_H

#include <stdbool.h>

#include "facetree/base.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum starve_kind { STARVE_HOOK, STARVE_SYSTEM } starve_kind;

/* Counts from 0 again. The nth allocation fails, and all later ones too if `lasting`; n = 0: none. */
void starve_set(starve_kind kind, long n, bool lasting);
/* Only allocations between these two count. */
void starve_begin(void);
void starve_end(void);
/* The result of a call that may run out of memory. */
#define STARVE(call) (starve_begin(), starve_keep(call))
static inline fct_result starve_keep(fct_result result) {
    starve_end();
    return result;
}
/* Whether the nth allocation was asked for. */
bool starve_failed(void);
/* Allocations of the kind that are alive, also outside of begin and end. */
long starve_alive(void);

/* Allocates through the hook. */
fct_env starve_env(void);

#ifdef __cplusplus
}
#endif
#endif
