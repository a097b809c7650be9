/* tests/memory/inputs.c: see calls.h. */
#include "tests/memory/calls.h"

memory_inputs inputs;

static void write_text(const char *path, const char *text) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
}

static void make_meshes(void) {
    fct_mesh grid = make_grid(&inputs.env, 6), *sheet = &inputs.sheet;
    unsigned arrays = FCT_MESH_COLORS | FCT_MESH_NORMALS | FCT_MESH_TEXCOORDS | FCT_MESH_MATERIALS;
    assert_int_equal(fct_mesh_create(&inputs.env, grid.vertex_count, grid.face_count, arrays, sheet), FCT_OK);
    memcpy(sheet->triangles, grid.triangles, 12 * (size_t)grid.face_count);
    for (uint32_t v = 0; v < grid.vertex_count; ++v) {
        const float *p = grid.positions + 3 * (size_t)v;
        float bent[3] = {p[0], p[1], .3F * p[0] * p[0] + .2F * p[0] * p[1]}, normal[3] = {0, 0, 1};
        memcpy(sheet->positions + 3 * (size_t)v, bent, sizeof bent);
        memcpy(sheet->colors + 3 * (size_t)v, bent, sizeof bent);
        memcpy(sheet->normals + 3 * (size_t)v, normal, sizeof normal);
    }
    for (uint32_t c = 0; c < 3 * grid.face_count; ++c)
        memcpy(sheet->texcoords + 2 * (size_t)c, grid.positions + 3 * (size_t)grid.triangles[c], 8);
    for (uint32_t f = 0; f < grid.face_count; ++f) sheet->materials[f] = f < 20;
    sheet->material_count = 2;
    fct_mesh_release(&inputs.env, &grid);
    inputs.ball = make_sphere(&inputs.env, 5);
    for (uint32_t f = 0; f < inputs.ball.face_count; ++f) {
        uint32_t *t = inputs.ball.triangles + 3 * (size_t)f, swap = t[1];
        t[1] = t[2], t[2] = swap;
    }
}

static void make_scene(void) {
    fct_material white = {.name = "white", .reflectance = {.6F, .5F, .4F}, .two_sided = true};
    fct_material light = {.name = "light", .emission = {3, 2, 1}};
    static const float places[2][12] = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
                                        {.5F, 0, 0, .2F, 0, -.5F, 0, .8F, 0, 0, -.5F, 1}};
    uint32_t ids[2];
    fct_scene *scene;
    assert_int_equal(fct_scene_create(&inputs.env, FCT_BACKEND_OBB, &scene), FCT_OK);
    assert_int_equal(fct_scene_add_material(scene, &white, &ids[0]), FCT_OK);
    assert_int_equal(fct_scene_add_material(scene, &light, &ids[1]), FCT_OK);
    static const uint8_t pixels[12] = {200, 100, 50, 20, 30, 40, 250, 250, 250};
    const fct_texture texture = {"a texture", 2, 2, pixels};
    fct_paint paint = fct_paint_default();
    assert_int_equal(fct_scene_add_texture(scene, &texture, &paint.texture), FCT_OK);
    assert_int_equal(fct_scene_paint_material(scene, ids[0], &paint), FCT_OK);
    for (int i = 0; i < 2; ++i) {
        fct_mesh square = make_grid(&inputs.env, 1);
        square.texcoords = fct_allocate_zero(&inputs.env, square.face_count, 6 * sizeof *square.texcoords);
        square.texcoords[2] = square.texcoords[5] = 1;
        assert_int_equal(fct_scene_add_object(scene, "square", &square, NULL, places[i], ids[i], NULL),
                         FCT_OK);
        fct_mesh_release(&inputs.env, &square);
    }
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    inputs.scene = scene;
}

