/* tests/scene/test_load.c: scene.json: values that are read, the messages of errors, shared models,
 * hierarchies beside meshes, and running out of memory at every allocation. */
#include "files.h"

#include <sys/stat.h>
#include <xxhash.h>

#include "base/io/file.h"
#include "facetree/scene.h"
#include "scene/read/load.h"

static int set_up(void **unused) {
    (void)unused;
    assert_non_null(mkdtemp(folder));
    write_text("tri.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    /* two quads and a triangle of three materials */
    write_text("parts.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\nv 3 0 0\n"
                            "usemtl oak\nf 1 2 3 4\nusemtl tin\nf 2 5 6 3\nusemtl oak2\nf 5 7 6\n");
    write_text("empty.obj", "v 0 0 0\n");
    write_text("broken.obj", "v 0 0 zero\nf 1 1 1\n");
    return 0;
}

#define HEAD  "{\"materials\": {\"a\": {\"reflectance\": 0.5}, \"b\": {\"reflectance\": [0.1, 0.2, 0.3]}}, "
#define TRI   "\"models\": {\"t\": \"tri.obj\"}, "
#define PARTS "\"models\": {\"p\": \"parts.obj\"}, "

static fct_result parse(const fct_env *env, const char *text, fct_scene **scene) {
    char base[256];
    snprintf(base, sizeof base, "%s/", folder);
    return fct_scene_parse_json(env, "s.json", text, strlen(text), base, FCT_BACKEND_OBB, scene);
}

static fct_scene *must_parse(const fct_env *env, const char *text) {
    fct_scene *scene;
    assert_int_equal(parse(env, text, &scene), FCT_OK);
    return scene;
}

static void reads_materials_camera_and_groups(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    fct_scene *scene = must_parse(
        &env,
        "{\"light_groups\": [\"day\", \"night\"], \"materials\": ["
        "{\"name\": \"a\", \"reflectance\": 0.25, \"emission\": [1, 2, 3], \"two_sided\": true, "
        "\"light_group\": \"night\"}, {\"name\": \"b\"}], "
        "\"models\": [{\"name\": \"t\", \"file\": \"tri.obj\"}], "
        "\"camera\": {\"position\": [0, 1, 5], \"target\": [0, 1, 0], \"vertical_fov\": 30}, "
        "\"instances\": [{\"model\": \"t\", \"material\": \"a\"}, {\"model\": \"t\", \"material\": \"b\"}]}");
    fct_scene_view v = fct_scene_get(scene);
    assert_int_equal(v.material_count, 2);
    assert_true(v.materials[0].reflectance[1] == .25f && v.materials[0].emission[2] == 3);
    assert_true(v.materials[0].two_sided && v.materials[0].light_group == 1);
    assert_true(v.materials[1].reflectance[0] == .7f && !v.materials[1].two_sided);
    assert_int_equal(v.light_group_count, 2);
    assert_string_equal(v.light_groups[1], "night");
    assert_true(v.camera.given && v.camera.position[2] == 5 && v.camera.vertical_fov == 30 &&
                v.camera.up[1] == 1);
    assert_int_equal(v.model_count, 1); /* shared */
    assert_int_equal(v.instance_count, 2);
    assert_int_equal(v.face_count, 2);
    assert_string_equal(v.instances[0].name, "t");
    assert_string_not_equal(v.instances[1].name, "t");
    fct_scene_destroy(scene);

    scene = must_parse(&env, HEAD TRI "\"instances\": [{\"model\": \"t\", \"material\": \"a\"}]}");
    v = fct_scene_get(scene);
    assert_int_equal(v.light_group_count, 1);
    assert_false(v.camera.given);
    assert_true(v.camera.vertical_fov > 0 && v.camera.position[2] > v.bounds.upper[2]);
    /* The sphere around the triangle's bounds fills the view: its radius is sqrt(2) / 2. */
    double distance2 = 0, half_angle = (double)v.camera.vertical_fov / 2 * 3.14159265358979323846 / 180;
    for (int k = 0; k < 3; ++k) {
        double from = (double)v.camera.position[k] - (double)v.camera.target[k];
        assert_true(fabs((double)v.camera.target[k] - (k < 2 ? .5 : 0)) < 1e-6);
        distance2 += from * from;
    }
    assert_true(fabs(sqrt(distance2) * sin(half_angle) - sqrt(.5)) < 1e-5);
    fct_scene_destroy(scene);
}

static void expect_point(const fct_instance *i, double x, double y, double z) {
    const float *m = i->to_world; /* of the model's (1, 2, 3) */
    double at[3];
    for (int r = 0; r < 3; ++r) at[r] = m[4 * r] + 2 * m[4 * r + 1] + 3 * m[4 * r + 2] + m[4 * r + 3];
    assert_true(fabs(at[0] - x) + fabs(at[1] - y) + fabs(at[2] - z) < 1e-5);
}

static void reads_transforms(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
#define PLACE "{\"model\": \"t\", \"material\": \"a\", "
    fct_scene *scene =
        must_parse(&env, HEAD TRI
                   "\"instances\": [" PLACE "\"transform\": [2,0,0,0, 0,2,0,0, 0,0,2,0, 5,6,7,1]}," PLACE
                   "\"translate\": [5, 6, 7]}," PLACE "\"scale\": [1, 2, -1]}," PLACE
                   "\"rotate\": {\"axis\": [0, 0, 2], \"degrees\": 90}}," PLACE
                   "\"rotate\": [0, 0, 0.70710678, 0.70710678], \"scale\": 2, \"translate\": [1, 0, 0]}]}");
    fct_scene_view v = fct_scene_get(scene);
    expect_point(v.instances, 7, 10, 13);
    expect_point(v.instances + 1, 6, 8, 10);
    expect_point(v.instances + 2, 1, 4, -3);
    expect_point(v.instances + 3, -2, 1, 3);
    expect_point(v.instances + 4, -3, 2, 6);
    assert_true(v.instances[2].mirrored && !v.instances[3].mirrored);
    assert_true(fabs(v.instances[4].uniform_scale - 2) < 1e-5);
    fct_scene_destroy(scene);
}

static void cuts_models_by_material(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    fct_scene *scene = must_parse(
        &env, HEAD PARTS "\"instances\": ["
                         "{\"name\": \"x\", \"model\": \"p\", \"materials\": {\"oak\": \"a\", \"tin\": "
                         "\"b\", \"oak2\": \"a\"}},"
                         "{\"name\": \"y\", \"model\": \"p\", \"materials\": {\"tin\": \"a\", \"*\": \"b\"}},"
                         "{\"name\": \"z\", \"model\": \"p\", \"material\": \"b\"},"
                         "{\"name\": \"w\", \"model\": \"p\", \"face_materials\": [\"b\", \"a\", \"b\"]}]}");
    fct_scene_view v = fct_scene_get(scene);
    assert_int_equal(v.object_count, 4);
    assert_int_equal(v.instance_count, 3 + 3 + 1 + 2);
    assert_int_equal(v.model_count, 3 + 1 + 2);
    assert_int_equal(v.face_count, 4 * 5);
    static const uint32_t materials[9] = {0, 1, 0, 1, 0, 1, 1, 0, 1}, faces[9] = {2, 2, 1, 2, 2, 1, 5, 2, 3};
    static const char names[] = "xxxyyyzww";
    for (uint32_t i = 0; i < 9; ++i) {
        const fct_instance *instance = v.instances + i;
        assert_int_equal(instance->material, materials[i]);
        assert_int_equal(instance->name[0], names[i]);
        assert_int_equal(fct_tree_get(v.models[instance->model].tree).face_count, faces[i]);
    }
    assert_int_equal(v.instances[0].model, v.instances[3].model);
    /* the parts of w know their faces and vertices of the mesh */
    const fct_model *w = v.models + v.instances[8].model;
    assert_int_equal(w->source_faces[0], 0);
    assert_int_equal(w->source_faces[2], 4);
    assert_int_equal(w->source_vertices[0], 0);
    assert_null(v.models[v.instances[6].model].source_faces);
    fct_scene_destroy(scene);
}

typedef struct bad {
    const char *text, *message; /* a part of the message */
    fct_result result;
} bad;

#define ONE(...) HEAD TRI "\"instances\": [{\"model\": \"t\", \"material\": \"a\"" __VA_ARGS__ "}]}"
#define MATERIAL(m)                                                                                          \
    "{\"materials\": {\"a\": " m "}, " TRI "\"instances\": [{\"model\": \"t\", \"material\": \"a\"}]}"
#define CAMERA(c) HEAD TRI "\"camera\": " c ", \"instances\": [{\"model\": \"t\", \"material\": \"a\"}]}"

static const bad bad_scenes[] = {
    {"", "s.json:1:", FCT_ERROR_DATA},
    {"{\n  \"models\": {,\n}", "s.json:2:", FCT_ERROR_DATA},
    {"{\"models\": NaN}", "s.json:1:", FCT_ERROR_DATA},
    {"{\"models\": {}, \"models\": {}}", "duplicate", FCT_ERROR_DATA},
    {"[]", "expected an object, found an array", FCT_ERROR_DATA},
    {"{}", "materials: expected an object or an array, found nothing", FCT_ERROR_DATA},
    {"{\"modles\": 1}", "unknown key \"modles\"", FCT_ERROR_DATA},
    {HEAD TRI "\"instances\": []}", "instances: expected at least one", FCT_ERROR_DATA},
    {HEAD TRI "\"instances\": 5}", "instances: expected an array of objects, found 5", FCT_ERROR_DATA},
    {HEAD TRI "\"instances\": [5]}", "instances[0]: expected an object, found 5", FCT_ERROR_DATA},
    {HEAD TRI "\"instances\": [{\"material\": \"a\"}]}",
     "instances[0].model: expected a string, found nothing", FCT_ERROR_DATA},
    {HEAD TRI "\"instances\": [{\"model\": \"u\"}]}", "instances[0].model: there is no model \"u\"",
     FCT_ERROR_DATA},
    {HEAD TRI "\"instances\": [{\"model\": \"t\", \"material\": \"c\"}]}",
     "instances[0].material: there is no material \"c\"", FCT_ERROR_DATA},
    {HEAD TRI "\"instances\": [{\"model\": \"t\"}]}", "names no materials", FCT_ERROR_DATA},
    {ONE(", \"materials\": {}"), "found several", FCT_ERROR_DATA},
    {ONE(", \"colour\": 1"), "instances[0]: unknown key \"colour\"", FCT_ERROR_DATA},
    {ONE(", \"name\": \"\""), "instances[0].name: expected a string of 1 to", FCT_ERROR_DATA},
    {ONE(", \"name\": \"x\"}, {\"model\": \"t\", \"material\": \"a\", \"name\": \"x\""),
     "instances[1].name: the name exists already", FCT_ERROR_DATA},
    {ONE(", \"transform\": [1, 2]"), "transform: expected an array of 16 numbers, found an array of 2",
     FCT_ERROR_DATA},
    {ONE(", \"transform\": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,\"x\",1]"),
     "transform[14]: expected a number, found \"x\"", FCT_ERROR_DATA},
    {ONE(", \"transform\": [1,0,0,5, 0,1,0,0, 0,0,1,0, 0,0,0,1]"), "last row 0 0 0 1", FCT_ERROR_DATA},
    {ONE(", \"transform\": [1,0,0,0, 0,1,0,0, 1,1,0,0, 0,0,0,1]"),
     "instances[0].transform: the transform is singular", FCT_ERROR_DATA},
    {ONE(", \"scale\": 0"), "singular", FCT_ERROR_DATA},
    {ONE(", \"scale\": 1e39"), "scale: expected a number that fits a float", FCT_ERROR_DATA},
    {ONE(", \"scale\": 1e30"), "singular", FCT_ERROR_DATA},
    {ONE(", \"scale\": [1, 2]"), "scale: expected an array of 3 numbers", FCT_ERROR_DATA},
    {ONE(", \"rotate\": [0, 0, 0, 0]"), "rotate: the quaternion has no length", FCT_ERROR_DATA},
    {ONE(", \"rotate\": {\"axis\": [0, 0, 0], \"degrees\": 1}"), "the axis has no length", FCT_ERROR_DATA},
    {ONE(", \"rotate\": {\"axis\": [0, 0, 1]}"), "rotate.degrees: expected a number, found nothing",
     FCT_ERROR_DATA},
    {ONE(", \"scale\": 2, \"transform\": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]"), "found both",
     FCT_ERROR_DATA},
    {MATERIAL("{\"reflectance\": 1}"), "materials.a.reflectance: expected numbers below 1, found 1",
     FCT_ERROR_DATA},
    {MATERIAL("{\"reflectance\": 0.99999999999}"), "expected numbers below 1", FCT_ERROR_DATA},
    {MATERIAL("{\"reflectance\": [0.5, 0.5, -0.1]}"), "expected numbers >= 0, found -0.1", FCT_ERROR_DATA},
    {MATERIAL("{\"emission\": -1}"), "materials.a.emission: expected numbers >= 0", FCT_ERROR_DATA},
    {MATERIAL("{\"emission\": [1, 2]}"), "expected an array of 3 numbers", FCT_ERROR_DATA},
    {MATERIAL("{\"reflectence\": 0.5}"), "materials.a: unknown key \"reflectence\"", FCT_ERROR_DATA},
    {MATERIAL("{\"two_sided\": 1}"), "materials.a.two_sided: expected true or false, found 1",
     FCT_ERROR_DATA},
    {MATERIAL("{\"light_group\": \"x\"}"), "there is no light group \"x\"", FCT_ERROR_DATA},
    {MATERIAL("\"white\""), "materials.a: expected an object, found \"white\"", FCT_ERROR_DATA},
    {CAMERA("{\"position\": [0, 0, 0]}"), "camera.target", FCT_ERROR_DATA},
    {CAMERA("{\"position\": [1, 0, 0], \"target\": [1, 0, 0]}"), "the same point", FCT_ERROR_DATA},
    {CAMERA("{\"position\": [0, 1, 0], \"target\": [0, 0, 0]}"), "along the view", FCT_ERROR_DATA},
    {CAMERA("{\"position\": [1, 0, 0], \"target\": [0, 0, 0], \"vertical_fov\": 180}"), "between 0 and 180",
     FCT_ERROR_DATA},
    {HEAD "\"models\": {\"t\": \"gone.ply\"}, \"instances\": [{\"model\": \"t\", \"material\": \"a\"}]}",
     "gone.ply", FCT_ERROR_INPUT},
    {HEAD "\"models\": {\"t\": \"gone.fct\"}, \"instances\": [{\"model\": \"t\", \"material\": \"a\"}]}",
     "gone.fct", FCT_ERROR_INPUT},
    {HEAD "\"models\": {\"t\": \"empty.obj\"}, \"instances\": [{\"model\": \"t\", \"material\": \"a\"}]}",
     "at least one face", FCT_ERROR_DATA},
    {HEAD "\"models\": {\"t\": \"broken.obj\"}, \"instances\": [{\"model\": \"t\", \"material\": \"a\"}]}",
     "broken.obj:1", FCT_ERROR_DATA},
    {HEAD "\"models\": {\"t\": {\"path\": \"x\"}}, \"instances\": []}", "models.t: unknown key \"path\"",
     FCT_ERROR_DATA},
    {HEAD "\"models\": [{\"name\": \"t\", \"file\": \"x\"}, {\"name\": \"t\", \"file\": \"x\"}], "
          "\"instances\": []}",
     "models[1].name: \"t\" exists already", FCT_ERROR_DATA},
    {HEAD "\"models\": [{\"file\": \"x\"}], \"instances\": []}", "models[0].name", FCT_ERROR_DATA},
    {HEAD PARTS "\"instances\": [{\"model\": \"p\"}]}", "no material for \"oak\"", FCT_ERROR_DATA},
    {HEAD PARTS "\"instances\": [{\"model\": \"p\", \"materials\": {\"pine\": \"a\"}}]}",
     "has no faces of material \"pine\"", FCT_ERROR_DATA},
    {HEAD PARTS "\"instances\": [{\"model\": \"p\", \"materials\": {\"tin\": \"c\", \"*\": \"a\"}}]}",
     "instances[0].materials.tin: there is no material \"c\"", FCT_ERROR_DATA},
    {HEAD PARTS "\"instances\": [{\"model\": \"p\", \"face_materials\": [\"a\"]}]}",
     "face_materials: expected an array of 3 materials, one per face, found an array of 1", FCT_ERROR_DATA},
    {HEAD PARTS "\"instances\": [{\"model\": \"p\", \"face_materials\": [\"a\", \"b\", \"c\"]}]}",
     "face_materials[2]: there is no material \"c\"", FCT_ERROR_DATA},
    {"{\"light_groups\": [\"x\", \"x\"]}", "light_groups[1]: the name exists already", FCT_ERROR_DATA},
};

static void refuses_bad_scenes_and_says_where(void **unused) {
    (void)unused;
    for (size_t k = 0; k < sizeof bad_scenes / sizeof *bad_scenes; ++k) {
        recorder r = {0};
        fct_env env = recorder_env(&r);
        fct_scene *scene = (fct_scene *)&r;
        fct_result result = parse(&env, bad_scenes[k].text, &scene);
        if (result != bad_scenes[k].result || !strstr(r.text, bad_scenes[k].message))
            fail_msg("case %zu: %s\nresult %d, message: %s\nexpected: %s", k, bad_scenes[k].text, result,
                     r.text, bad_scenes[k].message);
        assert_null(scene);
        assert_int_equal(r.alive, 0);
    }
}

static void fails_cleanly_at_every_allocation(void **unused) {
    (void)unused;
    static const char text[] = HEAD PARTS "\"light_groups\": [\"x\"], \"instances\": ["
                                          "{\"model\": \"p\", \"materials\": {\"tin\": \"a\", \"*\": \"b\"}},"
                                          "{\"model\": \"p\", \"material\": \"b\", \"translate\": [5, 0, 0]},"
                                          "{\"model\": \"p\", \"face_materials\": [\"b\", \"a\", \"b\"]}]}";
    long failures = 0;
    for (long n = 1;; ++n) {
        recorder r = {.fail_at = n};
        fct_env env = recorder_env(&r);
        fct_scene *scene;
        fct_result result = parse(&env, text, &scene);
        if (result == FCT_OK) fct_scene_destroy(scene);
        assert_int_equal(r.alive, 0);
        if (r.allocations < n) {
            assert_int_equal(result, FCT_OK);
            break;
        }
        assert_int_equal(result, FCT_ERROR_MEMORY);
        assert_true(r.messages > 0);
        ++failures;
    }
    assert_true(failures > 50);
}

static fct_result load(const fct_env *env, const char *name, fct_scene **scene) {
    return fct_scene_load(env, path_of(name), FCT_BACKEND_OBB, scene);
}

static void opens_the_hierarchy_beside_a_mesh(void **unused) {
    (void)unused;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh mesh = make_grid(&env, 6);
    fct_tree *tree;
    fct_scene *scene;
    fct_file file;
    fct_tree_def def = fct_tree_def_default();
    assert_int_equal(fct_mesh_save(&env, path_of("grid.ply"), &mesh, NULL), FCT_OK);
    assert_int_equal(fct_file_open(&env, path_of("grid.ply"), &file), FCT_OK);
    def.source = "told by the test";
    def.source_hash = XXH3_64bits(file.data, file.size);
    fct_file_close(&env, &file);
    assert_int_equal(fct_tree_build(&env, &mesh, &def, NULL, &tree), FCT_OK);
    assert_int_equal(fct_tree_save(&env, tree, path_of("grid.fct")), FCT_OK);
    fct_tree_destroy(tree);

    static const char *const names[] = {"grid.ply", "grid.fct"};
    for (int k = 0; k < 2; ++k) {
        assert_int_equal(load(&env, names[k], &scene), FCT_OK);
        fct_scene_view v = fct_scene_get(scene);
        assert_string_equal(fct_tree_get(v.models[0].tree).source, "told by the test");
        assert_true(v.face_count == 72 && v.materials[0].reflectance[0] == .7f);
        fct_scene_destroy(scene);
    }
    mesh.positions[2] = .5f; /* the file is of another mesh now */
    assert_int_equal(fct_mesh_save(&env, path_of("grid.ply"), &mesh, NULL), FCT_OK);
    assert_int_equal(load(&env, "grid.ply", &scene), FCT_OK);
    assert_string_not_equal(fct_tree_get(fct_scene_get(scene).models[0].tree).source, "told by the test");
    fct_scene_destroy(scene);
    /* a broken hierarchy file is an error; it is not ignored */
    write_text("grid.fct", "no hierarchy");
    assert_int_equal(load(&env, "grid.ply", &scene), FCT_ERROR_DATA);
    assert_non_null(strstr(r.text, "grid.fct"));
    fct_mesh_release(&env, &mesh);
    assert_int_equal(r.alive, 0);
}

/* A hierarchy file has no texture coordinates and no colours of faces, so the mesh is read for them. */
static void reads_the_attributes_of_a_mesh_with_a_hierarchy(void **unused) {
    (void)unused;
    static const char ply[] = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                              "property float z\n%selement face 1\nproperty list uchar int vertex_indices\n%s"
                              "end_header\n0 0 0%s\n1 0 0%s\n0 1 0%s\n3 0 1 2%s\n";
    static const char st[] = "property float s\nproperty float t\n",
                      rgb[] = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    for (int k = 0; k < 4; ++k) {
        fct_env env = fct_env_default();
        const char *name = k == 0 ? "attribute.obj" : "attribute.ply";
        char text[1024];
        if (k == 0)
            snprintf(text, sizeof text, "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n");
        else
            snprintf(text, sizeof text, ply, k == 1 ? st : "", k == 2 ? rgb : "", k == 1 ? " 0 0" : "",
                     k == 1 ? " 1 0" : "", k == 1 ? " 0 1" : "", k == 2 ? " 255 0 0" : "");
        write_text(name, text);
        fct_mesh mesh;
        fct_tree *tree;
        fct_file file;
        fct_scene *scene;
        fct_tree_def def = fct_tree_def_default();
        assert_int_equal(fct_mesh_load(&env, path_of(name), &mesh), FCT_OK);
        assert_int_equal(fct_file_open(&env, path_of(name), &file), FCT_OK);
        def.source = "told by the test";
        def.source_hash = XXH3_64bits(file.data, file.size);
        fct_file_close(&env, &file);
        assert_int_equal(fct_tree_build(&env, &mesh, &def, NULL, &tree), FCT_OK);
        assert_int_equal(fct_tree_save(&env, tree, path_of("attribute.fct")), FCT_OK);
        assert_int_equal(load(&env, name, &scene), FCT_OK);
        fct_scene_view v = fct_scene_get(scene);
        assert_string_equal(fct_tree_get(v.models[0].tree).source, "told by the test");
        assert_int_equal(v.models[0].texcoords != NULL, k < 2);
        assert_int_equal(v.models[0].face_colors != NULL, k == 2);
        fct_surface_point point;
        fct_scene_point(scene, 0, 0, .25F, .5F, &point);
        if (k < 2) assert_true(point.texcoord[0] == .25F && point.texcoord[1] == .5F);
        if (k == 2) assert_true(point.color[0] == 1 && point.color[1] == 0);
        fct_scene_destroy(scene);
        fct_tree_destroy(tree);
        fct_mesh_release(&env, &mesh);
    }
}

/* face_materials has a name for every polygon of the file, also for those that are left out. */
static void names_polygons_that_are_left_out(void **unused) {
    (void)unused;
    write_text("short.off",
               "OFF\n4 5 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 0 1\n4 0 1 2 3\n2 0 1\n3 2 3 0\n2 2 3\n");
    for (int count = 3; count <= 6; ++count) {
        recorder r = {0};
        fct_env env = recorder_env(&r);
        fct_scene *scene;
        static const char *const names[] = {"",
                                            "",
                                            "",
                                            "\"b\", \"a\", \"a\"",
                                            "\"b\", \"a\", \"a\", \"b\"",
                                            "\"b\", \"a\", \"a\", \"b\", \"a\"",
                                            "\"b\", \"a\", \"a\", \"b\", \"a\", \"a\""};
        char text[600];
        snprintf(text, sizeof text,
                 HEAD "\"models\": {\"t\": \"short.off\"}, \"instances\": [{\"model\": \"t\", "
                      "\"face_materials\": [%s]}]}",
                 names[count]);
        assert_int_equal(parse(&env, text, &scene), count == 5 ? FCT_OK : FCT_ERROR_DATA);
        if (count != 5) {
            assert_non_null(strstr(r.text, "an array of 5 materials"));
            continue;
        }
        fct_scene_view v = fct_scene_get(scene);
        assert_int_equal(v.instance_count, 2);
        for (uint32_t i = 0; i < 2; ++i) /* the square has material a, the triangle b */
            assert_int_equal(fct_tree_get(v.models[v.instances[i].model].tree).face_count,
                             v.materials[v.instances[i].material].name[0] == 'a' ? 2 : 1);
        fct_scene_destroy(scene);
        assert_int_equal(r.alive, 0);
    }
}

/* A model of one soup of two triangles at one side. */
static void expect_weld(const fct_env *env, const char *name, bool weld) {
    fct_scene *scene;
    assert_int_equal(load(env, name, &scene), FCT_OK);
    fct_tree_view v = fct_tree_get(fct_scene_get(scene).models[0].tree);
    assert_int_equal(v.def.weld, weld);
    assert_int_equal(v.component_count, weld ? 1 : 2);
    fct_scene_destroy(scene);
}

static void models_follow_the_choice_of_the_weld(void **unused) {
    (void)unused;
    recorder r = {0};
    fct_env welding = recorder_env(&r), apart = recorder_env(&r);
    fct_mesh mesh;
    fct_tree *tree;
    fct_file file;
    fct_tree_def def = fct_tree_def_default();
    apart.no_weld = true;
    write_text("soup.obj", "mtllib soup.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
                           "usemtl a\nf 1 2 3\nf 4 5 6\n");
    write_text("soup.mtl", "newmtl a\nKd .5 .5 .5\n");
    write_text("soup.json", HEAD "\"models\": {\"t\": \"soup.obj\"}, \"instances\": [{\"model\": \"t\", "
                                 "\"material\": \"a\"}]}");
    assert_int_equal(fct_mesh_load(&welding, path_of("soup.obj"), &mesh), FCT_OK);
    assert_int_equal(fct_mesh_save(&welding, path_of("soup.glb"), &mesh, NULL), FCT_OK);
    static const char *const names[] = {"soup.obj", "soup.json", "soup.glb"};
    for (int k = 0; k < 3; ++k) {
        expect_weld(&welding, names[k], true);
        expect_weld(&apart, names[k], false);
    }
    /* A hierarchy file keeps the choice of its build. The welded one beside a mesh is not used. */
    assert_int_equal(fct_file_open(&welding, path_of("soup.obj"), &file), FCT_OK);
    def.source_hash = XXH3_64bits(file.data, file.size);
    fct_file_close(&welding, &file);
    for (int weld = 1; weld >= 0; --weld) {
        def.weld = weld;
        assert_int_equal(fct_tree_build(&welding, &mesh, &def, NULL, &tree), FCT_OK);
        assert_int_equal(fct_tree_save(&welding, tree, path_of("soup.fct")), FCT_OK);
        fct_tree_destroy(tree);
        expect_weld(&welding, "soup.fct", weld);
        expect_weld(&apart, "soup.fct", weld);
        expect_weld(&welding, "soup.json", weld);
        expect_weld(&apart, "soup.json", false);
    }
    fct_mesh_release(&welding, &mesh);
    assert_int_equal(r.alive, 0);
}

static void missing_files_are_told(void **unused) {
    (void)unused;
    static const char *const names[] = {"gone.json", "gone.obj", "gone.ply", "gone.fct"};
    for (int k = 0; k < 4; ++k) {
        recorder r = {0};
        fct_env env = recorder_env(&r);
        fct_scene *scene;
        assert_int_equal(load(&env, names[k], &scene), FCT_ERROR_INPUT);
        assert_non_null(strstr(r.text, names[k]));
        assert_null(scene);
    }
}

static void scenes_made_by_calls_are_checked(void **unused) {
    (void)unused;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_scene *scene;
    uint32_t id, group;
    fct_material material = {.name = "m", .reflectance = {.5f, .5f, .5f}};
    fct_mesh mesh = make_grid(&env, 2);
    assert_int_equal(fct_scene_create(&env, FCT_BACKEND_OBB, &scene), FCT_OK);
    material.reflectance[1] = NAN;
    assert_int_equal(fct_scene_add_material(scene, &material, &id), FCT_ERROR_DATA);
    material.reflectance[1] = 1;
    assert_int_equal(fct_scene_add_material(scene, &material, &id), FCT_ERROR_DATA);
    material.reflectance[1] = 0, material.emission[0] = INFINITY;
    assert_int_equal(fct_scene_add_material(scene, &material, &id), FCT_ERROR_DATA);
    material.emission[0] = 0;
    assert_int_equal(fct_scene_add_material(scene, &material, &id), FCT_OK);
    float flat[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0}, nan[12] = {1, 0, 0, NAN, 0, 1, 0, 0, 0, 0, 1, 0};
    assert_int_equal(fct_scene_add_object(scene, "o", &mesh, NULL, flat, id, NULL), FCT_ERROR_DATA);
    assert_int_equal(fct_scene_add_object(scene, "o", &mesh, NULL, nan, id, NULL), FCT_ERROR_DATA);
    uint32_t faces[8] = {0, 0, 0, 7, 0, 0, 0, 0};
    assert_int_equal(fct_scene_add_object(scene, "o", &mesh, NULL, NULL, id, faces), FCT_ERROR_DATA);
    assert_non_null(strstr(r.text, "face 3 has material 7, expected one below 1"));
    mesh.positions[4] = NAN;
    assert_int_equal(fct_scene_add_object(scene, "o", &mesh, NULL, NULL, id, NULL), FCT_ERROR_DATA);
    mesh.positions[4] = 0;
    material.light_group = 1;
    assert_int_equal(fct_scene_add_material(scene, &material, &id), FCT_OK);
    assert_int_equal(fct_scene_add_light_group(scene, "one", &group), FCT_OK);
    assert_int_equal(fct_scene_add_object(scene, "o", &mesh, NULL, NULL, id, NULL), FCT_OK);
    assert_int_equal(fct_scene_commit(scene), FCT_ERROR_DATA); /* group 1 of 1 */
    fct_scene_destroy(scene);
    assert_int_equal(fct_scene_create(&env, FCT_BACKEND_OBB, &scene), FCT_OK);
    assert_int_equal(fct_scene_commit(scene), FCT_ERROR_DATA); /* empty */
    fct_scene_destroy(scene);
    fct_mesh_release(&env, &mesh);
    assert_int_equal(r.alive, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reads_materials_camera_and_groups),
        cmocka_unit_test(reads_transforms),
        cmocka_unit_test(cuts_models_by_material),
        cmocka_unit_test(refuses_bad_scenes_and_says_where),
        cmocka_unit_test(fails_cleanly_at_every_allocation),
        cmocka_unit_test(opens_the_hierarchy_beside_a_mesh),
        cmocka_unit_test(reads_the_attributes_of_a_mesh_with_a_hierarchy),
        cmocka_unit_test(names_polygons_that_are_left_out),
        cmocka_unit_test(models_follow_the_choice_of_the_weld),
        cmocka_unit_test(missing_files_are_told),
        cmocka_unit_test(scenes_made_by_calls_are_checked),
    };
    return cmocka_run_group_tests(tests, set_up, remove_folder);
}
