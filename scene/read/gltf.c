/* scene/read/gltf.c: reads glTF 2.0: materials, meshes, nodes and the first perspective camera.
 *
 * Source: glTF 2.0 specification, chapters 3.5 to 3.10, and KHR_materials_emissive_strength. Nodes share
 * meshes. When the first node places a mesh, the mesh becomes models, one per material. Points, lines,
 * textures, skins and animations are ignored. A mirroring node reverses the winding, as the specification
 * requires and as instances of a scene do.
 */
#include "scene/read/gltf.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "mesh/glb/glb.h"
#include "mesh/soup.h"
#include "scene/read/gltf_pack.h"
#include "scene/transform.h"

typedef struct visit {
    int64_t node;
    double to_world[12]; /* of the parent node */
} visit;

typedef struct reader {
    fct_scene *scene;
    const fct_env *env;
    const char *name;
    fct_glb glb;
    fct_scene_parts *meshes;        /* per mesh; count 0: not read yet */
    unsigned char *visited, *empty; /* per node; per mesh: it has been read and has no triangles */
    size_t mesh_count, node_count, material_count, whitened;
    visit *stack;
    size_t stack_count, stack_capacity;
    fct_soup soup; /* of the mesh that is being read */
    size_t position_capacity, corner_capacity, label_capacity;
} reader;

static size_t count_items(const reader *r, const char *name) {
    return json_array_size(json_object_get(r->glb.root, name));
}

static fct_result fail_item(const reader *r, const char *what, int64_t index, const char *text) {
    return fct_fail(r->env, FCT_ERROR_DATA, "%s: %s[%lld]: %s", r->name, what, (long long)index, text);
}

/* Reads `count` numbers. If the key is absent, *out is unchanged and the result is true. */
static bool read_numbers(json_t *object, const char *key, size_t count, double *out) {
    json_t *array = json_object_get(object, key);
    if (!array) return true;
    if (json_array_size(array) != count) return false;
    for (size_t k = 0; k < count; ++k) {
        if (!json_is_number(json_array_get(array, k))) return false;
        out[k] = json_number_value(json_array_get(array, k));
    }
    return true;
}

static void name_item(json_t *object, const char *what, size_t index, char *out, size_t size) {
    const char *name = json_string_value(json_object_get(object, "name"));
    if (name && name[0])
        snprintf(out, size, "%.*s", (int)size - 1, name);
    else
        snprintf(out, size, "%s %zu", what, index);
}

/* ---- Materials: those of the file, then one for primitives without a material ---- */

static fct_result read_materials(reader *r) {
    r->material_count = count_items(r, "materials");
    for (size_t k = 0; k <= r->material_count; ++k) {
        json_t *object = json_array_get(json_object_get(r->glb.root, "materials"), k);
        json_t *surface = json_object_get(object, "pbrMetallicRoughness"),
               *strong = json_object_get(
                   json_object_get(json_object_get(object, "extensions"), "KHR_materials_emissive_strength"),
                   "emissiveStrength");
        double color[4] = {1, 1, 1, 1}, light[3] = {0, 0, 0},
               strength = strong ? json_number_value(strong) : 1;
        fct_material material = {.two_sided = json_is_true(json_object_get(object, "doubleSided"))};
        name_item(object, "material", k, material.name, sizeof material.name);
        if (k == r->material_count) {
            color[0] = color[1] = color[2] = .7;
            strcpy(material.name, "(none)");
        } else if (!read_numbers(surface, "baseColorFactor", 4, color) ||
                   !read_numbers(object, "emissiveFactor", 3, light)) {
            return fail_item(r, "materials", (int64_t)k,
                             "expected 4 numbers of baseColorFactor and 3 of emissiveFactor");
        }
        bool white = false;
        for (int c = 0; c < 3; ++c) {
            if (!(color[c] >= 0 && color[c] <= 1))
                return fail_item(r, "materials", (int64_t)k, "expected a base colour in [0, 1]");
            if (!(light[c] >= 0 && strength >= 0))
                return fail_item(r, "materials", (int64_t)k, "expected an emission >= 0");
            white |= color[c] > FCT_SCENE_MOST_REFLECTANCE;
            material.reflectance[c] = fminf((float)color[c], FCT_SCENE_MOST_REFLECTANCE);
            material.emission[c] = (float)(light[c] * strength);
        }
        uint32_t id;
        r->whitened += white;
        fct_result result = fct_scene_add_material(r->scene, &material, &id);
        if (result != FCT_OK) return result;
    }
    if (r->whitened)
        fct_note(r->env, FCT_MESSAGE_NOTE,
                 "%s: %zu materials reflect more than %g; their reflectance is reduced to %g", r->name,
                 r->whitened, (double)FCT_SCENE_MOST_REFLECTANCE, (double)FCT_SCENE_MOST_REFLECTANCE);
    return FCT_OK;
}

