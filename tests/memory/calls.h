/* tests/memory/calls.h: one call of each public function that can fail, and the inputs of the calls.
 *
 * A call makes what the function needs with `env`, runs the function within STARVE, checks that a failure
 * left no object, and releases everything. Only functions that write files write to the folder OUT.
 */
#ifndef FCT_TESTS_MEMORY_CALLS_H
#define FCT_TESTS_MEMORY_CALLS_H

#include "support.h"

#include "facetree/facetree.h"
#include "tests/memory/starve.h"

#define IN  "in/"
#define OUT "out/"

typedef struct memory_call {
    const char *function; /* the name of the public function */
    const char *variant;  /* what the call shows; "" if the function has one call */
    fct_result (*run)(const fct_env *env);
    bool hook_only; /* Embree 3.13 reads wild pointers after a failed malloc, so its malloc does not fail */
} memory_call;

/* Tables of calls. The last function is NULL. */
extern const memory_call mesh_calls[], tree_calls[], partition_calls[], scene_calls[];

/* Inputs, made with an environment that is never starved. */
typedef struct memory_inputs {
    fct_env env;
    fct_mesh sheet; /* bent, with colours and two materials */
    fct_mesh ball;  /* wound inwards */
    fct_tree *tree; /* of the sheet */
    fct_tree *other;
    fct_bvh *bvh, *other_bvh, *embree;
    fct_scene *scene; /* committed: a lamp over a floor */
} memory_inputs;
extern memory_inputs inputs;

/* Also writes the files of IN. The current folder must have the empty folders IN and OUT. */
void make_inputs(void);
void release_inputs(void);

#endif
