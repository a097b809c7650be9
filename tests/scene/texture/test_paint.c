/* tests/scene/texture/test_paint.c: lookups in textures, reflectance at points, and its means, against plain
 * evaluations of their definitions. */
#include "support.h"

#include "base/math/vec.h"
#include "facetree/scene.h"
#include "mesh/color.h"
#include "radiosity/sample.h"
#include "scene/texture/pyramid.h"
#include "scene/texture/reflectance.h"

static double pick(uint64_t *seed) {
    return fct_uniform(*seed = fct_hash(*seed + 1));
}

static fct_image make_noise(uint32_t width, uint32_t height, uint64_t seed) {
    fct_image image = {width, height, malloc(3 * (size_t)width * height)};
    for (size_t i = 0; i < 3 * (size_t)width * height; ++i) image.pixels[i] = (uint8_t)(255 * pick(&seed));
    return image;
}

/* ---- Pyramids ---- */

static double texel_of(const fct_pyramid *p, uint32_t level, const fct_image *image, const float *factor,
                       int64_t x, int64_t y, int c) {
    const fct_pyramid_level *l = &p->levels[level];
    const size_t at = 3 * ((size_t)y * l->width + (size_t)x) + (size_t)c;
    if (level) return l->texels[at] / 65535.;
    const double s = image->pixels[at] / 255.,
                 linear = s <= .04045 ? s / 12.92 : pow((s + .055) / 1.055, 2.4);
    return p->clamped ? fmin(factor[c] * linear, .9) : factor[c] * linear;
}

static void levels_keep_the_mean(void **unused) {
    (void)unused;
    static const uint32_t sizes[][2] = {{16, 16}, {7, 5}, {1, 9}, {33, 1}, {1, 1}, {100, 63}};
    static const float factor[3] = {1, .5F, .95F};
    const fct_env env = fct_env_default();
    for (size_t k = 0; k < FCT_LENGTH(sizes); ++k) {
        fct_image image = make_noise(sizes[k][0], sizes[k][1], k);
        fct_pyramid p;
        assert_int_equal(fct_pyramid_build(&env, &image, factor, true, &p), FCT_OK);
        double means[3] = {0, 0, 0};
        for (uint32_t level = 0; level < p.level_count; ++level) {
            const fct_pyramid_level *l = &p.levels[level];
            if (level) assert_int_equal(l->width, fmax(1, l[-1].width / 2));
            if (level) assert_int_equal(l->height, fmax(1, l[-1].height / 2));
            for (int c = 0; c < 3; ++c) {
                double sum = 0;
                for (uint32_t y = 0; y < l->height; ++y)
                    for (uint32_t x = 0; x < l->width; ++x)
                        sum += texel_of(&p, level, &image, factor, x, y, c);
                sum /= (double)l->width * l->height;
                if (!level) means[c] = sum;
                assert_true(fabs(sum - means[c]) < 1e-4);
            }
        }
        assert_true(p.levels[p.level_count - 1].width == 1 && p.levels[p.level_count - 1].height == 1);
        fct_pyramid_release(&env, &p);
        free(image.pixels);
    }
}

/* The texel of the endless image that the wrapping makes. */
static int64_t wrap_index(fct_wrap wrap, int64_t i, int64_t n) {
    if (wrap == FCT_WRAP_CLAMP) return i < 0 ? 0 : i < n ? i : n - 1;
    const int64_t period = wrap == FCT_WRAP_REPEAT ? n : 2 * n, m = ((i % period) + period) % period;
    return m < n ? m : 2 * n - 1 - m;
}

static double look_up(const fct_pyramid *p, const fct_image *image, const float *factor, uint32_t level,
                      const fct_wrap wrap[2], const double at[2], int c) {
    const int64_t w = p->levels[level].width, h = p->levels[level].height;
    const double x = at[0] * (double)w - .5, y = at[1] * (double)h - .5;
    const int64_t i = (int64_t)floor(x), j = (int64_t)floor(y);
    double sum = 0;
    for (int64_t b = 0; b < 2; ++b)
        for (int64_t a = 0; a < 2; ++a)
            sum += (a ? x - (double)i : 1 - x + (double)i) * (b ? y - (double)j : 1 - y + (double)j) *
                   texel_of(p, level, image, factor, wrap_index(wrap[0], i + a, w),
                            wrap_index(wrap[1], j + b, h), c);
    return sum;
}

