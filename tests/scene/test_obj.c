/* tests/scene/test_obj.c: OBJ + MTL: materials, names, libraries, what becomes grey, and refused files. */
#include "files.h"

#include <sys/stat.h>

#include "facetree/scene.h"

static int set_up(void **unused) {
    (void)unused;
    assert_non_null(mkdtemp(folder));
    return mkdir(path_of("mat"), 0777);
}

static fct_result load(const fct_env *env, const char *name, fct_scene **scene) {
    return fct_scene_load(env, path_of(name), FCT_BACKEND_OBB, scene);
}

#define QUAD "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"

static void reads_obj_with_materials(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    fct_scene *scene;
    write_text("box.mtl",
               "# two\nnewmtl white wall\n Kd 0.5 0.25 .125\n Ns 10\n\nnewmtl lamp\nKd 0.1\nKe 5 4 3 # on\n");
    write_text("box.obj",
               "mtllib box.mtl\n" QUAD "usemtl white wall\no one\nf 1 2 3\ng two\nusemtl lamp\nf 1 3 4\n"
               "o one\nf 1 2 4\n");
    assert_int_equal(load(&env, "box.obj", &scene), FCT_OK);
    fct_scene_view v = fct_scene_get(scene);
    assert_int_equal(v.material_count, 2);
    assert_true(v.materials[0].reflectance[2] == .125f && !v.materials[0].two_sided);
    assert_true(v.materials[1].reflectance[2] == .1f && v.materials[1].emission[0] == 5 &&
                !v.materials[1].two_sided);
    fct_scene_make_two_sided(scene);
    v = fct_scene_get(scene);
    assert_true(v.materials[0].two_sided && !v.materials[1].two_sided); /* a lamp stays one-sided */
    assert_int_equal(v.object_count, 2);
    assert_int_equal(v.instance_count, 3);
    assert_string_equal(v.instances[0].name, "one");
    assert_string_equal(v.instances[1].name, "one");
    assert_string_equal(v.instances[2].name, "two");
    assert_true(v.instances[0].material == 0 && v.instances[1].material == 1 && v.instances[2].material == 1);
    fct_scene_destroy(scene);

    write_text("unused.obj", "mtllib box.mtl\n" QUAD "usemtl lamp\nf 1 2 3\n"); /* as many libraries are */
    assert_int_equal(load(&env, "unused.obj", &scene), FCT_OK);
    v = fct_scene_get(scene);
    assert_int_equal(v.instance_count, 1);
    assert_string_equal(v.materials[v.instances[0].material].name, "lamp");
    fct_scene_destroy(scene);

    write_text("plain.obj", QUAD "o one\nf 1 2 3\no two\nf 1 3 4\n"); /* no materials: a grey mesh */
    assert_int_equal(load(&env, "plain.obj", &scene), FCT_OK);
    assert_int_equal(fct_scene_get(scene).instance_count, 1);
    fct_scene_destroy(scene);
}

/* Keeps all messages. */
typedef struct messages {
    char text[4096];
} messages;

static void keep_message(void *user, fct_severity severity, const char *text) {
    messages *m = user;
    (void)severity;
    strncat(m->text, text, sizeof m->text - strlen(m->text) - 1);
    strncat(m->text, "\n", sizeof m->text - strlen(m->text) - 1);
}

/* Loads the OBJ. Its messages must be `message` lines, or none if it is empty. */
static fct_scene *must_load(const char *obj, const char *message) {
    messages m = {""};
    fct_env env = fct_env_default();
    env.message = keep_message, env.message_user = &m;
    fct_scene *scene;
    char expected[1024] = "";
    write_text("s.obj", obj);
    assert_int_equal(load(&env, "s.obj", &scene), FCT_OK);
    for (const char *p = message; *p; p += strcspn(p, "\n"), p += *p == '\n')
        snprintf(expected + strlen(expected), sizeof expected - strlen(expected), "%s: %.*s\n",
                 path_of("s.obj"), (int)strcspn(p, "\n"), p);
    if (strcmp(m.text, expected)) fail_msg("expected '%s', got '%s'", expected, m.text);
    return scene;
}

