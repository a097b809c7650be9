/* tests/scene/texture/test_image.c: decoded images of every kind, and files that are damaged or lie. */
#include "scene/texture/pictures.h"

#include "scene/texture/image.h"

enum { W = 13, H = 7 };

/* The value of a pixel's channel; a smooth one, because JPEG blurs. */
static uint8_t channel(uint32_t x, uint32_t y, uint32_t c) {
    return (uint8_t)(20 + 9 * x + 11 * y + 7 * c);
}

static void expect_pixels(const picture *p, const uint8_t *pixels, int tolerance) {
    recorder r = {0};
    const fct_env env = recorder_env(&r);
    fct_image image;
    assert_int_equal(fct_image_decode(&env, "image", p->data, p->size, &image), FCT_OK);
    assert_int_equal(image.width, W);
    assert_int_equal(image.height, H);
    assert_int_equal(r.messages, 0);
    for (size_t i = 0; i < 3 * W * H; ++i)
        if (abs(image.pixels[i] - pixels[i]) > tolerance)
            fail_msg("pixel %zu: %d, expected %d", i, image.pixels[i], pixels[i]);
    fct_release(&env, image.pixels);
    assert_int_equal(r.alive, 0);
}

static void decodes_png_of_every_kind(void **unused) {
    (void)unused;
    static const struct {
        int type, channels;
    } types[] = {{PNG_COLOR_TYPE_GRAY, 1},
                 {PNG_COLOR_TYPE_GRAY_ALPHA, 2},
                 {PNG_COLOR_TYPE_RGB, 3},
                 {PNG_COLOR_TYPE_RGB_ALPHA, 4},
                 {PNG_COLOR_TYPE_PALETTE, 1}};
    for (size_t t = 0; t < FCT_LENGTH(types); ++t)
        for (int depth = 1; depth <= 16; depth *= 2)
            for (int interlaced = 0; interlaced < 2; ++interlaced) {
                const int type = types[t].type, channels = types[t].channels;
                if (depth < 8 && channels > 1) continue;
                if (depth == 16 && type == PNG_COLOR_TYPE_PALETTE) continue;
                uint8_t rows[H][8 * W] = {{0}}, expected[3 * W * H];
                for (uint32_t y = 0; y < H; ++y)
                    for (uint32_t x = 0; x < W; ++x)
                        for (uint32_t k = 0; k < 3; ++k) {
                            uint32_t c = channels > 2 ? k : 0, value = channel(x, y, c);
                            if (depth < 8) value = value % (1U << depth);
                            uint32_t bit = x * (uint32_t)depth, shown = value;
                            if (depth < 8 && k == 0)
                                rows[y][bit / 8] |= (uint8_t)(value << (8 - depth - (int)bit % 8));
                            if (depth == 8) rows[y][x * (uint32_t)channels + c] = (uint8_t)value;
                            if (depth == 16) rows[y][2 * (x * (uint32_t)channels + c)] = (uint8_t)value;
                            if (depth == 16) rows[y][2 * (x * (uint32_t)channels + c) + 1] = 255;
                            if (depth < 8) shown = value * 255 / ((1U << depth) - 1);
                            if (depth == 16) shown = (uint32_t)floor((256 * value + 255) / 257. + .5);
                            if (type == PNG_COLOR_TYPE_PALETTE)
                                shown = k == 0 ? value : k == 1 ? 255 - value : value / 2;
                            expected[3 * (y * W + x) + k] = (uint8_t)shown;
                        }
                picture p = make_png(W, H, depth, type, interlaced, rows[0], sizeof rows[0]);
                expect_pixels(&p, expected, 0);
                free(p.data);
            }
}

static void decodes_jpeg(void **unused) {
    (void)unused;
    uint8_t pixels[3 * W * H], grey[W * H];
    for (uint32_t i = 0; i < W * H; ++i) {
        for (uint32_t c = 0; c < 3; ++c) pixels[3 * i + c] = channel(i % W, i / W, c);
        grey[i] = pixels[3 * i];
    }
    for (int progressive = 0; progressive < 2; ++progressive) {
        picture color = make_jpeg(W, H, 3, progressive, pixels),
                plain = make_jpeg(W, H, 1, progressive, grey);
        uint8_t spread[3 * W * H];
        for (uint32_t i = 0; i < 3 * W * H; ++i) spread[i] = grey[i / 3];
        expect_pixels(&color, pixels, 6);
        expect_pixels(&plain, spread, 4);
        free(color.data), free(plain.data);
    }
}

