/* Lit scenes as glTF documents. Attributes of the input are linear functions of the position, so those of the
 * output must have the same values wherever its vertices are. */
#include <sys/stat.h>
#include <unistd.h>

#include "base/math/vec.h"
#include "facetree/radiosity.h"
#include "mesh/glb/document/accessor.h"
#include "mesh/glb/document/glb.h"
#include "place.h"

static fct_env plain;
static char folder[] = "/tmp/facetree-scene-XXXXXX";

static const char *path_of(const char *name) {
    static char path[4][200];
    static int next;
    char *out = path[next = (next + 1) % 4];
    snprintf(out, sizeof path[0], "%s/%s", folder, name);
    return out;
}

/* ---- The input ---- */

enum { SIDES = 6, CORNERS = 24 };

static v3 box_corner(uint32_t v) {
    static const uint32_t sides[SIDES][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                             {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    const uint32_t c = sides[v / 4][v % 4];
    return v3_make(c & 1, 1.5 * (c >> 1 & 1), .75 * (c >> 2 & 1));
}

/* The attributes as functions of the position: width components. Stored normals and tangents are not unit. */
static void attribute(const char *name, v3 p, double out[4]) {
    const struct {
        const char *name;
        double values[4];
    } all[] = {{"POSITION", {p.x, p.y, p.z, 0}},
               {"NORMAL", {p.x + .3, p.y + .1, p.z + .2, 0}},
               {"TANGENT", {1 + p.x, p.y, .5 * p.z, -1}},
               {"TEXCOORD_0", {p.x + 2 * p.y, 3 - p.z, 0, 0}},
               {"other", {2 * p.x - p.z, p.y, 0, 0}}, /* TEXCOORD_0 of the second primitive */
               {"TEXCOORD_1", {p.y - p.z, p.x, 0, 0}},
               {"COLOR_0", {.1 + .2 * p.x, .5 - .1 * p.y, .3 * p.z, .5}},
               {"_HEAT", {p.x - p.y, 0, 0, 0}}};
    for (size_t i = 0; i < sizeof all / sizeof *all; ++i)
        if (!strcmp(name, all[i].name)) memcpy(out, all[i].values, sizeof all[i].values);
}

/* Writes the values of an attribute for the vertices [first, first + count). */
static void put_attribute(FILE *file, const char *name, int width, uint32_t first, uint32_t count) {
    for (uint32_t v = first; v < first + count; ++v) {
        double values[4];
        attribute(name, box_corner(v), values);
        for (int c = 0; c < width; ++c) {
            const float x = (float)values[c];
            fwrite(&x, sizeof x, 1, file);
        }
    }
}

static void put_quads(FILE *file, uint32_t count) {
    for (uint32_t q = 0; q < count; ++q) {
        const uint32_t six[6] = {4 * q, 4 * q + 1, 4 * q + 2, 4 * q, 4 * q + 2, 4 * q + 3};
        fwrite(six, sizeof *six, 6, file);
    }
}

/* Sides 0 to 3 have accessors 0 to 6 and are two primitives of one material; sides 4 and 5 are a third one.
 */
static const char *const accessors =
    "\"accessors\":["
    "{\"bufferView\":0,\"byteOffset\":0,\"componentType\":5126,\"count\":16,\"type\":\"VEC3\"},"
    "{\"bufferView\":0,\"byteOffset\":192,\"componentType\":5126,\"count\":16,\"type\":\"VEC3\"},"
    "{\"bufferView\":0,\"byteOffset\":384,\"componentType\":5126,\"count\":16,\"type\":\"VEC4\"},"
    "{\"bufferView\":0,\"byteOffset\":640,\"componentType\":5126,\"count\":16,\"type\":\"VEC2\"},"
    "{\"bufferView\":0,\"byteOffset\":768,\"componentType\":5126,\"count\":16,\"type\":\"VEC2\"},"
    "{\"bufferView\":0,\"byteOffset\":896,\"componentType\":5126,\"count\":16,\"type\":\"VEC2\"},"
    "{\"bufferView\":0,\"byteOffset\":1024,\"componentType\":5126,\"count\":16,\"type\":\"SCALAR\"},"
    "{\"bufferView\":0,\"byteOffset\":1088,\"componentType\":5125,\"count\":12,\"type\":\"SCALAR\"},"
    "{\"bufferView\":0,\"byteOffset\":1136,\"componentType\":5125,\"count\":12,\"type\":\"SCALAR\"},"
    "{\"bufferView\":0,\"byteOffset\":1184,\"componentType\":5126,\"count\":8,\"type\":\"VEC3\"},"
    "{\"bufferView\":0,\"byteOffset\":1280,\"componentType\":5126,\"count\":8,\"type\":\"VEC4\"},"
    "{\"bufferView\":0,\"byteOffset\":1408,\"componentType\":5126,\"count\":8,\"type\":\"VEC2\"},"
    "{\"bufferView\":0,\"byteOffset\":1088,\"componentType\":5125,\"count\":6,\"type\":\"SCALAR\"}],"
    "\"bufferViews\":[{\"buffer\":0,\"byteLength\":1472}],"
    "\"buffers\":[{\"uri\":\"scene.bin\",\"byteLength\":1472}]";

static const char *const meshes =
    "\"meshes\":[{\"name\":\"box\",\"extras\":{\"kept\":1},\"primitives\":["
    "{\"attributes\":{\"POSITION\":0,\"NORMAL\":1,\"TANGENT\":2,\"TEXCOORD_0\":3,\"TEXCOORD_1\":5,\"_HEAT\":"
    "6},"
    "\"indices\":7,\"material\":0,\"extras\":\"first\"},"
    "{\"attributes\":{\"POSITION\":0,\"NORMAL\":1,\"TEXCOORD_0\":4,\"TEXCOORD_1\":5},\"indices\":8,"
    "\"material\":0},"
    "{\"attributes\":{\"POSITION\":9,\"COLOR_0\":10,\"TEXCOORD_0\":11,\"TEXCOORD_1\":11,\"JOINTS_0\":10},"
    "\"indices\":7,\"material\":1}]},"
    "{\"name\":\"lamp\",\"primitives\":[{\"attributes\":{\"POSITION\":9},\"indices\":12,\"material\":2}]},"
    "{\"name\":\"sheet\",\"primitives\":[{\"attributes\":{\"POSITION\":9,\"NORMAL\":9},\"indices\":12,"
    "\"material\":3}]}]";

static const char *const rest =
    "\"asset\":{\"version\":\"2.0\",\"copyright\":\"us\"},"
    "\"extensionsUsed\":[\"KHR_lights_punctual\",\"KHR_materials_emissive_strength\"],"
    "\"extensions\":{\"KHR_lights_punctual\":{\"lights\":[{\"type\":\"point\",\"name\":\"sun\"}]}},"
    "\"extras\":{\"note\":\"root\"},\"scene\":0,\"scenes\":[{\"name\":\"all\",\"nodes\":[0,4,5,6,7]}],"
    "\"cameras\":[{\"type\":\"perspective\",\"perspective\":{\"yfov\":1,\"znear\":0.1}}],"
    "\"nodes\":[{\"name\":\"hall\",\"translation\":[1,2,0],\"children\":[1,2,3],\"extras\":{\"key\":7}},"
    "{\"name\":\"left\",\"mesh\":0,\"rotation\":[0.6,0,0,0.8],\"scale\":[1,2,1]},"
    "{\"name\":\"eye\",\"camera\":0},"
    "{\"name\":\"sun\",\"extensions\":{\"KHR_lights_punctual\":{\"light\":0}}},"
    "{\"name\":\"right\",\"mesh\":0,\"scale\":[-1,1,1],\"translation\":[5,0,0]},"
    "{\"name\":\"top\",\"mesh\":1,\"rotation\":[1,0,0,0],\"scale\":[3,3,3],\"translation\":[2,4,7]},"
    "{\"name\":\"sheet\",\"mesh\":2,\"translation\":[-3,0,0]},"
    "{\"name\":\"low\",\"mesh\":1,\"translation\":[-3,0,-2],\"rotation\":[0,0,0,1]}],"
    "\"materials\":[{\"name\":\"tile\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.5,0.6,0.7,1],"
    "\"baseColorTexture\":{\"index\":0,\"texCoord\":1}}},"
    "{\"name\":\"stone\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.25,0.5,0.125,1]}},"
    "{\"name\":\"lamp\",\"emissiveFactor\":[1,0.75,0.5],\"doubleSided\":true,"
    "\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.125,0.125,0.125,1]},"
    "\"extensions\":{\"KHR_materials_emissive_strength\":{\"emissiveStrength\":8}}},"
    "{\"name\":\"cloth\",\"doubleSided\":true,\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.5,0.5,0.5,1]}}"
    "],"
    "\"textures\":[{\"source\":0}],\"images\":[{\"uri\":\"data:image/png;base64,iVBORw0KGgo=\"}]";

static void write_input(void) {
    FILE *file = fopen(path_of("scene.bin"), "wb");
    assert_non_null(file);
    put_attribute(file, "POSITION", 3, 0, 16);
    put_attribute(file, "NORMAL", 3, 0, 16);
    put_attribute(file, "TANGENT", 4, 0, 16);
    put_attribute(file, "TEXCOORD_0", 2, 0, 16);
    put_attribute(file, "other", 2, 0, 16);
    put_attribute(file, "TEXCOORD_1", 2, 0, 16);
    put_attribute(file, "_HEAT", 1, 0, 16);
    put_quads(file, 2);
    const uint32_t second[12] = {8, 9, 10, 8, 10, 11, 12, 13, 14, 12, 14, 15};
    fwrite(second, sizeof *second, 12, file);
    put_attribute(file, "POSITION", 3, 16, 8);
    put_attribute(file, "COLOR_0", 4, 16, 8);
    put_attribute(file, "TEXCOORD_0", 2, 16, 8);
    assert_int_equal(ftell(file), 1472);
    fclose(file);
    file = fopen(path_of("scene.gltf"), "w");
    fprintf(file, "{%s,%s,%s}", rest, meshes, accessors);
    fclose(file);
}

/* ---- The output ---- */

typedef struct output {
    fct_source source;
    fct_file file;
    fct_glb glb;
} output;

static void open_output(const char *name, output *out) {
    assert_int_equal(fct_file_open(&plain, path_of(name), &out->file), FCT_OK);
    out->source = (fct_source){&plain, "output", out->file.data, out->file.size, NULL};
    assert_int_equal(fct_glb_open(&out->source, &out->glb), FCT_OK);
}

static void close_output(output *o) {
    fct_glb_close(&o->glb);
    fct_file_close(&plain, &o->file);
}

static json_t *item(const output *o, const char *list, size_t index) {
    return json_array_get(json_object_get(o->glb.root, list), index);
}

static json_t *primitive_of(const output *o, size_t node, size_t index) {
    const size_t mesh = (size_t)json_integer_value(json_object_get(item(o, "nodes", node), "mesh"));
    return json_array_get(json_object_get(item(o, "meshes", mesh), "primitives"), index);
}

/* The values of an attribute, or NULL. */
static const fct_glb_array *array_of(output *o, json_t *primitive, const char *name) {
    json_t *value = json_object_get(json_object_get(primitive, "attributes"), name);
    const fct_glb_array *array = NULL;
    if (value) assert_int_equal(fct_glb_array_of(&o->glb, json_integer_value(value), 1, 4, &array), FCT_OK);
    return array;
}

static v3 vector_of(const fct_glb_array *array, size_t v) {
    return v3_make(fct_glb_value(array, v, 0), fct_glb_value(array, v, 1), fct_glb_value(array, v, 2));
}

/* The attribute `name` of a primitive is the function `function` of its position. */
static void expect_function(output *o, json_t *primitive, const char *name, const char *function,
                            double sign) {
    const fct_glb_array *values = array_of(o, primitive, name),
                        *positions = array_of(o, primitive, "POSITION");
    const bool unit = !strcmp(name, "NORMAL") || !strcmp(name, "TANGENT");
    assert_non_null(values);
    assert_true(values->count == positions->count && values->component == 5126 && values->count > 0);
    for (size_t v = 0; v < values->count; ++v) {
        double expected[4] = {0, 0, 0, 0};
        attribute(function, vector_of(positions, v), expected);
        if (unit) {
            const v3 n = v3_scale(v3_unit(v3_make(expected[0], expected[1], expected[2])), sign);
            expected[0] = n.x, expected[1] = n.y, expected[2] = n.z;
        }
        for (int c = 0; c < values->width; ++c)
            if (!(fabs(fct_glb_value(values, v, c) - expected[c]) < 3e-6))
                fail_msg("%s[%d] of vertex %zu: %g, expected %g", name, c, v, fct_glb_value(values, v, c),
                         expected[c]);
    }
}

/* COLOR_n is the light of _RADIOSITY, clamped. */
static void expect_colors(output *o, json_t *primitive, const char *name) {
    const fct_glb_array *colors = array_of(o, primitive, name), *light = array_of(o, primitive, "_RADIOSITY");
    assert_true(colors && light && light->component == 5126 && colors->count == light->count);
    for (size_t v = 0; v < light->count; ++v)
        for (int c = 0; c < 3; ++c) {
            const double x = fct_glb_value(light, v, c);
            assert_true(fabs(fct_glb_value(colors, v, c) - (x < 1 ? x : 1)) < 1e-4);
        }
}

static double measure_area(output *o, json_t *primitive) {
    const fct_glb_array *indices = NULL, *positions = array_of(o, primitive, "POSITION");
    const int64_t accessor = json_integer_value(json_object_get(primitive, "indices"));
    assert_int_equal(fct_glb_array_of(&o->glb, accessor, 1, 1, &indices), FCT_OK);
    double area = 0;
    for (size_t i = 0; i + 2 < indices->count; i += 3) {
        v3 p[3];
        for (size_t k = 0; k < 3; ++k) p[k] = vector_of(positions, (size_t)fct_glb_value(indices, i + k, 0));
        area += .5 * v3_norm(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
    }
    return area;
}

/* Both meshes have the same corners with the same light, in any order. Corners are compared by sums that see
 * every value: equal sums of 64 random functions. */
static void expect_same_light(const fct_mesh *a, const fct_mesh *b) {
    assert_int_equal(a->face_count, b->face_count);
    assert_int_equal(a->error != NULL, b->error != NULL);
    for (uint64_t k = 0; k < 64; ++k) {
        double sums[2] = {0, 0}, scale = 0;
        for (int m = 0; m < 2; ++m) {
            const fct_mesh *x = m ? b : a;
            for (size_t c = 0; c < 3 * (size_t)x->face_count; ++c) {
                const float *p = x->positions + 3 * (size_t)x->triangles[c],
                            *q = x->colors + 3 * (size_t)x->triangles[c];
                double phase = 0, light = 0;
                for (uint64_t j = 0; j < 3; ++j) {
                    phase += (fct_uniform(fct_hash2(k, j)) - .5) * ((double)p[j] + x->origin[j]);
                    light += fct_uniform(fct_hash2(k, 3 + j)) * (double)q[j];
                }
                if (x->error) light += fct_uniform(fct_hash2(k, 6)) * (double)x->error[x->triangles[c]];
                sums[m] += sin(phase) * (1 + light), scale += fabs(1 + light) / 2;
            }
        }
        if (!(fabs(sums[0] - sums[1]) < 1e-6 * scale)) fail_msg("%.9g, expected %.9g", sums[0], sums[1]);
    }
}

static fct_mesh bake_input(const fct_env *env, const char *document, const char *out, fct_keep keep) {
    fct_scene *scene;
    fct_bake *bake;
    fct_mesh merged;
    fct_bake_def def = fct_bake_def_default();
    def.error = 1e-3, def.max_edge = .5, def.keep = keep;
    assert_int_equal(fct_scene_load(env, path_of("scene.gltf"), FCT_BACKEND_OBB, &scene), FCT_OK);
    assert_int_equal(fct_bake_create(env, scene, &def, &bake), FCT_OK);
    assert_int_equal(fct_bake_save_scene(bake, path_of(out), document, NULL, &merged), FCT_OK);
    fct_bake_destroy(bake);
    fct_scene_destroy(scene);
    return merged;
}

static void expect_box(output *o, size_t node) {
    const double area[3] = {2 * 1.5 * .75, 2 * .75, 2 * 1.5};
    json_t *primitives[3];
    for (size_t i = 0; i < 3; ++i) {
        primitives[i] = primitive_of(o, node, i);
        assert_non_null(primitives[i]);
    }
    assert_null(primitive_of(o, node, 3));
    expect_function(o, primitives[0], "NORMAL", "NORMAL", 1);
    expect_function(o, primitives[0], "TANGENT", "TANGENT", 1);
    expect_function(o, primitives[0], "TEXCOORD_0", "TEXCOORD_0", 1);
    expect_function(o, primitives[0], "TEXCOORD_1", "TEXCOORD_1", 1);
    expect_function(o, primitives[0], "_HEAT", "_HEAT", 1);
    expect_function(o, primitives[1], "NORMAL", "NORMAL", 1);
    expect_function(o, primitives[1], "TEXCOORD_0", "other", 1);
    expect_function(o, primitives[1], "TEXCOORD_1", "TEXCOORD_1", 1);
    expect_function(o, primitives[2], "COLOR_0", "COLOR_0", 1);
    expect_function(o, primitives[2], "TEXCOORD_1", "TEXCOORD_0", 1);
    expect_colors(o, primitives[0], "COLOR_0");
    expect_colors(o, primitives[1], "COLOR_0");
    expect_colors(o, primitives[2], "COLOR_1");
    assert_null(array_of(o, primitives[2], "JOINTS_0"));
    for (size_t i = 0; i < 3; ++i) assert_true(fabs(measure_area(o, primitives[i]) / area[i] - 1) < 1e-5);
    assert_string_equal(json_string_value(json_object_get(primitives[0], "extras")), "first");
    assert_int_equal(json_integer_value(json_object_get(primitives[2], "material")), 1);
}

static void documents_keep_all(void **state) {
    (void)state;
    plain = fct_env_default();
    json_t *input = json_load_file(path_of("scene.gltf"), 0, NULL);
    for (int keep = FCT_KEEP_NONE; keep <= FCT_KEEP_FACE; ++keep) {
        fct_mesh merged = bake_input(&plain, path_of("scene.gltf"), "out.glb", (fct_keep)keep), back;
        output o;
        open_output("out.glb", &o);
        expect_box(&o, 1);
        expect_box(&o, 4);
        /* Everything else is as it was, but for the numbers of meshes and the place of the image. */
        static const char *const same[] = {"cameras", "extras", "extensions", "scenes", "scene", "textures"};
        for (size_t i = 0; i < sizeof same / sizeof *same; ++i)
            assert_true(json_equal(json_object_get(o.glb.root, same[i]), json_object_get(input, same[i])));
        for (size_t i = 0; i < 8; ++i) {
            json_t *a = json_copy(item(&o, "nodes", i)),
                   *b = json_copy(json_array_get(json_object_get(input, "nodes"), i));
            assert_int_equal(json_object_get(a, "mesh") != NULL, json_object_get(b, "mesh") != NULL);
            json_object_del(a, "mesh"), json_object_del(b, "mesh");
            assert_true(json_equal(a, b));
            json_decref(a), json_decref(b);
        }
        for (size_t i = 0; i < 4; ++i)
            assert_true(
                json_equal(item(&o, "materials", i), json_array_get(json_object_get(input, "materials"), i)));
        assert_true(json_object_get(item(&o, "images", 0), "bufferView") != NULL);
        assert_string_equal(json_string_value(json_object_get(item(&o, "meshes", 0), "name")), "box");
        assert_int_equal(json_array_size(json_object_get(o.glb.root, "meshes")), 5);
        /* Both sides of the sheet have light: each shows one side, and the back has turned normals. */
        const bool both = keep == FCT_KEEP_NONE;
        json_t *sheet = primitive_of(&o, 6, 0), *other = primitive_of(&o, 6, 1);
        assert_int_equal(other != NULL, both);
        assert_true(json_array_size(json_object_get(o.glb.root, "materials")) >= (both ? 5 : 4));
        const json_t *material =
            item(&o, "materials", (size_t)json_integer_value(json_object_get(sheet, "material")));
        assert_string_equal(json_string_value(json_object_get(material, "name")), "cloth");
        assert_int_equal(json_is_true(json_object_get(material, "doubleSided")), !both);
        if (both) {
            const v3 a = vector_of(array_of(&o, sheet, "NORMAL"), 3),
                     b = vector_of(array_of(&o, other, "NORMAL"), 3);
            assert_true(v3_dot(a, b) < -.99);
        }
        close_output(&o);
        /* A reader finds the light where the merged mesh has it. */
        assert_int_equal(fct_mesh_load(&plain, path_of("out.glb"), &back), FCT_OK);
        if (merged.colors) expect_same_light(&back, &merged);
        assert_int_equal(back.face_count, merged.face_count);
        fct_mesh_release(&plain, &merged), fct_mesh_release(&plain, &back);
    }
    json_decref(input);
}

static void read_bytes(const char *name, unsigned char **bytes, size_t *size) {
    FILE *file = fopen(path_of(name), "rb");
    assert_non_null(file);
    *bytes = malloc(1 << 24);
    *size = fread(*bytes, 1, 1 << 24, file);
    fclose(file);
}

static void threads_give_the_same_file(void **state) {
    (void)state;
    unsigned char *bytes[2];
    size_t sizes[2];
    for (int document = 0; document < 2; ++document) {
        for (uint32_t k = 0; k < 2; ++k) {
            fct_env env = fct_env_default();
            env.thread_count = 1 + 2 * k;
            fct_mesh merged =
                bake_input(&env, document ? path_of("scene.gltf") : NULL, "out.glb", FCT_KEEP_NONE);
            read_bytes("out.glb", &bytes[k], &sizes[k]);
            fct_mesh_release(&env, &merged);
        }
        assert_int_equal(sizes[0], sizes[1]);
        assert_memory_equal(bytes[0], bytes[1], sizes[0]);
        free(bytes[0]), free(bytes[1]);
    }
}

/* Without a document: nodes with names and transforms, materials, the camera; sheared and mirrored objects.
 */
static void scenes_become_nodes(void **state) {
    (void)state;
    static const float placed[3][12] = {{0, -2, 0, 1, 2, 0, 0, 2, 0, 0, 2, 3},
                                        {-1, 0, 0, 8, 0, 1, 0, 0, 0, 0, 3, 0},
                                        {1, .5F, 0, -5, 0, 1, .25F, 0, 0, 0, 1, 0}};
    plain = fct_env_default();
    for (int far = 0; far < 2; ++far) {
        fct_scene *scene;
        fct_bake *bake;
        fct_mesh ball = make_bumpy(&plain, 5, .2), merged, back;
        assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
        const fct_material materials[3] = {
            {.name = "clay", .reflectance = {.5F, .25F, .125F}},
            {.name = "lamp", .reflectance = {.1F, .1F, .1F}, .emission = {4, 2, 1}},
            {.name = "glow \xff", .emission = {.5F, .25F, .25F}, .two_sided = true}};
        uint32_t ids[3], *labels = malloc(ball.face_count * sizeof *labels);
        for (int i = 0; i < 3; ++i)
            assert_int_equal(fct_scene_add_material(scene, &materials[i], &ids[i]), FCT_OK);
        for (uint32_t f = 0; f < ball.face_count; ++f) labels[f] = f % 2;
        float transforms[3][12];
        memcpy(transforms, placed, sizeof placed);
        for (int i = 0; far && i < 3; ++i) transforms[i][3] += 1e7F;
        for (int i = 0; i < 3; ++i) {
            char name[8];
            snprintf(name, sizeof name, "ball %d", i);
            assert_int_equal(
                fct_scene_add_object(scene, name, &ball, NULL, transforms[i], 2, i ? NULL : labels), FCT_OK);
        }
        const float x = far ? 10000003 : 3;
        const fct_camera camera = {{x, 4, 5}, {x, 4, 1}, {0, 1, 0}, 60, true};
        fct_scene_set_camera(scene, &camera);
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        fct_bake_def def = fct_bake_def_default();
        def.error = 1e-3, def.outputs = FCT_MESH_IRRADIANCE | FCT_MESH_ERROR, def.max_edge = .4;
        fct_mesh_save_def save = fct_mesh_save_def_default();
        save.display = FCT_MESH_IRRADIANCE;
        assert_int_equal(fct_bake_create(&plain, scene, &def, &bake), FCT_OK);
        assert_int_equal(fct_bake_save_scene(bake, path_of("made.glb"), NULL, &save, &merged), FCT_OK);
        assert_int_equal(fct_mesh_load(&plain, path_of("made.glb"), &back), FCT_OK);
        expect_same_light(&back, &merged);
        output o;
        open_output("made.glb", &o);
        assert_int_equal(json_array_size(json_object_get(o.glb.root, "nodes")), 4);
        for (size_t i = 0; i < 3; ++i) {
            char name[8];
            snprintf(name, sizeof name, "ball %zu", i);
            json_t *node = item(&o, "nodes", i + 1), *p = primitive_of(&o, i + 1, 0);
            assert_string_equal(json_string_value(json_object_get(node, "name")), name);
            assert_int_equal(json_object_get(node, "scale") != NULL, i < 2);
            assert_int_equal(json_object_get(node, "rotation") != NULL, i == 0);
            assert_true(array_of(&o, p, "_RADIOSITY") && array_of(&o, p, "_IRRADIANCE"));
            /* Vertices of the model have its positions, bit for bit. */
            const fct_glb_array *positions = array_of(&o, p, "POSITION");
            uint32_t found = 0;
            for (uint32_t v = 0; i < 2 && v < ball.vertex_count; ++v)
                for (size_t w = 0; w < positions->count; ++w) {
                    const float *q = ball.positions + 3 * (size_t)v;
                    const v3 at = vector_of(positions, w);
                    if (at.x == q[0] && at.y == q[1] && at.z == q[2]) {
                        ++found;
                        break;
                    }
                }
            if (i == 0) assert_true(found > 30); /* half of the faces */
            if (i == 1) assert_int_equal(found, ball.vertex_count);
        }
        json_t *node = item(&o, "nodes", 0);
        assert_true(json_object_get(node, "camera") && !json_object_get(node, "rotation"));
        const json_t *at = json_object_get(node, "translation");
        for (size_t k = 0; k < 3; ++k)
            assert_true(json_number_value(json_array_get(at, k)) == (k ? 3 + (double)k : (double)x));
        for (size_t m = 0; m < 3; ++m) {
            json_t *material = item(&o, "materials", m), *extras = json_object_get(material, "extras");
            const double strength = m == 1 ? 4 : 1;
            assert_string_equal(json_string_value(json_object_get(material, "name")),
                                m == 2 ? "glow ?" : materials[m].name);
            assert_non_null(fct_glb_extension(material, "KHR_materials_unlit"));
            assert_null(
                json_object_get(json_object_get(material, "pbrMetallicRoughness"), "baseColorFactor"));
            assert_int_equal(json_is_true(json_object_get(material, "doubleSided")), m == 2);
            json_t *strong = fct_glb_extension(material, "KHR_materials_emissive_strength");
            assert_int_equal(strong != NULL, m == 1);
            if (strong)
                assert_true(json_number_value(json_object_get(strong, "emissiveStrength")) == strength);
            for (size_t c = 0; c < 3; ++c) {
                const double e = materials[m].emission[c];
                assert_true(json_number_value(json_array_get(json_object_get(extras, "reflectance"), c)) ==
                            (double)materials[m].reflectance[c]);
                assert_true(json_number_value(json_array_get(json_object_get(extras, "emission"), c)) == e);
                assert_true(
                    json_number_value(json_array_get(json_object_get(material, "emissiveFactor"), c)) *
                        strength ==
                    e);
            }
        }
        close_output(&o);
        fct_mesh_release(&plain, &merged), fct_mesh_release(&plain, &back), fct_mesh_release(&plain, &ball);
        fct_bake_destroy(bake);
        fct_scene_destroy(scene);
        free(labels);
    }
}

/* Documents that are not those of the scene, and outputs that cannot be. */
static void wrong_documents_are_refused(void **state) {
    (void)state;
    recorder r = {0};
    plain = fct_env_default();
    plain.message = recorder_message, plain.message_user = &r;
    fct_scene *scene;
    fct_bake *bake;
    fct_bake_def def = fct_bake_def_default();
    def.error = 1e-2, def.final = FCT_FINAL_NONE;
    assert_int_equal(fct_scene_load(&plain, path_of("scene.gltf"), FCT_BACKEND_OBB, &scene), FCT_OK);
    assert_int_equal(fct_bake_create(&plain, scene, &def, &bake), FCT_OK);
    for (int kind = 0; kind < 2; ++kind) { /* fewer faces, fewer vertices */
        FILE *file = fopen(path_of("less.gltf"), "w");
        char *less = strdup(accessors), *count = strstr(less, kind ? "\"count\":16" : "\"count\":12");
        memcpy(count, "\"count\": 3", 10);
        fprintf(file, "{%s,%s,%s}", rest, meshes, less);
        fclose(file);
        free(less);
        r.text[0] = 0;
        assert_int_equal(fct_bake_save_scene(bake, path_of("x.glb"), path_of("less.gltf"), NULL, NULL),
                         FCT_ERROR_DATA);
        assert_non_null(strstr(r.text, "is not the file that the scene was read from"));
    }
    assert_int_equal(fct_bake_save_scene(bake, path_of("x.glb"), path_of("none.gltf"), NULL, NULL),
                     FCT_ERROR_INPUT);
    assert_int_equal(fct_bake_save_scene(bake, path_of("x.gltf"), NULL, NULL, NULL), FCT_ERROR_DATA);
    fct_mesh_save_def save = fct_mesh_save_def_default();
    save.display = FCT_MESH_DIRECT;
    assert_int_equal(fct_bake_save_scene(bake, path_of("x.glb"), NULL, &save, NULL), FCT_ERROR_DATA);
    assert_int_equal(access(path_of("x.glb"), F_OK), -1);
    fct_bake_destroy(bake);
    fct_scene_destroy(scene);
    /* A scene that was made by calls has no document. */
    fct_mesh ball = make_sphere(&plain, 4);
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    place_mesh(scene, &ball, place_material(scene, .5, 1, false), NULL);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    assert_int_equal(fct_bake_create(&plain, scene, &def, &bake), FCT_OK);
    assert_int_equal(fct_bake_save_scene(bake, path_of("x.glb"), path_of("scene.gltf"), NULL, NULL),
                     FCT_ERROR_DATA);
    assert_non_null(strstr(r.text, "object \"part\" was not read from the glTF file"));
    fct_mesh_release(&plain, &ball);
    fct_bake_destroy(bake);
    fct_scene_destroy(scene);
}

static int make_folder(void **state) {
    (void)state;
    if (!mkdtemp(folder)) return 1;
    write_input();
    return 0;
}

static int remove_folder(void **state) {
    (void)state;
    static const char *const names[] = {"scene.bin", "scene.gltf", "out.glb", "made.glb", "less.gltf"};
    for (size_t i = 0; i < sizeof names / sizeof *names; ++i) unlink(path_of(names[i]));
    return rmdir(folder);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(documents_keep_all),
        cmocka_unit_test(threads_give_the_same_file),
        cmocka_unit_test(scenes_become_nodes),
        cmocka_unit_test(wrong_documents_are_refused),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
