/* tools/compare.c: facetree compare: the distance between two surfaces, and between their colours. */
#include "tools/commands.h"

#include <string.h>

#include "tools/kit/command.h"
#include "tools/kit/model.h"
#include "tools/kit/options.h"

enum { KEY_SAMPLES = TOOL_KEY, KEY_BUDGET, KEY_HAUSDORFF };

typedef struct compare_options {
    uint32_t samples; /* per face; UINT32_MAX: from the budget */
    uint64_t budget;  /* samples over all faces */
    bool hausdorff;
} compare_options;

enum { USUAL_SAMPLES = 100 }; /* per face, as in Garland's dissertation */

static const struct argp_option compare_options_table[] = {
    {"samples", KEY_SAMPLES, "N", 0,
     "Random samples per face, in addition to the vertices (default: 100, or fewer to keep the budget)", 0},
    {"budget", KEY_BUDGET, "N", 0,
     "Without --samples: at most N random samples over both meshes, but at least one per face (default "
     "4000000)",
     0},
    {"hausdorff", KEY_HAUSDORFF, NULL, 0,
     "Also find the largest distance of any point, within 1 % and 1e-4 of the diameter", 0},
    {0}};

/* Tolerances of the Hausdorff distance, of itself and of the diameter. */
#define HAUSDORFF_RELATIVE .01
#define HAUSDORFF_ABSOLUTE 1e-4

static error_t parse_compare(int key, char *text, struct argp_state *state) {
    compare_options *o = state->input;
    if (key == KEY_SAMPLES) return tool_parse_count32(state, "--samples", text, 0, 1000000, &o->samples);
    if (key == KEY_BUDGET) return tool_parse_count(state, "--budget", text, 1, UINT64_MAX, &o->budget);
    if (key == KEY_HAUSDORFF) return o->hausdorff = true, 0;
    return ARGP_ERR_UNKNOWN;
}

static uint32_t choose_samples(const compare_options *o, const fct_tree *a, const fct_tree *b) {
    uint64_t faces = (uint64_t)fct_tree_get(a).face_count + fct_tree_get(b).face_count;
    uint64_t each = o->budget / (faces ? faces : 1);
    if (o->samples != UINT32_MAX) return o->samples;
    return each < 1 ? 1 : each < USUAL_SAMPLES ? (uint32_t)each : USUAL_SAMPLES;
}

static json_t *report_error(const fct_mesh_error *e, uint32_t samples, double seconds) {
    double d = e->diameter > 0 ? e->diameter : 1;
    return json_pack("{s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:I, s:I, s:f}", "e_avg",
                     e->e_avg, "e_max", e->e_max, "e_avg_ab", e->e_avg_ab, "e_avg_ba", e->e_avg_ba,
                     "e_max_ab", e->e_max_ab, "e_max_ba", e->e_max_ba, "e_avg_relative", e->e_avg / (d * d),
                     "e_max_relative", e->e_max / d, "diameter", e->diameter, "color_rms", e->color_rms,
                     "color_max", e->color_max, "color_rms_relative", e->color_rms_relative, "samples",
                     (json_int_t)e->samples, "samples_per_face", (json_int_t)samples, "seconds", seconds);
}

static json_t *report_hausdorff(const fct_hausdorff *h) {
    return json_pack("{s:f, s:f, s:f, s:[f,f,f], s:[f,f,f], s:I, s:I}", "hausdorff", h->distance,
                     "hausdorff_ab", h->distance_ab, "hausdorff_ba", h->distance_ba, "farthest_a",
                     h->point_a[0], h->point_a[1], h->point_a[2], "farthest_b", h->point_b[0], h->point_b[1],
                     h->point_b[2], "farthest_face_a", (json_int_t)h->face_a, "farthest_face_b",
                     (json_int_t)h->face_b);
}

/* Builds the second tree again, relative to the origin of the first, if their origins differ. */
static int share_origin(tool *t, fct_tree *trees[2]) {
    fct_tree_view a = fct_tree_get(trees[0]), b = fct_tree_get(trees[1]);
    if (!memcmp(a.origin, b.origin, sizeof a.origin)) return TOOL_DONE;
    fct_mesh mesh;
    fct_tree_def def = fct_tree_def_default();
    def.weld = b.def.weld;
    int code = tool_result(t, fct_tree_mesh(&t->env, trees[1], &mesh));
    if (code != TOOL_DONE) return code;
    for (size_t i = 0; i < 3 * (size_t)mesh.vertex_count; ++i)
        mesh.positions[i] = (float)(b.origin[i % 3] - a.origin[i % 3] + (double)mesh.positions[i]);
    memcpy(mesh.origin, a.origin, sizeof mesh.origin);
    fct_tree_destroy(trees[1]);
    trees[1] = NULL;
    code = tool_result(t, fct_tree_build(&t->env, &mesh, &def, NULL, &trees[1]));
    fct_mesh_release(&t->env, &mesh);
    return code;
}