/* Whether the scene has an instance of a material with this reflectance in red and emission in green. */
static void expect_material(fct_scene *scene, const char *name, double reflectance, double emission) {
    fct_scene_view v = fct_scene_get(scene);
    for (uint32_t i = 0; i < v.instance_count; ++i) {
        const fct_material *m = v.materials + v.instances[i].material;
        if (strcmp(m->name, name)) continue;
        if (fabs((double)m->reflectance[0] - reflectance) > 1e-6 ||
            fabs((double)m->emission[1] - emission) > 1e-6 || m->two_sided)
            fail_msg("%s: reflectance %g, emission %g", name, (double)m->reflectance[0],
                     (double)m->emission[1]);
        return;
    }
    fail_msg("no instance of %s", name);
}

#define ROOM QUAD "usemtl white\nf 1 2 3\nusemtl lamp\nf 1 3 4\n"

static void expect_room(const char *libraries, const char *message) {
    char obj[512];
    snprintf(obj, sizeof obj, "%s" ROOM, libraries);
    fct_scene *scene = must_load(obj, message);
    expect_material(scene, "white", .6, 0);
    expect_material(scene, "lamp", .1, 4);
    assert_int_equal(fct_scene_get(scene).instance_count, 2);
    fct_scene_destroy(scene);
}

static void finds_libraries(void **unused) {
    (void)unused;
    static const char *const all[] = {"all.mtl", "my room.mtl", "mat/all.mtl", "beside.mtl"};
    for (int k = 0; k < 4; ++k) write_text(all[k], "newmtl white\nKd .6\nnewmtl lamp\nKd .1\nKe 5 4 3\n");
    write_text("white.mtl", "\xef\xbb\xbfnewmtl white\rKd .6 .6 .6\r");
    write_text("my lamp.mtl", "newmtl lamp\r\nKd .1\r\nKe 5 4 3");
    expect_room("mtllib all.mtl\n", "");
    expect_room("mtllib my room.mtl  \n", "");
    expect_room("mtllib \"my room.mtl\"\r\n", "");
    expect_room("mtllib ./mat/all.mtl\n", "");
    expect_room("mtllib mat\\all.mtl\n", "");
    expect_room("mtllib .\\mat\\all.mtl\n", "");
    expect_room("mtllib C:\\My Scenes\\beside.mtl\n", "");
    expect_room("mtllib /nowhere/beside.mtl\n", "");
    expect_room("mtllib white.mtl my lamp.mtl\n", "");
    expect_room("mtllib my lamp.mtl\twhite.mtl # both\n", "");
    write_text("p", "newmtl white\nKd .6\n");
    write_text("p q", "newmtl white\nKd .5\n");
    write_text("q r.mtl", "newmtl lamp\nKd .1\nKe 5 4 3\n");
    expect_room("mtllib p q r.mtl\n", ""); /* p q, and r.mtl is missing; or p, and q r.mtl */
    expect_room("mtllib white.mtl\nmtllib my lamp.mtl\n", "");
    expect_room("mtllib x/white.mtl mat\\all.mtl\n",
                "1 materials are defined again; the first definition stays (\"white\" first)");
    expect_room("mtllib all.mtl\nmtllib ./all.mtl all.mtl\n",
                "material libraries are named again 2 times and read once");
    expect_room("mtllib white.mtl gone.mtl my lamp.mtl no\x1b[7m.mtl\n",
                "2 material libraries cannot be read (\"gone.mtl\" first)");
    expect_room("mtllib\nmtllib all.mtl\n", "");
    expect_room("mtllib mat\nmtllib all.mtl\n", "1 material libraries cannot be read (\"mat\" first)");
}

