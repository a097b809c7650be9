/* tools/render/palette.h: colours for clusters and boxes. */
#ifndef FCT_TOOLS_PALETTE_H
#define FCT_TOOLS_PALETTE_H

#include <stdint.h>

enum { PALETTE = 12 };

/* Colour i of the palette, which repeats; linear. Neighbouring colours differ in hue and lightness. */
void drawing_color(uint32_t i, float rgb[3]);

#endif
