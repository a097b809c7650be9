/* tools/render/palette.c: see palette.h. */
#include "tools/render/palette.h"

#include <math.h>

#define TURN (2 * 3.14159265358979323846)

/* Ends of the false colours. The chroma is the largest that sRGB has all the way. */
#define DARKEST   .27
#define LIGHTEST  .93
#define CHROMA    .13
#define FIRST_HUE (275. / 360 * TURN)
#define LAST_HUE  (465. / 360 * TURN)

/* OKLCH to linear sRGB (Ottosson 2020). In OKLCH, equal steps look equal for every hue. */
static void convert_oklch(double lightness, double chroma, double hue, float rgb[3]) {
    double a = chroma * cos(hue), b = chroma * sin(hue);
    double l = lightness + .3963377774 * a + .2158037573 * b,
           m = lightness - .1055613458 * a - .0638541728 * b,
           s = lightness - .0894841775 * a - 1.2914855480 * b;
    l = l * l * l, m = m * m * m, s = s * s * s;
    rgb[0] = (float)fmax(0, 4.0767416621 * l - 3.3077115913 * m + .2309699292 * s);
    rgb[1] = (float)fmax(0, -1.2684380046 * l + 2.6097574011 * m - .3413193965 * s);
    rgb[2] = (float)fmax(0, -.0041960863 * l - .7034186147 * m + 1.7076147010 * s);
}

void drawing_color(uint32_t i, float rgb[3]) {
    uint32_t hue = i % PALETTE * 5 % PALETTE;
    convert_oklch(hue % 2 ? .68 : .80, hue % 2 ? .12 : .10, (hue + .4) / PALETTE * TURN, rgb);
}

/* A helix around the axis of greys: in OKLab, equal steps have equal lengths. */
void drawing_false_color(double value, float rgb[3]) {
    const double t = fmin(fmax(value, 0), 1);
    convert_oklch(DARKEST + (LIGHTEST - DARKEST) * t, CHROMA, FIRST_HUE + (LAST_HUE - FIRST_HUE) * t, rgb);
}
