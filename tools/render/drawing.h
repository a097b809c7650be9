/* tools/render/drawing.h: the input of a picture: one mesh in the world and the appearance of its faces. */
#ifndef FCT_TOOLS_RENDER_DRAWING_H
#define FCT_TOOLS_RENDER_DRAWING_H

#include "tools/render/picture.h"
#include "tools/render/raster.h"

typedef enum drawing_shading {
    DRAWING_AUTO,  /* LIGHT if the input has vertex colours, else SMOOTH */
    DRAWING_LIGHT, /* the vertex colours, or the paint, are light already */
    DRAWING_SMOOTH,
    DRAWING_FLAT
} drawing_shading;

typedef enum drawing_subject { DRAWING_SURFACE, DRAWING_CLUSTERS, DRAWING_BOXES } drawing_subject;

typedef struct drawing {
    fct_mesh mesh;    /* world space */
    float *paint;     /* face_count x 3: reflectance, or NULL */
    float *glow;      /* face_count x 3: emission, or NULL */
    uint32_t *labels; /* face_count: the cluster of each face, ascending, or NULL */
    uint8_t *lines;   /* face_count: bit i draws the side opposite corner i, or NULL */
    float *normals;   /* face_count x 3 x 3: a unit normal per corner; NULL: flat shading */
    float *values;    /* vertex_count: numbers that false colours show, in place of light; or NULL */
    drawing_shading shading;
    fct_camera camera; /* of the scene, if the input is one */
    fct_scene *scene;  /* of painted materials, or NULL: `paint` holds the whole reflectance */
    uint32_t *starts;  /* of the scene: the first face of each instance, then face_count */

    /* Set by the command and read by drawing_shade. */
    picture_tone tone;
    float exposure;
    float line_width;  /* pixels */
    float light[3][3]; /* directions towards the key light, the fill light and the sky; world space */
    const double *eye; /* 3 */
} drawing;

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