static void lookups_are_bilinear_in_an_endless_image(void **unused) {
    (void)unused;
    static const float factor[3] = {1, .8F, .6F};
    const fct_env env = fct_env_default();
    fct_image image = make_noise(11, 6, 5);
    fct_pyramid p;
    uint64_t seed = 3;
    assert_int_equal(fct_pyramid_build(&env, &image, factor, true, &p), FCT_OK);
    assert_int_equal(p.level_count, 4);
    for (int k = 0; k < 9 * 500; ++k) {
        const fct_wrap wrap[2] = {(fct_wrap)(k % 3), (fct_wrap)(k / 3 % 3)};
        const double at[2] = {6 * pick(&seed) - 3, 6 * pick(&seed) - 3}, level = 3 * pick(&seed);
        const double share = level - floor(level);
        double found[3];
        fct_pyramid_sample(&p, wrap, at, level, found);
        for (int c = 0; c < 3; ++c) {
            const uint32_t below = (uint32_t)level;
            const double expected = (1 - share) * look_up(&p, &image, factor, below, wrap, at, c) +
                                    share * look_up(&p, &image, factor, below + 1, wrap, at, c);
            assert_true(fabs(found[c] - expected) < 1e-6);
        }
    }
    memset(image.pixels, 230, 3 * 11 * 6); /* .791 */
    assert_true(fct_pyramid_would_clamp(&image, (const float[3]){.5F, .5F, 1.15F}));
    assert_false(fct_pyramid_would_clamp(&image, (const float[3]){1.1F, 1, 1}));
    assert_true(fct_pyramid_level_of(&p, .3) == 0 && fct_pyramid_level_of(&p, 2) == 1);
    assert_true(fct_pyramid_level_of(&p, 1e30) == 3);
    fct_pyramid_release(&env, &p);
    free(image.pixels);
}

/* ---- Painted scenes ---- */

typedef struct fixture {
    fct_env env;
    fct_scene *scene;
    fct_image image;
    fct_paint paint;
} fixture;

/* A bumpy sheet with colours and texture coordinates, twice as large as its image in u. */
static fct_mesh make_sheet(const fct_env *env, uint32_t n) {
    fct_mesh grid = make_grid(env, n), mesh;
    assert_int_equal(
        fct_mesh_create(env, grid.vertex_count, grid.face_count, FCT_MESH_COLORS | FCT_MESH_TEXCOORDS, &mesh),
        FCT_OK);
    memcpy(mesh.triangles, grid.triangles, 12 * (size_t)grid.face_count);
    for (size_t v = 0; v < grid.vertex_count; ++v) {
        const float *q = grid.positions + 3 * v;
        const float p[3] = {2 * q[0], q[1], .1F * sinf(9 * q[0] + 5 * q[1])};
        memcpy(mesh.positions + 3 * v, p, sizeof p);
        mesh.colors[3 * v] = q[0], mesh.colors[3 * v + 1] = 1.4F * q[1], mesh.colors[3 * v + 2] = .5F;
    }
    for (size_t c = 0; c < 3 * (size_t)mesh.face_count; ++c) {
        const float *q = grid.positions + 3 * (size_t)mesh.triangles[c];
        mesh.texcoords[2 * c] = 2 * q[0] - .3F, mesh.texcoords[2 * c + 1] = q[1] + .1F * q[0];
    }
    fct_mesh_release(env, &grid);
    return mesh;
}

static void begin(fixture *f, uint32_t n, bool textured, bool colored, const float factor[3]) {
    static const float transform[6] = {.9F, .1F, .25F, -.2F, 1.1F, .4F};
    static const float tall[12] = {1, 0, 0, 4, 0, 0, -1, 2, 0, 1, 0, 1};
    *f = (fixture){.env = fct_env_default(), .paint = fct_paint_default()};
    f->image = make_noise(37, 21, 8);
    fct_material material = {.name = "paint", .reflectance = {.1F, .1F, .1F}};
    fct_mesh mesh = make_sheet(&f->env, n);
    uint32_t id;
    assert_int_equal(fct_scene_create(&f->env, FCT_BACKEND_OBB, &f->scene), FCT_OK);
    assert_int_equal(fct_scene_add_material(f->scene, &material, &id), FCT_OK);
    memcpy(f->paint.factor, factor, sizeof f->paint.factor);
    memcpy(f->paint.transform, transform, sizeof transform);
    f->paint.wrap[1] = FCT_WRAP_MIRROR;
    f->paint.vertex_colors = colored;
    if (textured) {
        const fct_texture texture = {"noise", f->image.width, f->image.height, f->image.pixels};
        assert_int_equal(fct_scene_add_texture(f->scene, &texture, &f->paint.texture), FCT_OK);
    }
    assert_int_equal(fct_scene_paint_material(f->scene, id, &f->paint), FCT_OK);
    assert_int_equal(fct_scene_add_object(f->scene, "sheet", &mesh, NULL, tall, id, NULL), FCT_OK);
    assert_int_equal(fct_scene_commit(f->scene), FCT_OK);
    fct_mesh_release(&f->env, &mesh);
}

