/* tools/level.c: facetree level: one level of a progressive mesh. */
#include "tools/commands.h"

#include <math.h>

#include "tools/kit/command.h"
#include "tools/kit/file.h"
#include "tools/kit/model.h"
#include "tools/kit/options.h"

typedef struct level_options {
    uint32_t faces; /* FCT_NONE: not given */
    double ratio;   /* 0: not given */
    double error;   /* negative: not given */
} level_options;

enum { KEY_FACES = TOOL_KEY, KEY_RATIO, KEY_MAX_ERROR };

static const struct argp_option level_options_table[] = {
    {"faces", KEY_FACES, "N", 0, "The finest level of at most N faces", 0},
    {"ratio", KEY_RATIO, "R", 0,
     "The finest level of at most R times the faces of the finest one, above 0 and at most 1", 0},
    {"max-error", KEY_MAX_ERROR, "E", 0,
     "The coarsest level without a contraction whose error is above E, in the mesh's unit, as "
     "'facetree simplify' measures it",
     0},
    {0}};

static int count_options(const level_options *o) {
    return (o->faces != FCT_NONE) + (o->ratio > 0) + (o->error >= 0);
}

static error_t parse_level(int key, char *text, struct argp_state *state) {
    level_options *o = state->input;
    switch (key) {
    case KEY_FACES:
        return tool_parse_count32(state, "--faces", text, 0, FCT_NONE - 1, &o->faces);
    case KEY_RATIO:
        return tool_parse_ratio(state, "--ratio", text, &o->ratio);
    case KEY_MAX_ERROR:
        return tool_parse_real(state, "--max-error", text, 0, INFINITY, &o->error);
    case ARGP_KEY_END:
        if (count_options(o) > 1)
            return tool_usage(state, "expected one of --faces, --ratio and --max-error, found several");
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* Goes to the level that the options choose, and warns if the file has no such level. */
static void choose_level(tool *t, const level_options *o, fct_progressive *progressive) {
    fct_progressive_info info;
    fct_progressive_inspect(progressive, &info);
    if (o->error >= 0) {
        fct_progressive_go_error(progressive, o->error);
        fct_progressive_inspect(progressive, &info);
        if (info.error > o->error)
            tool_warn(t, "the finest level has an error of %.3g, %.3g was asked for", info.error, o->error);
        return;
    }
    uint32_t wanted = o->ratio > 0 ? (uint32_t)llround(o->ratio * info.total_faces) : o->faces;
    uint32_t found = fct_progressive_go(progressive, wanted);
    if (found > wanted) tool_warn(t, "the coarsest level has %u faces, %u were asked for", found, wanted);
    if (wanted > info.most_faces && info.most_faces < info.total_faces)
        tool_warn(t, "the file was truncated: the finest level has %u faces, %u were asked for", found,
                  wanted);
}

static int run_level(tool *t, void *options) {
    fct_progressive *progressive;
    fct_progressive_info info;
    fct_mesh mesh = {0};
    if (count_options(options) == 0)
        return tool_fail(t, TOOL_USAGE, "expected --faces N, --ratio R or --max-error E");
    int code = tool_result(t, fct_progressive_load(&t->env, t->inputs[0], &progressive));
    if (code != TOOL_DONE) return code;
    double read = tool_seconds() - t->start;
    choose_level(t, options, progressive);
    fct_progressive_inspect(progressive, &info);
    code = tool_result(t, fct_progressive_mesh(progressive, &mesh));
    double found = tool_seconds() - t->start;
    if (code == TOOL_DONE) code = tool_save_mesh(t, t->output, &mesh, 1);
    if (code == TOOL_DONE) {
        double total = tool_seconds() - t->start;
        tool_say(t, "%u of %u faces, largest error %.3g, %.2f s", mesh.face_count, info.total_faces,
                 info.error, total);
        code = tool_json(t, json_pack("{s:I, s:I, s:I, s:I, s:I, s:I, s:f, s:{s:f, s:f, s:f, s:f}, s:I}",
                                      "faces", (json_int_t)mesh.face_count, "vertices",
                                      (json_int_t)mesh.vertex_count, "least_faces",
                                      (json_int_t)info.least_faces, "most_faces", (json_int_t)info.most_faces,
                                      "total_faces", (json_int_t)info.total_faces, "splits",
                                      (json_int_t)info.split_count, "max_cost", info.error, "seconds", "read",
                                      read, "level", found - read, "write", total - found, "total", total,
                                      "peak_bytes", (json_int_t)tool_peak_bytes()));
    }
    fct_mesh_release(&t->env, &mesh);
    fct_progressive_destroy(progressive);
    return code;
}

int tool_level(int argc, char **argv) {
    static const tool_stage stages[] = {{"read", 70}, {"write", 30}, {0}};
    static const tool_command command = {
        .name = "level",
        .synopsis = "IN.fpm -o OUT",
        .summary = "write a level of a progressive mesh",
        .text =
            "IN is a progressive mesh, which 'facetree simplify --progressive' writes; OUT is a mesh. A "
            "level "
            "has the positions and attributes of the contractions, which are not fitted to the input. If the "
            "input has up to about 8,000 faces more than the level, it has the faces of 'facetree simplify "
            "--refit 0'; else other ones with about the same error. The finest level has the faces of the "
            "input. Of a truncated file the coarse levels can be read.\n\n"
            "JSON keys: faces, vertices, least_faces and most_faces (of the levels that were read), "
            "total_faces (of the finest level), splits, max_cost (the largest error of a contraction), "
            "seconds{read, level, write, total}, peak_bytes.",
        .examples = "  facetree level bunny.fpm --faces 5000 -o small.ply\n"
                    "  facetree level bunny.fpm --ratio .5 -o half.glb",
        .options = level_options_table,
        .parse = parse_level,
        .run = run_level,
        .stages = stages,
        .inputs_min = 1,
        .inputs_max = 1,
        .output = TOOL_OUTPUT_REQUIRED,
        .endings = TOOL_MESHES};
    level_options options = {.faces = FCT_NONE, .error = -1};
    return tool_main(&command, argc, argv, &options);
}
