/* tools/render/camera.h: the position and direction of the eye. */
#ifndef FCT_TOOLS_CAMERA_H
#define FCT_TOOLS_CAMERA_H

#include "tools/render/drawing.h"

extern const char *const drawing_views[]; /* names; ends with NULL */

typedef struct drawing_frame {
    int view;   /* index into drawing_views; -1: not given */
    int up;     /* the axis that points up in a named view: 1 or 2 */
    double fov; /* vertical, degrees */
    bool given; /* position and target are given */
    double position[3], target[3], up_vector[3];
} drawing_frame;

/* Reads "ex,ey,ez,tx,ty,tz[,fov]". False for any other text. */
bool drawing_parse_camera(const char *text, drawing_frame *out);
/* Reads "WxH", each 1 to RASTER_MAX_SIZE. False for any other text. */
bool drawing_parse_size(const char *text, uint32_t *width, uint32_t *height);
void drawing_from_scene(const fct_camera *camera, drawing_frame *out);
/* Fills the eye, the axes and the focal length of `out`, whose width, height, samples and cull are set
 * already, and the lights of the drawing. *outside: whether the eye is outside the bounds of the mesh. */
void drawing_aim(drawing *d, const drawing_frame *frame, raster_camera *out, bool *outside);

#endif
