/* tools/collide/collide.c: facetree collide: whether two meshes touch, where, and how far apart they are. */
#include "tools/commands.h"

#include <math.h>
#include <string.h>

#include "tools/collide/bodies.h"
#include "tools/kit/command.h"
#include "tools/kit/model.h"
#include "tools/kit/options.h"

typedef struct collide_options {
    const char *pose, *poses;
    bool pairs, contacts, distance, relation, self;
    uint64_t limit;                /* 0: not given */
    tool_length tolerance, within; /* negative: not given */
} collide_options;

enum {
    KEY_POSE = TOOL_KEY,
    KEY_POSES,
    KEY_PAIRS,
    KEY_CONTACTS,
    KEY_LIMIT,
    KEY_DISTANCE,
    KEY_TOLERANCE,
    KEY_WITHIN,
    KEY_RELATION,
    KEY_SELF
};

static const struct argp_option collide_options_table[] = {
    {"pose", KEY_POSE, "NUMBERS", 0,
     "Place B in A's coordinates: 12 numbers in quotes, the rows of R|t (default: the identity)", 0},
    {"poses", KEY_POSES, "FILE", 0, "Poses, one per line: 12 numbers; - is standard input", 0},
    {"pairs", KEY_PAIRS, NULL, 0, "Print all pairs of faces that meet", 0},
    {"contacts", KEY_CONTACTS, NULL, 0, "Print all pairs with their contact: where they meet, and how deep",
     0},
    {"limit", KEY_LIMIT, "N", 0, "Print N pairs at most, per pose", 0},
    {"distance", KEY_DISTANCE, NULL, 0, "Print the distance, and the two nearest points", 0},
    {"tolerance", KEY_TOLERANCE, "T", 0,
     "With --distance: the printed distance may be T too large, in the mesh's unit or in % of A's diagonal "
     "(default 0)",
     0},
    {"within", KEY_WITHIN, "D", 0,
     "Print whether the surfaces are within D of each other, in the mesh's unit or in % of A's diagonal; "
     "with "
     "--distance: print -1 if they are not",
     0},
    {"relation", KEY_RELATION, NULL, 0,
     "Print apart, touching, a-inside or b-inside: whether they touch, or a part of one lies inside the "
     "other",
     0},
    {"self", KEY_SELF, NULL, 0, "Print the pairs of faces of A that meet and share no corner", 0},
    {0}};

