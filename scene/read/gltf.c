/* scene/read/gltf.c: reads glTF 2.0 into a scene: materials, meshes as models, nodes as objects, and the
 * first perspective camera.
 *
 * Source: glTF 2.0 specification, chapters 3.5 to 3.10, and KHR_materials_emissive_strength. mesh/glb/ reads
 * the document, its nodes and its triangles. Nodes share meshes: when the first node places a mesh, the mesh
 * becomes models, one per material. A mirroring node reverses the winding, as the specification requires and
 * as instances of a scene do.
 */
#include "scene/read/gltf.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "mesh/glb/features.h"
#include "mesh/glb/primitive.h"
#include "scene/read/gltf_paint.h"
#include "scene/transform.h"

typedef struct reader {
    fct_scene *scene;
    const fct_env *env;
    fct_glb glb;
    fct_glb_builder builder; /* of the mesh that is being read */
    fct_scene_parts *meshes; /* per mesh; count 0: not read yet */
    unsigned char *empty;    /* per mesh: it has been read and has no triangles */
    fct_gltf_paints paints;
    size_t mesh_count, meshes_read, clamped, flat, bare;
    uint32_t material_count; /* of the file; the scene has one more, for primitives without a material */
} reader;

/* Copies the name of an object, or "WHAT NUMBER" if it has none. A long name ends before the first character
 * that does not fit. */
static void name_item(json_t *object, const char *what, size_t index, char *out, size_t size) {
    const char *name = json_string_value(json_object_get(object, "name"));
    if (!name || !name[0]) {
        snprintf(out, size, "%s %zu", what, index);
        return;
    }
    size_t length = strlen(name);
    if (length >= size) length = size - 1;
    while (length && ((unsigned char)name[length] & 0xc0) == 0x80) --length; /* inside a character of UTF-8 */
    memcpy(out, name, length);
    out[length] = 0;
}

/* ---- Materials: those of the file, then one for primitives without a material ---- */

/* The material of a baked scene is white and unlit, and keeps its reflectance beside (mesh/glb/scene/). */
static void take_baked_reflectance(json_t *material, double color[3]) {
    json_t *list = json_object_get(json_object_get(material, "extras"), "reflectance");
    double values[3];
    if (!fct_glb_extension(material, "KHR_materials_unlit") || json_array_size(list) != 3) return;
    for (size_t c = 0; c < 3; ++c) {
        values[c] = json_number_value(json_array_get(list, c));
        if (!json_is_number(json_array_get(list, c)) || !(values[c] >= 0 && values[c] <= 1)) return;
    }
    memcpy(color, values, sizeof values);
}

static fct_result read_material(reader *r, json_t *object, size_t index, double color[4], fct_material *out) {
    json_t *surface = json_object_get(object, "pbrMetallicRoughness"),
           *strong = json_object_get(fct_glb_extension(object, "KHR_materials_emissive_strength"),
                                     "emissiveStrength");
    double light[3] = {0, 0, 0}, strength = strong ? json_number_value(strong) : 1;
    *out = (fct_material){.two_sided = json_is_true(json_object_get(object, "doubleSided"))};
    name_item(object, "material", index, out->name, sizeof out->name);
    fct_result result =
        fct_glb_numbers(&r->glb, surface, "materials", (int64_t)index, "baseColorFactor", 4, color);
    if (result == FCT_OK)
        result = fct_glb_numbers(&r->glb, object, "materials", (int64_t)index, "emissiveFactor", 3, light);
    if (result != FCT_OK) return result;
    take_baked_reflectance(object, color);
    for (int c = 0; c < 3; ++c) {
        if (!(color[c] >= 0) || !(light[c] >= 0 && strength >= 0))
            return fct_glb_fail(&r->glb, "materials[%zu]: expected a base colour and an emission >= 0",
                                index);
        out->reflectance[c] = fminf((float)color[c], FCT_SCENE_MOST_REFLECTANCE);
        out->emission[c] = (float)(light[c] * strength);
    }
    return FCT_OK;
}

/* Whether a factor, or a texel times it, reflects too much. */
static bool is_clamped(const reader *r, const double color[3], uint32_t id) {
    if (r->scene->paints[id].pyramid != FCT_NONE) return fct_textures_clamp(r->scene, id);
    return color[0] > FCT_SCENE_MOST_REFLECTANCE || color[1] > FCT_SCENE_MOST_REFLECTANCE ||
           color[2] > FCT_SCENE_MOST_REFLECTANCE;
}

