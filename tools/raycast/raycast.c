/* tools/raycast/raycast.c: facetree raycast: the hits of rays from a text file, and the comparison of both
 * backends. */
#include "tools/commands.h"

#include <math.h>
#include <string.h>

#include "tools/kit/command.h"
#include "tools/kit/file.h"
#include "tools/kit/model.h"
#include "tools/kit/options.h"
#include "tools/raycast/check.h"
#include "tools/raycast/shots.h"

typedef struct ray_options {
    const char *rays;
    fct_backend backend;
    bool backend_given, occlusion, all, check;
    raycast_attributes attributes;
    uint64_t made;  /* rays to write with --make-rays; 0: none */
    uint64_t count; /* of generated rays; 0: not given */
} ray_options;

enum {
    KEY_RAYS = TOOL_KEY,
    KEY_OCCLUSION,
    KEY_ALL,
    KEY_ATTRIBUTES,
    KEY_BACKEND,
    KEY_CHECK,
    KEY_COUNT,
    KEY_MAKE
};

static const struct argp_option ray_options_table[] = {
    {"rays", KEY_RAYS, "FILE", 0,
     "Rays, one per line: ox oy oz dx dy dz [tmin tmax] (default 0 and inf); - is standard input", 0},
    {"occlusion", KEY_OCCLUSION, NULL, 0, "Print only whether the ray hits anything: 1 or 0 per line", 0},
    {"all", KEY_ALL, NULL, 0,
     "Print all hits of each ray in order of t, one per line that begins with the number of the ray", 0},
    {"attributes", KEY_ATTRIBUTES, "LIST", 0,
     "Print attributes of the surface behind each hit: some of normal, uv and color, such as normal,uv", 0},
    {"backend", KEY_BACKEND, "NAME", 0, "Backend: obb (default) or embree", 0},
    {"check", KEY_CHECK, NULL, 0, "Shoot the rays with both backends and count the differences", 0},
    {"count", KEY_COUNT, "N", 0,
     "With --check and without --rays: generate N rays of several kinds (default 1000000)", 0},
    {"make-rays", KEY_MAKE, "N", 0,
     "Write N rays of several kinds instead of shooting any, for --rays; --seed chooses others", 0},
    {0}};

static const char *const attribute_names[] = {"normal", "uv", "color", NULL};
static const unsigned attribute_kinds[] = {FCT_MESH_NORMALS, FCT_MESH_TEXCOORDS, FCT_MESH_COLORS};

static error_t parse_attributes(raycast_attributes *out, char *list, struct argp_state *state) {
    out->count = 0;
    for (char *item = list; item;) {
        char *comma = strchr(item, ',');
        if (comma) *comma = 0;
        int index = 0;
        error_t error = tool_parse_choice(state, "--attributes", item, attribute_names, &index);
        if (error) return error;
        for (int i = 0; i < out->count; ++i)
            if (out->kind[i] == attribute_kinds[index])
                return tool_usage(state, "--attributes: found '%s' twice", item);
        out->kind[out->count++] = attribute_kinds[index];
        item = comma ? comma + 1 : NULL;
    }
    return 0;
}