static int run_compare(tool *t, void *options) {
    uint32_t samples = 0;
    fct_tree *trees[2] = {NULL, NULL};
    fct_bvh *bvhs[2] = {NULL, NULL};
    fct_mesh_error error;
    fct_hausdorff hausdorff;
    int code = TOOL_DONE;
    for (int i = 0; i < 2 && code == TOOL_DONE; ++i) code = tool_open_tree(t, t->inputs[i], NULL, &trees[i]);
    if (code == TOOL_DONE) code = share_origin(t, trees);
    for (int i = 0; i < 2 && code == TOOL_DONE; ++i)
        code = tool_result(t, fct_bvh_create(&t->env, trees[i], FCT_BACKEND_OBB, &bvhs[i]));
    double start = tool_seconds();
    if (code == TOOL_DONE) {
        samples = choose_samples(options, trees[0], trees[1]);
        code = tool_result(t, fct_mesh_compare(&t->env, bvhs[0], bvhs[1], samples, t->seed, &error));
    }
    const compare_options *o = options;
    if (code == TOOL_DONE && o->hausdorff)
        code = tool_result(t, fct_mesh_hausdorff(&t->env, bvhs[0], bvhs[1], HAUSDORFF_RELATIVE,
                                                 HAUSDORFF_ABSOLUTE * error.diameter, &hausdorff));
    if (code == TOOL_DONE) {
        json_t *report = report_error(&error, samples, tool_seconds() - start);
        if (o->hausdorff && json_object_update_new(report, report_hausdorff(&hausdorff)) != 0) {
            json_decref(report);
            report = NULL;
        }
        code = tool_print(t, report);
    }
    for (int i = 0; i < 2; ++i) {
        fct_bvh_destroy(bvhs[i]);
        fct_tree_destroy(trees[i]);
    }
    return code;
}

int tool_compare(int argc, char **argv) {
    static const tool_stage stages[] = {
        TOOL_TREE_STAGES, TOOL_TREE_STAGES, {"ray structure", 80}, {"comparing", 250}, {0}};
    static const tool_command command = {
        .name = "compare",
        .synopsis = "A B",
        .summary = "measure the distance between two meshes",
        .text = "Measures the distance from every vertex and from N random "
                "points per face of each mesh to the other mesh.\n\n"
                "e_avg is the mean squared distance and e_max the largest "
                "distance, of both directions; _ab is from A to B, _ba from "
                "B to A. Lengths are in the mesh's unit. e_avg_relative is "
                "e_avg divided by the squared diameter, e_max_relative is "
                "e_max divided by the diameter, where the diameter is the "
                "diagonal of A's bounds. Colours are compared if both "
                "meshes have them on their vertices. --hausdorff adds the "
                "largest distance of all points, not only of samples, with "
                "the points and faces where it is.\n\n"
                "JSON keys: e_avg, e_max, e_avg_ab, e_avg_ba, e_max_ab, "
                "e_max_ba, e_avg_relative, e_max_relative, diameter, "
                "color_rms, color_max, color_rms_relative, samples, "
                "samples_per_face, seconds; with --hausdorff: hausdorff, "
                "hausdorff_ab, hausdorff_ba, farthest_a, farthest_b, "
                "farthest_face_a, farthest_face_b.",
        .examples = "  facetree compare bunny.obj bunny-small.ply\n"
                    "  facetree compare bunny.obj bunny-small.ply --samples 100 --json",
        .options = compare_options_table,
        .parse = parse_compare,
        .run = run_compare,
        .stages = stages,
        .builds_tree = true,
        .inputs_min = 2,
        .inputs_max = 2,
        .output = TOOL_OUTPUT_UNUSED};
    compare_options options = {.samples = UINT32_MAX, .budget = 4000000};
    return tool_main(&command, argc, argv, &options);
}
