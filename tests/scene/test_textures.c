/* tests/scene/test_textures.c: textures and vertex colours of scene files. */
#include "files.h"
#include "scene/texture/pictures.h"

#include "facetree/cluster.h"
#include "scene/read/load.h"
#include "scene/scene.h"

enum { N = 4 };
static uint8_t pixels[3 * N * N];
static char data_uri[1024]; /* of the same picture */
static size_t picture_size;

/* The corners of a square, two sets of texture coordinates, and colours. */
static const float quad[] = {0,  0,  0, 1,  0, 0, 1,  1, 0, 0, 1, 0,  0,  1,  1,   1,   1,   0, 0, 0,
                             .5, .5, 1, .5, 1, 1, .5, 1, 1, 1, 1, .5, .5, .5, .25, .25, .25, 0, 0, 0};

static void encode_base64(const unsigned char *data, size_t size, char *to) {
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < size; i += 3) {
        uint32_t bits = 0;
        for (size_t k = 0; k < 3; ++k) bits = bits << 8 | (i + k < size ? data[i + k] : 0);
        for (size_t k = 0; k < 4; ++k) *to++ = i + k > size ? '=' : digits[bits >> (18 - 6 * k) & 63];
    }
    *to = 0;
}

static int set_up(void **unused) {
    (void)unused;
    assert_non_null(mkdtemp(folder));
    for (int i = 0; i < 3 * N * N; ++i) pixels[i] = (uint8_t)(5 * i);
    picture p = make_rgb_png(N, N, pixels);
    picture_size = p.size;
    write_bytes("a picture.png", p.data, p.size);
    write_bytes("broken.png", p.data, p.size - 20);
    strcpy(data_uri, "data:image/png;base64,");
    encode_base64(p.data, p.size, data_uri + strlen(data_uri));
    unsigned char both[sizeof quad + 1024];
    memcpy(both, quad, sizeof quad), memcpy(both + sizeof quad, p.data, p.size);
    write_bytes("quad.bin", both, sizeof quad + p.size);
    free(p.data);
    memset(pixels, 255, 3);
    p = make_rgb_png(N, N, pixels);
    write_bytes("white.png", p.data, p.size);
    free(p.data);
    pixels[0] = 0, pixels[1] = 5, pixels[2] = 10;
    return 0;
}

static double linear_of(uint8_t byte) {
    const double s = byte / 255.;
    return s <= .04045 ? s / 12.92 : pow((s + .055) / 1.055, 2.4);
}

/* The reflectance at image point (x, y) of a square whose coordinates v run down, by its position. */
static void expect_texel(const fct_scene *scene, uint32_t instance, int x, int y, const double factor[3]) {
    const fct_scene_view view = fct_scene_get(scene);
    const fct_ray ray = {.origin = {((float)x + .5F) / N, 1 - ((float)y + .5F) / N, 5},
                         .direction = {0, 0, -1},
                         .t_max = INFINITY};
    fct_scene_hit hit;
    float found[3];
    assert_true(fct_scene_closest_hit(scene, &ray, &hit, NULL));
    assert_true(instance < view.instance_count);
    fct_scene_reflectance(scene, instance, hit.place, hit.u, hit.v, 0, found);
    for (int c = 0; c < 3; ++c) {
        const double expected = factor[c] * linear_of(pixels[3 * (y * N + x) + c]);
        if (fabs(found[c] - expected) > 1e-4)
            fail_msg("texel %d %d: %g, expected %g", x, y, (double)found[c], expected);
    }
}

static void expect_picture(const fct_scene *scene, const double factor[3]) {
    assert_true(fct_scene_is_painted(scene, 0));
    for (int y = 0; y < N; ++y)
        for (int x = 0; x < N; ++x) expect_texel(scene, 0, x, y, factor);
}

static fct_scene *must_load(recorder *r, const char *name, bool no_textures) {
    static fct_env env;
    fct_scene *scene;
    env = recorder_env(r);
    env.no_textures = no_textures;
    assert_int_equal(fct_scene_load(&env, path_of(name), FCT_BACKEND_OBB, &scene), FCT_OK);
    return scene;
}

