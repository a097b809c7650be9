/* tools/raycast.c: facetree raycast: the hits of rays from a text file, and the comparison of both backends.
 */
#include "tools/commands.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tools/kit/command.h"
#include "tools/kit/file.h"
#include "tools/kit/model.h"
#include "tools/kit/options.h"
#include "tools/kit/rows.h"

typedef struct ray_options {
    const char *rays;
    fct_backend backend;
    bool backend_given, occlusion, check;
    uint64_t made;  /* rays to write with --make-rays; 0: none */
    uint64_t count; /* of generated rays; 0: not given */
} ray_options;

enum { KEY_RAYS = TOOL_KEY, KEY_OCCLUSION, KEY_BACKEND, KEY_CHECK, KEY_COUNT, KEY_MAKE };

static const struct argp_option ray_options_table[] = {
    {"rays", KEY_RAYS, "FILE", 0,
     "Rays, one per line: ox oy oz dx dy dz [tmin tmax] (default 0 and inf); - is standard input", 0},
    {"occlusion", KEY_OCCLUSION, NULL, 0, "Print only whether the ray hits anything: 1 or 0 per line", 0},
    {"backend", KEY_BACKEND, "NAME", 0, "Backend: obb (default) or embree", 0},
    {"check", KEY_CHECK, NULL, 0, "Shoot the rays with both backends and count the differences", 0},
    {"count", KEY_COUNT, "N", 0,
     "With --check and without --rays: generate N rays of several kinds (default 1000000)", 0},
    {"make-rays", KEY_MAKE, "N", 0,
     "Write N rays of several kinds instead of shooting any, for --rays; --seed chooses others", 0},
    {0}};

