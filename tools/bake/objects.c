/* tools/bake/objects.c: see objects.h. */
#define _GNU_SOURCE
#include "tools/bake/objects.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include "tools/bake/save.h"
#include "tools/guard/inputs.h"
#include "tools/kit/file.h"
#include "tools/kit/model.h"

/* "FOLDER/NAME.ply" with a name that is not in use. NULL after a recorded error. */
static char *make_object_path(tool *t, bake_names *names, const char *wanted) {
    char *name = bake_make_name(names, wanted), *path = NULL;
    size_t length = strlen(t->output);
    const char *slash = length && t->output[length - 1] == '/' ? "" : "/";
    if (!name || asprintf(&path, "%s%s%s.ply", t->output, slash, name) < 0) path = NULL;
    if (!path) tool_fail(t, TOOL_MEMORY, "out of memory for the names of files");
    free(name);
    return path;
}

static void find_first_instances(const fct_scene_view *scene, uint32_t *first) {
    for (uint32_t i = scene->instance_count; i-- > 0;) first[scene->instances[i].object] = i;
}

int bake_plan_objects(tool *t, const fct_scene_view *scene, bake_objects *out) {
    *out = (bake_objects){0};
    out->first = tool_allocate(t, scene->object_count, sizeof *out->first);
    out->paths = tool_allocate(t, scene->object_count, sizeof *out->paths);
    if (!out->first || !out->paths) return TOOL_MEMORY;
    for (uint32_t i = 0; i < scene->object_count; ++i) out->first[i] = FCT_NONE, out->paths[i] = NULL;
    out->count = scene->object_count;
    find_first_instances(scene, out->first);
    int code = TOOL_DONE;
    for (uint32_t i = 0; i < out->count && code == TOOL_DONE; ++i) {
        if (out->first[i] == FCT_NONE) continue;
        out->paths[i] = make_object_path(t, &out->names, scene->instances[out->first[i]].name);
        code = out->paths[i] ? tool_refuse_input(t, out->paths[i]) : TOOL_MEMORY;
    }
    return code;
}

/* A file system may take two names for one in ways that bake_make_name does not know. The file of an earlier
 * object then stays, and this object gets another name. */
static int avoid_written(tool *t, const guard_inputs *written, bake_objects *objects, uint32_t object,
                         const char *name) {
    while (guard_find_input(written, objects->paths[object])) {
        free(objects->paths[object]);
        objects->paths[object] = make_object_path(t, &objects->names, name);
        if (!objects->paths[object]) return TOOL_MEMORY;
    }
    return TOOL_DONE;
}

int bake_write_objects(tool *t, fct_bake *bake, const fct_scene_view *scene, bake_objects *objects,
                       const fct_mesh_save_def *def, json_t *files) {
    guard_inputs written = {0};
    int code = TOOL_DONE;
    for (uint32_t i = 0; i < objects->count && code == TOOL_DONE; ++i) {
        if (objects->first[i] == FCT_NONE) continue;
        const fct_instance *first = scene->instances + objects->first[i];
        fct_mesh all = {0};
        code = tool_result(t, fct_bake_object(bake, first->object, &all));
        if (code == TOOL_DONE) code = avoid_written(t, &written, objects, i, first->name);
        if (code == TOOL_DONE) code = bake_save_mesh(t, objects->paths[i], &all, def);
        if (code == TOOL_DONE && !guard_add_input(&written, objects->paths[i]))
            code = tool_fail(t, TOOL_MEMORY, "out of memory for the names of files");
        if (code == TOOL_DONE)
            json_array_append_new(
                files, json_pack("{s:o, s:o, s:I, s:o}", "object", tool_json_text(first->name), "file",
                                 tool_json_text(objects->paths[i]), "faces", (json_int_t)all.face_count,
                                 "source", tool_json_text(scene->models[first->model].name)));
        fct_mesh_release(&t->env, &all);
    }
    guard_release_inputs(&written);
    return code;
}

void bake_release_objects(tool *t, bake_objects *objects) {
    for (uint32_t i = 0; i < objects->count; ++i) free(objects->paths[i]);
    tool_release(t, objects->first);
    tool_release(t, objects->paths);
    bake_release_names(&objects->names);
    *objects = (bake_objects){0};
}