static const double one[3] = {1, 1, 1};

/* ---- glTF ---- */

static void write_gltf(const char *material, const char *attributes, const char *rest) {
    static char text[8192];
    int length = snprintf(
        text, sizeof text,
        "{\"asset\": {\"version\": \"2.0\"}, \"buffers\": [{\"byteLength\": 9999, \"uri\": \"quad.bin\"}],"
        "\"bufferViews\": [{\"buffer\": 0, \"byteLength\": 48}, {\"buffer\": 0, \"byteOffset\": 48, "
        "\"byteLength\": 32}, {\"buffer\": 0, \"byteOffset\": 80, \"byteLength\": 32}, {\"buffer\": 0, "
        "\"byteOffset\": 112, \"byteLength\": 48}, {\"buffer\": 0, \"byteOffset\": 160, \"byteLength\": "
        "%ld}],"
        "\"accessors\": [{\"bufferView\": 0, \"componentType\": 5126, \"count\": 4, \"type\": \"VEC3\"},"
        "{\"bufferView\": 1, \"componentType\": 5126, \"count\": 4, \"type\": \"VEC2\"},"
        "{\"bufferView\": 2, \"componentType\": 5126, \"count\": 4, \"type\": \"VEC2\"},"
        "{\"bufferView\": 3, \"componentType\": 5126, \"count\": 4, \"type\": \"VEC3\"}],"
        "\"meshes\": [{\"primitives\": [{\"attributes\": {\"POSITION\": 0%s}, \"mode\": 6, \"material\": "
        "0}]}],"
        "\"nodes\": [{\"mesh\": 0}], \"materials\": [{%s}] %s}",
        (long)picture_size, attributes, material, rest);
    assert_true(length < (int)sizeof text);
    write_text("s.gltf", text);
}

#define BASE(info, factor)                                                                                   \
    "\"pbrMetallicRoughness\": {\"baseColorTexture\": {\"index\": 0" info "}, \"baseColorFactor\": [" factor \
    ", 1]}"
#define UV    ", \"TEXCOORD_0\": 1"
#define IMAGE ", \"textures\": [{\"source\": 0}], \"images\": [{%s}]"
#define BESIDE                                                                                               \
    ", \"textures\": [{\"source\": 0, \"sampler\": 0}], \"images\": [{\"uri\": \"a%20picture.png\"}]"

static void gltf_images_from_everywhere(void **unused) {
    (void)unused;
    static const double factor[3] = {.5, 1, .25};
    char uri[1200], rest[2048];
    snprintf(uri, sizeof uri, "\"uri\": \"%s\"", data_uri);
    const char *const images[] = {"\"uri\": \"a%20picture.png\"", "\"bufferView\": 4", uri};
    for (int k = 0; k < 3; ++k) {
        recorder r = {0};
        snprintf(rest, sizeof rest, IMAGE, images[k]);
        write_gltf(BASE("", "0.5, 1, 0.25"), UV, rest);
        fct_scene *scene = must_load(&r, "s.gltf", false);
        assert_int_equal(fct_scene_get(scene).texture_count, 1);
        assert_non_null(strstr(fct_scene_get(scene).textures[0].name, "s.gltf: images[0]"));
        assert_int_equal(r.messages, 0);
        expect_picture(scene, factor);
        fct_scene_destroy(scene);
        scene = must_load(&r, "s.gltf", true);
        assert_false(fct_scene_is_painted(scene, 0));
        assert_int_equal(fct_scene_get(scene).texture_count, 0);
        assert_true(fct_scene_get(scene).materials[0].reflectance[2] == .25F);
        fct_scene_destroy(scene);
    }
}

