/* tools/meshlets.c: facetree meshlets: meshlets with their bounds, as JSON, as arrays for the GPU, or as a
 * coloured mesh. */
#define _DEFAULT_SOURCE
#include "tools/commands.h"

#include <endian.h>
#include <math.h>
#include <string.h>

#include "tools/kit/command.h"
#include "tools/kit/file.h"
#include "tools/kit/model.h"
#include "tools/kit/options.h"
#include "tools/labels.h"

enum { KEY_VERTICES = TOOL_KEY, KEY_TRIANGLES, KEY_FLATNESS };

static const struct argp_option meshlet_options_table[] = {
    {"vertices", KEY_VERTICES, "N", 0, "At most N vertices per meshlet, 3 to 256 (default 64)", 0},
    {"triangles", KEY_TRIANGLES, "M", 0, "At most M triangles per meshlet, 1 to 512 (default 124)", 0},
    {"flatness", KEY_FLATNESS, "W", 0,
     "Weight of similar normals against short distances (default 1). A larger weight makes narrower cones "
     "and a few "
     "more meshlets",
     0},
    {0}};

static error_t parse_meshlets(int key, char *text, struct argp_state *state) {
    fct_meshlet_def *def = state->input;
    switch (key) {
    case KEY_VERTICES:
        return tool_parse_count32(state, "--vertices", text, 3, 256, &def->max_vertices);
    case KEY_TRIANGLES:
        return tool_parse_count32(state, "--triangles", text, 1, 512, &def->max_triangles);
    case KEY_FLATNESS:
        return tool_parse_real(state, "--flatness", text, 0, 1e6, &def->flatness);
    default:
        return key == ARGP_KEY_SUCCESS ? 0 : ARGP_ERR_UNKNOWN;
    }
}

/* --- Arrays --- */

/* 32-bit words in little-endian order. */
static void write_words(FILE *stream, const void *words, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        uint32_t word;
        memcpy(&word, (const char *)words + 4 * i, sizeof word);
        word = htole32(word);
        fwrite(&word, sizeof word, 1, stream);
    }
}

static int write_binary(tool *t, const fct_meshlets *m, const fct_meshlet_def *def, fct_tree_view view) {
    _Static_assert(sizeof(fct_meshlet) == 16 && sizeof(fct_meshlet_bounds) == 128,
                   "as docs/clustering.md says");
    uint32_t header[14] = {1,
                           m->count,
                           m->vertex_count,
                           m->triangle_bytes,
                           view.face_count,
                           view.vertex_count,
                           def->max_vertices,
                           def->max_triangles};
    memcpy(header + 8, view.origin, sizeof view.origin);
    tool_writer writer;
    int code = tool_writer_open(t, t->output, &writer);
    if (code != TOOL_DONE) return code;
    fwrite("FCTMLETS", 8, 1, writer.stream);
    write_words(writer.stream, header, sizeof header / sizeof *header);
    write_words(writer.stream, m->meshlets, 4 * (size_t)m->count);
    write_words(writer.stream, m->bounds, 32 * (size_t)m->count);
    write_words(writer.stream, m->first_face, (size_t)m->count + 1);
    write_words(writer.stream, m->vertices, m->vertex_count);
    fwrite(m->triangles, 1, m->triangle_bytes, writer.stream);
    write_words(writer.stream, m->faces, view.face_count);
    return tool_writer_close(t, &writer, TOOL_DONE);
}

static void write_numbers(FILE *stream, const char *name, const float *values, int count) {
    fprintf(stream, "\"%s\":[", name);
    for (int i = 0; i < count; ++i) fprintf(stream, "%s%.9g", i ? "," : "", (double)values[i]);
    fputs("],", stream);
}

