/* tools/bake/errors.c: see errors.h. */
#include "tools/bake/errors.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tools/bake/normals.h"
#include "tools/kit/options.h"

/* Bakes until a target is given up, and the share of the target that the next bake aims at. */
enum { MOST_TRIES = 6 };
#define AIM .85
/* The error falls with the root of --error. One bake changes it by these factors at most, and at least. */
#define MOST_STEP  .1
#define LEAST_STEP .25
/* The least --error, and the least one for a target: numbers of rays do not grow below it. */
#define LEAST_ERROR 1e-9
#define FINEST      8e-8
/* Where more rays have lowered the error to no less than this share of it, the next bake has shorter edges.
 */
#define SMALL_GAIN .75
/* Share of the checked area below which an object is not printed, and the objects that are. */
#define PRINTED_AREA .005
enum { PRINTED_OBJECTS = 3 };

error_t bake_parse_error(struct argp_state *state, const char *text, double *error, bake_target *target) {
    const size_t size = strlen(text);
    char number[64];
    double percent;
    if (size < 2 || size >= sizeof number || text[size - 1] != '%')
        return tool_parse_real(state, "--error", text, LEAST_ERROR, 1, error);
    memcpy(number, text, size - 1);
    number[size - 1] = 0;
    error_t result = tool_parse_real(state, "--error", number, .01, 100, &percent);
    if (!result) target->share = percent / 100;
    return result;
}

bool bake_try_again(tool *t, bake_target *target, const fct_bake_stats *stats, fct_bake_def *def) {
    const double estimate = stats->error_estimate, last = target->last;
    if (!(target->share > 0) || estimate <= target->share || ++target->tries >= MOST_TRIES) return false;
    const double wanted = target->share * AIM / estimate;
    const bool gained = !target->more_rays || estimate < SMALL_GAIN * last;
    target->more_rays = gained && def->error > FINEST;
    if (!target->more_rays)
        def->max_edge = stats->max_edge * .5;
    else
        def->error = fmax(def->error * fmin(fmax(wanted * wanted, MOST_STEP), LEAST_STEP), FINEST);
    target->last = estimate;
    tool_say(t, "estimated error %.2g %%, wanted %.2g %%: once more with --error %.3g and edges up to %.3g",
             100 * estimate, 100 * target->share, def->error,
             def->max_edge > 0 ? def->max_edge : stats->max_edge);
    return true;
}

/* The name of each object, from its first instance. */
static const char *find_name(const fct_scene_view *scene, uint32_t object, uint32_t *instance) {
    while (scene->instances[*instance].object != object) ++*instance;
    return scene->instances[*instance].name;
}

json_t *bake_describe_errors(const fct_bake *bake, const fct_scene_view *scene) {
    json_t *list = json_array();
    uint32_t instance = 0;
    for (uint32_t k = 0; list && k < scene->object_count; ++k) {
        const fct_bake_error e = fct_bake_get_error(bake, k);
        const char *name = find_name(scene, k, &instance);
        json_t *item = json_pack("{s:o, s:s}", "object", tool_json_text(name), "normals",
                                 bake_name_normals(fct_bake_get_normals(bake, k)));
        if (item && e.area > 0) {
            json_object_set_new(item, "error_estimate", json_real(e.error));
            json_object_set_new(item, "bias", json_real(e.bias));
            json_object_set_new(item, "area", json_real(e.area));
        }
        if (json_array_append_new(list, item)) {
            json_decref(list);
            return NULL;
        }
    }
    return list;
}

typedef struct ranked {
    fct_bake_error error;
    const char *name;
} ranked;

static int compare_errors(const void *a, const void *b) {
    const double x = ((const ranked *)a)->error.error, y = ((const ranked *)b)->error.error;
    return (x < y) - (x > y);
}

int bake_print_errors(tool *t, const fct_bake *bake, const fct_scene_view *scene) {
    double area = 0;
    uint32_t instance = 0, count = 0;
    ranked *list = tool_allocate(t, scene->object_count, sizeof *list);
    if (!list) return TOOL_MEMORY;
    for (uint32_t k = 0; k < scene->object_count; ++k) {
        const char *name = find_name(scene, k, &instance);
        const float *light = scene->materials[scene->instances[instance].material].emission;
        const fct_bake_error e = fct_bake_get_error(bake, k);
        area += e.area;
        if (light[0] > 0 || light[1] > 0 || light[2] > 0) continue;
        list[count++] = (ranked){e, name};
    }
    qsort(list, count, sizeof *list, compare_errors);
    for (uint32_t k = 0, printed = 0; k < count && printed < PRINTED_OBJECTS; ++k) {
        const fct_bake_error *e = &list[k].error;
        if (e->area < PRINTED_AREA * area || !(e->error > 0)) continue;
        tool_say(t, "  %s: estimated error %.2g %%, bias %+.2g %%", list[k].name, 100 * e->error,
                 100 * e->bias);
        ++printed;
    }
    tool_release(t, list);
    return TOOL_DONE;
}
