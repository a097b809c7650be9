/* tools/make/make.c: facetree make: example scenes and meshes. */
#include "tools/make/parts.h"

#include <limits.h>
#include <math.h>
#include <string.h>

#include "tools/commands.h"
#include "tools/kit/command.h"
#include "tools/kit/file.h"
#include "tools/kit/options.h"

typedef struct make_options {
    uint32_t triangles; /* 0: the default of the thing */
    bool inside;
} make_options;

enum { KEY_TRIANGLES = TOOL_KEY, KEY_INSIDE };

static const struct argp_option make_options_table[] = {
    {"triangles", KEY_TRIANGLES, "N", 0, "Make about N triangles (default: depends on NAME)", 0},
    {"inside", KEY_INSIDE, NULL, 0, "Turn a mesh inside out", 0},
    {0}};

static error_t parse_make(int key, char *text, struct argp_state *state) {
    make_options *o = state->input;
    switch (key) {
    case KEY_TRIANGLES:
        return tool_parse_count32(state, "--triangles", text, 1, 200000000, &o->triangles);
    case KEY_INSIDE:
        o->inside = true;
        return 0;
    case ARGP_KEY_SUCCESS:
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* --- Single meshes --- */

static uint32_t round_root(double value) {
    return (uint32_t)fmax(1, lround(sqrt(value)));
}

static int build_sphere(make_mesh *m, uint32_t n) {
    make_sphere(m, make_p(0, 0, 0), 1, round_root(n / 20.));
    return TOOL_DONE;
}
static int build_box(make_mesh *m, uint32_t n) {
    make_cube(m, n);
    return TOOL_DONE;
}
static int build_cylinder(make_mesh *m, uint32_t n) {
    make_cylinder(m, n);
    return TOOL_DONE;
}
static int build_grid(make_mesh *m, uint32_t n) {
    make_sheet(m, round_root(n / 2.), NULL, 0);
    return TOOL_DONE;
}
static int build_terrain(make_mesh *m, uint32_t n) {
    make_sheet(m, round_root(n / 2.), make_terrain_height, m->t->seed);
    return TOOL_DONE;
}
static int build_crates(make_mesh *m, uint32_t n) {
    make_crates(m, (uint32_t)fmax(1, lround(n / 12.)), m->t->seed);
    return TOOL_DONE;
}
static int build_vase(make_mesh *m, uint32_t n) {
    make_vase(m, n);
    return TOOL_DONE;
}
static int build_torso(make_mesh *m, uint32_t n) {
    return make_statue_mesh(m, MAKE_TORSO, n, m->t->seed + MAKE_TORSO);
}
static int build_knot(make_mesh *m, uint32_t n) {
    return make_statue_mesh(m, MAKE_KNOT, n, m->t->seed + MAKE_KNOT);
}
static int build_gyroid(make_mesh *m, uint32_t n) {
    return make_statue_mesh(m, MAKE_GYROID, n, m->t->seed + MAKE_GYROID);
}
static int build_shell(make_mesh *m, uint32_t n) {
    return make_statue_mesh(m, MAKE_SHELL, n, m->t->seed + MAKE_SHELL);
}
static int build_bust(make_mesh *m, uint32_t n) {
    return make_statue_mesh(m, MAKE_BUST, n, m->t->seed + MAKE_BUST);
}

/* `triangles` is the default, `least` the smallest possible count. A thing is either a scene or a mesh. */
static const struct {
    const char *name;
    uint32_t triangles, least;
    int (*scene)(tool *t, const char *folder, uint32_t triangles, make_result *result);
    int (*mesh)(make_mesh *m, uint32_t triangles);
} things[] = {
    {"cornell", 1000, 38, make_cornell, NULL},    {"museum", 300000, 30000, make_museum, NULL},
    {"sphere", 20000, 20, NULL, build_sphere},    {"box", 12, 12, NULL, build_box},
    {"cylinder", 2000, 12, NULL, build_cylinder}, {"grid", 20000, 2, NULL, build_grid},
    {"terrain", 200000, 2, NULL, build_terrain},  {"crate-field", 120000, 12, NULL, build_crates},
    {"torso", 100000, 1000, NULL, build_torso},   {"knot", 100000, 1000, NULL, build_knot},
    {"gyroid", 100000, 1000, NULL, build_gyroid}, {"shell", 100000, 1000, NULL, build_shell},
    {"bust", 100000, 1000, NULL, build_bust},     {"vase", 50000, 1000, NULL, build_vase},
};
enum { THINGS = sizeof things / sizeof *things };

static int find_thing(tool *t, const char *name, int *index) {
    const char *names[THINGS + 1] = {NULL};
    for (*index = 0; *index < THINGS; ++*index) {
        if (strcmp(things[*index].name, name) == 0) return TOOL_DONE;
        names[*index] = things[*index].name;
    }
    const char *nearest = tool_nearest(name, names);
    if (nearest) return tool_fail(t, TOOL_USAGE, "cannot make '%s'; did you mean '%s'?", name, nearest);
    return tool_fail(t, TOOL_USAGE, "cannot make '%s'; 'facetree help make' lists the names", name);
}

/* A sheet that goes to a PLY file is written row by row, without a mesh in memory. */
static bool is_written_by_rows(int (*mesh)(make_mesh *m, uint32_t triangles), const char *path) {
    return (mesh == build_grid || mesh == build_terrain) && tool_ends(path, "ply");
}

static int make_one(tool *t, int index, uint32_t triangles, bool inside, make_result *result) {
    make_mesh m = {.t = t};
    int code = tool_check_kind(t, t->output, TOOL_MESHES, NULL);
    if (code == TOOL_DONE) code = tool_check_output(t, t->output);
    if (code == TOOL_DONE && is_written_by_rows(things[index].mesh, t->output)) {
        uint32_t n = round_root(triangles / 2.);
        result->triangles = 2 * (uint64_t)n * n;
        json_array_append_new(result->files, json_string(t->output));
        return make_sheet_file(t, t->output, n, things[index].mesh == build_grid ? NULL : make_terrain_height,
                               inside);
    }
    if (code == TOOL_DONE) code = things[index].mesh(&m, triangles);
    if (code != TOOL_DONE) {
        make_clear(&m);
        return code;
    }
    if (inside) make_turn(&m);
    result->triangles = m.face_count;
    json_array_append_new(result->files, json_string(t->output));
    return make_save(&m, t->output);
}

/* -o names the folder, or the scene.json in it. */
static int make_folder(tool *t, int index, uint32_t triangles, make_result *result) {
    static const char file[] = "scene.json";
    char folder[PATH_MAX];
    size_t length = strlen(t->output), tail = strlen(file);
    if (length >= sizeof folder)
        return tool_fail(t, TOOL_OUTPUT, "%.40s...: the name is too long", t->output);
    memcpy(folder, t->output, length + 1);
    if (length >= tail && strcmp(folder + length - tail, file) == 0 &&
        (length == tail || folder[length - tail - 1] == '/'))
        snprintf(folder + length - tail, 2, length == tail ? "." : "");
    else if (!tool_is_folder(folder) && !tool_is_unknown_kind(folder))
        return tool_fail(t, TOOL_USAGE, "%s: expected the name of a folder, or of the %s in it", t->output,
                         file);
    int code = tool_check_folder(t, folder);
    for (length = strlen(folder); length > 1 && folder[length - 1] == '/';) folder[--length] = 0;
    return code == TOOL_DONE ? things[index].scene(t, folder, triangles, result) : code;
}

static int run_make(tool *t, void *options) {
    const make_options *o = options;
    make_result result = {.files = json_array()};
    int index, code = find_thing(t, t->inputs[0], &index);
    uint32_t triangles = o->triangles ? o->triangles : code == TOOL_DONE ? things[index].triangles : 0;
    if (code == TOOL_DONE && triangles < things[index].least)
        code = tool_fail(t, TOOL_USAGE, "--triangles: %s needs at least %u, found %u", things[index].name,
                         things[index].least, triangles);
    if (code == TOOL_DONE && o->inside && things[index].scene)
        code = tool_fail(t, TOOL_USAGE, "--inside: expected a mesh, found a scene");
    if (code == TOOL_DONE)
        code = things[index].scene ? make_folder(t, index, triangles, &result)
                                   : make_one(t, index, triangles, o->inside, &result);
    if (code != TOOL_DONE) {
        json_decref(result.files);
        return code;
    }
    double seconds = tool_seconds() - t->start;
    tool_say(t, "%s: %llu triangles in %zu file%s, %.2f s", things[index].name,
             (unsigned long long)result.triangles, json_array_size(result.files),
             json_array_size(result.files) == 1 ? "" : "s", seconds);
    return tool_json(t, json_pack("{s:s, s:I, s:o, s:f}", "name", things[index].name, "triangles",
                                  (json_int_t)result.triangles, "files", result.files, "seconds", seconds));
}

int tool_make(int argc, char **argv) {
    static const tool_command command = {
        .name = "make",
        .synopsis = "NAME -o OUT",
        .summary = "make an example scene or mesh",
        .text = "NAME is one of these.\n\n"
                "Scenes, for which OUT is a folder that receives scene.json and its meshes: museum, a hall "
                "with columns, plinths, "
                "lamps and dense statues (default 300000 triangles over all instances, at least 30000, exact "
                "to 2 %); cornell, the "
                "Cornell box (default 1000 triangles).\n\n"
                "Meshes, for which OUT is a mesh file: sphere, box, cylinder, grid, terrain, crate-field "
                "(slender boxes at random "
                "angles), and the statues torso, knot, gyroid, shell, bust and vase.\n\n"
                "The same name, count and --seed make the same bytes.\n\n"
                "JSON keys: name, triangles, files[], seconds.",
        .examples = "  facetree make museum -o museum --triangles 300000\n"
                    "  facetree make sphere -o ball.ply --triangles 5000",
        .options = make_options_table,
        .parse = parse_make,
        .run = run_make,
        .inputs_min = 1,
        .inputs_max = 1,
        .output = TOOL_OUTPUT_REQUIRED,
        .output_folder = true};
    make_options options = {0};
    return tool_main(&command, argc, argv, &options);
}
