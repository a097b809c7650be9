/* tools/render/palette.h: colours for clusters and boxes, and for numbers. */
#ifndef FCT_TOOLS_PALETTE_H
#define FCT_TOOLS_PALETTE_H

#include <stdint.h>

enum { PALETTE = 12 };

/* Colour i of the palette, which repeats; linear. Neighbouring colours differ in hue and lightness. */
void drawing_color(uint32_t i, float rgb[3]);

/* A colour for a number from 0 (dark blue) over purple, red and orange to 1 (light yellow); linear. Numbers
 * outside have the colours of the ends. Equal differences look equal, and larger numbers are lighter. */
void drawing_false_color(double value, float rgb[3]);

#endif
