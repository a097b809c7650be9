/* tools/closest.c: facetree closest: the nearest surface point for each point of a text file, and
 * on which side of the surface the point lies. */
#include "tools/commands.h"

#include <math.h>
#include <string.h>

#include "tools/kit/chunks.h"
#include "tools/kit/command.h"
#include "tools/kit/file.h"
#include "tools/kit/model.h"
#include "tools/kit/options.h"
#include "tools/kit/rows.h"

typedef struct closest_options {
    const char *points;
    double max_distance;
    bool with_sign;
} closest_options;

enum { KEY_POINTS = TOOL_KEY, KEY_MAX_DISTANCE, KEY_SIGNED };

static const struct argp_option closest_options_table[] = {
    {"points", KEY_POINTS, "FILE", 0, "Points, one per line: x y z; - is standard input", 0},
    {"max-distance", KEY_MAX_DISTANCE, "D", 0,
     "Search only within D, in the mesh's unit (default: no limit); the answer is -1 if nothing is that near",
     0},
    {"signed", KEY_SIGNED, 0, 0,
     "Distances are negative inside the surface: where its winding number is above .5 or below -.5. Not for "
     "scenes",
     0},
    {0}};

static error_t parse_closest(int key, char *text, struct argp_state *state) {
    closest_options *o = state->input;
    switch (key) {
    case KEY_POINTS:
        o->points = text;
        return 0;
    case KEY_MAX_DISTANCE:
        return tool_parse_real(state, "--max-distance", text, 0, INFINITY, &o->max_distance);
    case KEY_SIGNED:
        o->with_sign = true;
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* The answers, and what turns them into the user's coordinates. */
typedef struct answers {
    fct_closest *found;
    uint32_t *instances; /* of a scene, else NULL */
    double origin[3];    /* of the mesh or scene */
} answers;

/* Points relative to an origin need more digits than a float. */
static void print_closest(FILE *stream, const fct_closest *c, const double origin[3]) {
    fprintf(stream, "%u", c->face);
    for (int k = 0; k < 3; ++k) {
        if (origin[k] != 0)
            fprintf(stream, " %.15g", origin[k] + (double)c->point[k]);
        else
            fprintf(stream, " %.9g", (double)c->point[k]);
    }
    fprintf(stream, " %.9g\n", (double)c->distance);
}

/* The points relative to the origin of the answers. The caller releases them. */
static int place_points(tool *t, const tool_rows *rows, const answers *a, float **points) {
    *points = tool_allocate(t, rows->count, 3 * sizeof **points);
    if (!*points) return TOOL_MEMORY;
    tool_rows_points(rows, 3, 0, a->origin, *points);
    return TOOL_DONE;
}

static int find_in_model(tool *t, const closest_options *o, const tool_rows *rows, answers *a) {
    fct_tree *tree;
    fct_bvh *bvh = NULL;
    float *points = NULL;
    int code = tool_open_tree(t, t->inputs[0], NULL, &tree);
    if (code != TOOL_DONE) return code;
    memcpy(a->origin, fct_tree_get(tree).origin, sizeof a->origin);
    code = place_points(t, rows, a, &points);
    fct_bvh_def def = fct_bvh_def_default();
    if (o->with_sign) def.parts = FCT_BVH_SIGN;
    if (code == TOOL_DONE) code = tool_result(t, fct_bvh_build(&t->env, tree, &def, &bvh));
    if (code == TOOL_DONE && o->with_sign)
        fct_bvh_signed_distances(bvh, rows->count, points, (float)o->max_distance, a->found);
    else if (code == TOOL_DONE)
        fct_bvh_closest_points(bvh, rows->count, points, (float)o->max_distance, a->found);
    tool_release(t, points);
    fct_bvh_destroy(bvh);
    fct_tree_destroy(tree);
    return code;
}

typedef struct scene_points {
    const fct_scene *scene;
    const float *points;
    float max_distance;
    const answers *out;
} scene_points;

static void find_chunk_in_scene(void *user, size_t begin, size_t end, size_t chunk) {
    (void)chunk;
    const scene_points *s = user;
    for (size_t i = begin; i < end; ++i)
        if (!fct_scene_closest_point(s->scene, s->points + 3 * i, s->max_distance, s->out->instances + i,
                                     s->out->found + i))
            s->out->found[i].face = FCT_NONE;
}

static int find_in_scene(tool *t, const closest_options *o, const tool_rows *rows, answers *a) {
    fct_scene *scene;
    float *points = NULL;
    int code = tool_result(t, fct_scene_load(&t->env, t->inputs[0], FCT_BACKEND_OBB, &scene));
    if (code != TOOL_DONE) return code;
    memcpy(a->origin, fct_scene_get(scene).origin, sizeof a->origin);
    code = place_points(t, rows, a, &points);
    scene_points job = {scene, points, (float)o->max_distance, a};
    tool_loop loop = {.count = rows->count,
                      .grain = 256,
                      .body = find_chunk_in_scene,
                      .user = &job,
                      .phase = "points",
                      .to = 1};
    if (code == TOOL_DONE && rows->count) code = tool_run_loop(t, &loop);
    tool_release(t, points);
    fct_scene_destroy(scene);
    return code;
}

typedef struct totals {
    size_t found, inside;
} totals;

static int write_found(tool *t, const answers *a, size_t count, totals *sum) {
    tool_writer writer = {0};
    bool wanted = !t->json || t->output;
    int code = wanted ? tool_writer_open(t, t->output ? t->output : "-", &writer) : TOOL_DONE;
    if (code != TOOL_DONE) return code;
    for (size_t i = 0; i < count; ++i) {
        bool hit = a->found[i].face != FCT_NONE;
        sum->found += hit, sum->inside += hit && a->found[i].distance < 0;
        if (!wanted) continue;
        if (hit && a->instances) fprintf(writer.stream, "%u ", a->instances[i]);
        if (hit)
            print_closest(writer.stream, a->found + i, a->origin);
        else
            fputs("-1\n", writer.stream);
    }
    return wanted ? tool_writer_close(t, &writer, TOOL_DONE) : TOOL_DONE;
}

static int report_found(tool *t, const closest_options *o, size_t points, const totals *sum, double seconds) {
    json_int_t found = (json_int_t)sum->found, inside = (json_int_t)sum->inside;
    if (o->with_sign)
        return tool_json(t, json_pack("{s:I, s:I, s:I, s:f}", "points", (json_int_t)points, "found", found,
                                      "inside", inside, "seconds", seconds));
    return tool_json(
        t, json_pack("{s:I, s:I, s:f}", "points", (json_int_t)points, "found", found, "seconds", seconds));
}

static int run_closest(tool *t, void *options) {
    const closest_options *o = options;
    if (!o->points) return tool_fail(t, TOOL_USAGE, "expected --points FILE");
    if (!strcmp(o->points, "-") && !strcmp(t->inputs[0], "-"))
        return tool_fail(t, TOOL_USAGE, "the mesh and the points cannot both come from standard input");
    bool scene = tool_is_scene(t, t->inputs[0]);
    if (scene && o->with_sign)
        return tool_fail(t, TOOL_USAGE, "--signed: expected a mesh or a hierarchy file, found the scene '%s'",
                         t->inputs[0]);
    tool_rows points;
    totals sum = {0, 0};
    const tool_row_format format = {.least = 3, .columns = 3};
    int code = tool_rows_read(t, o->points, &format, &points);
    if (code != TOOL_DONE) return code;
    answers a = {.found = tool_allocate(t, points.count, sizeof *a.found)};
    if (a.found && scene) a.instances = tool_allocate(t, points.count, sizeof *a.instances);
    if (!a.found || (scene && !a.instances)) code = TOOL_MEMORY;
    double start = tool_seconds();
    if (code == TOOL_DONE) code = scene ? find_in_scene(t, o, &points, &a) : find_in_model(t, o, &points, &a);
    double seconds = tool_seconds() - start;
    if (code == TOOL_DONE) code = write_found(t, &a, points.count, &sum);
    if (code == TOOL_DONE) code = report_found(t, o, points.count, &sum, seconds);
    tool_release(t, a.instances);
    tool_release(t, a.found);
    tool_rows_release(t, &points);
    return code;
}

int tool_closest(int argc, char **argv) {
    static const tool_stage stages[] = {TOOL_TREE_STAGES, {"ray structure", 50}, {"points", 50}, {0}};
    static const tool_command command = {
        .name = "closest",
        .synopsis = "IN --points FILE [-o FILE]",
        .summary = "find the nearest surface points",
        .text = "IN is a mesh, a hierarchy file (.fct) or a scene.json. For each point the output "
                "has one line: 'face x y z "
                "distance', or 'instance face x y z distance' for a scene. Without -o the lines go to "
                "standard output; with "
                "--json the answers are only counted.\n\n"
                "JSON keys: points, found, seconds (including the opening or building of the hierarchy); "
                "inside with "
                "--signed.",
        .examples = "  facetree closest bunny.fct --points points.txt -o nearest.txt\n"
                    "  echo 0 0 1 | facetree closest bunny.obj --points - --signed",
        .options = closest_options_table,
        .parse = parse_closest,
        .run = run_closest,
        .stages = stages,
        .builds_tree = true,
        .inputs_min = 1,
        .inputs_max = 1,
        .output = TOOL_OUTPUT_OPTIONAL,
        .endings = "txt csv",
        .other = ""};
    closest_options options = {.max_distance = INFINITY};
    return tool_main(&command, argc, argv, &options);
}
