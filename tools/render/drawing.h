/* tools/render/drawing.h: what `facetree render` draws: one mesh in the world, and how its faces look. */
#ifndef FCT_TOOLS_RENDER_DRAWING_H
#define FCT_TOOLS_RENDER_DRAWING_H

#include "tools/render/picture.h"
#include "tools/render/raster.h"

typedef enum drawing_shading {
    DRAWING_AUTO,  /* the vertex colours as they are where the input has some, else SMOOTH */
    DRAWING_LIGHT, /* colours are light: vertex colours, or the faces' paint, as they are */
    DRAWING_SMOOTH,
    DRAWING_FLAT
} drawing_shading;

typedef enum drawing_subject { DRAWING_SURFACE, DRAWING_CLUSTERS, DRAWING_BOXES } drawing_subject;

typedef struct drawing {
    fct_mesh mesh;    /* world space */
    float *paint;     /* face_count x 3: what the faces reflect, or NULL */
    float *glow;      /* face_count x 3: what they give off, or NULL */
    uint32_t *labels; /* face_count: cluster of each face, ascending, or NULL */
    uint8_t *lines;   /* face_count: bit i draws the side opposite corner i; or NULL */
    float *normals;   /* face_count x 3 x 3: a unit normal per corner, or NULL: flat */
    drawing_shading shading;
    fct_camera camera; /* of a scene */

    /* Set by the command, read by drawing_shade. */
    picture_tone tone;
    float exposure;
    float line_width;  /* pixels */
    float light[3][3]; /* directions towards key, fill and sky, world space */
    const double *eye; /* 3 */
} drawing;

/* --- render_load.c --- */
typedef struct drawing_source {
    const char *path;
    drawing_subject subject;
    uint32_t count; /* of clusters or boxes */
    fct_tree_def tree;
} drawing_source;
/* Loads a mesh, a .fct or a scene. Returns an exit code; release the drawing in any case. */
int drawing_load(tool *t, const drawing_source *source, drawing *out);
void drawing_release(tool *t, drawing *d);

/* --- render_shade.c --- */
/* Normals, lines and clusters' colours that the shading needs. `crease`: cosine of the angle above which an
 * edge is sharp. */
int drawing_prepare(tool *t, drawing *d, double crease, bool wireframe);
void drawing_shade(void *user, const raster_point *point, float rgb[3]);
/* The i-th of a dozen colours that go well together, and again; linear. */
void drawing_color(uint32_t i, float rgb[3]);

/* --- render_camera.c --- */
extern const char *const drawing_views[]; /* ends with NULL */
typedef struct drawing_frame {
    int view;   /* index into drawing_views, -1: not given */
    int up;     /* the axis that points up in views of ours: 1 or 2 */
    double fov; /* vertical, degrees */
    bool given; /* position and target are given */
    double position[3], target[3], up_vector[3];
} drawing_frame;
/* "ex,ey,ez,tx,ty,tz[,fov]" */
bool drawing_parse_camera(const char *text, drawing_frame *out);
void drawing_from_scene(const fct_camera *camera, drawing_frame *out);
/* width, height, samples and cull of `out` are set before. *outside: the eye is outside the mesh's bounds. */
void drawing_aim(drawing *d, const drawing_frame *frame, raster_camera *out, bool *outside);

#endif