/* ---- Meshes ---- */

/* Positions in the index list of the corners of triangle k of a list (mode 4), a strip (5) or a fan (6). */
static void find_triangle_places(int64_t mode, size_t k, size_t places[3]) {
    size_t odd = k & 1;
    places[0] = mode == 4 ? 3 * k : mode == 5 ? k : k + 1;
    places[1] = mode == 4 ? 3 * k + 1 : mode == 5 ? k + 1 + odd : k + 2;
    places[2] = mode == 4 ? 3 * k + 2 : mode == 5 ? k + 2 - odd : 0;
}

static fct_result add_positions(reader *r, const fct_glb_array *positions) {
    fct_soup *soup = &r->soup;
    size_t total = soup->vertex_count + positions->count;
    if (total > FCT_MESH_LIMIT) return fct_fail(r->env, FCT_ERROR_DATA, "%s: too many vertices", r->name);
    fct_result result =
        fct_grow(r->env, (void **)&soup->positions, &r->position_capacity, total, 3 * sizeof(float));
    for (size_t v = 0; result == FCT_OK && v < positions->count; ++v)
        for (int c = 0; c < 3; ++c)
            soup->positions[3 * (soup->vertex_count + v) + (size_t)c] = (float)fct_glb_value(positions, v, c);
    return result;
}

static fct_result add_triangles(reader *r, int64_t mode, const fct_glb_array *indices, size_t vertices,
                                size_t count, uint32_t label) {
    fct_soup *soup = &r->soup;
    size_t triangles = mode == 4   ? count / 3
                       : count < 3 ? 0
                                   : count - 2,
           total = soup->polygon_count + triangles;
    if (total > FCT_MESH_LIMIT) return fct_fail(r->env, FCT_ERROR_DATA, "%s: too many triangles", r->name);
    fct_result result =
        fct_grow(r->env, (void **)&soup->corners, &r->corner_capacity, 3 * total, sizeof *soup->corners);
    if (result == FCT_OK)
        result =
            fct_grow(r->env, (void **)&soup->materials, &r->label_capacity, total, sizeof *soup->materials);
    for (size_t k = 0; result == FCT_OK && k < triangles; ++k) {
        size_t places[3];
        find_triangle_places(mode, k, places);
        for (int j = 0; j < 3; ++j) {
            double index = indices ? fct_glb_value(indices, places[j], 0) : (double)places[j];
            if (!(index >= 0 && index < (double)vertices))
                return fct_fail(r->env, FCT_ERROR_DATA, "%s: vertex index %.0f is out of range, of %zu",
                                r->name, index, vertices);
            soup->corners[soup->corner_count++] = soup->vertex_count + (uint32_t)index;
        }
        soup->materials[soup->polygon_count++] = label;
    }
    return result;
}

static fct_result add_primitive(reader *r, json_t *primitive) {
    int64_t position, index, mode, material;
    fct_glb_array positions, indices;
    fct_result result =
        fct_glb_index(&r->glb, json_object_get(primitive, "attributes"), "POSITION", &position);
    if (result == FCT_OK) result = fct_glb_index(&r->glb, primitive, "indices", &index);
    if (result == FCT_OK) result = fct_glb_index(&r->glb, primitive, "mode", &mode);
    if (result == FCT_OK) result = fct_glb_index(&r->glb, primitive, "material", &material);
    if (result != FCT_OK || position == FCT_GLB_ABSENT) return result;
    if (mode == FCT_GLB_ABSENT) mode = 4;
    if (mode > 6)
        return fct_fail(r->env, FCT_ERROR_DATA, "%s: a primitive has mode %lld, expected 0 to 6", r->name,
                        (long long)mode);
    if (mode < 4) return FCT_OK;
    if (material != FCT_GLB_ABSENT && (uint64_t)material >= r->material_count)
        return fail_item(r, "materials", material, "a primitive uses it, but it does not exist");
    result = fct_glb_array_of(&r->glb, position, 3, 3, &positions);
    if (result == FCT_OK && index != FCT_GLB_ABSENT)
        result = fct_glb_array_of(&r->glb, index, 1, 1, &indices);
    if (result == FCT_OK) result = add_positions(r, &positions);
    if (result != FCT_OK) return result;
    bool indexed = index != FCT_GLB_ABSENT;
    size_t count = indexed ? indices.count : positions.count;
    if (mode == 4 && count % 3)
        return fct_fail(r->env, FCT_ERROR_DATA, "%s: a primitive has %zu indices, expected a multiple of 3",
                        r->name, count);
    uint32_t label = material == FCT_GLB_ABSENT ? (uint32_t)r->material_count : (uint32_t)material;
    result = add_triangles(r, mode, indexed ? &indices : NULL, positions.count, count, label);
    r->soup.vertex_count += (uint32_t)positions.count;
    return result;
}

