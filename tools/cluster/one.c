/* tools/cluster/one.c: clusters one file, in memory or in parts. */
#include "tools/cluster/one.h"

#include <string.h>
#include <sys/stat.h>

#include "tools/kit/file.h"
#include "tools/kit/model.h"

static json_t *describe_build(const fct_large_stats *s, double total, const char *output) {
    struct stat status;
    bool regular = strcmp(output, "-") != 0 && stat(output, &status) == 0 && S_ISREG(status.st_mode);
    return json_pack("{s:I, s:I, s:I, s:I, s:f, s:I, s:{s:f, s:f, s:f, s:f, s:f, s:f}, s:I, s:I}", "faces",
                     (json_int_t)s->face_count, "vertices", (json_int_t)s->vertex_count, "roots",
                     (json_int_t)s->root_count, "depth", (json_int_t)s->depth, "mean_depth", s->mean_depth,
                     "parts", (json_int_t)s->part_count, "seconds", "read", s->seconds_read, "dual",
                     s->seconds_dual, "contract", s->seconds_contract, "boxes", s->seconds_boxes, "write",
                     s->seconds_write, "total", total, "peak_bytes", (json_int_t)tool_peak_bytes(),
                     "file_bytes", (json_int_t)(regular ? status.st_size : 0));
}

static int check_faces(tool *t, const fct_tree_def *def, const char *input, uint32_t faces) {
    if (faces == 0) return tool_fail(t, TOOL_DATA, "%s: expected at least one face, found none", input);
    if (def->root_count > faces)
        return tool_fail(t, TOOL_USAGE, "--roots %u: %s has only %u faces", def->root_count, input, faces);
    return TOOL_DONE;
}

/* Bytes that --max-memory still allows. */
static size_t find_memory_left(const tool *t) {
    if (!t->max_memory) return SIZE_MAX;
    return t->max_memory > t->memory_now ? t->max_memory - t->memory_now : 0;
}

static bool fits_memory(const tool *t, const fct_tree_def *def, uint32_t faces, uint32_t vertices) {
    return fct_tree_build_need(faces, vertices, def).in_memory <= find_memory_left(t);
}

/* Builds the whole tree in memory. If it does not fit, sets *large and returns TOOL_DONE. */
static int cluster_in_memory(tool *t, const fct_tree_def *def, const char *input, const char *output,
                             bool *large, fct_large_stats *s) {
    fct_mesh mesh = {0};
    fct_tree *tree = NULL;
    fct_tree_stats stats = {0};
    double start = tool_seconds();
    int code = tool_load_mesh(t, input, &mesh);
    if (code == TOOL_DONE) code = check_faces(t, def, input, mesh.face_count);
    if (code != TOOL_DONE) goto done;
    *large =
        !tool_is_stream(input) && !fits_memory(t, def, mesh.face_count, 0); /* the mesh is loaded already */
    if (*large) goto done;
    if (mesh.face_colors)
        tool_warn(t, "%s: face colours are left out, because a hierarchy file has no place for them", input);
    t->bar.items = mesh.face_count;
    t->bar.unit = "faces";
    double read = tool_seconds();
    code = tool_result(t, fct_tree_build(&t->env, &mesh, def, &stats, &tree));
    *large = code == TOOL_MEMORY && t->max_memory && !tool_is_stream(input);
    if (*large) { /* the build needed more than the estimate */
        t->error[0] = 0, t->memory_refused = false;
        code = TOOL_DONE;
        goto done;
    }
    if (tool_context(t, code, input) != TOOL_DONE) goto done;
    double built = tool_seconds();
    code = tool_refuse_input(t, output);
    if (code == TOOL_DONE) code = tool_check_inputs(t);
    if (code == TOOL_DONE) code = tool_result(t, fct_tree_save(&t->env, tree, output));
    fct_tree_view view = fct_tree_get(tree);
    *s = (fct_large_stats){.face_count = view.face_count,
                           .vertex_count = view.vertex_count,
                           .root_count = view.root_count,
                           .depth = view.depth,
                           .mean_depth = view.mean_depth,
                           .part_count = 1,
                           .top_count = view.root_count,
                           .seconds_read = read - start,
                           .seconds_dual = stats.seconds_dual,
                           .seconds_contract = stats.seconds_contract,
                           .seconds_boxes = stats.seconds_boxes,
                           .seconds_write = tool_seconds() - built,
                           .inward = view.inward};
done:
    fct_tree_destroy(tree);
    fct_mesh_release(&t->env, &mesh);
    return code;
}