static error_t parse_collide(int key, char *text, struct argp_state *state) {
    collide_options *o = state->input;
    switch (key) {
    case KEY_POSE:
        o->pose = text;
        return 0;
    case KEY_POSES:
        o->poses = text;
        return 0;
    case KEY_CONTACTS:
        o->contacts = o->pairs = true;
        return 0;
    case KEY_PAIRS:
        o->pairs = true;
        return 0;
    case KEY_LIMIT:
        return tool_parse_count(state, "--limit", text, 1, SIZE_MAX, &o->limit);
    case KEY_DISTANCE:
        o->distance = true;
        return 0;
    case KEY_TOLERANCE:
        return tool_parse_length(state, "--tolerance", text, &o->tolerance);
    case KEY_WITHIN:
        return tool_parse_length(state, "--within", text, &o->within);
    case KEY_RELATION:
        o->relation = true;
        return 0;
    case KEY_SELF:
        o->self = true;
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static bool holds_instances(const tool *t, const char *path) {
    return tool_is_scene(t, path) || tool_is_gltf(t, path);
}

/* One input: a scene, or a mesh with --self. */
static int check_one_input(tool *t, const collide_options *o) {
    if (o->pose || o->poses || o->distance || o->relation || o->within.value >= 0)
        return tool_fail(t, TOOL_USAGE,
                         "--pose, --poses, --distance, --relation and --within: expected two meshes, found "
                         "one input");
    if (!o->self && !holds_instances(t, t->inputs[0]))
        return tool_fail(t, TOOL_USAGE, "expected A B, a scene or --self; found only '%s'", t->inputs[0]);
    if (!o->self && o->pairs)
        return tool_fail(t, TOOL_USAGE, "--pairs and --contacts: expected two meshes or --self");
    if (o->self && tool_is_scene(t, t->inputs[0]))
        return tool_fail(t, TOOL_USAGE, "--self: expected a mesh or a hierarchy file, found the scene '%s'",
                         t->inputs[0]);
    return TOOL_DONE;
}

static int check_two_inputs(tool *t, const collide_options *o) {
    int streams = o->poses && !strcmp(o->poses, "-");
    for (int i = 0; i < 2; ++i) {
        streams += !strcmp(t->inputs[i], "-");
        if (tool_is_scene(t, t->inputs[i]))
            return tool_fail(t, TOOL_USAGE, "expected a mesh or a hierarchy file, found the scene '%s'",
                             t->inputs[i]);
    }
    if (streams > 1)
        return tool_fail(t, TOOL_USAGE, "only one of A, B and the poses can come from standard input");
    if (o->self) return tool_fail(t, TOOL_USAGE, "--self: expected one mesh, found two");
    if (o->pose && o->poses) return tool_fail(t, TOOL_USAGE, "--pose and --poses exclude each other");
    bool near = o->distance || o->within.value >= 0;
    if (o->pairs + near + o->relation > 1)
        return tool_fail(t, TOOL_USAGE,
                         "expected one of --pairs or --contacts, --distance or --within, and --relation");
    if (o->limit && !o->pairs)
        return tool_fail(t, TOOL_USAGE, "--limit: expected --pairs, --contacts, --self or a scene");
    return TOOL_DONE;
}

static int check_collide_options(tool *t, const collide_options *o) {
    if (o->tolerance.value >= 0 && !o->distance)
        return tool_fail(t, TOOL_USAGE, "--tolerance: expected --distance");
    return t->input_count == 1 ? check_one_input(t, o) : check_two_inputs(t, o);
}

static size_t get_limit(const collide_options *o) {
    return o->limit ? o->limit : SIZE_MAX;
}

/* --- Two meshes --- */

static void set_question(const collide_options *o, const collide_models *models, const collide_poses *poses,
                         collide_question *q) {
    *q = (collide_question){.models = models,
                            .poses = poses,
                            .distance = fct_distance_def_default(),
                            .limit = get_limit(o),
                            .kind = o->pairs || o->self    ? COLLIDE_PAIRS
                                    : o->relation          ? COLLIDE_RELATION
                                    : o->distance          ? COLLIDE_DISTANCE
                                    : o->within.value >= 0 ? COLLIDE_WITHIN
                                                           : COLLIDE_TOUCH};
    if (o->within.value >= 0) q->distance.max_distance = tool_length_of(models->tree_a, o->within);
    if (o->tolerance.value >= 0) q->distance.absolute = tool_length_of(models->tree_a, o->tolerance);
}

static json_t *summarize(const collide_report *r, const collide_answers *a) {
    return json_pack("{s:I, s:I, s:f, s:I, s:I, s:I}", "poses", (json_int_t)a->next, "found",
                     (json_int_t)r->found, "seconds", a->seconds, "box_tests", (json_int_t)a->visits.boxes,
                     "triangle_tests", (json_int_t)a->visits.triangles, "peak_bytes",
                     (json_int_t)tool_peak_bytes());
}

static int answer_all(tool *t, const collide_options *o, const collide_question *q) {
    collide_answers answers;
    collide_report report = {.tool = t};
    const collide_answer *answer;
    int code = collide_answers_open(t, q, &answers);
    if (code == TOOL_DONE) code = collide_report_open(t, o->contacts, &report);
    while (code == TOOL_DONE && answers.next < q->poses->rows.count) {
        size_t pose = answers.next;
        code = collide_answers_take(t, &answers, &answer);
        if (code == TOOL_DONE) collide_report_answer(&report, q, pose, answer);
    }
    bool asked = (q->kind != COLLIDE_DISTANCE && q->kind != COLLIDE_RELATION) || o->within.value >= 0;
    code = collide_report_close(&report, code, summarize(&report, &answers), asked);
    collide_answers_close(t, &answers);
    return code;
}

static int collide_models_of(tool *t, const collide_options *o) {
    collide_models models = {0};
    collide_poses poses;
    collide_question question;
    int code = collide_poses_read(t, o->pose, o->poses, &poses);
    if (code == TOOL_DONE) code = collide_models_open(t, o->relation ? FCT_BVH_SIGN : 0, &models);
    if (code == TOOL_DONE) {
        fct_tree *tree_b = models.tree_b ? models.tree_b : models.tree_a;
        memcpy(poses.origin_a, fct_tree_get(models.tree_a).origin, sizeof poses.origin_a);
        memcpy(poses.origin_b, fct_tree_get(tree_b).origin, sizeof poses.origin_b);
        set_question(o, &models, &poses, &question);
        code = answer_all(t, o, &question);
    }
    collide_poses_release(t, &poses);
    collide_models_close(&models);
    return code;
}

/* --- A scene --- */

static int collide_scene(tool *t, const collide_options *o) {
    collide_report report;
    double seconds = 0;
    int code = collide_report_open(t, false, &report);
    if (code == TOOL_DONE) code = collide_bodies(t, t->inputs[0], get_limit(o), &report, &seconds);
    json_t *object =
        json_pack("{s:I, s:f, s:n, s:n, s:I}", "found", (json_int_t)report.found, "seconds", seconds,
                  "box_tests", "triangle_tests", "peak_bytes", (json_int_t)tool_peak_bytes());
    return collide_report_close(&report, code, object, true);
}

static int run_collide(tool *t, void *options) {
    const collide_options *o = options;
    int code = check_collide_options(t, o);
    if (code != TOOL_DONE) return code;
    return t->input_count == 1 && !o->self ? collide_scene(t, o) : collide_models_of(t, o);
}

int tool_collide(int argc, char **argv) {
    static const tool_stage stages[] = {
        TOOL_TREE_STAGES,      {"ray structure", 80},          TOOL_TREE_STAGES,
        {"ray structure", 80}, {"poses|pairs of bodies", 100}, {0}};
    static const tool_command command = {
        .name = "collide",
        .synopsis = "A B [--pose NUMBERS | --poses FILE] [-o FILE]\nA --self [-o FILE]\nSCENE [-o FILE]",
        .summary = "find where two meshes touch, or how far apart they are",
        .text =
            "A and B are meshes or hierarchy files (.fct). A pose takes B's coordinates to those of A: "
            "x -> R x + t, given as r00 r01 r02 tx r10 r11 r12 ty r20 r21 r22 tz. R may be any matrix "
            "with an inverse; one that shears or scales unequally makes queries slow. Faces are closed "
            "triangles, and whether two of them meet is decided exactly. A face without area meets "
            "nothing; its distance counts.\n\n"
            "For each pose the output has one line:\n"
            "'1 face_a face_b' with a pair of faces that meets, or '0';\n"
            "with --within: '1' or '0';\n"
            "with --relation: 'touching', 'a-inside' (nothing touches, and a connected part of A lies inside "
            "B), 'b-inside' or 'apart'; inside is where the winding number is over 1/2;\n"
            "with --distance: 'distance face_a face_b ax ay az bx by bz' with the two nearest points in A's "
            "coordinates.\n"
            "With --pairs, each pair has a line 'pose face_a face_b', where poses count from 0. With "
            "--contacts, the ends of the segment that both faces share, the unit direction in which the "
            "face of B leaves that of A by the shortest way, and the length of that way follow: "
            "'from_x from_y from_z to_x to_y to_z normal_x normal_y normal_z depth'.\n"
            "With --self, each pair has a line 'face_a face_b', with the contact as above.\n\n"
            "SCENE is a scene.json or a glTF file. Each pair of instances that touches has a line "
            "'instance_a instance_b face_a face_b'. Parts of one object do not count.\n\n"
            "The exit code is 1 if nothing touches, or nothing is within D. It is 0 with --relation, and "
            "with "
            "--distance alone.\n\n"
            "JSON keys: results[], found, poses, seconds (of the queries), box_tests, triangle_tests, "
            "peak_bytes. found counts poses, or pairs if those are asked for. With -o, the lines go to the "
            "file, and there are no results[]. Keys of results: touching, face_a, face_b; within; relation; "
            "distance, "
            "face_a, face_b, point_a, point_b; pairs[face_a, face_b, from, to, normal, depth]; instance_a, "
            "instance_b, name_a, name_b, face_a, face_b. For a scene, box_tests and triangle_tests are null.",
        .examples = "  facetree collide bunny.fct cow.fct --pose '1 0 0 .1  0 1 0 0  0 0 1 0'\n"
                    "  facetree collide robot.fct room.fct --poses path.txt --within 0.05 -o near.txt\n"
                    "  facetree collide bunny.fct cow.fct --distance --tolerance 0.1%\n"
                    "  facetree collide bunny.fct cow.fct --poses path.txt --relation\n"
                    "  facetree collide bunny.obj --self --json\n"
                    "  facetree collide scene.json",
        .options = collide_options_table,
        .parse = parse_collide,
        .run = run_collide,
        .stages = stages,
        .builds_tree = true,
        .inputs_min = 1,
        .inputs_max = 2,
        .output = TOOL_OUTPUT_OPTIONAL,
        .endings = "txt csv",
        .other = ""};
    collide_options options = {.tolerance = {-1, false}, .within = {-1, false}};
    return tool_main(&command, argc, argv, &options);
}