static void end(fixture *f) {
    fct_scene_destroy(f->scene);
    free(f->image.pixels);
}

static double linear_of(uint8_t byte) {
    const double s = byte / 255.;
    return s <= .04045 ? s / 12.92 : pow((s + .055) / 1.055, 2.4);
}

/* By the definition in scene.h, from the position of the point, which gives its colour and coordinates. */
static void expect_reflectance(const fixture *f, const fct_tree_view *t, uint32_t place, const double w[3],
                               double out[3]) {
    const fct_paint *paint = &f->paint;
    double x[2] = {0, 0}, tint[3] = {0, 0, 0};
    const double limit = paint->texture == FCT_NONE ? .9 : 1;
    for (int k = 0; k < 3; ++k) {
        const float *p = t->positions + 3 * (size_t)t->triangles[3 * (size_t)place + (uint32_t)k];
        const double u = p[0] / 2., v = p[1], color[3] = {u, 1.4 * v, .5};
        const double s[2] = {2 * u - .3, v + .1 * u};
        for (int c = 0; c < 2; ++c)
            x[c] += w[k] * (paint->transform[3 * c] * s[0] + paint->transform[3 * c + 1] * s[1] +
                            paint->transform[3 * c + 2]);
        for (int c = 0; c < 3; ++c)
            tint[c] += w[k] * fmin((paint->vertex_colors ? fmin(color[c], 1) : 1) *
                                       (paint->texture == FCT_NONE ? paint->factor[c] : 1),
                                   limit);
    }
    for (int c = 0; c < 3; ++c) out[c] = tint[c];
    if (paint->texture == FCT_NONE) return;
    const int64_t n[2] = {f->image.width, f->image.height};
    const double a = x[0] * (double)n[0] - .5, b = x[1] * (double)n[1] - .5;
    for (int c = 0; c < 3; ++c) {
        double sum = 0;
        for (int k = 0; k < 4; ++k) {
            const int64_t i = (int64_t)floor(a) + k % 2, j = (int64_t)floor(b) + k / 2;
            const size_t at =
                (size_t)(wrap_index(paint->wrap[1], j, n[1]) * n[0] + wrap_index(paint->wrap[0], i, n[0]));
            sum += (1 - fabs(a - (double)i)) * (1 - fabs(b - (double)j)) *
                   fmin(paint->factor[c] * linear_of(f->image.pixels[3 * at + (size_t)c]), .9);
        }
        out[c] *= sum;
    }
}

static void points_follow_the_definition(void **unused) {
    (void)unused;
    static const float factors[2][3] = {{1, .5F, 3}, {.3F, .2F, .9F}}; /* with and without clamped texels */
    for (int kind = 0; kind < 8; ++kind) {
        fixture f;
        const bool textured = kind & 1, colored = kind & 2;
        uint64_t seed = 1;
        begin(&f, 3, textured, colored, factors[kind / 4]);
        const fct_scene_view view = fct_scene_get(f.scene);
        const fct_tree_view t = fct_tree_get(view.models[0].tree);
        assert_int_equal(fct_scene_is_painted(f.scene, 0), textured || colored);
        for (int k = 0; k < 500; ++k) {
            const uint32_t place = (uint32_t)(pick(&seed) * t.face_count);
            double a = pick(&seed), b = pick(&seed), expected[3];
            if (a + b > 1) a = 1 - a, b = 1 - b;
            const double w[3] = {1 - a - b, a, b};
            float found[3];
            fct_scene_reflectance(f.scene, 0, place, (float)a, (float)b, 0, found);
            expect_reflectance(&f, &t, place, w, expected);
            for (int c = 0; c < 3; ++c) {
                if (fabs(found[c] - expected[c]) > 2e-4)
                    fail_msg("kind %d: channel %d is %g, expected %g", kind, c, (double)found[c],
                             expected[c]);
                assert_true(found[c] <= view.materials[0].reflectance[c] + 1e-6F && found[c] <= .9F + 1e-6F);
            }
        }
        end(&f);
    }
}