/* A line of a hundred names, each twice. */
static void reads_long_lines_of_libraries(void **unused) {
    (void)unused;
    static char obj[8192];
    size_t size = (size_t)sprintf(obj, "mtllib");
    for (int k = 0; k < 100; ++k) {
        char name[32], text[64];
        snprintf(name, sizeof name, "part %d.mtl", k % 50);
        snprintf(text, sizeof text, "newmtl m%d\nKd .%02d\n", k % 50, k % 50 + 10);
        write_text(name, text);
        size += (size_t)sprintf(obj + size, " %s", name);
    }
    strcat(obj, "\n" QUAD "usemtl m49\nf 1 2 3\nusemtl m0\nf 1 2 3\n");
    fct_scene *scene = must_load(obj, "material libraries are named again 50 times and read once");
    expect_material(scene, "m49", .59, 0);
    expect_material(scene, "m0", .1, 0);
    fct_scene_destroy(scene);
}

static void what_is_missing_becomes_grey(void **unused) {
    (void)unused;
    write_text("one.mtl", "newmtl white\nKd .6\nnewmtl\nKd .3\n");
    fct_scene *scene = must_load("mtllib gone.mtl\n" QUAD "f 1 2 3\n",
                                 "1 material libraries cannot be read (\"gone.mtl\" first)\n"
                                 "1 faces have no material and become grey");
    expect_material(scene, "(none)", .7, 0);
    fct_scene_destroy(scene);
    scene = must_load(
        "mtllib one.mtl\n" QUAD
        "usemtl wall\nf 1 2 3\nusemtl white\nf 1 2 3\nusemtl unused\nusemtl sky\nf 1 2 3\nf 1 2 3\n",
        "2 materials are in no library and become grey (\"wall\" first)");
    expect_material(scene, "wall", .7, 0);
    expect_material(scene, "sky", .7, 0);
    expect_material(scene, "white", .6, 0);
    assert_int_equal(fct_scene_get(scene).material_count, 4);
    fct_scene_destroy(scene);
    scene = must_load("usemtl a\n" QUAD "f 1 2 3 4\n",
                      "1 materials are in no library and become grey (\"a\" first)");
    fct_scene_destroy(scene);
}

#define ONE(name) "mtllib one.mtl\n" QUAD "usemtl " name "\nf 1 2 3\n"

static void expect_one(const char *mtl, double reflectance, double emission, const char *message) {
    write_text("one.mtl", mtl);
    fct_scene *scene = must_load(ONE("a"), message);
    expect_material(scene, "a", reflectance, emission);
    fct_scene_destroy(scene);
}

/* The matrix of IEC 61966-2-1 takes XYZ to linear RGB. X alone: red 3.2404542, green < 0. */
static void clamps_colors(void **unused) {
    (void)unused;
    static const char clamped[] = "1 materials have colours out of range, which are clamped: Kd to 0 to .9, "
                                  "Ke to >= 0 (\"a\" first)";
    expect_one("newmtl a\nKd .9 .9 .9\n", .9, 0, "");
    expect_one("newmtl a\nKd 1 1 1\nKe 0 2 0\n", .9, 2, clamped);
    expect_one("newmtl a\nKd 0 0 255\n", 0, 0, clamped);
    expect_one("newmtl a\nKd .91\n", .9, 0, clamped);
    expect_one("newmtl a\nKd xyz .2 .3 .1\n", 3.2404542 * .2 - 1.5371385 * .3 - .4985314 * .1, 0, "");
    expect_one("newmtl a\nKd .5\nKe xyz 2 3 1 # sun\n", .5, -.9692660 * 2 + 1.8760108 * 3 + .0415560, "");
    expect_one("newmtl a\nKd xyz .2 0 0\n", 3.2404542 * .2, 0, clamped);
    expect_one("newmtl a\nKd xyz .5\n", .5 * (3.2404542 - 1.5371385 - .4985314), 0, "");
    expect_one("newmtl a\nKd .5\nKe xyz 0 1 0\n", .5, 1.8760108, clamped);
    expect_one("newmtl a\nKd spectral w.rfl 1\n", .7, 0,
               "1 materials have a spectral Kd and become grey (\"a\" first)");
    expect_one("newmtl a\nKd .5\nKe spectral w.rfl\n", .5, 0,
               "1 materials have a spectral Ke and emit no light (\"a\" first)");
    expect_one("newmtl a\nKd .2\nnewmtl b\nnewmtl a\nKd 1\nnewmtl b\n", .2, 0,
               "2 materials are defined again; the first definition stays (\"a\" first)");
    expect_one("newmtl a\nKd .5\nmap_Kd wood.png\n", .5, 0,
               "1 textures cannot be read and are left out (no file \"wood.png\")");
    expect_one("newmtl a\nKd .5\nmap_Ke wood.png\n", .5, 0,
               "1 materials have a texture of their emission, which is left out (\"a\" first)");
    expect_one("newmtl a\nKd .5\nd 1\nTr 0\n", .5, 0, "");
    expect_one("newmtl a\nd 1\nTr 0\nKd .5\nd .5\n", .5, 0,
               "1 materials are transparent and become opaque (\"a\" first)");
}

