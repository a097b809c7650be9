/* simplify/view/hierarchy.c: see hierarchy.h. */
#include "simplify/view/hierarchy.h"

void fct_hierarchy_destroy(const fct_env *env, fct_hierarchy *h) {
    if (!h) return;
    void *arrays[] = {h->first_needs, h->first_strict, h->needs, h->parents, h->first_children, h->siblings,
                      h->bounds,      h->turns,        h->done,  h->wanted,  h->forced,         h->strict,
                      h->triangles,   h->nodes,        h->stack, h->tested};
    for (size_t i = 0; i < FCT_LENGTH(arrays); ++i) fct_release(env, arrays[i]);
    fct_release(env, h);
}