/* Dense samples of the definition over a triangle of a face. */
static void average_densely(const fixture *f, const fct_tree_view *t, uint32_t place,
                            const double corners[3][2], double out[3]) {
    enum { N = 300 };
    out[0] = out[1] = out[2] = 0;
    for (int i = 0; i < N; ++i)
        for (int j = 0; j < N; ++j) {
            double s = (i + .5) / N, q = (j + .5) / N, uv[2], rho[3];
            if (s + q > 1) s = 1 - s, q = 1 - q;
            for (int c = 0; c < 2; ++c)
                uv[c] = (1 - s - q) * corners[0][c] + s * corners[1][c] + q * corners[2][c];
            const double w[3] = {1 - uv[0] - uv[1], uv[0], uv[1]};
            expect_reflectance(f, t, place, w, rho);
            for (int c = 0; c < 3; ++c) out[c] += rho[c] / N / N;
        }
}

static void means_of_triangles(void **unused) {
    (void)unused;
    static const float factor[3] = {1, .7F, .4F};
    static const double corners[3][3][2] = {
        {{0, 0}, {1, 0}, {0, 1}}, {{.5, 0}, {0, .5}, {.5, .5}}, {{.1, .7}, {.2, .7}, {.1, .8}}};
    for (int kind = 1; kind < 4; ++kind) {
        fixture f;
        begin(&f, 2, kind & 1, kind & 2, factor);
        const fct_tree_view t = fct_tree_get(fct_scene_get(f.scene).models[0].tree);
        for (uint32_t place = 0; place < t.face_count; ++place)
            for (int k = 0; k < 3; ++k) {
                double found[3], expected[3];
                fct_reflectance_of_triangle(f.scene, 0, place, corners[k], 1 << 14, found);
                average_densely(&f, &t, place, corners[k], expected);
                for (int c = 0; c < 3; ++c)
                    if (fabs(found[c] - expected[c]) > (k < 2 ? .01 : .02) * expected[c])
                        fail_msg("kind %d, face %u, part %d: %g, expected %g", kind, place, k, found[c],
                                 expected[c]);
            }
        end(&f);
    }
}

/* On coarse levels, the neighbourhood of a triangle shows at its border, but means over many triangles hold.
 */
static void few_samples_still_average(void **unused) {
    (void)unused;
    static const float factor[3] = {1, .7F, .4F};
    static const double whole[3][2] = {{0, 0}, {1, 0}, {0, 1}};
    fixture f;
    begin(&f, 1, true, false, factor);
    const fct_tree_view t = fct_tree_get(fct_scene_get(f.scene).models[0].tree);
    double found[3], expected[3];
    for (uint32_t place = 0; place < 2; ++place) {
        fct_reflectance_of_triangle(f.scene, 0, place, whole, 64, found);
        average_densely(&f, &t, place, whole, expected);
        for (int c = 0; c < 3; ++c) assert_true(fabs(found[c] - expected[c]) < .1 * expected[c]);
    }
    end(&f);
}

static void nodes_add_up_their_faces(void **unused) {
    (void)unused;
    static const float factor[3] = {1, .7F, .4F};
    for (uint32_t threads = 1; threads <= 3; threads += 2) {
        fixture f;
        begin(&f, 6, true, true, factor);
        f.env.thread_count = threads;
        const fct_tree *tree = fct_scene_get(f.scene).models[0].tree;
        const fct_tree_view t = fct_tree_get(tree);
        static const double whole[3][2] = {{0, 0}, {1, 0}, {0, 1}};
        float *means;
        assert_int_equal(fct_reflectance_of_nodes(&f.env, f.scene, 0, &means), FCT_OK);
        for (uint32_t node = 0; node < t.node_count + t.face_count; ++node) {
            double sum[3] = {0, 0, 0}, area = 0;
            fct_cluster c;
            assert_int_equal(fct_tree_cluster(tree, node, &c), FCT_OK);
            for (uint32_t p = c.first; p < c.first + c.count; ++p) {
                double mean[3];
                fct_cluster leaf;
                assert_int_equal(fct_tree_cluster(tree, t.node_count + p, &leaf), FCT_OK);
                fct_reflectance_of_triangle(f.scene, 0, p, whole, fct_reflectance_samples(t.face_count),
                                            mean);
                for (int k = 0; k < 3; ++k) sum[k] += (double)leaf.area * mean[k];
                area += (double)leaf.area;
            }
            for (int k = 0; k < 3; ++k)
                assert_true(fabs(means[3 * (size_t)node + (size_t)k] - sum[k] / area) < 1e-5);
        }
        fct_release(&f.env, means);
        end(&f);
    }
    assert_true(fct_reflectance_samples(1) == 1 << 18 && fct_reflectance_samples(UINT32_MAX) == 16);
}

