/* mesh/glb/read.c: joins the meshes of a glTF file, placed by their nodes, to one soup. */
#include "mesh/glb/read.h"

#include <stdio.h>
#include <string.h>

#include "mesh/glb/features.h"
#include "mesh/glb/primitive.h"

typedef struct reader {
    fct_glb glb;
    fct_glb_builder builder;
    bool needs_unnamed;
    size_t primitives, with_normals;
} reader;

/* Decides which arrays the soup has: colours, texture coordinates and materials if any primitive has them,
 * normals if all primitives have them. */
static fct_result choose_arrays(reader *r) {
    json_t *meshes = json_object_get(r->glb.root, "meshes"), *mesh, *object;
    size_t i, j;
    json_array_foreach(meshes, i, mesh) json_array_foreach(json_object_get(mesh, "primitives"), j, object) {
        fct_glb_primitive p;
        fct_result result = fct_glb_read_primitive(&r->glb, object, &p);
        if (result != FCT_OK) return result;
        if (p.position == FCT_GLB_ABSENT || (p.mode > 0 && p.mode < 4)) continue;
        ++r->primitives;
        r->with_normals += p.normal >= 0;
        r->builder.has_colors |= p.color >= 0 || p.radiosity >= 0;
        r->builder.has_texcoords |= p.texcoord >= 0;
        r->needs_unnamed |= p.material < 0;
        if (p.material < 0) continue;
        json_t *material;
        result = fct_glb_item(&r->glb, "materials", p.material, &material);
        if (result != FCT_OK) return result;
        r->builder.has_materials |= json_is_string(json_object_get(material, "name")) || p.material > 0;
    }
    r->builder.has_normals = r->with_normals && r->with_normals == r->primitives;
    if (r->with_normals && !r->builder.has_normals)
        fct_glb_warn(&r->glb, "%zu of %zu primitives have no normals, so all normals are left out",
                     r->primitives - r->with_normals, r->primitives);
    return FCT_OK;
}

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
    if (result == FCT_OK) result = choose_arrays(&r);
    if (result == FCT_OK) result = name_materials(&r);
    if (result == FCT_OK) result = fct_glb_begin_soup(&r.builder);
    if (result == FCT_OK) result = fct_glb_visit_nodes(&r.glb, place_mesh, &r);
    if (result == FCT_OK) {
        fct_glb_end_soup(&r.builder);
        fct_glb_report_builder(&r.builder);
        fct_glb_report_features(&r.glb);
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
        json_object_get(json_object_get(object, "attributes"), "_RADIOSITY") != NULL;
    fct_glb_close(&glb);
    return result;
}