static void expect_failure(const void *data, size_t size, const char *text) {
    recorder r = {0};
    const fct_env env = recorder_env(&r);
    fct_image image;
    assert_int_equal(fct_image_decode(&env, "image", data, size, &image), FCT_ERROR_DATA);
    if (!strstr(r.text, text)) fail_msg("%s, expected %s", r.text, text);
    assert_true(!image.pixels && !image.width && !image.height);
    assert_int_equal(r.alive, 0);
}

static void refuses_damaged_files(void **unused) {
    (void)unused;
    uint8_t pixels[4 * W * H];
    for (uint32_t i = 0; i < sizeof pixels; ++i) pixels[i] = (uint8_t)(i * i);
    picture png = make_rgb_png(W, H, pixels), jpeg = make_jpeg(W, H, 3, false, pixels),
            cmyk = make_jpeg(W, H, 4, false, pixels);
    for (size_t size = 0; size < png.size - 12; ++size) expect_failure(png.data, size, "image: ");
    expect_failure(png.data, png.size - 20, "a damaged PNG: the file ends too early");
    png.data[50] ^= 1;
    expect_failure(png.data, png.size, "a damaged PNG");
    expect_failure(cmyk.data, cmyk.size, "a damaged JPEG: Unsupported color conversion");
    expect_failure("GIF89a", 6, "image: expected a PNG or JPEG image");
    for (size_t size = 0; size < jpeg.size; ++size) { /* a shorter file: its part is decoded */
        recorder r = {0};
        const fct_env env = recorder_env(&r);
        fct_image image;
        fct_result result = fct_image_decode(&env, "image", jpeg.data, size, &image);
        assert_true(result == FCT_ERROR_DATA || (result == FCT_OK && strstr(r.text, "a damaged JPEG: ")));
        fct_release(&env, image.pixels);
        assert_int_equal(r.alive, 0);
    }
    free(png.data), free(jpeg.data), free(cmyk.data);
}

/* 18 MB of zeros become 18 kB, and would become an image of 432 MB. */
static void refuses_sizes_out_of_proportion(void **unused) {
    (void)unused;
    enum { SIDE = 12000 };
    unsigned char *rows = calloc(SIDE, SIDE / 8);
    picture p = make_png(SIDE, SIDE, 1, PNG_COLOR_TYPE_GRAY, false, rows, SIDE / 8);
    expect_failure(p.data, p.size, "cannot hold an image of 12000 x 12000 pixels");
    free(p.data);
    p = make_png(2000, 2000, 1, PNG_COLOR_TYPE_GRAY, false, rows, SIDE / 8);
    const fct_env env = fct_env_default();
    fct_image image;
    assert_int_equal(fct_image_decode(&env, "image", p.data, p.size, &image), FCT_OK);
    fct_release(&env, image.pixels);
    free(p.data), free(rows);
}

static void fails_cleanly_at_every_allocation(void **unused) {
    (void)unused;
    uint8_t pixels[3 * W * H] = {1, 2, 3};
    picture files[] = {make_png(W, H, 8, PNG_COLOR_TYPE_RGB, true, pixels, 3 * W),
                       make_jpeg(W, H, 3, true, pixels)};
    for (int k = 0; k < 2; ++k) {
        for (long n = 1;; ++n) {
            recorder r = {.fail_at = n};
            const fct_env env = recorder_env(&r);
            fct_image image;
            fct_result result = fct_image_decode(&env, "image", files[k].data, files[k].size, &image);
            fct_release(&env, image.pixels);
            assert_int_equal(r.alive, 0);
            assert_int_equal(result, r.allocations < n ? FCT_OK : FCT_ERROR_MEMORY);
            if (result == FCT_OK) break;
            assert_true(r.text[0]);
        }
        free(files[k].data);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(decodes_png_of_every_kind),
        cmocka_unit_test(decodes_jpeg),
        cmocka_unit_test(refuses_damaged_files),
        cmocka_unit_test(refuses_sizes_out_of_proportion),
        cmocka_unit_test(fails_cleanly_at_every_allocation),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
