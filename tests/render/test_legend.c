/* The legend of false colours. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tools/render/legend.h"
#include "tools/render/palette.h"

enum { LEFT = 6, BAR = 17, BAR_WIDTH = 180, NUMBERS = 29, HEIGHT = 42, WIDTH = 192 }; /* dots */

static float *draw(const char *title, double end, uint32_t width, uint32_t height) {
    float *image = calloc((size_t)width * height, 4 * sizeof *image);
    picture_draw_legend(title, end, width, height, image);
    return image;
}

/* The dots of a line of text, a character per row bit: 1 where the picture is bright. */
static int count_ink(const float *image, uint32_t width, uint32_t dot, uint32_t x, uint32_t y,
                     uint32_t columns) {
    int count = 0;
    for (uint32_t row = 0; row < 7; ++row)
        for (uint32_t column = 0; column < columns; ++column)
            count += image[4 * ((size_t)((y + row) * dot) * width + (x + column) * dot)] > .5F;
    return count;
}

/* All colours in the bar from left to right, in dots of whole pixels; nothing outside the panel. */
static void the_bar_has_all_colours(void **state) {
    (void)state;
    for (uint32_t dot = 1; dot <= 2; ++dot) {
        const uint32_t width = 500, height = 400 * dot, top = height - HEIGHT * dot;
        float *image = draw("error", 10, width, height);
        for (uint32_t x = 0; x < BAR_WIDTH * dot; ++x)
            for (uint32_t y = 0; y < 8 * dot; ++y) {
                float rgb[3];
                drawing_false_color((x / dot + .5) / BAR_WIDTH, rgb);
                const float *pixel = image + 4 * ((size_t)(top + BAR * dot + y) * width + LEFT * dot + x);
                for (int k = 0; k < 3; ++k) assert_float_equal(pixel[k], rgb[k], 1e-6);
                assert_float_equal(pixel[3], 1, 1e-6);
            }
        for (uint32_t y = 0; y < height; ++y)
            for (uint32_t x = 0; x < width; ++x)
                if (y < top || x >= WIDTH * dot) assert_true(image[4 * ((size_t)y * width + x) + 3] == 0);
        free(image);
    }
}

/* "5" and "0" have different dots; the numbers are 0, the half and the end, at the left, the middle and the
 * right of the bar. */
static void the_numbers_stand_below_the_bar(void **state) {
    (void)state;
    const uint32_t width = 300, height = 200;
    const size_t top = (size_t)(height - HEIGHT) * width * 4;
    float *ten = draw("", 10, width, height), *two = draw("", 2, width, height);
    const int zero = count_ink(ten + top, width, 1, LEFT, NUMBERS, 5);
    assert_int_equal(zero, 19);
    assert_int_equal(count_ink(ten + top, width, 1, LEFT + 87, NUMBERS, 5), 17);       /* 5, in the middle */
    assert_int_equal(count_ink(ten + top, width, 1, LEFT + 180 - 11, NUMBERS, 5), 10); /* 1 of 10 */
    assert_int_equal(count_ink(ten + top, width, 1, LEFT + 180 - 5, NUMBERS, 5), zero);
    assert_int_equal(count_ink(two + top, width, 1, LEFT + 180 - 5, NUMBERS, 5), 14); /* 2 */
    free(ten), free(two);
}

/* The title is above the bar, and every one of its letters has dots. */
static void the_title_has_all_letters(void **state) {
    (void)state;
    static const char text[] = "error,%ofthemedianlight0123456789.+-";
    const uint32_t width = 300, height = 200;
    const size_t top = (size_t)(height - HEIGHT) * width * 4;
    for (size_t i = 0; text[i]; ++i) {
        const char title[2] = {text[i], 0};
        float *image = draw(title, 1, width, height);
        assert_in_range(count_ink(image + top, width, 1, LEFT, 6, 5), 2, 25);
        assert_int_equal(count_ink(image + top, width, 1, LEFT + 5, 6, 100), 0);
        free(image);
    }
}

static void small_pictures_have_no_legend(void **state) {
    (void)state;
    static const uint32_t sizes[2][2] = {{WIDTH - 1, 300}, {300, HEIGHT - 1}};
    for (int k = 0; k < 2; ++k) {
        float *image = draw("error", 1, sizes[k][0], sizes[k][1]);
        for (size_t i = 0; i < 4 * (size_t)sizes[k][0] * sizes[k][1]; ++i) assert_true(image[i] == 0);
        free(image);
    }
    float *image = draw("error", 1, WIDTH, HEIGHT);
    assert_true(image[3] > 0);
    free(image);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_bar_has_all_colours), cmocka_unit_test(the_numbers_stand_below_the_bar),
        cmocka_unit_test(the_title_has_all_letters), cmocka_unit_test(small_pictures_have_no_legend)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