/* Adds the models of a mesh to the scene, unless they are there already. */
static fct_result need_mesh(reader *r, int64_t index) {
    json_t *mesh, *primitive;
    size_t k;
    char name[128];
    fct_mesh made;
    fct_result result = fct_glb_item(&r->glb, "meshes", index, &mesh);
    if (result != FCT_OK || r->meshes[index].count || r->empty[index]) return result;
    r->soup = (fct_soup){0};
    r->position_capacity = r->corner_capacity = r->label_capacity = 0;
    json_array_foreach(json_object_get(mesh, "primitives"), k, primitive) {
        if (result == FCT_OK) result = add_primitive(r, primitive);
    }
    if (result != FCT_OK || r->soup.polygon_count == 0) {
        r->empty[index] = result == FCT_OK;
        fct_soup_release(r->env, &r->soup);
        return result;
    }
    uint32_t *labels = r->soup.materials; /* face k is triangle k, because nothing is triangulated */
    r->soup.materials = NULL;
    result = fct_soup_mesh(r->env, r->name, &r->soup, &made);
    name_item(mesh, "mesh", (size_t)index, name, sizeof name);
    if (result == FCT_OK) {
        result = fct_scene_split(r->scene, name, &made, NULL, labels, (uint32_t)r->material_count + 1,
                                 r->meshes + index);
        fct_mesh_release(r->env, &made);
    }
    fct_release(r->env, labels);
    return result;
}

/* ---- Nodes ---- */

static fct_result read_local_transform(const reader *r, json_t *node, int64_t index, double out[12]) {
    double m[16], t[3] = {0, 0, 0}, q[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1};
    bool matrix = json_object_get(node, "matrix") != NULL;
    if (!read_numbers(node, "matrix", 16, m) || !read_numbers(node, "translation", 3, t) ||
        !read_numbers(node, "rotation", 4, q) || !read_numbers(node, "scale", 3, s))
        return fail_item(r, "nodes", index,
                         "expected numbers: 16 of matrix, 3 of translation, 4 of rotation, 3 of scale");
    fct_transform_compose(t, q, s, out);
    for (int i = 0; matrix && i < 12; ++i) out[i] = m[4 * (i % 4) + i / 4];
    return FCT_OK;
}

static fct_result read_node_camera(reader *r, json_t *node, int64_t index, const double m[12]) {
    json_t *object;
    int64_t camera;
    fct_result result = fct_glb_index(&r->glb, node, "camera", &camera);
    if (result != FCT_OK || camera == FCT_GLB_ABSENT || r->scene->camera.given) return result;
    result = fct_glb_item(&r->glb, "cameras", camera, &object);
    if (result != FCT_OK) return result;
    double angle = json_number_value(json_object_get(json_object_get(object, "perspective"), "yfov"));
    fct_camera c = {.vertical_fov = (float)(angle * 180 / 3.14159265358979323846)};
    if (!json_object_get(object, "perspective")) return FCT_OK;
    if (!(c.vertical_fov > 0 && c.vertical_fov < 180))
        return fail_item(r, "cameras", camera, "expected yfov in (0, pi)");
    for (int k = 0; k < 3; ++k) {
        c.position[k] = (float)m[4 * k + 3];
        c.target[k] = (float)(m[4 * k + 3] - m[4 * k + 2]);
        c.up[k] = (float)m[4 * k + 1];
        if (!isfinite(c.position[k]) || !isfinite(c.target[k]) || !isfinite(c.up[k]))
            return fail_item(r, "nodes", index, "the camera's transform is not finite");
    }
    fct_scene_set_camera(r->scene, &c);
    return FCT_OK;
}

static fct_result place_node_mesh(reader *r, json_t *node, int64_t index, const double m[12]) {
    int64_t mesh;
    char name[128];
    float to_world[12];
    fct_result result = fct_glb_index(&r->glb, node, "mesh", &mesh);
    if (result != FCT_OK || mesh == FCT_GLB_ABSENT) return result;
    result = need_mesh(r, mesh);
    if (result != FCT_OK || r->empty[mesh]) return result;
    name_item(node, "node", (size_t)index, name, sizeof name);
    for (int k = 0; k < 12; ++k) to_world[k] = (float)m[k];
    const fct_scene_parts *parts = r->meshes + mesh;
    return fct_scene_place(r->scene, name, parts->first, parts->count, parts->labels, to_world);
}