static fct_result read_materials(reader *r) {
    json_t *materials = json_object_get(r->glb.root, "materials");
    r->material_count = (uint32_t)json_array_size(materials);
    fct_result result = FCT_OK;
    for (size_t k = 0; k <= r->material_count && result == FCT_OK; ++k) {
        fct_material material = {.name = "(none)", .reflectance = {.7f, .7f, .7f}};
        json_t *object = json_array_get(materials, k);
        const bool real = k < r->material_count;
        double color[4] = {1, 1, 1, 1};
        uint32_t id;
        if (!real) color[0] = color[1] = color[2] = .7;
        if (real) result = read_material(r, object, k, color, &material);
        if (result == FCT_OK) result = fct_scene_add_material(r->scene, &material, &id);
        if (result == FCT_OK && !r->env->no_textures)
            result = fct_gltf_paint(&r->paints, object, k, color, id);
        if (result == FCT_OK) r->clamped += is_clamped(r, color, id);
    }
    if (result == FCT_OK && r->clamped)
        fct_glb_warn(&r->glb, "%zu materials reflect more than %g; their reflectance is reduced to %g",
                     r->clamped, (double)FCT_SCENE_MOST_REFLECTANCE, (double)FCT_SCENE_MOST_REFLECTANCE);
    return result;
}

/* ---- Meshes ---- */

/* Makes models of the triangles in the soup. Releases the soup. */
static fct_result add_models(reader *r, json_t *mesh, int64_t index, fct_soup *soup) {
    char name[128];
    fct_mesh made;
    uint32_t *labels = soup->materials; /* face k is triangle k, because nothing is triangulated */
    soup->materials = NULL;
    fct_result result = fct_soup_mesh(r->env, r->glb.source->name, soup, &made);
    name_item(mesh, "mesh", (size_t)index, name, sizeof name);
    if (result == FCT_OK) {
        result =
            fct_scene_split(r->scene, name, &made, NULL, labels, r->material_count + 1, r->meshes + index);
        fct_mesh_release(r->env, &made);
    }
    fct_release(r->env, labels);
    return result;
}

/* The vertex data that the models of a mesh keep. Colours of a mesh that stores light are not those of its
 * surface. */
static fct_result choose_arrays(reader *r, json_t *mesh) {
    json_t *object;
    size_t i, with_light = 0;
    json_array_foreach(json_object_get(mesh, "primitives"), i, object) {
        fct_glb_primitive p;
        fct_result result = fct_glb_read_primitive(&r->glb, object, &p);
        if (result == FCT_OK) result = fct_glb_choose_texcoords(&r->builder, object, &p);
        if (result != FCT_OK) return result;
        if (p.position == FCT_GLB_ABSENT || (p.mode > 0 && p.mode < 4)) continue;
        const bool textured = p.material >= 0 && p.material < r->material_count &&
                              r->scene->paints[p.material].pyramid != FCT_NONE;
        r->bare += textured && p.texcoord < 0;
        with_light += p.light >= 0;
        r->builder.has_normals |= p.normal >= 0;
        r->builder.has_texcoords |= textured || p.texcoord >= 0;
        r->builder.has_colors |= p.color >= 0;
    }
    r->builder.has_colors &= !with_light;
    return FCT_OK;
}

/* Adds the models of a mesh to the scene, unless they are there already. */
static fct_result need_mesh(reader *r, int64_t index) {
    static const fct_glb_transform identity = {.m = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, .identity = true};
    json_t *mesh;
    fct_result result = fct_glb_item(&r->glb, "meshes", index, &mesh);
    if (result != FCT_OK || r->meshes[index].count || r->empty[index]) return result;
    fct_soup soup = {0};
    size_t incomplete = r->builder.incomplete, clear = r->builder.clear;
    r->builder = (fct_glb_builder){.glb = &r->glb,
                                   .soup = &soup,
                                   .has_materials = true,
                                   .unnamed = r->material_count,
                                   .texcoord_sets = r->paints.sets,
                                   .clear = clear,
                                   .incomplete = incomplete};
    result = choose_arrays(r, mesh);
    if (result == FCT_OK) result = fct_glb_append_mesh(&r->builder, index, &identity);
    r->builder.without_texcoord = r->builder.without_color =
        0; /* primitives need not have what others have */
    fct_glb_end_soup(&r->builder);
    if (result == FCT_OK && soup.polygon_count) {
        result = add_models(r, mesh, index, &soup);
    } else {
        r->empty[index] = result == FCT_OK;
        fct_soup_release(r->env, &soup);
    }
    if (result != FCT_OK) return result;
    return fct_progress(r->env, "models", (double)++r->meshes_read / (double)r->mesh_count);
}

/* ---- Nodes ---- */

