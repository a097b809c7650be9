/* mesh/glb/features.c: see features.h. */
#include "mesh/glb/features.h"

#include <string.h>

#include "mesh/glb/document/accessor.h"
#include "mesh/glb/primitive.h"

typedef struct use_counts {
    size_t color_textures, emissive_textures, other_textures, transparent;
    size_t lights, instanced, skinned, orthographic;
    size_t morphed, points, lines, attributed;
} use_counts;

/* Whether the object has a member whose name ends in Texture, such as normalTexture. */
static bool has_texture(json_t *object) {
    const char *key;
    json_t *value;
    json_object_foreach(object, key, value) {
        size_t length = strlen(key);
        if (length >= 7 && !strcmp(key + length - 7, "Texture")) return true;
    }
    return false;
}

/* Whether a texture other than those of base colour and emission is used: of normals, roughness, occlusion,
 * or of an extension. */
static bool has_other_texture(json_t *material) {
    json_t *surface = json_object_get(material, "pbrMetallicRoughness"), *extension;
    const char *key;
    if (json_object_get(surface, "metallicRoughnessTexture") || json_object_get(material, "normalTexture") ||
        json_object_get(material, "occlusionTexture"))
        return true;
    json_object_foreach(json_object_get(material, "extensions"), key,
                        extension) if (has_texture(extension)) return true;
    return false;
}

static void count_materials(const fct_glb *glb, use_counts *n) {
    json_t *material;
    size_t i;
    json_array_foreach(json_object_get(glb->root, "materials"), i, material) {
        const char *alpha = json_string_value(json_object_get(material, "alphaMode"));
        json_t *surface = json_object_get(material, "pbrMetallicRoughness");
        n->color_textures += json_object_get(surface, "baseColorTexture") != NULL;
        n->emissive_textures += json_object_get(material, "emissiveTexture") != NULL;
        n->other_textures += has_other_texture(material);
        n->transparent += alpha && strcmp(alpha, "OPAQUE") != 0;
    }
}

static void count_nodes(const fct_glb *glb, use_counts *n) {
    json_t *node, *camera;
    size_t i;
    json_array_foreach(json_object_get(glb->root, "nodes"), i, node) {
        n->lights += fct_glb_extension(node, "KHR_lights_punctual") != NULL;
        n->instanced += fct_glb_extension(node, "EXT_mesh_gpu_instancing") != NULL;
        n->skinned += json_object_get(node, "skin") != NULL;
    }
    json_array_foreach(json_object_get(glb->root, "cameras"), i, camera) n->orthographic +=
        json_object_get(camera, "perspective") == NULL;
    /* Lights that no node places light nothing, but a file that has them was meant to be lit. */
    if (!n->lights)
        n->lights =
            json_array_size(json_object_get(fct_glb_extension(glb->root, "KHR_lights_punctual"), "lights"));
}

/* Whether the primitive has an attribute that fct_mesh has no place for. */
static bool has_other_attribute(json_t *primitive) {
    static const char *const known[] = {"POSITION", "NORMAL", "COLOR_0", "TEXCOORD_0"};
    const char *key;
    json_t *value;
    json_object_foreach(json_object_get(primitive, "attributes"), key, value) {
        bool found = false;
        const char *light = fct_glb_find_light(json_object_get(primitive, "attributes"));
        found = light && !strcmp(key, light);
        for (size_t i = 0; i < sizeof known / sizeof *known; ++i) found = found || !strcmp(key, known[i]);
        if (!found) return true;
    }
    return false;
}

static void count_primitives(const fct_glb *glb, use_counts *n) {
    json_t *mesh, *primitive;
    size_t i, j;
    json_array_foreach(json_object_get(glb->root, "meshes"), i, mesh)
        json_array_foreach(json_object_get(mesh, "primitives"), j, primitive) {
        json_t *value = json_object_get(primitive, "mode");
        json_int_t mode = value ? json_integer_value(value) : 4;
        n->morphed += json_array_size(json_object_get(primitive, "targets")) > 0;
        n->points += mode == 0;
        n->lines += mode > 0 && mode < 4;
        n->attributed += has_other_attribute(primitive);
    }
}

typedef struct feature_line {
    size_t count;
    const char *text;
} feature_line;

static void report_lines(const fct_glb *glb, const feature_line *lines, size_t count) {
    for (size_t i = 0; i < count; ++i)
        if (lines[i].count) fct_glb_warn(glb, "%zu %s", lines[i].count, lines[i].text);
}