static error_t parse_raycast(int key, char *text, struct argp_state *state) {
    ray_options *o = state->input;
    switch (key) {
    case KEY_RAYS:
        o->rays = text;
        return 0;
    case KEY_OCCLUSION:
        o->occlusion = true;
        return 0;
    case KEY_ALL:
        o->all = true;
        return 0;
    case KEY_ATTRIBUTES:
        return parse_attributes(&o->attributes, text, state);
    case KEY_BACKEND:
        o->backend_given = true;
        return tool_parse_backend(state, "--backend", text, &o->backend);
    case KEY_CHECK:
        o->check = true;
        return 0;
    case KEY_MAKE:
        return tool_parse_count(state, "--make-rays", text, 1, UINT32_MAX, &o->made);
    case KEY_COUNT:
        return tool_parse_count(state, "--count", text, 1, UINT32_MAX, &o->count);
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static int check_ray_options(tool *t, const ray_options *o) {
    bool prints_hits = o->all || o->attributes.count;
    if (o->made && (o->rays || o->check || o->occlusion || o->count || prints_hits))
        return tool_fail(
            t, TOOL_USAGE,
            "--make-rays: expected no --rays, --check, --count, --occlusion, --all or --attributes");
    if (prints_hits && o->check)
        return tool_fail(t, TOOL_USAGE, "--check writes no hits: remove --all and --attributes");
    if (prints_hits && o->occlusion)
        return tool_fail(t, TOOL_USAGE, "--occlusion: expected neither --all nor --attributes");
    if (o->all && o->backend == FCT_BACKEND_EMBREE)
        return tool_fail(t, TOOL_USAGE, "--all: expected the backend obb, found embree");
    if (o->made && tool_is_scene(t, t->inputs[0]))
        return tool_fail(t, TOOL_USAGE,
                         "--make-rays: expected a mesh or a hierarchy file, found the scene '%s'",
                         t->inputs[0]);
    if (o->check && o->backend_given)
        return tool_fail(t, TOOL_USAGE, "--check uses both backends: remove --backend");
    if (o->check && o->occlusion)
        return tool_fail(t, TOOL_USAGE, "--check includes occlusion: remove --occlusion");
    if (o->check && t->output) return tool_fail(t, TOOL_USAGE, "--check writes no hits: remove -o");
    if (o->count && (!o->check || o->rays))
        return tool_fail(t, TOOL_USAGE, "--count: expected --check, and no --rays");
    if (!o->check && !o->rays && !o->made)
        return tool_fail(t, TOOL_USAGE, "expected --rays FILE, --check or --make-rays N");
    if (o->check && tool_is_scene(t, t->inputs[0]))
        return tool_fail(t, TOOL_USAGE, "--check: expected a mesh or a hierarchy file, found the scene '%s'",
                         t->inputs[0]);
    if (o->rays && !strcmp(o->rays, "-") && !strcmp(t->inputs[0], "-"))
        return tool_fail(t, TOOL_USAGE, "the mesh and the rays cannot both come from standard input");
    return TOOL_DONE;
}

static int read_rays(tool *t, const char *path, tool_rows *rows) {
    static const double usual[2] = {0, INFINITY};
    const tool_row_format format = {.least = 6, .columns = 8, .missing = usual};
    return tool_rows_read(t, path, &format, rows);
}

/* --- Attributes --- */

static const char *name_attribute(unsigned kind) {
    return kind == FCT_MESH_NORMALS     ? "normals"
           : kind == FCT_MESH_TEXCOORDS ? "texture coordinates"
                                        : "colours";
}

/* `held`: what a mesh or model has. model: its name in the scene `path`; NULL for a mesh. */
static int require_attributes(tool *t, const raycast_attributes *wanted, unsigned held, const char *path,
                              const char *model) {
    for (int i = 0; i < wanted->count; ++i) {
        if (held & wanted->kind[i]) continue;
        const char *hint =
            tool_has_format(t, path, "fct") ? "; a hierarchy file stores only colours of vertices" : "";
        return tool_fail(t, TOOL_DATA, "%s: %s%s%sexpected %s for --attributes, found none%s", path,
                         model ? "model \"" : "", model ? model : "", model ? "\": " : "",
                         name_attribute(wanted->kind[i]), hint);
    }
    return TOOL_DONE;
}

static int check_mesh(tool *t, const raycast_attributes *wanted, const fct_mesh *mesh) {
    fct_surface_point point = {0};
    if (mesh->face_count) fct_mesh_point(mesh, 0, 0, 0, &point);
    return require_attributes(t, wanted, point.found, t->inputs[0], NULL);
}

static int check_scene(tool *t, const raycast_attributes *wanted, const fct_scene *scene) {
    fct_scene_view view = fct_scene_get(scene);
    int code = TOOL_DONE;
    for (uint32_t i = 0; i < view.instance_count && wanted->count && code == TOOL_DONE; ++i) {
        fct_surface_point point;
        fct_scene_point(scene, i, 0, 0, 0, &point);
        code = require_attributes(t, wanted, point.found, t->inputs[0],
                                  view.models[view.instances[i].model].name);
    }
    return code;
}

/* --- Hits --- */

static int report_hits(tool *t, const ray_options *options, size_t rays, const raycast_totals *o) {
    double rate = o->seconds > 0 ? (double)rays / o->seconds : 0;
    json_t *object = json_pack("{s:I, s:I, s:f, s:f, s:I}", "rays", (json_int_t)rays, "hits",
                               (json_int_t)o->hits, "seconds", o->seconds, "rays_per_second", rate,
                               "peak_bytes", (json_int_t)tool_peak_bytes());
    if (object && options->all)
        json_object_set_new(object, "rays_hit", json_integer((json_int_t)o->rays_hit));
    return tool_json(t, object);
}

static int cast_in_model(tool *t, const ray_options *options, raycast_question *q) {
    fct_tree *tree;
    fct_bvh *bvh = NULL;
    fct_mesh mesh = {0};
    raycast_totals totals;
    bool attributes = options->attributes.count > 0;
    int code = tool_open_tree_mesh(t, t->inputs[0], NULL, &tree, attributes ? &mesh : NULL);
    if (code != TOOL_DONE) return code;
    tool_warn_inward(t, t->inputs[0], fct_tree_get(tree).inward);
    if (attributes) code = check_mesh(t, &options->attributes, &mesh);
    if (code == TOOL_DONE) code = tool_result(t, fct_bvh_create(&t->env, tree, options->backend, &bvh));
    q->bvh = bvh, q->mesh = &mesh;
    memcpy(q->origin, fct_tree_get(tree).origin, sizeof q->origin);
    if (code == TOOL_DONE) code = raycast_shoot(t, q, &totals);
    if (code == TOOL_DONE) code = report_hits(t, options, q->rows->count, &totals);
    fct_bvh_destroy(bvh);
    fct_mesh_release(&t->env, &mesh);
    fct_tree_destroy(tree);
    return code;
}

static int cast_in_scene(tool *t, const ray_options *options, raycast_question *q) {
    fct_scene *scene;
    raycast_totals totals;
    int code = tool_result(t, fct_scene_load(&t->env, t->inputs[0], options->backend, &scene));
    if (code != TOOL_DONE) return code;
    code = check_scene(t, &options->attributes, scene);
    q->scene = scene;
    memcpy(q->origin, fct_scene_get(scene).origin, sizeof q->origin);
    if (code == TOOL_DONE) code = raycast_shoot(t, q, &totals);
    if (code == TOOL_DONE) code = report_hits(t, options, q->rows->count, &totals);
    fct_scene_destroy(scene);
    return code;
}

static int run_raycast(tool *t, void *user) {
    const ray_options *options = user;
    tool_rows rows = {0};
    int code = check_ray_options(t, options);
    if (code == TOOL_DONE && options->rays) code = read_rays(t, options->rays, &rows);
    raycast_question question = {.rows = &rows,
                                 .occlusion = options->occlusion,
                                 .all = options->all,
                                 .attributes = options->attributes};
    size_t count = options->rays ? rows.count : options->count ? options->count : 1000000;
    if (code == TOOL_DONE) {
        if (options->made)
            code = raycast_make(t, options->made);
        else if (options->check)
            code = raycast_check(t, options->rays ? &rows : NULL, count);
        else if (tool_is_scene(t, t->inputs[0]))
            code = cast_in_scene(t, options, &question);
        else
            code = cast_in_model(t, options, &question);
    }
    tool_rows_release(t, &rows);
    return code;
}

int tool_raycast(int argc, char **argv) {
    static const tool_stage stages[] = {
        TOOL_TREE_STAGES, {"ray structure", 50}, {"rays|checking rays", 200}, {0}};
    static const tool_command command = {
        .name = "raycast",
        .synopsis = "IN --rays FILE [-o FILE]\nIN --check [--rays FILE]\nIN --make-rays N -o FILE",
        .summary = "shoot rays; compare both backends",
        .text =
            "IN is a mesh, a hierarchy file (.fct) or a scene.json. "
            "For each ray the output has one line with the closest "
            "hit for tmin <= t <= tmax: 'face t u v', or 'instance face t u "
            "v' for a scene, or -1 if the ray misses. The hit "
            "point is (1 - u - v) p0 + u p1 + v p2. Without -o the hits go "
            "to standard output; with --json they are only "
            "counted.\n\n"
            "--all writes a line for each hit, in order of t: 'ray face t u v', or 'ray instance face t u v' "
            "for a scene, where ray is the number of the ray, from 0. A ray without hits has the line "
            "'ray -1'. Only the backend obb finds all hits.\n\n"
            "--attributes adds to the line of a hit, in the order of its list, the unit normal (3 numbers; "
            "0 0 0 where normals cancel), the texture coordinates (2) and the linear colour (3), "
            "interpolated between the corners of the face with u and v, or the colour of the face. "
            "In a scene, normals are in the world and v counts from the top of the image. "
            "The mesh, or each model of the scene, must have them.\n\n"
            "--check decides every difference between the backends in "
            "double precision. The exit code is 1 if a difference "
            "stays unexplained.\n\n"
            "JSON keys: rays, hits, seconds, rays_per_second, peak_bytes; with --all also rays_hit, the rays "
            "with "
            "hits. Seconds are those of the queries, and of making the lines if they are written. "
            "--check prints rays, hits, differences, explained, "
            "unexplained, occlusion_differences, seconds{obb, embree}.",
        .examples = "  facetree raycast bunny.fct --make-rays 1000 -o rays.txt\n"
                    "  facetree raycast bunny.fct --rays rays.txt -o hits.txt\n"
                    "  facetree raycast bunny.fct --rays rays.txt --all -o all.txt\n"
                    "  facetree raycast spot.obj --rays rays.txt --attributes uv\n"
                    "  facetree raycast bunny.fct --check",
        .options = ray_options_table,
        .parse = parse_raycast,
        .run = run_raycast,
        .stages = stages,
        .builds_tree = true,
        .inputs_min = 1,
        .inputs_max = 1,
        .output = TOOL_OUTPUT_OPTIONAL,
        .endings = "txt csv",
        .other = ""};
    ray_options options = {.backend = FCT_BACKEND_OBB};
    return tool_main(&command, argc, argv, &options);
}
