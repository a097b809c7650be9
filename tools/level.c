/* tools/level.c: facetree level: one level of a progressive mesh. */
#include "tools/commands.h"

#include <math.h>

#include "tools/kit/command.h"
#include "tools/kit/file.h"
#include "tools/kit/model.h"
#include "tools/kit/options.h"
#include "tools/view.h"

typedef struct level_options {
    uint32_t faces; /* FCT_NONE: not given */
    double ratio;   /* 0: not given */
    double error;   /* negative: not given */
    view_options view;
} level_options;

enum { KEY_FACES = TOOL_KEY, KEY_RATIO, KEY_MAX_ERROR };

static const struct argp_option level_options_table[] = {
    {NULL, 0, NULL, 0, "Level:", 1},
    {"faces", KEY_FACES, "N", 0, "The finest level of at most N faces", 1},
    {"ratio", KEY_RATIO, "R", 0,
     "The finest level of at most R times the faces of the finest one, above 0 and at most 1", 1},
    {"max-error", KEY_MAX_ERROR, "E", 0,
     "The coarsest level without a contraction whose error is above E, in the mesh's unit, as 'facetree "
     "simplify' measures it",
     1},
    VIEW_OPTIONS,
    {0}};

static int count_options(const level_options *o) {
    return (o->faces != FCT_NONE) + (o->ratio > 0) + (o->error >= 0) + (o->view.camera != NULL);
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
            return tool_usage(state,
                              "expected one of --faces, --ratio, --max-error and --view, found several");
        return view_parse(key, text, state, &o->view);
    default:
        return view_parse(key, text, state, &o->view);
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

/* Writes the mesh of the level or of the view. *stats: of the view. */
static fct_result make_level(tool *t, const level_options *o, fct_progressive *progressive, fct_mesh *mesh,
                             fct_view_stats *stats) {
    fct_progressive_info info;
    fct_progressive_inspect(progressive, &info);
    if (!o->view.camera) {
        choose_level(t, o, progressive);
        return fct_progressive_mesh(progressive, mesh);
    }
    fct_result result = fct_progressive_view(progressive, &o->view.view, mesh, stats);
    if (result == FCT_OK && info.most_faces < info.total_faces)
        tool_warn(t, "the file was truncated: pixels are counted from its level of %u faces",
                  info.most_faces);
    return result;
}

/* times: seconds of reading, of the level and of writing. */
static int report_level(tool *t, const level_options *o, const fct_progressive_info *info,
                        const fct_mesh *mesh, const fct_view_stats *stats, const double times[3]) {
    double total = tool_seconds() - t->start;
    if (o->view.camera)
        tool_say(t, "%u of %u faces, about %.3g pixels off, %.2f s", mesh->face_count, info->total_faces,
                 stats->pixels, total);
    else
        tool_say(t, "%u of %u faces, largest error %.3g, %.2f s", mesh->face_count, info->total_faces,
                 info->error, total);
    json_t *json = json_pack(
        "{s:I, s:I, s:I, s:I, s:I, s:I, s:{s:f, s:f, s:f, s:f}, s:I}", "faces", (json_int_t)mesh->face_count,
        "vertices", (json_int_t)mesh->vertex_count, "least_faces", (json_int_t)info->least_faces,
        "most_faces", (json_int_t)info->most_faces, "total_faces", (json_int_t)info->total_faces, "splits",
        (json_int_t)info->split_count, "seconds", "read", times[0], "level", times[1], "write", times[2],
        "total", total, "peak_bytes", (json_int_t)tool_peak_bytes());
    if (json && !o->view.camera) json_object_set_new(json, "max_cost", json_real(info->error));
    if (json && o->view.camera)
        json_object_update_new(json,
                               json_pack("{s:f, s:f, s:I, s:I, s:f, s:f}", "pixels", stats->pixels,
                                         "distance", stats->error, "splits_done", (json_int_t)stats->splits,
                                         "splits_forced", (json_int_t)stats->forced, "seconds_hierarchy",
                                         stats->seconds_hierarchy, "seconds_cut", stats->seconds_cut));
    return tool_json(t, json);
}

static int run_level(tool *t, void *options) {
    const level_options *o = options;
    fct_progressive *progressive;
    fct_progressive_info info;
    fct_view_stats stats;
    fct_mesh mesh = {0};
    double times[3];
    if (count_options(o) == 0)
        return tool_fail(t, TOOL_USAGE, "expected --faces N, --ratio R, --max-error E or --view CAMERA");
    int code = tool_result(t, fct_progressive_load(&t->env, t->inputs[0], &progressive));
    if (code != TOOL_DONE) return code;
    times[0] = tool_seconds() - t->start;
    code = tool_result(t, make_level(t, o, progressive, &mesh, &stats));
    fct_progressive_inspect(progressive, &info);
    times[1] = tool_seconds() - t->start - times[0];
    if (code == TOOL_DONE) code = tool_save_mesh(t, t->output, &mesh, 1);
    times[2] = tool_seconds() - t->start - times[0] - times[1];
    if (code == TOOL_DONE) code = report_level(t, o, &info, &mesh, &stats, times);
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
            "level has the positions and attributes of the contractions, which are not fitted to the input. "
            "If the input has up to about 8,000 faces more than the level, it has the faces of 'facetree "
            "simplify --refit 0'; else other ones with about the same error. The finest level has the faces "
            "of the input. Of a truncated file the coarse levels can be read. --view mixes levels: fine "
            "where the camera sees it, coarse far away, behind and outside of the picture.\n\n"
            "JSON keys: faces, vertices, least_faces and most_faces (of the levels that were read), "
            "total_faces (of the finest level), splits, max_cost (the largest error of a contraction), "
            "seconds{read, level, write, total}, peak_bytes. With --view, instead of max_cost: pixels (the "
            "largest measured distance on the screen; between coarse and fine parts it can be a quarter "
            "larger) and distance (the largest one anywhere) between the mesh and the finest level, "
            "splits_done, splits_forced (needed by others), seconds_hierarchy, seconds_cut.",
        .examples = "  facetree level bunny.fpm --faces 5000 -o small.ply\n"
                    "  facetree level bunny.fpm --ratio .5 -o half.glb\n"
                    "  facetree level bunny.fpm --view 0,.1,.4,0,.1,0 --tolerance 2 -o seen.ply",
        .options = level_options_table,
        .parse = parse_level,
        .run = run_level,
        .stages = stages,
        .inputs_min = 1,
        .inputs_max = 1,
        .output = TOOL_OUTPUT_REQUIRED,
        .endings = TOOL_MESHES};
    level_options options = {.faces = FCT_NONE, .error = -1, .view = view_options_default()};
    return tool_main(&command, argc, argv, &options);
}