static void report_counts(const fct_glb *glb, const use_counts *n) {
    const feature_line lines[] = {
        {n->lights, "lights (KHR_lights_punctual) are left out; only materials with an emission emit light"},
        {n->color_textures, "materials have a base colour texture, which is left out; the base colour factor "
                            "alone is used"},
        {n->emissive_textures, "materials have an emissive texture, which is left out; their whole surface "
                               "emits the emissive factor"},
        {n->other_textures, "materials have other textures (normals, roughness, ...), which are left out"},
        {n->transparent, "materials are transparent (alphaMode) and are read as opaque"},
        {n->instanced, "nodes have instances (EXT_mesh_gpu_instancing), which are left out; each node places "
                       "its mesh once"},
        {fct_glb_count(glb, "animations"), "animations are left out; nodes stay where the file places them"},
        {n->skinned, "nodes have a skin, which is left out; their mesh keeps its own shape"},
        {n->morphed, "primitives have morph targets, which are left out"},
        {n->points, "primitives of points have no faces; only meshes keep their vertices"},
        {n->lines, "primitives of lines are left out"},
        {n->orthographic, "cameras have no perspective and are left out"},
    };
    report_lines(glb, lines, sizeof lines / sizeof *lines);
}

/* Counts the primitives with a colour that is not opaque. */
static fct_result count_clear_colors(fct_glb *glb, size_t *count) {
    json_t *mesh, *primitive;
    size_t i, j;
    json_array_foreach(json_object_get(glb->root, "meshes"), i, mesh)
        json_array_foreach(json_object_get(mesh, "primitives"), j, primitive) {
        const fct_glb_array *colors = NULL;
        int64_t color;
        bool clear = false;
        fct_result result = fct_glb_index(glb, json_object_get(primitive, "attributes"), "COLOR_0", &color);
        if (result == FCT_OK && color == FCT_GLB_ABSENT) continue;
        if (result == FCT_OK) result = fct_glb_array_of(glb, color, 3, 4, &colors);
        if (result != FCT_OK) return result;
        for (size_t v = 0; colors->width == 4 && v < colors->count && !clear; ++v)
            clear = fct_glb_value(colors, v, 3) < 1;
        *count += clear;
    }
    return FCT_OK;
}

fct_result fct_glb_report_losses(fct_glb *glb) {
    use_counts n = {0};
    size_t clear = 0;
    count_nodes(glb, &n);
    count_primitives(glb, &n);
    fct_result result = count_clear_colors(glb, &clear);
    if (result != FCT_OK) return result;
    const feature_line lines[] = {
        {n.instanced, "nodes have instances (EXT_mesh_gpu_instancing), which are left out; each node places "
                      "its mesh once"},
        {fct_glb_count(glb, "animations"), "animations are left out"},
        {n.skinned, "nodes have a skin, which is left out"},
        {n.morphed, "primitives have morph targets, which are left out"},
        {n.points, "primitives of points are left out"},
        {n.lines, "primitives of lines are left out"},
        {n.attributed,
         "primitives have other attributes (tangents, more texture coordinates, ...), which are left "
         "out"},
        {clear, "primitives have colours with an alpha below 1, which becomes 1"},
    };
    report_lines(glb, lines, sizeof lines / sizeof *lines);
    return FCT_OK;
}

/* Whether another warning, or an error, already reports what the extension stands for. */
static bool is_reported_elsewhere(const char *extension) {
    static const char *const names[] = {
        "KHR_lights_punctual", "EXT_mesh_gpu_instancing",    "KHR_texture_transform",   "KHR_texture_basisu",
        "EXT_texture_webp",    "KHR_draco_mesh_compression", "EXT_meshopt_compression", "EXT_texture_avif"};
    for (size_t i = 0; i < sizeof names / sizeof *names; ++i)
        if (!strcmp(extension, names[i])) return true;
    return false;
}

void fct_glb_report_features(const fct_glb *glb, bool textured) {
    use_counts n = {0};
    json_t *used = json_object_get(glb->root, "extensionsUsed"), *item;
    size_t i;
    count_materials(glb, &n);
    count_nodes(glb, &n);
    count_primitives(glb, &n);
    if (textured) n.color_textures = 0;
    report_counts(glb, &n);
    json_array_foreach(used, i, item) {
        const char *name = json_string_value(item);
        if (name && !fct_glb_supports(name) && !is_reported_elsewhere(name))
            fct_glb_warn(glb, "the extension %.100s is not supported and is left out", name);
    }
}
