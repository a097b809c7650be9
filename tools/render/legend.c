/* tools/render/legend.c: see legend.h. Letters are 5 x 7 dots, and a dot is a square of whole pixels.
 *
 *      title
 *      [ colours from 0 to end ]
 *      0        end / 2      end
 */
#include "tools/render/legend.h"

#include <stdio.h>
#include <string.h>

#include "tools/render/palette.h"

enum { COLUMNS = 5, ROWS = 7, ADVANCE = COLUMNS + 1 }; /* dots */
/* Sizes in dots: of the bar, the panel's margin, and the gaps between its lines. */
enum { BAR_WIDTH = 180, BAR_HEIGHT = 8, MARGIN = 6, GAP = 4 };
enum { PANEL_WIDTH = BAR_WIDTH + 2 * MARGIN, PANEL_HEIGHT = 2 * ROWS + BAR_HEIGHT + 2 * GAP + 2 * MARGIN };
/* Pixels of the picture's height per pixel of a dot. */
enum { HEIGHT_PER_DOT = 360 };
/* How much of the picture the panel hides. */
#define PANEL_COVER .7F

typedef struct glyph {
    char character;
    uint8_t rows[ROWS]; /* from the top; the highest of the five bits is on the left */
} glyph;

static const glyph glyphs[] = {{'0', {14, 17, 19, 21, 25, 17, 14}}, {'1', {4, 12, 4, 4, 4, 4, 14}},
                               {'2', {14, 17, 1, 2, 4, 8, 31}},     {'3', {31, 2, 4, 2, 1, 17, 14}},
                               {'4', {2, 6, 10, 18, 31, 2, 2}},     {'5', {31, 16, 30, 1, 1, 17, 14}},
                               {'6', {6, 8, 16, 30, 17, 17, 14}},   {'7', {31, 1, 2, 4, 8, 8, 8}},
                               {'8', {14, 17, 17, 14, 17, 17, 14}}, {'9', {14, 17, 17, 15, 1, 2, 12}},
                               {'.', {0, 0, 0, 0, 0, 12, 12}},      {',', {0, 0, 0, 0, 12, 4, 8}},
                               {'+', {0, 4, 4, 31, 4, 4, 0}},       {'-', {0, 0, 0, 31, 0, 0, 0}},
                               {'%', {24, 25, 2, 4, 8, 19, 3}},     {'a', {0, 0, 14, 1, 15, 17, 15}},
                               {'d', {1, 1, 13, 19, 17, 17, 15}},   {'e', {0, 0, 14, 17, 31, 16, 14}},
                               {'f', {6, 9, 8, 28, 8, 8, 8}},       {'g', {0, 15, 17, 17, 15, 1, 14}},
                               {'h', {16, 16, 22, 25, 17, 17, 17}}, {'i', {4, 0, 12, 4, 4, 4, 14}},
                               {'l', {12, 4, 4, 4, 4, 4, 14}},      {'m', {0, 0, 26, 21, 21, 17, 17}},
                               {'n', {0, 0, 22, 25, 17, 17, 17}},   {'o', {0, 0, 14, 17, 17, 17, 14}},
                               {'r', {0, 0, 22, 25, 16, 16, 16}},   {'t', {8, 8, 28, 8, 8, 9, 6}}};

typedef struct canvas {
    float *image;
    size_t width;
    size_t left, top; /* of the panel, pixels */
    size_t dot;       /* pixels */
} canvas;

/* Blends a rectangle of the panel, in dots, with a colour. */
static void fill_dots(const canvas *c, size_t x, size_t y, size_t width, size_t height, const float rgb[3],
                      float cover) {
    for (size_t row = y * c->dot; row < (y + height) * c->dot; ++row)
        for (size_t column = x * c->dot; column < (x + width) * c->dot; ++column) {
            float *pixel = c->image + 4 * ((c->top + row) * c->width + c->left + column);
            for (int k = 0; k < 3; ++k) pixel[k] += cover * (rgb[k] - pixel[k]);
            pixel[3] += cover * (1 - pixel[3]);
        }
}

static void draw_glyph(const canvas *c, const uint8_t rows[ROWS], size_t x, size_t y) {
    static const float ink[3] = {.8F, .8F, .8F};
    for (size_t row = 0; row < ROWS; ++row)
        for (size_t column = 0; column < COLUMNS; ++column)
            if (rows[row] >> (COLUMNS - 1 - column) & 1) fill_dots(c, x + column, y + row, 1, 1, ink, 1);
}

static size_t measure_text(const char *text) {
    return strlen(text) * ADVANCE - 1;
}

static void draw_text(const canvas *c, const char *text, size_t x, size_t y) {
    for (; *text; ++text, x += ADVANCE)
        for (size_t i = 0; i < sizeof glyphs / sizeof *glyphs; ++i)
            if (glyphs[i].character == *text) draw_glyph(c, glyphs[i].rows, x, y);
}

void picture_draw_legend(const char *title, double end, uint32_t width, uint32_t height, float *image) {
    static const float dark[3] = {.01F, .01F, .01F};
    const size_t dot = height / HEIGHT_PER_DOT > 0 ? height / HEIGHT_PER_DOT : 1;
    if (width < PANEL_WIDTH * dot || height < PANEL_HEIGHT * dot) return;
    const canvas c = {image, width, 0, height - PANEL_HEIGHT * dot, dot};
    const size_t bar = MARGIN + ROWS + GAP, numbers = bar + BAR_HEIGHT + GAP;
    fill_dots(&c, 0, 0, PANEL_WIDTH, PANEL_HEIGHT, dark, PANEL_COVER);
    draw_text(&c, title, MARGIN, MARGIN);
    for (size_t x = 0; x < BAR_WIDTH; ++x) {
        float rgb[3];
        drawing_false_color(((double)x + .5) / BAR_WIDTH, rgb);
        fill_dots(&c, MARGIN + x, bar, 1, BAR_HEIGHT, rgb, 1);
    }
    for (size_t k = 0; k < 3; ++k) {
        char text[32];
        snprintf(text, sizeof text, "%.3g", .5 * (double)k * end);
        draw_text(&c, text, MARGIN + k * (BAR_WIDTH - measure_text(text)) / 2, numbers);
    }
}