static error_t parse_raycast(int key, char *text, struct argp_state *state) {
    ray_options *o = state->input;
    switch (key) {
    case KEY_RAYS:
        o->rays = text;
        return 0;
    case KEY_OCCLUSION:
        o->occlusion = true;
        return 0;
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
    if (o->made && (o->rays || o->check || o->occlusion || o->count))
        return tool_fail(t, TOOL_USAGE, "--make-rays: expected no --rays, --check, --count or --occlusion");
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
    return tool_rows_read(t, path, 6, 8, usual, rows);
}

/* Rays relative to the origin of the mesh or scene. The caller releases them. */
static int place_rays(tool *t, const tool_rows *rows, const double origin[3], fct_ray **rays) {
    *rays = tool_allocate(t, rows->count, sizeof **rays);
    if (!*rays) return TOOL_MEMORY;
    for (size_t i = 0; i < rows->count; ++i) {
        const double *r = rows->values + 8 * i;
        fct_ray *ray = *rays + i;
        for (int k = 0; k < 3; ++k)
            ray->origin[k] = (float)(r[k] - origin[k]), ray->direction[k] = (float)r[3 + k];
        ray->t_min = (float)r[6], ray->t_max = (float)r[7];
    }
    return TOOL_DONE;
}

/* --- Hits --- */

typedef struct outcome {
    size_t hits;
    double seconds; /* of the queries alone */
} outcome;

static int report_hits(tool *t, size_t rays, const outcome *o) {
    double rate = o->seconds > 0 ? (double)rays / o->seconds : 0;
    return tool_json(t, json_pack("{s:I, s:I, s:f, s:f, s:I}", "rays", (json_int_t)rays, "hits",
                                  (json_int_t)o->hits, "seconds", o->seconds, "rays_per_second", rate,
                                  "peak_bytes", (json_int_t)tool_peak_bytes()));
}

/* The stream is NULL if hits are only counted: --json without -o. */
static int open_hits(tool *t, tool_writer *writer) {
    *writer = (tool_writer){0};
    return t->json && !t->output ? TOOL_DONE : tool_writer_open(t, t->output ? t->output : "-", writer);
}

static int close_hits(tool *t, tool_writer *writer) {
    return writer->stream ? tool_writer_close(t, writer, TOOL_DONE) : TOOL_DONE;
}

static int closest_in_model(tool *t, const fct_bvh *bvh, const fct_ray *rays, size_t count, outcome *o) {
    tool_writer writer;
    fct_hit *hits = tool_allocate(t, count, sizeof *hits);
    if (!hits) return TOOL_MEMORY;
    double start = tool_seconds();
    fct_bvh_closest_hits(bvh, count, rays, hits);
    o->seconds = tool_seconds() - start;
    int code = open_hits(t, &writer);
    for (size_t i = 0; i < count && code == TOOL_DONE; ++i) {
        bool hit = hits[i].face != FCT_NONE;
        o->hits += hit;
        if (!writer.stream) continue;
        if (hit)
            fprintf(writer.stream, "%u %.9g %.9g %.9g\n", hits[i].face, (double)hits[i].t, (double)hits[i].u,
                    (double)hits[i].v);
        else
            fputs("-1\n", writer.stream);
    }
    if (code == TOOL_DONE) code = close_hits(t, &writer);
    tool_release(t, hits);
    return code;
}

static int occlusion_in_model(tool *t, const fct_bvh *bvh, const fct_ray *rays, size_t count, outcome *o) {
    tool_writer writer;
    uint64_t *bits = tool_allocate(t, count / 64 + 1, sizeof *bits);
    if (!bits) return TOOL_MEMORY;
    double start = tool_seconds();
    fct_bvh_any_hits(bvh, count, rays, bits);
    o->seconds = tool_seconds() - start;
    int code = open_hits(t, &writer);
    for (size_t i = 0; i < count && code == TOOL_DONE; ++i) {
        bool hit = bits[i / 64] >> (i % 64) & 1;
        o->hits += hit;
        if (writer.stream) fputs(hit ? "1\n" : "0\n", writer.stream);
    }
    if (code == TOOL_DONE) code = close_hits(t, &writer);
    tool_release(t, bits);
    return code;
}

static int cast_in_model(tool *t, const ray_options *options, const tool_rows *rows) {
    fct_tree *tree;
    fct_bvh *bvh = NULL;
    fct_ray *rays = NULL;
    size_t count = rows->count;
    outcome o = {0};
    int code = tool_open_tree(t, t->inputs[0], NULL, &tree);
    if (code != TOOL_DONE) return code;
    tool_warn_inward(t, t->inputs[0], fct_tree_get(tree).inward);
    code = place_rays(t, rows, fct_tree_get(tree).origin, &rays);
    if (code == TOOL_DONE) code = tool_result(t, fct_bvh_create(&t->env, tree, options->backend, &bvh));
    if (code == TOOL_DONE)
        code = options->occlusion ? occlusion_in_model(t, bvh, rays, count, &o)
                                  : closest_in_model(t, bvh, rays, count, &o);
    if (code == TOOL_DONE) code = report_hits(t, count, &o);
    tool_release(t, rays);
    fct_bvh_destroy(bvh);
    fct_tree_destroy(tree);
    return code;
}

static int cast_in_scene(tool *t, const ray_options *options, const tool_rows *rows) {
    fct_scene *scene;
    fct_ray *rays = NULL;
    size_t count = rows->count;
    tool_writer writer;
    outcome o = {0};
    int code = tool_result(t, fct_scene_load(&t->env, t->inputs[0], options->backend, &scene));
    if (code != TOOL_DONE) return code;
    code = place_rays(t, rows, fct_scene_get(scene).origin, &rays);
    if (code == TOOL_DONE) code = open_hits(t, &writer);
    double start = tool_seconds();
    for (size_t i = 0; i < count && code == TOOL_DONE; ++i) {
        fct_scene_hit hit;
        bool found = options->occlusion ? fct_scene_any_hit(scene, rays + i, NULL)
                                        : fct_scene_closest_hit(scene, rays + i, &hit, NULL);
        o.hits += found;
        if (!writer.stream) continue;
        if (options->occlusion)
            fputs(found ? "1\n" : "0\n", writer.stream);
        else if (found)
            fprintf(writer.stream, "%u %u %.9g %.9g %.9g\n", hit.instance, hit.face, (double)hit.t,
                    (double)hit.u, (double)hit.v);
        else
            fputs("-1\n", writer.stream);
    }
    o.seconds = tool_seconds() - start;
    if (code == TOOL_DONE) code = close_hits(t, &writer);
    if (code == TOOL_DONE) code = report_hits(t, count, &o);
    tool_release(t, rays);
    fct_scene_destroy(scene);
    return code;
}

/* --- Check --- */

static int report_check(tool *t, const fct_ray_check *c) {
    tool_say(
        t,
        "%zu rays, %zu hits, %zu differences: %zu explained, %zu unexplained; %zu differences in occlusion",
        c->rays, c->hits, c->differences, c->explained, c->unexplained, c->occlusion_differences);
    tool_say(t, "obb %.3f s (%.2f M rays/s), embree %.3f s (%.2f M rays/s)", c->seconds_obb,
             (double)c->rays / fmax(c->seconds_obb, 1e-9) / 1e6, c->seconds_embree,
             (double)c->rays / fmax(c->seconds_embree, 1e-9) / 1e6);
    int code = tool_json(t, json_pack("{s:I, s:I, s:I, s:I, s:I, s:I, s:{s:f, s:f}}", "rays",
                                      (json_int_t)c->rays, "hits", (json_int_t)c->hits, "differences",
                                      (json_int_t)c->differences, "explained", (json_int_t)c->explained,
                                      "unexplained", (json_int_t)c->unexplained, "occlusion_differences",
                                      (json_int_t)c->occlusion_differences, "seconds", "obb", c->seconds_obb,
                                      "embree", c->seconds_embree));
    if (code != TOOL_DONE) return code;
    return c->unexplained || c->occlusion_differences ? TOOL_NO : TOOL_DONE;
}

static int generate_rays(tool *t, const fct_bvh *bvh, size_t count, fct_ray **rays) {
    *rays = tool_allocate(t, count, sizeof **rays);
    if (!*rays) return TOOL_MEMORY;
    fct_ray_mix(bvh, t->seed, count, *rays);
    return TOOL_DONE;
}

static int check_backends(tool *t, const ray_options *options, const tool_rows *rows) {
    fct_tree *tree;
    fct_bvh *obb = NULL, *embree = NULL;
    fct_ray *rays = NULL;
    size_t count = options->rays ? rows->count : options->count ? options->count : 1000000;
    fct_ray_check counts;
    int code = tool_open_tree(t, t->inputs[0], NULL, &tree);
    if (code != TOOL_DONE) return code;
    code = tool_result(t, fct_bvh_create(&t->env, tree, FCT_BACKEND_OBB, &obb));
    if (code == TOOL_DONE) code = tool_result(t, fct_bvh_create(&t->env, tree, FCT_BACKEND_EMBREE, &embree));
    if (code == TOOL_DONE)
        code = options->rays ? place_rays(t, rows, fct_tree_get(tree).origin, &rays)
                             : generate_rays(t, obb, count, &rays);
    if (code == TOOL_DONE) code = tool_result(t, fct_bvh_check(&t->env, obb, embree, count, rays, &counts));
    if (code == TOOL_DONE) code = report_check(t, &counts);
    tool_release(t, rays);
    fct_bvh_destroy(embree);
    fct_bvh_destroy(obb);
    fct_tree_destroy(tree);
    return code;
}

/* --- Rays --- */

/* In the user's coordinates. Those relative to an origin need more digits than a float. */
static int write_rays(tool *t, const fct_ray *rays, size_t count, const double origin[3]) {
    tool_writer writer;
    int code = open_hits(t, &writer);
    if (code != TOOL_DONE || !writer.stream) return code;
    for (size_t i = 0; i < count; ++i) {
        const fct_ray *r = rays + i;
        for (int k = 0; k < 3; ++k)
            fprintf(writer.stream, "%.*g ", origin[k] != 0 ? 17 : 9, origin[k] + (double)r->origin[k]);
        fprintf(writer.stream, "%.9g %.9g %.9g %.9g %.9g\n", (double)r->direction[0], (double)r->direction[1],
                (double)r->direction[2], (double)r->t_min, (double)r->t_max);
    }
    return close_hits(t, &writer);
}

static int make_rays(tool *t, size_t count) {
    fct_tree *tree;
    fct_bvh *bvh = NULL;
    fct_ray *rays = NULL;
    int code = tool_open_tree(t, t->inputs[0], NULL, &tree);
    if (code == TOOL_DONE) code = tool_result(t, fct_bvh_create(&t->env, tree, FCT_BACKEND_OBB, &bvh));
    if (code == TOOL_DONE && !(rays = tool_allocate(t, count, sizeof *rays))) code = TOOL_MEMORY;
    if (code == TOOL_DONE) {
        fct_ray_mix(bvh, t->seed, count, rays);
        code = write_rays(t, rays, count, fct_tree_get(tree).origin);
    }
    if (code == TOOL_DONE) code = tool_json(t, json_pack("{s:I}", "rays", (json_int_t)count));
    tool_release(t, rays);
    fct_bvh_destroy(bvh);
    fct_tree_destroy(tree);
    return code;
}

static int run_raycast(tool *t, void *user) {
    const ray_options *options = user;
    tool_rows rows = {0};
    int code = check_ray_options(t, options);
    if (code == TOOL_DONE && options->rays) code = read_rays(t, options->rays, &rows);
    if (code == TOOL_DONE) {
        if (options->made)
            code = make_rays(t, options->made);
        else if (options->check)
            code = check_backends(t, options, &rows);
        else if (tool_is_scene(t, t->inputs[0]))
            code = cast_in_scene(t, options, &rows);
        else
            code = cast_in_model(t, options, &rows);
    }
    tool_rows_release(t, &rows);
    return code;
}

int tool_raycast(int argc, char **argv) {
    static const tool_stage stages[] = {TOOL_TREE_STAGES, {"ray structure", 50}, {"checking rays", 200}, {0}};
    static const tool_command command = {
        .name = "raycast",
        .synopsis = "IN --rays FILE [-o FILE]\nIN --check [--rays FILE]\nIN --make-rays N -o FILE",
        .summary = "shoot rays; compare both backends",
        .text = "IN is a mesh, a hierarchy file (.fct) or a scene.json. "
                "For each ray the output has one line with the closest "
                "hit for tmin <= t <= tmax: 'face t u v', or 'instance face t u "
                "v' for a scene, or -1 if the ray misses. The hit "
                "point is (1 - u - v) p0 + u p1 + v p2. Without -o the hits go "
                "to standard output; with --json they are only "
                "counted.\n\n"
                "--check decides every difference between the backends in "
                "double precision. The exit code is 1 if a difference "
                "stays unexplained.\n\n"
                "JSON keys: rays, hits, seconds, rays_per_second, peak_bytes. "
                "--check prints rays, hits, differences, explained, "
                "unexplained, occlusion_differences, seconds{obb, embree}.",
        .examples = "  facetree raycast bunny.fct --make-rays 1000 -o rays.txt\n"
                    "  facetree raycast bunny.fct --rays rays.txt -o hits.txt\n"
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