/* Long names keep their beginning and stay different. */
static void names_have_any_length(void **unused) {
    (void)unused;
    char name[300], mtl[1024], obj[4096];
    memset(name, 'x', sizeof name);
    name[sizeof name - 1] = 0;
    memcpy(name + 58, "\xc3\xa9\xc3\xa9", 4); /* two letters of UTF-8, of which one fits */
    snprintf(mtl, sizeof mtl, "newmtl %s1\nKd .1\nnewmtl %s2\nKd .2\nnewmtl\nKd .3\n", name, name);
    write_text("one.mtl", mtl);
    snprintf(obj, sizeof obj,
             "mtllib one.mtl\n" QUAD
             "o %s1\nusemtl %s2\nf 1 2 3\no %s2\nusemtl %s1\nf 1 2 4\no\nusemtl \nf 1 3 4\n",
             name, name, name, name);
    fct_scene *scene = must_load(obj, "1 faces have no material and become grey");
    fct_scene_view v = fct_scene_get(scene);
    assert_int_equal(v.object_count, 3);
    assert_int_equal(v.material_count, 3);
    for (uint32_t k = 0; k < 2; ++k) {
        assert_memory_equal(v.materials[k].name, name, 58);
        assert_true(strlen(v.materials[k].name) <= 63 && strlen(v.instances[k].name) <= 100);
        assert_true(v.materials[k].reflectance[0] == (k ? .2f : .1f));
        assert_int_equal(v.materials[k].name[60], '~');
    }
    assert_string_not_equal(v.materials[0].name, v.materials[1].name);
    expect_material(scene, "(none)", .3, 0);
    fct_scene_destroy(scene);
}

/* Short faces and continued lines do not shift the objects. */
static void faces_stay_in_their_objects(void **unused) {
    (void)unused;
    write_text("one.mtl", "newmtl a\n");
    fct_scene *scene = must_load(
        "mtllib one.mtl\n" QUAD
        "usemtl a\no p\nf 1 2\nf 1 2 3 4\no q\nfo 1 \\\n2\nl 1 2 3\nfo 1 \\\n2 3\nf 1 2 4\nf 1 3 4\n",
        "2 faces of fewer than 3 corners are left out\n1 statements of points, lines and free-form shapes "
        "are left out");
    fct_scene_view v = fct_scene_get(scene);
    assert_int_equal(v.object_count, 2);
    assert_int_equal(fct_tree_get(v.models[v.instances[0].model].tree).face_count, 2);
    assert_int_equal(fct_tree_get(v.models[v.instances[1].model].tree).face_count, 3);
    fct_scene_destroy(scene);
}

