/* mesh/glb/read.c: joins the meshes of a glTF file, placed by their nodes, to one soup. */
#define XXH_STATIC_LINKING_ONLY /* for the size of XXH3_state_t */
#include "mesh/glb/read.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <xxhash.h>

#include "mesh/glb/document/buffer.h"
#include "mesh/glb/features.h"
#include "mesh/glb/primitive.h"

typedef struct reader {
    fct_glb glb;
    fct_glb_builder builder;
    bool needs_unnamed;
} reader;

/* Numbers the materials as the file does. Adds one with an empty name if a primitive has no material. */
static fct_result name_materials(reader *r) {
    const fct_env *env = r->glb.source->env;
    fct_soup *soup = r->builder.soup;
    if (!r->builder.has_materials) return FCT_OK;
    size_t count = fct_glb_count(&r->glb, "materials");
    r->builder.unnamed = (uint32_t)count;
    soup->material_names = fct_allocate_zero(env, count + 1, sizeof(char *));
    if (!soup->material_names) return fct_fail_memory(env, "material names");
    soup->material_count = (uint32_t)(count + r->needs_unnamed);
    for (size_t i = 0; i < soup->material_count; ++i) {
        json_t *name = json_object_get(json_array_get(json_object_get(r->glb.root, "materials"), i), "name");
        char number[32];
        snprintf(number, sizeof number, "material_%zu", i);
        const char *text = json_is_string(name) ? json_string_value(name) : i < count ? number : "";
        soup->material_names[i] = fct_copy_text(env, text, strlen(text));
        if (!soup->material_names[i]) return fct_fail_memory(env, "material names");
    }
    return FCT_OK;
}

static fct_result place_mesh(void *user, const fct_glb_place *place) {
    reader *r = user;
    return place->mesh < 0 ? FCT_OK : fct_glb_append_mesh(&r->builder, place->mesh, &place->to_world);
}

fct_result fct_read_glb(const fct_source *source, fct_soup *out) {
    reader r = {.builder = {.soup = out}};
    r.builder.glb = &r.glb;
    fct_result result = fct_glb_open(source, &r.glb);
    if (result == FCT_OK) result = fct_glb_choose_arrays(&r.builder, &r.needs_unnamed);
    if (result == FCT_OK) result = name_materials(&r);
    if (result == FCT_OK) result = fct_glb_begin_soup(&r.builder);
    if (result == FCT_OK) result = fct_glb_visit_nodes(&r.glb, place_mesh, &r);
    if (result == FCT_OK) {
        fct_glb_end_soup(&r.builder);
        fct_glb_report_builder(&r.builder);
        fct_glb_report_features(&r.glb, false);
    }
    fct_glb_close(&r.glb);
    return result;
}

fct_result fct_glb_holds_light(const fct_source *source, bool *out) {
    fct_glb glb;
    json_t *mesh, *object;
    size_t i, j;
    fct_result result = fct_glb_open(source, &glb);
    *out = false;
    json_array_foreach(json_object_get(glb.root, "meshes"), i, mesh)
        json_array_foreach(json_object_get(mesh, "primitives"), j, object) *out |=
        fct_glb_find_light(json_object_get(object, "attributes")) != NULL;
    fct_glb_close(&glb);
    return result;
}

fct_result fct_glb_hash(const fct_source *source, uint64_t *out) {
    fct_env env = *source->env;
    env.message = NULL;
    fct_source quiet = *source;
    quiet.env = &env;
    fct_glb glb;
    json_t *object;
    size_t i;
    XXH3_state_t state;
    XXH3_64bits_reset(&state);
    XXH3_64bits_update(&state, source->data, source->size);
    fct_result result = fct_glb_open(&quiet, &glb);
    json_array_foreach(json_object_get(glb.root, "buffers"), i, object) {
        const json_t *uri = json_object_get(object, "uri");
        fct_glb_buffer buffer = {0};
        if (result != FCT_OK || !json_is_string(uri)) continue;
        if (!strncasecmp(json_string_value(uri), "data:", 5)) continue;
        fct_result opened = fct_glb_open_uri(&glb, uri, &buffer);
        if (opened == FCT_OK) XXH3_64bits_update(&state, buffer.data, buffer.size);
        if (opened == FCT_ERROR_MEMORY) result = opened;
        fct_file_close(&env, &buffer.file);
        fct_release(&env, buffer.own);
    }
    fct_glb_close(&glb);
    *out = XXH3_64bits_digest(&state);
    return result == FCT_ERROR_MEMORY ? fct_fail_memory(source->env, "a hash") : FCT_OK;
}