static void gltf_samplers_sets_and_transforms(void **unused) {
    (void)unused;
    recorder r = {0};
    write_gltf(BASE(", \"texCoord\": 0, \"extensions\": {\"KHR_texture_transform\": {\"offset\": [0.1, 0.2], "
                    "\"rotation\": 0.5, \"scale\": [2, 3], \"texCoord\": 1}}",
                    "1, 1, 1"),
               UV ", \"TEXCOORD_1\": 2",
               BESIDE ", \"samplers\": [{\"wrapS\": 33648, \"wrapT\": 33071}], \"extensionsUsed\": "
                      "[\"KHR_texture_transform\"], \"extensionsRequired\": [\"KHR_texture_transform\"]");
    fct_scene *scene = must_load(&r, "s.gltf", false);
    assert_int_equal(r.messages, 0);
    const fct_paint *p = &scene->paints[0].def;
    const double s = sin(.5), c = cos(.5), expected[6] = {2 * c, 3 * s, .1, -2 * s, 3 * c, .2};
    for (int k = 0; k < 6; ++k) assert_true(fabs(p->transform[k] - expected[k]) < 1e-6);
    assert_true(p->wrap[0] == FCT_WRAP_MIRROR && p->wrap[1] == FCT_WRAP_CLAMP && p->vertex_colors);
    const float *uv = scene->models[0].texcoords; /* all of set 1 lie in [.5, 1] */
    for (int k = 0; k < 12; ++k) assert_true(uv[k] >= .5F);
    fct_scene_destroy(scene);
}

static void gltf_losses_are_reported(void **unused) {
    (void)unused;
    static const struct {
        const char *rest, *message;
    } cases[] = {
        {", \"textures\": [{\"source\": 0}], \"images\": [{\"uri\": \"gone.png\"}]", "gone.png"},
        {", \"textures\": [{\"source\": 0}], \"images\": [{\"uri\": \"broken.png\"}]", "a damaged PNG"},
        {", \"textures\": [{\"source\": 0}], \"images\": [{\"uri\": \"../x.png\"}]", ".."},
        {", \"textures\": [{\"source\": 0}], \"images\": [{\"uri\": \"quad.bin\"}]",
         "expected a PNG or JPEG"},
        {", \"textures\": [{\"extensions\": {\"KHR_texture_basisu\": {\"source\": 0}}}]",
         "no PNG or JPEG image"},
        {", \"textures\": [{\"source\": 7}]", "images[7] does not exist"},
        {"", "textures[0] does not exist"},
        {", \"textures\": [{\"source\": 0}], \"images\": [{\"bufferView\": 9}]",
         "bufferViews[9] does not exist"},
    };
    for (size_t k = 0; k < FCT_LENGTH(cases); ++k) {
        recorder r = {0};
        write_gltf(BASE("", "0.5, 0.5, 0.5"), UV, cases[k].rest);
        fct_scene *scene = must_load(&r, "s.gltf", false);
        if (!strstr(r.text, cases[k].message) ||
            !strstr(r.text, "1 textures cannot be read and are left out"))
            fail_msg("%s, expected %s", r.text, cases[k].message);
        assert_int_equal(r.messages, 1);
        assert_false(fct_scene_is_painted(scene, 0));
        assert_true(fct_scene_get(scene).materials[0].reflectance[0] == .5F);
        fct_scene_destroy(scene);
        assert_int_equal(r.alive, 0);
    }
    recorder r = {0};
    write_gltf(BASE("", "1, 1, 1"), "", BESIDE ", \"samplers\": [{}]");
    fct_scene *scene = must_load(&r, "s.gltf", false);
    assert_non_null(strstr(r.text, "1 primitives have a texture but no texture coordinates"));
    fct_scene_destroy(scene);
    memset(&r, 0, sizeof r);
    write_gltf(BASE("", "1, 1, 1"), UV,
               ", \"textures\": [{\"source\": 0}], \"images\": [{\"uri\": \"white.png\"}]");
    scene = must_load(&r, "s.gltf", false);
    assert_non_null(strstr(r.text, "1 materials reflect more than 0.9"));
    fct_scene_destroy(scene);
}

