/* tools/convert.c: facetree convert: a mesh in another format. */
#include "tools/commands.h"

#include <string.h>

#include "tools/kit/command.h"
#include "tools/kit/file.h"
#include "tools/kit/model.h"

enum { KEY_ASCII = TOOL_KEY };

static const struct argp_option convert_options_table[] = {
    {"ascii", KEY_ASCII, NULL, 0, "Write text where the format has text and binary files (PLY, STL)", 0},
    {0}};

static error_t parse_convert(int key, char *text, struct argp_state *state) {
    (void)text;
    if (key != KEY_ASCII) return ARGP_ERR_UNKNOWN;
    ((fct_mesh_save_def *)state->input)->ascii = true;
    return 0;
}

static int run_convert(tool *t, void *options) {
    fct_mesh mesh;
    int code = tool_load_mesh(t, t->inputs[0], &mesh);
    if (code != TOOL_DONE) return code;
    double read = tool_seconds() - t->start;
    code = tool_save_mesh_as(t, t->output, &mesh, options);
    double total = tool_seconds() - t->start;
    if (code == TOOL_DONE) {
        tool_say(t, "%s: %u vertices, %u faces, %.2f s", t->output, mesh.vertex_count, mesh.face_count,
                 total);
        code = tool_json(t, json_pack("{s:I, s:I, s:{s:f, s:f, s:f}, s:I}", "vertices",
                                      (json_int_t)mesh.vertex_count, "faces", (json_int_t)mesh.face_count,
                                      "seconds", "read", read, "write", total - read, "total", total,
                                      "peak_bytes", (json_int_t)tool_peak_bytes()));
    }
    fct_mesh_release(&t->env, &mesh);
    return code;
}

int tool_convert(int argc, char **argv) {
    static const tool_stage stages[] = {{"read", 60}, {"write", 40}, {0}};
    static const tool_command command = {
        .name = "convert",
        .synopsis = "IN -o OUT",
        .summary = "write a mesh in another format",
        .text = "IN is a mesh or a hierarchy file (.fct), OUT is a mesh. The endings of the names choose the "
                "formats. A message names what the format of OUT cannot store.\n\n"
                "JSON keys: vertices, faces, seconds{read, write, total}, peak_bytes.",
        .examples = "  facetree convert bunny.obj -o bunny.ply\n"
                    "  facetree convert bunny.fct -o bunny.glb\n"
                    "  facetree convert bunny.obj -o - | facetree info -",
        .options = convert_options_table,
        .parse = parse_convert,
        .run = run_convert,
        .stages = stages,
        .turns_bodies = true,
        .inputs_min = 1,
        .inputs_max = 1,
        .output = TOOL_OUTPUT_REQUIRED,
        .endings = TOOL_MESHES};
    fct_mesh_save_def def = fct_mesh_save_def_default();
    return tool_main(&command, argc, argv, &def);
}