static void write_inputs(void) {
    static const char *const meshes[] = {IN "sheet.ply", IN "sheet.obj", IN "sheet.off",
                                         IN "sheet.stl", IN "sheet.om",  IN "sheet.glb"};
    for (size_t i = 0; i < FCT_LENGTH(meshes); ++i)
        assert_int_equal(fct_mesh_save(&inputs.env, meshes[i], &inputs.sheet, NULL), FCT_OK);
    fct_mesh_save_def text = fct_mesh_save_def_default();
    text.ascii = true;
    assert_int_equal(fct_mesh_save(&inputs.env, IN "text.ply", &inputs.sheet, &text), FCT_OK);
    assert_int_equal(fct_mesh_save(&inputs.env, IN "text.stl", &inputs.sheet, &text), FCT_OK);
    assert_int_equal(fct_mesh_save(&inputs.env, IN "ball.ply", &inputs.ball, NULL), FCT_OK);
    assert_int_equal(fct_tree_save(&inputs.env, inputs.tree, IN "sheet.fct"), FCT_OK);
    fct_simplify_def def = fct_simplify_def_default();
    fct_progressive *progressive;
    fct_mesh simple;
    assert_int_equal(fct_simplify_progressive(&inputs.env, &inputs.sheet, &def, &simple, NULL, &progressive),
                     FCT_OK);
    assert_int_equal(fct_progressive_save(progressive, IN "sheet.fpm"), FCT_OK);
    fct_progressive_destroy(progressive);
    fct_mesh_release(&inputs.env, &simple);
    fct_simplifier *simplifier;
    assert_int_equal(fct_simplifier_create(&inputs.env, &inputs.sheet, &def, &simplifier), FCT_OK);
    assert_int_equal(fct_simplifier_run(simplifier, 40, INFINITY, NULL), FCT_OK);
    assert_int_equal(fct_simplifier_save(simplifier, IN "sheet.fst"), FCT_OK);
    fct_simplifier_destroy(simplifier);
    static const unsigned char corners[12] = {0, 0, 0, 0, 0, 0, 128, 63, 0, 0, 128, 63};
    FILE *file = fopen(IN "corner coordinates.bin", "wb"); /* (0 0 0), (1 0 0), (1 1 0) as floats */
    assert_non_null(file);
    fwrite(corners, 1, 4, file), fwrite(corners, 1, 4, file), fwrite(corners, 1, 4, file);
    fwrite(corners + 4, 1, 4, file), fwrite(corners, 1, 4, file), fwrite(corners, 1, 4, file);
    fwrite(corners + 4, 1, 4, file), fwrite(corners + 8, 1, 4, file), fwrite(corners, 1, 4, file);
    assert_int_equal(fclose(file), 0);
    write_text(
        IN "corner.gltf",
        "{\"asset\": {\"version\": \"2.0\", \"generator\": \"a name of more than thirty-two bytes\"},"
        "\"buffers\": [{\"byteLength\": 36, \"uri\": \"corner%20coordinates.bin\"}],"
        "\"bufferViews\": [{\"buffer\": 0, \"byteLength\": 36}],"
        "\"accessors\": [{\"bufferView\": 0, \"componentType\": 5126, \"count\": 3, "
        "\"type\": \"VEC3\"}], \"materials\": [{\"name\": \"red\", \"emissiveFactor\": [1, 0, 0], "
        "\"pbrMetallicRoughness\": {\"baseColorTexture\": {\"index\": 0}}}], \"textures\": [{\"source\": 0}],"
        "\"images\": [{\"uri\": \"picture.png\"}],"
        "\"meshes\": [{\"primitives\": [{\"attributes\": {\"POSITION\": 0}, \"material\": 0}]}],"
        "\"nodes\": [{\"mesh\": 0}], \"scenes\": [{\"nodes\": [0]}], \"scene\": 0}");
    /* 3 x 2 pixels */
    static const unsigned char picture[] = {
        137, 80, 78,  71, 13,  10, 26,  10,  0,   0,   0,   13,  73, 72,  68, 82, 0,   0,   0,   3,   0,
        0,   0,  2,   8,  2,   0,  0,   0,   18,  22,  241, 77,  0,  0,   0,  27, 73,  68,  65,  84,  120,
        218, 99, 224, 18, 145, 59, 113, 233, 206, 255, 255, 255, 25, 128, 32, 42, 192, 141, 145, 137, 25,
        0,   81, 184, 6,  166, 40, 124, 51,  151, 0,   0,   0,   0,  73,  69, 78, 68,  174, 66,  96,  130};
    file = fopen(IN "picture.png", "wb");
    assert_non_null(file);
    fwrite(picture, 1, sizeof picture, file);
    assert_int_equal(fclose(file), 0);
    write_text(IN "lit.mtl", "newmtl lamp\nKe 1 1 1\nnewmtl floor\nKd .5 .5 .5\nmap_Kd -s 2 2 picture.png\n");
    write_text(IN "shaded.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 1\nvn 0 1 0\n"
                                "f 1//1 2//1 3//1\nf 1//2 4//2 2//2\n");
    write_text(IN "lit.obj", "mtllib lit.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\no one\nusemtl lamp\n"
                             "f 1 2 3\no two\nusemtl floor\nf 1 2 4\nusemtl lamp\nf 1 3 4\n");
    write_text(IN "lit.json",
               "{\"light_groups\": [\"day\", \"the second group of lamps\"],"
               "\"materials\": [{\"name\": \"lamp\", \"emission\": [1, 1, 1]}, {\"name\": \"a long name\", "
               "\"texture\": \"picture.png\", "
               "\"vertex_colors\": true}],"
               "\"models\": [{\"name\": \"sheet\", \"file\": \"sheet.fct\"}, "
               "{\"name\": \"ball\", \"file\": \"ball.ply\"}, {\"name\": \"lit\", \"file\": \"lit.obj\"}],"
               "\"instances\": [{\"model\": \"ball\", \"material\": \"lamp\", \"translate\": [0, 0, 3]},"
               "{\"model\": \"sheet\", \"material\": \"a long name\"},"
               "{\"model\": \"lit\", \"materials\": {\"lamp\": \"lamp\", \"*\": \"a long name\"}}]}");
}

void make_inputs(void) {
    inputs.env = starve_env();
    inputs.env.thread_count = 2;
    make_meshes();
    assert_int_equal(fct_tree_build(&inputs.env, &inputs.sheet, NULL, NULL, &inputs.tree), FCT_OK);
    assert_int_equal(fct_tree_build(&inputs.env, &inputs.ball, NULL, NULL, &inputs.other), FCT_OK);
    assert_int_equal(fct_bvh_create(&inputs.env, inputs.tree, FCT_BACKEND_OBB, &inputs.bvh), FCT_OK);
    assert_int_equal(fct_bvh_create(&inputs.env, inputs.other, FCT_BACKEND_OBB, &inputs.other_bvh), FCT_OK);
    assert_int_equal(fct_bvh_create(&inputs.env, inputs.tree, FCT_BACKEND_EMBREE, &inputs.embree), FCT_OK);
    make_scene();
    write_inputs();
}

void release_inputs(void) {
    fct_scene_destroy(inputs.scene);
    fct_bvh_destroy(inputs.embree);
    fct_bvh_destroy(inputs.other_bvh);
    fct_bvh_destroy(inputs.bvh);
    fct_tree_destroy(inputs.other);
    fct_tree_destroy(inputs.tree);
    fct_mesh_release(&inputs.env, &inputs.ball);
    fct_mesh_release(&inputs.env, &inputs.sheet);
}
