/* scene/volume.h: the hierarchy over the boxes of instances, binary and eight wide. */
#ifndef FCT_SCENE_VOLUME_H
#define FCT_SCENE_VOLUME_H

#include "base/env.h"
#include "facetree/scene.h"

/* Eight children. Row 2 c of bounds holds the lower, row 2 c + 1 the upper bounds along axis c. A child is a
 * node, or an instance (FCT_SCENE_LEAF is set), or FCT_NONE with bounds that no ray hits. */
enum { FCT_SCENE_WIDTH = 8 };
#define FCT_SCENE_LEAF 0x80000000u
typedef struct fct_scene_node {
    float bounds[6][FCT_SCENE_WIDTH];
    uint32_t child[FCT_SCENE_WIDTH];
} fct_scene_node;

/* Neither hierarchy has more levels: 32 of free splits, 30 of halving 2^30 instances, and a few spare. */
enum { FCT_SCENE_DEPTH = 66 };

/* Binary hierarchy over `count` >= 1 boxes. `volumes` has room for 2 count - 1; node 0 is the root, and
 * children come after their parents. Errors: MEMORY. */
fct_result fct_scene_build_volumes(const fct_env *env, uint32_t count, const fct_bounds *bounds,
                                   fct_volume *volumes);
/* The same hierarchy eight wide; the caller releases *out. Errors: MEMORY. */
fct_result fct_scene_build_nodes(const fct_env *env, uint32_t count, const fct_volume *volumes,
                                 fct_scene_node **out);

#endif
