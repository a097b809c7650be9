/* tools/render/picture.h: from light to a PNG file. */
#ifndef FCT_TOOLS_PICTURE_H
#define FCT_TOOLS_PICTURE_H

#include "tools/kit/env.h"

/* How linear light of any strength is mapped to [0, 1]. SOFT keeps values below .7 and compresses brighter
 * ones, which keep their hue first and then fade to white. FILMIC is an S-curve per channel. CLAMP cuts at 1.
 */
typedef enum picture_tone { PICTURE_TONE_SOFT, PICTURE_TONE_FILMIC, PICTURE_TONE_CLAMP } picture_tone;
void picture_apply_tone(picture_tone tone, float rgb[3]);

/* Linear colours at the top and at the bottom of the picture. transparent: the PNG has an alpha channel
 * instead. */
typedef struct picture_background {
    float top[3], bottom[3];
    bool transparent;
} picture_background;

/* Reads "#rrggbb" or "none" (transparent). False for any other text. */
bool picture_parse_background(const char *text, picture_background *out);

/* Writes an 8-bit sRGB PNG. image (width x height x 4): linear, premultiplied by coverage. Returns an exit
 * code. */
int picture_save(tool *t, const char *path, uint32_t width, uint32_t height, const float *image,
                 const picture_background *background);

#endif
