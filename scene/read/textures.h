/* scene/read/textures.h: the textures that a scene file names. Images that cannot be read are left out. */
#ifndef FCT_SCENE_READ_TEXTURES_H
#define FCT_SCENE_READ_TEXTURES_H

#include "scene/scene.h"

/* Images that were left out, and why the first of them was. Begin with zero. */
typedef struct fct_texture_loss {
    size_t count;
    char first[240];
} fct_texture_loss;

/* Adds the image of a file, or of bytes in memory that `name` names, unless the scene has a texture of that
 * name. *id is FCT_NONE if the image cannot be read. Errors: MEMORY. */
fct_result fct_textures_open(fct_scene *scene, const char *path, fct_texture_loss *loss, uint32_t *id);
fct_result fct_textures_decode(fct_scene *scene, const char *name, const unsigned char *data, size_t size,
                               fct_texture_loss *loss, uint32_t *id);
/* Counts an image that the caller cannot read. */
void fct_textures_lose(fct_texture_loss *loss, const char *reason);
/* Sends one warning; `name` begins it. */
void fct_textures_report(const fct_env *env, const char *name, const fct_texture_loss *loss);

/* Calls of the library with this environment turn their errors into a loss. */
typedef struct fct_texture_quiet {
    fct_env env;
    const fct_env *outer;
    fct_texture_loss *loss;
} fct_texture_quiet;
void fct_textures_begin_quiet(fct_texture_quiet *quiet, const fct_env *env, fct_texture_loss *loss);
/* OK for INPUT and DATA, which have been counted. */
fct_result fct_textures_forgive(const fct_texture_quiet *quiet, fct_result result);

/* Whether the paint of a material reduces the reflectance of a texel. */
bool fct_textures_clamp(const fct_scene *scene, uint32_t material);

#endif