int tool_cluster_file(tool *t, const cluster_options *options, const char *input, const char *output,
                      json_t **out) {
    fct_tree_def def = options->def;
    def.weld = !t->no_weld;
    fct_large_stats stats = {0};
    double start = tool_seconds();
    bool standard = strcmp(input, "-") == 0, once = tool_is_stream(input), known = false, large = false;
    uint32_t faces = 0, vertices = 0;
    int code = once ? TOOL_DONE : tool_hash_file(t, input, &def.source_hash);
    if (code == TOOL_DONE && t->max_memory && !once && tool_ends(input, "ply"))
        code = tool_result(t, fct_mesh_file_counts(&t->env, input, &known, &faces, &vertices));
    if (code == TOOL_DONE && known) code = check_faces(t, &def, input, faces);
    if (code != TOOL_DONE) return code;
    const char *slash = strrchr(input, '/');
    def.source = standard ? "standard input" : slash ? slash + 1 : input;
    double hashed = tool_seconds() - start;
    large = known && !fits_memory(t, &def, faces, vertices);
    if (!large) code = cluster_in_memory(t, &def, input, output, &large, &stats);
    if (large && t->flip_inward)
        return tool_fail(t, TOOL_MEMORY, "%s: --flip-inward needs the whole mesh in memory", input);
    if (large) {
        fct_large_def limits = fct_large_def_default();
        limits.max_memory = find_memory_left(t);
        uint64_t least = known ? fct_tree_build_need(faces, vertices, &def).in_parts : 0;
        if (limits.max_memory < least)
            return tool_fail(
                t, TOOL_MEMORY, "%s: --max-memory %zu: a tree of %u faces needs at least %llu bytes", input,
                t->max_memory, faces, (unsigned long long)(least + (t->max_memory - limits.max_memory)));
        limits.temporary_folder = options->temporary;
        static const tool_stage stages[] = {{"read|weld", 3},
                                            {"cut", 10},
                                            {"parts|dual graph|clusters", 60},
                                            {"boxes of joins", 3},
                                            {"order", 7},
                                            {"write", 18},
                                            {0}};
        tool_progress_start(&t->bar, stages, t->bar.shown, tool_seconds());
        t->bar.items = faces;
        t->bar.unit = "faces";
        code = tool_refuse_input(t, output);
        if (code == TOOL_DONE)
            code = tool_result(t, fct_tree_build_file(&t->env, input, output, &def, &limits, &stats));
        tool_context(t, code, input);
    }
    stats.seconds_read += hashed;
    t->wrote |= code == TOOL_DONE;
    if (code == TOOL_DONE) tool_warn_inward(t, input, stats.inward);
    if (code == TOOL_DONE) *out = describe_build(&stats, tool_seconds() - start, output);
    return code;
}

double tool_cluster_number(const json_t *object, const char *key) {
    return json_number_value(json_object_get(object, key));
}

void tool_cluster_say(tool *t, const char *input, const json_t *r) {
    tool_say(t, "%s: %.0f faces, %.0f root%s, depth %.0f (mean %.1f), %.2f s, %.1f MB", input,
             tool_cluster_number(r, "faces"), tool_cluster_number(r, "roots"),
             tool_cluster_number(r, "roots") == 1 ? "" : "s", tool_cluster_number(r, "depth"),
             tool_cluster_number(r, "mean_depth"),
             tool_cluster_number(json_object_get(r, "seconds"), "total"),
             tool_cluster_number(r, "file_bytes") / 1e6);
}
