/* scene/read/mtl.h: the materials of MTL libraries, by name.
 *
 * Kd is the reflectance, at most FCT_SCENE_MOST_REFLECTANCE, and Ke the emission. map_Kd is a texture of the
 * reflectance, times Kd; a Kd of 0, or none, counts as 1 then. `xyz` colours become linear
 * RGB. A `spectral` reflectance becomes grey (.7), a `spectral` emission 0. A material without emission is
 * two-sided, because the winding of such files is often wrong. A material with emission is one-sided, by the
 * winding.
 */
#ifndef FCT_SCENE_MTL_H
#define FCT_SCENE_MTL_H

#include <jansson.h>

#include "mesh/text/text.h"
#include "scene/read/textures.h"

/* How many materials have something, and the first of them. */
typedef struct fct_mtl_tally {
    size_t count;
    char first[FCT_TEXT_SHOWN];
} fct_mtl_tally;

typedef struct fct_mtl {
    fct_scene *scene;
    json_t *ids;        /* scene ids by the names of the file */
    json_t *used_names; /* in the scene, which has shorter names */
    fct_texture_loss loss;
    fct_mtl_tally repeated, clamped, grey, dark, textured, transparent;
} fct_mtl;

/* Errors: MEMORY. */
fct_result fct_mtl_create(fct_scene *scene, fct_mtl *out);
void fct_mtl_release(fct_mtl *mtl);

/* Reads a library in the folder `base` ("" or ending in '/'). If a material has the name of an earlier one,
 * the earlier one stays. Errors: DATA, MEMORY. */
fct_result fct_mtl_read(fct_mtl *mtl, const char *base, fct_text *t);
/* Sends one message for each thing that the materials ask for and do not get. */
void fct_mtl_send_notes(const fct_mtl *mtl, const char *name);

/* The scene's id of a material, or FCT_NONE. */
uint32_t fct_mtl_find(const fct_mtl *mtl, const char *name);
/* Adds a grey (.7), two-sided material under the name. Errors: MEMORY. */
fct_result fct_mtl_add_grey(fct_mtl *mtl, const char *name, uint32_t *id);

/* Copies a name that is not in `used` to out[0 .. size) and adds it there: the name itself, or its beginning
 * and a number. Errors: MEMORY. */
fct_result fct_mtl_choose_name(const fct_env *env, json_t *used, const char *name, char *out, size_t size);

#endif
