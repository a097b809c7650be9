/* tools/render/picture.h: from light to a PNG file. */
#ifndef FCT_TOOLS_PICTURE_H
#define FCT_TOOLS_PICTURE_H

#include "tools/kit/tool.h"

/* How linear light of any strength fits into [0, 1]. SOFT leaves what is below .7 as it is and bends the
 * rest, hue first kept, then fading to white; FILMIC is an S-curve on each channel; CLAMP cuts. */
typedef enum picture_tone { PICTURE_TONE_SOFT, PICTURE_TONE_FILMIC, PICTURE_TONE_CLAMP } picture_tone;
void picture_apply_tone(picture_tone tone, float rgb[3]);

/* Linear colours at the top and the bottom of the picture; transparent: the PNG gets an alpha channel. */
typedef struct picture_background {
    float top[3], bottom[3];
    bool transparent;
} picture_background;

/* "#rrggbb", or "none" for transparent. */
bool picture_parse_background(const char *text, picture_background *out);

/* Writes an 8-bit sRGB PNG. image: width x height x 4, linear, premultiplied by coverage. Returns an exit
 * code. */
int picture_save(tool *t, const char *path, uint32_t width, uint32_t height, const float *image,
                 const picture_background *background);

#endif