/* COLOR_0 multiplies; the colours that stand beside radiosity are no colours of the surface. */
static void gltf_vertex_colors(void **unused) {
    (void)unused;
    static const float corner[2] = {1, .25F};
    recorder r = {0};
    for (int lit = 0; lit < 2; ++lit) {
        write_gltf("\"pbrMetallicRoughness\": {\"baseColorFactor\": [0.8, 0.8, 0.8, 1]}",
                   lit ? ", \"COLOR_0\": 3, \"_RADIOSITY\": 3" : ", \"COLOR_0\": 3", "");
        fct_scene *scene = must_load(&r, "s.gltf", false);
        assert_int_equal(fct_scene_is_painted(scene, 0), !lit);
        const fct_tree_view t = fct_tree_get(fct_scene_get(scene).models[0].tree);
        for (uint32_t c = 0; c < 3; ++c) { /* the corners 0 and 2 of the square are 1 and .25 */
            const float *p = t.positions + 3 * (size_t)t.triangles[c], bary[3][2] = {{0, 0}, {1, 0}, {0, 1}};
            float rho[3];
            if (p[0] != p[1]) continue;
            fct_scene_reflectance(scene, 0, 0, bary[c][0], bary[c][1], 0, rho);
            assert_true(fabsf(rho[1] - .8F * (lit ? 1 : corner[p[0] > 0])) < 1e-6F);
        }
        fct_scene_destroy(scene);
    }
}

static void gltf_fails_cleanly_at_every_allocation(void **unused) {
    (void)unused;
    write_gltf(BASE("", "1, 1, 1"), UV, BESIDE ", \"samplers\": [{}]");
    for (long n = 1;; ++n) {
        recorder r = {.fail_at = n};
        fct_env env = recorder_env(&r);
        fct_scene *scene;
        fct_result result = fct_scene_load(&env, path_of("s.gltf"), FCT_BACKEND_OBB, &scene);
        if (result == FCT_OK) fct_scene_destroy(scene);
        assert_int_equal(r.alive, 0);
        assert_int_equal(result, r.allocations < n ? FCT_OK : FCT_ERROR_MEMORY);
        if (result == FCT_OK) break;
    }
}

/* ---- OBJ ---- */

#define QUAD_OBJ                                                                                             \
    "mtllib s.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl a\n"           \
    "f 1/1 2/2 3/3 4/4\n"

static void obj_textures(void **unused) {
    (void)unused;
    static const struct {
        const char *mtl;
        double factor;
    } cases[] = {
        {"newmtl a\nKd .5 .5 .5\nmap_Kd a picture.png\n", .5},
        {"newmtl a\nKd 0 0 0\nmap_Kd a picture.png\n", 1},
        {"newmtl a\nmap_Kd C:\\art\\a picture.png\n", 1},
        {"newmtl a\nmap_Kd -blendu off -mm 0 1 -s 1 1 1 -o 0 0 0 -clamp on a picture.png\nKd .25\n", .25}};
    write_text("s.obj", QUAD_OBJ);
    for (size_t k = 0; k < FCT_LENGTH(cases); ++k) {
        recorder r = {0};
        const double factor[3] = {cases[k].factor, cases[k].factor, cases[k].factor};
        write_text("s.mtl", cases[k].mtl);
        fct_scene *scene = must_load(&r, "s.obj", false);
        expect_picture(scene, factor);
        assert_int_equal(r.messages, 0);
        assert_int_equal(scene->paints[0].def.wrap[0], k == 3 ? FCT_WRAP_CLAMP : FCT_WRAP_REPEAT);
        fct_scene_destroy(scene);
        scene = must_load(&r, "s.obj", true);
        assert_false(fct_scene_is_painted(scene, 0));
        fct_scene_destroy(scene);
    }
    recorder r = {0};
    write_text("s.mtl", "newmtl a\nmap_Kd -s 2 3 -o .25 .5 0 a picture.png\n");
    fct_scene *scene = must_load(&r, "s.obj", false);
    /* u' = 2 u + .25; from the bottom v' = 3 v + .5, so from the top 1 - v' = 3 (1 - v) - 2.5. */
    static const float expected[6] = {2, 0, .25F, 0, 3, -2.5F};
    assert_memory_equal(scene->paints[0].def.transform, expected, sizeof expected);
    fct_scene_destroy(scene);
    write_text("s.mtl", "newmtl a\nKd .5\nmap_Kd broken.png\n");
    scene = must_load(&r, "s.obj", false);
    assert_non_null(strstr(r.text, "1 textures cannot be read and are left out ("));
    assert_true(fct_scene_get(scene).materials[0].reflectance[0] == .5F);
    fct_scene_destroy(scene);
}