static fct_result read_node_camera(reader *r, const fct_glb_place *place) {
    json_t *object;
    int64_t camera;
    const double *m = place->to_world.m;
    fct_result result = fct_glb_index(&r->glb, place->node, "camera", &camera);
    if (result != FCT_OK || camera == FCT_GLB_ABSENT || r->scene->camera.given) return result;
    result = fct_glb_item(&r->glb, "cameras", camera, &object);
    if (result != FCT_OK) return result;
    double angle = json_number_value(json_object_get(json_object_get(object, "perspective"), "yfov"));
    fct_camera c = {.vertical_fov = (float)(angle * 180 / 3.14159265358979323846)};
    if (!json_object_get(object, "perspective")) return FCT_OK;
    if (!(c.vertical_fov > 0 && c.vertical_fov < 180))
        return fct_glb_fail(&r->glb, "cameras[%lld]: expected yfov in (0, pi)", (long long)camera);
    for (int k = 0; k < 3; ++k) {
        c.position[k] = (float)m[4 * k + 3];
        c.target[k] = (float)(m[4 * k + 3] - m[4 * k + 2]);
        c.up[k] = (float)m[4 * k + 1];
        if (!isfinite(c.position[k]) || !isfinite(c.target[k]) || !isfinite(c.up[k]))
            return fct_glb_fail(&r->glb, "nodes[%lld]: the camera's transform is not finite",
                                (long long)place->index);
    }
    fct_scene_set_camera(r->scene, &c);
    return FCT_OK;
}

/* A node that flattens its mesh has no inverse transform: its mesh is left out. */
static bool is_flat(const float to_world[12]) {
    fct_instance probe;
    double inverse[12];
    return fct_transform_set(to_world, &probe, inverse) == FCT_TRANSFORM_SINGULAR;
}

static fct_result place_mesh(reader *r, const fct_glb_place *place) {
    char name[128];
    float to_world[12];
    fct_result result = need_mesh(r, place->mesh);
    if (result != FCT_OK || r->empty[place->mesh]) return result;
    for (int k = 0; k < 12; ++k) to_world[k] = (float)place->to_world.m[k];
    if (is_flat(to_world)) {
        ++r->flat;
        return FCT_OK;
    }
    if (place->node)
        name_item(place->node, "node", (size_t)place->index, name, sizeof name);
    else
        name_item(json_array_get(json_object_get(r->glb.root, "meshes"), (size_t)place->mesh), "mesh",
                  (size_t)place->mesh, name, sizeof name);
    const fct_scene_parts *parts = r->meshes + place->mesh;
    result = fct_scene_place(r->scene, name, parts->first, parts->count, parts->labels, to_world);
    if (result != FCT_OK) return result;
    fct_scene_object *object = r->scene->objects + r->scene->object_count - 1;
    object->node = place->index, object->mesh = place->mesh;
    return FCT_OK;
}

static fct_result visit_node(void *user, const fct_glb_place *place) {
    reader *r = user;
    fct_result result = place->node ? read_node_camera(r, place) : FCT_OK;
    return result == FCT_OK && place->mesh != FCT_GLB_ABSENT ? place_mesh(r, place) : result;
}

static fct_result read_nodes(reader *r) {
    r->mesh_count = fct_glb_count(&r->glb, "meshes");
    const fct_array arrays[] = {FCT_ARRAY_ZERO(r->meshes, r->mesh_count),
                                FCT_ARRAY_ZERO(r->empty, r->mesh_count)};
    fct_result result = fct_allocate_all(r->env, arrays, FCT_LENGTH(arrays), "a glTF scene");
    if (result == FCT_OK) result = fct_glb_visit_nodes(&r->glb, visit_node, r);
    for (size_t k = 0; r->meshes && k < r->mesh_count; ++k) fct_release(r->env, r->meshes[k].labels);
    fct_release_all(r->env, arrays, FCT_LENGTH(arrays));
    if (r->flat)
        fct_glb_warn(&r->glb, "%zu nodes have a singular transform; their meshes are left out", r->flat);
    if (r->bare)
        fct_glb_warn(&r->glb, "%zu primitives have a texture but no texture coordinates; these are 0 0",
                     r->bare);
    if (result == FCT_OK && r->scene->instance_count == 0)
        return fct_glb_fail(&r->glb, "a scene needs at least one face, found none");
    return result;
}

fct_result fct_scene_read_gltf(fct_scene *scene, const char *name, const unsigned char *data, size_t size,
                               const char *base) {
    fct_source source = {scene->env, name, data, size, base};
    reader r = {.scene = scene, .env = scene->env};
    fct_result result = fct_glb_open(&source, &r.glb);
    if (result == FCT_OK) result = fct_gltf_paints_create(scene, &r.glb, &r.paints);
    if (result == FCT_OK) result = read_materials(&r);
    if (result == FCT_OK) result = read_nodes(&r);
    if (result == FCT_OK) {
        fct_glb_report_builder(&r.builder);
        fct_glb_report_features(&r.glb, true);
        fct_textures_report(r.env, name, &r.paints.loss);
    }
    fct_gltf_paints_release(&r.paints);
    fct_glb_close(&r.glb);
    return result;
}
