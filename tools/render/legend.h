/* tools/render/legend.h: the legend of false colours, drawn into a picture. */
#ifndef FCT_TOOLS_LEGEND_H
#define FCT_TOOLS_LEGEND_H

#include <stdint.h>

/* Draws a bar of all colours with the numbers 0, end / 2 and end below it and the title above it, into the
 * lower left corner. image: as in picture_save. A picture that is too small for it stays as it is. Characters
 * of the title: those of the words "error, % of the median light". */
void picture_draw_legend(const char *title, double end, uint32_t width, uint32_t height, float *image);

#endif