static void obj_vertex_colors(void **unused) {
    (void)unused;
    recorder r = {0};
    float rho[3];
    write_text("s.obj",
               "mtllib s.mtl\nv 0 0 0 1 1 1\nv 1 0 0 1 1 1\nv 0 1 0 1 1 1\nv 0 0 1 0 0 0\nusemtl a\nf 1 2 3\n"
               "f 1 2 4\n");
    write_text("s.mtl", "newmtl a\nKd .6\n");
    fct_scene *scene = must_load(&r, "s.obj", false);
    const fct_tree_view t = fct_tree_get(fct_scene_get(scene).models[0].tree);
    for (uint32_t place = 0; place < 2; ++place) {
        fct_scene_reflectance(scene, 0, place, 1 / 3.F, 1 / 3.F, 0, rho);
        assert_true(fabsf(rho[0] - (t.face_ids[place] ? .4F : .6F)) < 1e-5F);
    }
    fct_scene_destroy(scene);
}

/* ---- scene.json ---- */

static fct_scene *load_json(recorder *r, const char *material, const char *model) {
    char text[1024];
    snprintf(text, sizeof text,
             "{\"materials\": {\"m\": {%s}}, \"models\": {\"q\": \"%s\"}, \"instances\": [{\"name\": \"i\", "
             "\"model\": \"q\", \"material\": \"m\"}]}",
             material, model);
    memset(r, 0, sizeof *r);
    write_text("s.json", text);
    return must_load(r, "s.json", false);
}

/* A model with or without a hierarchy beside it gives the same paint. */
static void json_textures(void **unused) {
    (void)unused;
    static const double half[3] = {.5, .5, .5};
    const fct_env env = fct_env_default();
    recorder r;
    fct_mesh mesh;
    fct_tree *tree;
    write_text("q.obj", QUAD_OBJ);
    assert_int_equal(fct_mesh_load(&env, path_of("q.obj"), &mesh), FCT_OK);
    assert_int_equal(fct_mesh_save(&env, path_of("q.ply"), &mesh, NULL), FCT_OK);
    for (int beside = 0; beside < 2; ++beside) {
        fct_scene *scene = load_json(&r, "\"texture\": \"a picture.png\"", "q.ply");
        assert_int_equal(r.messages, 0);
        expect_picture(scene, one);
        fct_scene_destroy(scene);
        scene = load_json(&r, "\"texture\": \"a picture.png\", \"reflectance\": 0.5", "q.ply");
        expect_picture(scene, half);
        fct_scene_destroy(scene);
        fct_tree_def def = fct_tree_def_default();
        assert_int_equal(fct_mesh_file_hash(&env, path_of("q.ply"), &def.source_hash), FCT_OK);
        assert_int_equal(fct_tree_build(&env, &mesh, &def, NULL, &tree), FCT_OK);
        assert_int_equal(fct_tree_save(&env, tree, path_of("q.fct")), FCT_OK);
        fct_tree_destroy(tree);
    }
    fct_mesh_release(&env, &mesh);
    fct_scene *scene = load_json(&r, "\"texture\": \"a picture.png\"", "q.fct");
    assert_non_null(strstr(r.text,
                           "1 instances have a texture but no texture coordinates; they take the factor "
                           "alone (\"i\" first)"));
    assert_false(fct_scene_is_painted(scene, 0));
    fct_scene_destroy(scene);
    scene = load_json(&r, "\"texture\": \"white.png\", \"reflectance\": 1", "q.ply");
    assert_non_null(strstr(r.text, "1 textures reflect more than 0.9"));
    assert_true(fct_scene_get(scene).materials[0].reflectance[0] == .9F);
    fct_scene_destroy(scene);
}

