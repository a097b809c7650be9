/* tools/render/load.h: from a file to a drawing. */
#ifndef FCT_TOOLS_LOAD_H
#define FCT_TOOLS_LOAD_H

#include "tools/render/drawing.h"

typedef struct drawing_source {
    const char *path;
    drawing_subject subject;
    uint32_t count; /* of clusters or boxes */
    fct_tree_def tree;
} drawing_source;

/* Loads a mesh, a .fct or a scene. Returns an exit code. Release the drawing in any case. */
int drawing_load(tool *t, const drawing_source *source, drawing *out);
void drawing_release(tool *t, drawing *d);

#endif
