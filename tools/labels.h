/* tools/labels.h: writes a number per face, as text or as a mesh with a colour per number. */
#ifndef FCT_TOOLS_LABELS_H
#define FCT_TOOLS_LABELS_H

#include "tools/kit/env.h"

/* labels (one per input face, below count): one per line, or, if the path is named as a mesh, the mesh with a
 * colour per label. Colours are on the faces in .ply and .off, else on vertices, doubled along borders.
 * Returns an exit code. */
int tool_save_labels(tool *t, const char *path, const fct_tree *tree, const uint32_t *labels, uint32_t count);
/* The linear colour of number `index`. Neighbouring numbers differ clearly; the first 7 million colours are
 * all different. */
void tool_palette(uint32_t index, float color[3]);

#endif