static void json_vertex_colors(void **unused) {
    (void)unused;
    static const char head[] = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                               "property float z\n",
                      tail[] = "element face 1\nproperty list uchar int vertex_index\nend_header\n";
    recorder r;
    char text[1024];
    float rho[3];
    snprintf(text, sizeof text,
             "%sproperty float red\nproperty float green\nproperty float blue\n%s"
             "0 0 0 .2 .3 .4\n1 0 0 .2 .3 .4\n0 1 0 .2 .3 .4\n3 0 1 2\n",
             head, tail);
    write_text("c.ply", text);
    fct_scene *scene = load_json(&r, "\"vertex_colors\": true", "c.ply");
    fct_scene_reflectance(scene, 0, 0, .25F, .25F, 0, rho);
    assert_true(fabsf(rho[0] - .2F) < 1e-6F && fabsf(rho[2] - .4F) < 1e-6F);
    assert_int_equal(r.messages, 0);
    fct_scene_destroy(scene);
    scene = load_json(&r, "\"reflectance\": 0.5", "c.ply"); /* only on request */
    assert_false(fct_scene_is_painted(scene, 0));
    fct_scene_destroy(scene);
    snprintf(text, sizeof text,
             "%sproperty float radiosity_r\nproperty float radiosity_g\nproperty float radiosity_b\n%s"
             "0 0 0 .2 .3 .4\n1 0 0 .2 .3 .4\n0 1 0 .2 .3 .4\n3 0 1 2\n",
             head, tail);
    write_text("lit.ply", text);
    scene = load_json(&r, "\"vertex_colors\": true, \"reflectance\": 0.6", "lit.ply");
    fct_scene_reflectance(scene, 0, 0, .25F, .25F, 0, rho);
    assert_true(rho[0] == .6F);
    assert_non_null(strstr(r.text, "1 instances have vertex_colors, but their model has no colours"));
    fct_scene_destroy(scene);
}

static void json_errors(void **unused) {
    (void)unused;
    static const struct {
        const char *material, *message;
    } cases[] = {
        {"\"texture\": \"gone.png\"", "s.json: materials.m.texture: cannot read \"gone.png\""},
        {"\"texture\": 3", "materials.m.texture: expected"},
        {"\"texture\": \"broken.png\"", "broken.png: a damaged PNG: the file ends too early"},
        {"\"vertex_colors\": 1", "materials.m.vertex_colors: expected true or false"},
        {"\"texture\": \"white.png\", \"reflectance\": 1.5", "materials.m.reflectance: expected numbers"},
        {"\"reflectance\": 1", "materials.m.reflectance: expected numbers below 1"},
    };
    for (size_t k = 0; k < FCT_LENGTH(cases); ++k) {
        recorder r = {0};
        fct_env env = recorder_env(&r);
        fct_scene *scene;
        char text[1024];
        snprintf(text, sizeof text, "{\"materials\": {\"m\": {%s}}, \"instances\": []}", cases[k].material);
        write_text("s.json", text);
        assert_true(fct_scene_load(&env, path_of("s.json"), FCT_BACKEND_OBB, &scene) != FCT_OK);
        if (!strstr(r.text, cases[k].message)) fail_msg("%s, expected %s", r.text, cases[k].message);
        assert_int_equal(r.alive, 0);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(gltf_images_from_everywhere),
        cmocka_unit_test(gltf_samplers_sets_and_transforms),
        cmocka_unit_test(gltf_losses_are_reported),
        cmocka_unit_test(gltf_vertex_colors),
        cmocka_unit_test(gltf_fails_cleanly_at_every_allocation),
        cmocka_unit_test(obj_textures),
        cmocka_unit_test(obj_vertex_colors),
        cmocka_unit_test(json_textures),
        cmocka_unit_test(json_vertex_colors),
        cmocka_unit_test(json_errors),
    };
    return cmocka_run_group_tests(tests, set_up, remove_folder);
}