static fct_result push_nodes(reader *r, json_t *nodes, const double to_world[12]) {
    fct_result result = FCT_OK;
    for (size_t k = json_array_size(nodes); k-- > 0 && result == FCT_OK;) {
        json_t *item = json_array_get(nodes, k);
        if (!json_is_integer(item))
            return fct_fail(r->env, FCT_ERROR_DATA,
                            "%s: a list of nodes holds something else than a whole number", r->name);
        result =
            fct_grow(r->env, (void **)&r->stack, &r->stack_capacity, r->stack_count + 1, sizeof *r->stack);
        if (result != FCT_OK) return result;
        visit *v = r->stack + r->stack_count++;
        v->node = json_integer_value(item);
        memcpy(v->to_world, to_world, sizeof v->to_world);
    }
    return result;
}

static fct_result visit_node(reader *r, const visit *v) {
    json_t *node;
    double local[12], to_world[12];
    fct_result result = fct_glb_item(&r->glb, "nodes", v->node, &node);
    if (result != FCT_OK) return result;
    if (r->visited[v->node]) return fail_item(r, "nodes", v->node, "it has two parents");
    r->visited[v->node] = 1;
    result = read_local_transform(r, node, v->node, local);
    if (result != FCT_OK) return result;
    fct_transform_multiply(v->to_world, local, to_world);
    result = read_node_camera(r, node, v->node, to_world);
    if (result == FCT_OK) result = place_node_mesh(r, node, v->node, to_world);
    return result == FCT_OK ? push_nodes(r, json_object_get(node, "children"), to_world) : result;
}

static fct_result visit_all_nodes(reader *r) {
    double identity[12];
    int64_t scene;
    json_t *object;
    for (int k = 0; k < 12; ++k) identity[k] = fct_transform_identity[k];
    fct_result result = fct_glb_index(&r->glb, r->glb.root, "scene", &scene);
    if (result == FCT_OK) result = fct_glb_item(&r->glb, "scenes", scene < 0 ? 0 : scene, &object);
    if (result == FCT_OK) result = push_nodes(r, json_object_get(object, "nodes"), identity);
    while (result == FCT_OK && r->stack_count > 0) {
        visit v = r->stack[--r->stack_count];
        result = visit_node(r, &v);
    }
    if (result == FCT_OK && r->scene->instance_count == 0)
        result = fct_fail(r->env, FCT_ERROR_DATA, "%s: a scene needs at least one face, found none", r->name);
    return result;
}

static fct_result read_glb(fct_scene *scene, const char *name, const unsigned char *data, size_t size) {
    reader r = {.scene = scene, .env = scene->env, .name = name};
    fct_source source = {scene->env, name, data, size};
    fct_result result = fct_glb_open(&source, &r.glb);
    if (result == FCT_OK) {
        r.mesh_count = count_items(&r, "meshes"), r.node_count = count_items(&r, "nodes");
        r.meshes = fct_allocate_zero(r.env, r.mesh_count, sizeof *r.meshes);
        r.empty = fct_allocate_zero(r.env, r.mesh_count, 1);
        r.visited = fct_allocate_zero(r.env, r.node_count, 1);
        if (!r.meshes || !r.empty || !r.visited) result = fct_fail_memory(r.env, "a glTF scene");
    }
    if (result == FCT_OK) result = read_materials(&r);
    if (result == FCT_OK) result = visit_all_nodes(&r);
    for (size_t k = 0; r.meshes && k < r.mesh_count; ++k) fct_release(r.env, r.meshes[k].labels);
    fct_release(r.env, r.meshes);
    fct_release(r.env, r.empty);
    fct_release(r.env, r.visited);
    fct_release(r.env, r.stack);
    fct_glb_close(&r.glb);
    return result;
}

fct_result fct_scene_read_gltf(fct_scene *scene, const char *name, const unsigned char *data, size_t size,
                               const char *base) {
    if (size >= 4 && memcmp(data, "glTF", 4) == 0) return read_glb(scene, name, data, size);
    unsigned char *packed;
    size_t packed_size;
    fct_result result =
        fct_gltf_pack(scene->env, name, (const char *)data, size, base, &packed, &packed_size);
    if (result == FCT_OK) result = read_glb(scene, name, packed, packed_size);
    fct_release(scene->env, packed);
    return result;
}
