/* mesh/obj/color.h: colours of the vertices of an OBJ file.
 *
 * Components are sRGB: floats, or bytes if every component of the file is a whole number up to 255 and one is
 * over 1. A vertex of seven numbers is x y z w r g b if every fourth number is 1, else x y z r g b a. If
 * every seventh number is 1 or 255 too, it is x y z r g b a.
 */
#ifndef FCT_MESH_OBJ_COLOR_H
#define FCT_MESH_OBJ_COLOR_H

#include "mesh/soup.h"

/* What a reader has seen of a component in the whole file. */
typedef struct fct_obj_range {
    bool over_one, no_byte;
} fct_obj_range;

typedef struct fct_obj_colors {
    float *values;      /* V x 3: linear as floats of sRGB; NAN in the first: the vertex has no colour */
    float *seventh;     /* V: the seventh number likewise, NAN: none; NULL: no vertex has seven numbers */
    fct_obj_range rgb;  /* numbers 4 to 6 */
    fct_obj_range last; /* number 7 */
    size_t without, not_finite;
    bool weighted, opaque; /* every fourth number is 1; every seventh number is 1 or 255 */
} fct_obj_colors;

/* Sets the colour of vertex v of `total` from the `count` numbers that follow x y z. Vertices come in
 * ascending order. Errors: MEMORY. */
fct_result fct_obj_set_color(const fct_env *env, fct_obj_colors *c, size_t v, size_t total,
                             const double *numbers, size_t count);
/* Moves the linear colours into the soup, or leaves them out if one is not finite. A vertex without a colour
 * becomes white. Sends the warnings. Releases *c. */
void fct_obj_finish_colors(const fct_env *env, const char *name, fct_obj_colors *c, fct_soup *soup);
void fct_obj_release_colors(const fct_env *env, fct_obj_colors *c);

#endif