/* One line per meshlet. */
static int write_meshlets_json(tool *t, const fct_meshlets *m, const double origin[3]) {
    tool_writer writer;
    int code = tool_writer_open(t, t->output, &writer);
    if (code != TOOL_DONE) return code;
    FILE *f = writer.stream;
    fprintf(f, "{\"count\":%u,", m->count);
    if (origin[0] != 0 || origin[1] != 0 || origin[2] != 0)
        fprintf(f, "\"origin\":[%.17g,%.17g,%.17g],", origin[0], origin[1], origin[2]);
    fputs("\"meshlets\":[", f);
    for (uint32_t i = 0; i < m->count; ++i) {
        const fct_meshlet *x = &m->meshlets[i];
        const fct_meshlet_bounds *b = &m->bounds[i];
        fputs(i ? ",\n{" : "\n{", f);
        write_numbers(f, "center", b->center, 3);
        fprintf(f, "\"radius\":%.9g,", (double)b->radius);
        write_numbers(f, "cone_apex", b->cone_apex, 3);
        write_numbers(f, "cone_axis", b->cone_axis, 3);
        fprintf(f, "\"cone_cutoff\":%.9g,", (double)b->cone_cutoff);
        write_numbers(f, "lower", b->bounds.lower, 3);
        write_numbers(f, "upper", b->bounds.upper, 3);
        write_numbers(f, "box_center", b->box.center, 3);
        write_numbers(f, "box_axes", b->box.axes[0], 9);
        write_numbers(f, "box_half_extents", b->box.half, 3);
        fputs("\"vertices\":[", f);
        for (uint32_t v = 0; v < x->vertex_count; ++v)
            fprintf(f, "%s%u", v ? "," : "", m->vertices[x->vertex_offset + v]);
        fputs("],\"triangles\":[", f);
        for (uint32_t k = 0; k < 3 * x->triangle_count; ++k)
            fprintf(f, "%s%u", k ? "," : "", m->triangles[x->triangle_offset + k]);
        fputs("],\"faces\":[", f);
        for (uint32_t k = m->first_face[i]; k < m->first_face[i + 1]; ++k)
            fprintf(f, "%s%u", k > m->first_face[i] ? "," : "", m->faces[k]);
        fputs("]}", f);
    }
    fputs("\n]}\n", f);
    return tool_writer_close(t, &writer, TOOL_DONE);
}

static int write_colors(tool *t, const fct_tree *tree, const fct_meshlets *m) {
    uint32_t *labels = tool_allocate(t, fct_tree_get(tree).face_count, sizeof *labels);
    if (!labels) return TOOL_MEMORY;
    for (uint32_t i = 0; i < m->count; ++i)
        for (uint32_t k = m->first_face[i]; k < m->first_face[i + 1]; ++k) labels[m->faces[k]] = i;
    int code = tool_save_labels(t, t->output, tree, labels, m->count);
    tool_release(t, labels);
    return code;
}

/* --- Report --- */

/* The share of triangles that the cones cull, as a mean over all directions of a distant eye. A cone with the
 * cutoff c culls for the share (1 - c) / 2 of directions. */
static double measure_culled_share(const fct_meshlets *m, uint32_t faces) {
    double culled = 0;
    for (uint32_t i = 0; i < m->count; ++i)
        culled += m->meshlets[i].triangle_count * 0.5 * (1 - fmin((double)m->bounds[i].cone_cutoff, 1));
    return culled / faces;
}

static int report_meshlets(tool *t, const fct_tree *tree, const fct_meshlet_def *def, const fct_meshlets *m,
                           double seconds) {
    fct_tree_view view = fct_tree_get(tree);
    double vertices = (double)m->vertex_count / m->count, triangles = (double)view.face_count / m->count;
    double radius = 0;
    uint32_t without = 0;
    for (uint32_t i = 0; i < m->count; ++i) {
        radius += (double)m->bounds[i].radius / m->count;
        without += !(m->bounds[i].cone_cutoff < 1);
    }
    double share = measure_culled_share(m, view.face_count);
    tool_say(t,
             "%u meshlets with %.1f vertices (%.0f%%) and %.1f triangles (%.0f%%) on average; %u without a "
             "cone; cones cull "
             "%.1f%% of triangles for a distant eye",
             m->count, vertices, 100 * vertices / def->max_vertices, triangles,
             100 * triangles / def->max_triangles, without, 100 * share);
    return tool_json(t, json_pack("{s:I, s:I, s:I, s:f, s:f, s:f, s:f, s:f, s:I, s:f, s:{s:f}}", "meshlets",
                                  (json_int_t)m->count, "faces", (json_int_t)view.face_count, "vertices",
                                  (json_int_t)m->vertex_count, "mean_vertices", vertices, "mean_triangles",
                                  triangles, "vertex_fill", vertices / def->max_vertices, "triangle_fill",
                                  triangles / def->max_triangles, "mean_radius", radius, "without_cone",
                                  (json_int_t)without, "culled", share, "seconds", "meshlets", seconds));
}