/* Far wider than a texel, the filter leaves the mean; narrower than one, nothing changes. */
static void wide_filters_flatten(void **unused) {
    (void)unused;
    static const float factor[3] = {1, .7F, .4F};
    fixture f;
    begin(&f, 1, true, false, factor);
    float exact[3], fine[3], wide[3], middle[3];
    double mean[3] = {0, 0, 0}, spread[2] = {0, 0};
    const size_t count = (size_t)f.image.width * f.image.height;
    for (size_t i = 0; i < 3 * count; ++i)
        mean[i % 3] += fmin(factor[i % 3] * linear_of(f.image.pixels[i]), .9) / (double)count;
    uint64_t seed = 7;
    for (int k = 0; k < 400; ++k) {
        const float u = (float)(.5 * pick(&seed)), v = (float)(.5 * pick(&seed));
        fct_scene_reflectance(f.scene, 0, 0, u, v, 0, exact);
        fct_scene_reflectance(f.scene, 0, 0, u, v, .01F, fine);
        fct_scene_reflectance(f.scene, 0, 0, u, v, .15F, middle); /* about three texels */
        fct_scene_reflectance(f.scene, 0, 0, u, v, 100, wide);
        for (int c = 0; c < 3; ++c) {
            assert_true(exact[c] == fine[c]);
            assert_true(fabs(wide[c] - mean[c]) < .001);
        }
        spread[0] += pow(exact[0] - mean[0], 2), spread[1] += pow(middle[0] - mean[0], 2);
    }
    assert_true(spread[1] < .35 * spread[0] && spread[1] > .01 * spread[0]);
    end(&f);
}

static void bad_paints_are_refused(void **unused) {
    (void)unused;
    recorder r = {0};
    const fct_env env = recorder_env(&r);
    fct_scene *scene;
    const fct_material white = {.name = "white"};
    const fct_texture empty = {"empty", 0, 1, NULL};
    uint32_t id, texture;
    assert_int_equal(fct_scene_create(&env, FCT_BACKEND_OBB, &scene), FCT_OK);
    assert_int_equal(fct_scene_add_material(scene, &white, &id), FCT_OK);
    fct_paint paint = fct_paint_default();
    paint.factor[1] = -1;
    assert_int_equal(fct_scene_paint_material(scene, id, &paint), FCT_ERROR_DATA);
    assert_non_null(strstr(r.text, "factor[1] is -1"));
    paint = fct_paint_default(), paint.texture = 3;
    assert_int_equal(fct_scene_paint_material(scene, id, &paint), FCT_ERROR_DATA);
    assert_non_null(strstr(r.text, "texture 3, expected one below 0"));
    paint = fct_paint_default(), paint.transform[2] = NAN;
    assert_int_equal(fct_scene_paint_material(scene, id, &paint), FCT_ERROR_DATA);
    assert_int_equal(fct_scene_add_texture(scene, &empty, &texture), FCT_ERROR_DATA);
    assert_int_equal(fct_scene_read_texture(scene, "no such file", &texture), FCT_ERROR_INPUT);
    assert_int_equal(texture, FCT_NONE);
    fct_scene_destroy(scene);
    assert_int_equal(r.alive, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(levels_keep_the_mean),
        cmocka_unit_test(lookups_are_bilinear_in_an_endless_image),
        cmocka_unit_test(points_follow_the_definition),
        cmocka_unit_test(means_of_triangles),
        cmocka_unit_test(few_samples_still_average),
        cmocka_unit_test(nodes_add_up_their_faces),
        cmocka_unit_test(wide_filters_flatten),
        cmocka_unit_test(bad_paints_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