static void refuses_bad_obj_scenes(void **unused) {
    (void)unused;
    static const struct {
        const char *obj, *mtl, *message;
        fct_result result;
    } cases[] = {
        {"mtllib bad.mtl\n" QUAD "usemtl a\nf 1 2 3\n", "newmtl a\nKd red\n", "bad.mtl:2", FCT_ERROR_DATA},
        {"mtllib bad.mtl\n" QUAD "usemtl a\nf 1 2 3\n", "newmtl a\nKd nan\n", "bad.mtl:2", FCT_ERROR_DATA},
        {"mtllib bad.mtl\n" QUAD "usemtl a\nf 1 2 3\n", "newmtl a\r\rKd 1 3.1+e2 1\r",
         "bad.mtl:3: expected a reflectance, found '3.1+e2'", FCT_ERROR_DATA},
        {"mtllib bad.mtl\n" QUAD "usemtl a\nf 1 2 3\n", "newmtl a\nKd -1\n", "bad.mtl:2: expected Kd >= 0",
         FCT_ERROR_DATA},
        {"mtllib bad.mtl\n" QUAD "usemtl a\nf 1 2 3\n", "newmtl a\nKd xyz 1 1 1 1\n",
         "bad.mtl:2: expected the end of the line", FCT_ERROR_DATA},
        {"mtllib bad.mtl\n" QUAD "usemtl a\nf 1 2 3\n", "newmtl a\nKe -1\n", "expected Ke >= 0, found -1",
         FCT_ERROR_DATA},
        {"mtllib bad.mtl\n" QUAD "usemtl a\nf 1 2 3\n", "Kd 1 1 1\n", "bad.mtl:1: expected newmtl",
         FCT_ERROR_DATA},
        {"mtllib bad.mtl\n" QUAD "usemtl a\nf 1 2 9\n", "newmtl a\n", "bad.obj:7", FCT_ERROR_DATA},
        {"mtllib bad.mtl\n" QUAD "usemtl a\n", "newmtl a\n", "at least one face", FCT_ERROR_DATA},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; ++k) {
        recorder r = {0};
        fct_env env = recorder_env(&r);
        fct_scene *scene;
        write_text("bad.obj", cases[k].obj);
        write_text("bad.mtl", cases[k].mtl);
        fct_result result = load(&env, "bad.obj", &scene);
        if (result != cases[k].result || !strstr(r.text, cases[k].message))
            fail_msg("case %zu: result %d, message: %s\nexpected: %s", k, result, r.text, cases[k].message);
        assert_null(scene);
        assert_int_equal(r.alive, 0);
    }
}

static void obj_fails_cleanly_at_every_allocation(void **unused) {
    (void)unused;
    write_text("memory.mtl", "newmtl a\nnewmtl b\nKe 1 1 1\n");
    write_text("memory.obj", "f 1 2 3\nmtllib memory.mtl gone.mtl\nmtllib a\\memory.mtl\n" QUAD
                             "usemtl a # first\nf 1 2 3\no x\nusemtl b\nf 1 3 4\nusemtl c\nf 1 2 4\n");
    for (long n = 1;; ++n) {
        recorder r = {.fail_at = n};
        fct_env env = recorder_env(&r);
        fct_scene *scene;
        fct_result result = load(&env, "memory.obj", &scene);
        if (result == FCT_OK) fct_scene_destroy(scene);
        assert_int_equal(r.alive, 0);
        assert_int_equal(result, r.allocations < n ? FCT_OK : FCT_ERROR_MEMORY);
        if (result == FCT_OK) break;
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reads_obj_with_materials),
        cmocka_unit_test(finds_libraries),
        cmocka_unit_test(reads_long_lines_of_libraries),
        cmocka_unit_test(what_is_missing_becomes_grey),
        cmocka_unit_test(clamps_colors),
        cmocka_unit_test(names_have_any_length),
        cmocka_unit_test(faces_stay_in_their_objects),
        cmocka_unit_test(refuses_bad_obj_scenes),
        cmocka_unit_test(obj_fails_cleanly_at_every_allocation),
    };
    return cmocka_run_group_tests(tests, set_up, remove_folder);
}
