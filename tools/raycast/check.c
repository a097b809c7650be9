/* tools/raycast/check.c: see check.h. */
#include "tools/raycast/check.h"

#include <math.h>

#include "tools/kit/file.h"
#include "tools/kit/model.h"
#include "tools/raycast/shots.h"

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

int raycast_check(tool *t, const tool_rows *rows, size_t count) {
    fct_tree *tree;
    fct_bvh *obb = NULL, *embree = NULL;
    fct_ray *rays = NULL;
    fct_ray_check counts;
    int code = tool_open_tree(t, t->inputs[0], NULL, &tree);
    if (code != TOOL_DONE) return code;
    code = tool_result(t, fct_bvh_create(&t->env, tree, FCT_BACKEND_OBB, &obb));
    if (code == TOOL_DONE) code = tool_result(t, fct_bvh_create(&t->env, tree, FCT_BACKEND_EMBREE, &embree));
    if (code == TOOL_DONE) code = (rays = tool_allocate(t, count, sizeof *rays)) ? TOOL_DONE : TOOL_MEMORY;
    if (code == TOOL_DONE && !rows) fct_ray_mix(obb, t->seed, count, rays);
    for (size_t i = 0; i < count && code == TOOL_DONE && rows; ++i)
        rays[i] = raycast_ray(rows, i, fct_tree_get(tree).origin);
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
    if (t->json && !t->output) return TOOL_DONE;
    int code = tool_writer_open(t, t->output ? t->output : "-", &writer);
    if (code != TOOL_DONE) return code;
    for (size_t i = 0; i < count; ++i) {
        const fct_ray *r = rays + i;
        for (int k = 0; k < 3; ++k)
            fprintf(writer.stream, "%.*g ", origin[k] != 0 ? 17 : 9, origin[k] + (double)r->origin[k]);
        fprintf(writer.stream, "%.9g %.9g %.9g %.9g %.9g\n", (double)r->direction[0], (double)r->direction[1],
                (double)r->direction[2], (double)r->t_min, (double)r->t_max);
    }
    return tool_writer_close(t, &writer, TOOL_DONE);
}

int raycast_make(tool *t, size_t count) {
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