static int run_meshlets(tool *t, void *options) {
    const fct_meshlet_def *def = options;
    bool binary = tool_ends(t->output, "bin"), json = !binary && !tool_is_mesh_name(t->output);
    fct_tree *tree;
    fct_meshlets meshlets = {0};
    int code = tool_open_tree(t, t->inputs[0], NULL, &tree);
    if (code != TOOL_DONE) return code;
    tool_warn_inward(t, t->inputs[0], fct_tree_get(tree).inward);
    double start = tool_seconds();
    code = tool_result(t, fct_tree_meshlets(&t->env, tree, def, &meshlets));
    double seconds = tool_seconds() - start;
    if (code == TOOL_DONE && binary)
        code = write_binary(t, &meshlets, def, fct_tree_get(tree));
    else if (code == TOOL_DONE)
        code = json ? write_meshlets_json(t, &meshlets, fct_tree_get(tree).origin)
                    : write_colors(t, tree, &meshlets);
    if (code == TOOL_DONE) code = report_meshlets(t, tree, def, &meshlets, seconds);
    fct_meshlets_release(&t->env, &meshlets);
    fct_tree_destroy(tree);
    return code;
}

int tool_meshlets(int argc, char **argv) {
    static const tool_stage stages[] = {TOOL_TREE_STAGES, {"meshlets", 3}, {"sides", 6}, {"growing", 20},
                                        {"packing", 8},   {"bounds", 10},  {"write", 3}, {0}};
    static const tool_command command = {
        .name = "meshlets",
        .synopsis = "IN -o OUT",
        .summary = "cut a mesh into meshlets for mesh shaders",
        .text =
            "IN is a mesh or a hierarchy file (.fct). OUT is JSON (.json, or -), the arrays that a mesh "
            "shader reads (.bin; see "
            "docs/clustering.md), or the mesh with a colour per meshlet (.ply, .off, .obj, .glb, .om).\n\n"
            "Every triangle is in one meshlet, and a meshlet has one material. The sphere and the boxes "
            "contain its vertices. "
            "An eye E sees only back faces if dot(normalize(cone_apex - E), cone_axis) >= cone_cutoff. A "
            "meshlet without a cone "
            "has the axis 0 and the cutoff 1.\n\n"
            "OUT.json: count, meshlets[]{center, radius, cone_apex, cone_axis, cone_cutoff, lower, upper, "
            "box_center, box_axes "
            "(three unit vectors in a row), box_half_extents, vertices (of the input; one per position, "
            "unless "
            "--no-weld is given), triangles (three "
            "positions in `vertices` "
            "each), faces (of the input)}.\n\n"
            "JSON keys: meshlets, faces, vertices (over all meshlets), mean_vertices, mean_triangles, "
            "vertex_fill, triangle_fill "
            "(shares of the limits), mean_radius, without_cone, culled (share of triangles that cones cull, "
            "mean over all "
            "directions), seconds{meshlets}.",
        .examples = "  facetree meshlets bunny.fct -o bunny.json\n"
                    "  facetree meshlets bunny.obj -o colours.ply --vertices 96",
        .options = meshlet_options_table,
        .parse = parse_meshlets,
        .run = run_meshlets,
        .stages = stages,
        .builds_tree = true,
        .inputs_min = 1,
        .inputs_max = 1,
        .output = TOOL_OUTPUT_REQUIRED,
        .endings = "json bin " TOOL_COLOR_MESHES};
    fct_meshlet_def def = fct_meshlet_def_default();
    return tool_main(&command, argc, argv, &def);
}
